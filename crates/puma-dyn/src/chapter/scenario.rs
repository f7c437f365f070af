//! The data set: four figure-of-eight paths at four speeds under fifteen loads, states and torques.
//!
//! ```text
//! x(φ) = (q, ω q', ω² q'')(φ)      φ = 2πk / samples,  ω = 2π / duration,  ' = d/dφ
//! ```
//!
//! The states do not depend on the load, and a faster run of a path visits the same positions, so the inverse
//! kinematics is solved once per path. Derivatives come from the Jacobian, not from differences of samples.
//!
//! # Source
//! Sec. 2.2 and table 1; what they leave silent is in `fixtures/scenario.toml` with its reasons.

use std::f64::consts::PI;
use std::fmt;

use crate::chapter::inverse_kin::{Branch, inverse_kinematics};
use crate::chapter::inverse_rates::{JointMotion, inverse_rates};
use crate::chapter::path::{FigureOfEight, Tool};
use crate::chapter::puma560;
use crate::chapter::scenario_file::{LoadSection, PathSection, ScenarioFile};
use crate::chapter::trajectory::{N_JOINTS, N_STATE, Trajectory};
use crate::dynamics::hysteresis::Hysteresis;
use crate::dynamics::payload::{Context, Payload};
use crate::dynamics::rnea::rnea_with_hysteresis;
use crate::dynamics::workspace::Workspace;
use crate::error::DynError;
use crate::robot::friction_law::Effects;
use crate::robot::model::Model;
use crate::robot::sidecar::Sidecar;

/// Mechanical ranges of the joints, deg: `qlim` of `mdl_puma560.m`, Robotics Toolbox for MATLAB.
const RANGES_DEG: [(f64, f64); N_JOINTS] = [
    (-160.0, 160.0),
    (-45.0, 225.0),
    (-225.0, 45.0),
    (-110.0, 170.0),
    (-100.0, 100.0),
    (-266.0, 266.0),
];

/// An arm, its paths, their durations and its loads.
///
/// Paths are called `p1`, `p2`, …, speeds `s1`, `s2`, …; loads carry the names of the file.
///
/// ```
/// use puma_dyn::Scenario;
///
/// let scenario = Scenario::reference();
/// let (path, speed) = (scenario.path_idx("p2")?, scenario.speed_idx("s4")?);
/// let trajectory = scenario.trajectory(path, speed)?;
/// let torques = scenario.torques(&trajectory, scenario.load_idx("c3")?);
/// assert_eq!((trajectory.n_samples(), torques.len()), (4000, 4000 * 6));
/// # Ok::<(), puma_dyn::DynError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Scenario {
    model: Model,
    effects: Effects,
    branch: Branch,
    tool: Tool,
    shoulder_height: f64,
    paths: Vec<FigureOfEight>,
    durations: Vec<f64>,
    n_samples: usize,
    loads: Vec<Load>,
}

/// A load of a scenario.
#[derive(Clone, Debug)]
struct Load {
    name: String,
    payload: Payload,
    context: Context,
}

/// A joint that leaves its mechanical range along a path; nothing enforces the range.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RangeExcess {
    /// Index of the path.
    pub path_idx: usize,
    /// Index of the joint.
    pub joint_idx: usize,
    /// Smallest and largest angle along the path, rad.
    pub reached: (f64, f64),
    /// Mechanical range, rad.
    pub range: (f64, f64),
}

impl fmt::Display for RangeExcess {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let deg = |(low, high): (f64, f64)| {
            format!("{:.1}° … {:.1}°", low.to_degrees(), high.to_degrees())
        };
        let (path, joint) = (self.path_idx + 1, self.joint_idx + 1);
        write!(
            f,
            "path p{path}: joint {joint} moves over {}, outside its mechanical range {}",
            deg(self.reached),
            deg(self.range)
        )
    }
}

/// Joint angles along a path and their derivatives with respect to the phase.
struct PathMotion {
    samples: Vec<([f64; N_JOINTS], JointMotion)>,
}

impl Scenario {
    /// The scenario of `fixtures/scenario.toml`: every reported number comes from it.
    ///
    /// # Panics
    /// Never: a test builds it.
    pub fn reference() -> Self {
        Self::from_toml(include_str!("../../../../fixtures/scenario.toml"))
            .expect("the built-in scenario is valid")
    }

    /// A scenario from the text of a TOML file with the keys of `fixtures/scenario.toml`.
    ///
    /// # Errors
    /// [`DynError::Scenario`] for text that is not TOML, unknown or missing keys and values that do not fit together;
    /// the payload's own error for a load that cannot be.
    pub fn from_toml(text: &str) -> Result<Self, DynError> {
        let file = ScenarioFile::parse(text)?;
        let model = puma560::model().with_gravity([0.0, 0.0, -file.robot.gravity]);
        let loads = file
            .loads
            .iter()
            .map(|load| Load::new(&model, load))
            .collect::<Result<_, _>>()?;
        Ok(Self {
            effects: Effects {
                friction: file.robot.friction(),
                rotor_inertia: true,
            },
            branch: file.robot.branch(),
            tool: Tool {
                offset: file.tool.offset,
                pitch: file.tool.pitch.to_radians(),
                yaw: file.tool.yaw.to_radians(),
            },
            shoulder_height: file.robot.shoulder_height,
            paths: figures(&file.path, file.robot.shoulder_height),
            durations: file.path.durations,
            n_samples: file.path.samples,
            model,
            loads,
        })
    }

    /// The same scenario with the drives and the friction that a sidecar states of the arm's joints.
    ///
    /// The sidecar's friction convention, if it states one, takes the place of the scenario's.
    ///
    /// # Errors
    /// `DynError::Sidecar` for a joint that the arm does not have, [`DynError::Scenario`] for one that is to be
    /// locked, and what [`Model::new`] refuses.
    pub fn with_sidecar(mut self, sidecar: &Sidecar) -> Result<Self, DynError> {
        let mut arm = puma560::description();
        sidecar.apply(&mut arm)?;
        if let Some(joint) = arm.joints.iter().find(|joint| sidecar.locks(&joint.name)) {
            let reason = format!(
                "the sidecar locks joint `{}`, which its paths move",
                joint.name
            );
            return Err(DynError::Scenario { reason });
        }
        self.model = Model::new(&arm)?.with_gravity(self.model.gravity());
        self.effects.friction = sidecar.friction().unwrap_or(self.effects.friction);
        Ok(self)
    }

    /// The unloaded arm under the scenario's gravity.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Friction and rotor inertia of the torques.
    pub fn effects(&self) -> Effects {
        self.effects
    }

    /// Number of samples of a trajectory.
    pub fn n_samples(&self) -> usize {
        self.n_samples
    }

    /// Names of the paths, in order.
    pub fn path_names(&self) -> Vec<String> {
        numbered('p', self.paths.len())
    }

    /// Names of the speeds, in order.
    pub fn speed_names(&self) -> Vec<String> {
        numbered('s', self.durations.len())
    }

    /// Names of the loads, in order.
    pub fn load_names(&self) -> Vec<String> {
        self.loads.iter().map(|load| load.name.clone()).collect()
    }

    /// Index of a path by its name.
    ///
    /// # Errors
    /// [`DynError::UnknownName`], with the names there are.
    pub fn path_idx(&self, name: &str) -> Result<usize, DynError> {
        index_of("path", name, &self.path_names())
    }

    /// Index of a speed by its name.
    ///
    /// # Errors
    /// [`DynError::UnknownName`], with the names there are.
    pub fn speed_idx(&self, name: &str) -> Result<usize, DynError> {
        index_of("speed", name, &self.speed_names())
    }

    /// Index of a load by its name.
    ///
    /// # Errors
    /// [`DynError::UnknownName`], with the names there are.
    pub fn load_idx(&self, name: &str) -> Result<usize, DynError> {
        index_of("load", name, &self.load_names())
    }

    /// Time for one round of a path at a speed, s.
    ///
    /// # Panics
    /// If there is no such speed.
    pub fn duration(&self, speed_idx: usize) -> f64 {
        self.durations[speed_idx]
    }

    /// Point of a path at a phase (rad), m; the origin is on the floor below joint 1, as in table 1.
    ///
    /// # Panics
    /// If there is no such path.
    pub fn path_point(&self, path_idx: usize, phase: f64) -> [f64; 3] {
        let point = self.paths[path_idx].motion(phase).point;
        [point.x, point.y, point.z + self.shoulder_height]
    }

    /// A load as a payload in the frame of the last link.
    ///
    /// # Panics
    /// If there is no such load.
    pub fn payload(&self, load_idx: usize) -> &Payload {
        &self.loads[load_idx].payload
    }

    /// One round of a path at a speed.
    ///
    /// # Errors
    /// [`DynError::Unreachable`] for a point that the wrist cannot reach, with the path and the sample.
    ///
    /// # Panics
    /// If there is no such path or speed.
    pub fn trajectory(&self, path_idx: usize, speed_idx: usize) -> Result<Trajectory, DynError> {
        let motion = self.path_motion(path_idx)?;
        Ok(self.timed(&motion, path_idx, speed_idx))
    }

    /// Every path at every speed: (p1,s1), (p1,s2), …, (p2,s1), …
    ///
    /// # Errors
    /// [`DynError::Unreachable`] for a point that the wrist cannot reach, with the path and the sample.
    pub fn trajectories(&self) -> Result<Vec<Trajectory>, DynError> {
        let mut trajectories = Vec::with_capacity(self.paths.len() * self.durations.len());
        for path_idx in 0..self.paths.len() {
            let motion = self.path_motion(path_idx)?;
            trajectories.extend(
                (0..self.durations.len()).map(|speed_idx| self.timed(&motion, path_idx, speed_idx)),
            );
        }
        Ok(trajectories)
    }

    /// Torques along a trajectory under a load, without noise; the memory of friction begins at zero.
    ///
    /// # Shapes
    /// (n_samples, 6) row-major, N·m.
    ///
    /// # Panics
    /// If there is no such load.
    pub fn torques(&self, trajectory: &Trajectory, load_idx: usize) -> Vec<f64> {
        let mut torques = vec![0.0; trajectory.n_samples() * N_JOINTS];
        let mut workspace = Workspace::new(&self.model);
        let mut hysteresis = Hysteresis::new(&self.model);
        let context = &self.loads[load_idx].context;
        for (sample_idx, tau) in torques.chunks_exact_mut(N_JOINTS).enumerate() {
            let (q, qd, qdd) = trajectory.state(sample_idx);
            if let Some(before) = sample_idx.checked_sub(1) {
                hysteresis.advance(qd, trajectory.time[sample_idx] - trajectory.time[before]);
            }
            rnea_with_hysteresis(
                &self.model,
                &mut workspace,
                self.effects,
                context,
                &hysteresis,
                q,
                qd,
                qdd,
                tau,
            );
        }
        torques
    }

    /// The joints that leave their mechanical ranges, path by path. The chapter's simulator enforces no range, nor does this one.
    ///
    /// # Errors
    /// [`DynError::Unreachable`] for a point that the wrist cannot reach, with the path and the sample.
    pub fn range_excesses(&self) -> Result<Vec<RangeExcess>, DynError> {
        let mut excesses = Vec::new();
        for path_idx in 0..self.paths.len() {
            let motion = self.path_motion(path_idx)?;
            for (joint_idx, &(lower, upper)) in RANGES_DEG.iter().enumerate() {
                let reached = motion.extent(joint_idx);
                let range = (lower.to_radians(), upper.to_radians());
                if reached.0 < range.0 || reached.1 > range.1 {
                    excesses.push(RangeExcess {
                        path_idx,
                        joint_idx,
                        reached,
                        range,
                    });
                }
            }
        }
        Ok(excesses)
    }

    /// Solves the inverse kinematics along one path.
    fn path_motion(&self, path_idx: usize) -> Result<PathMotion, DynError> {
        let path = &self.paths[path_idx];
        let mut samples: Vec<([f64; N_JOINTS], JointMotion)> = Vec::with_capacity(self.n_samples);
        for sample_idx in 0..self.n_samples {
            let phi = 2.0 * PI * sample_idx as f64 / self.n_samples as f64;
            let previous = samples.last().map(|(q, _)| q);
            let sample = self
                .joint_motion(path, phi, previous)
                .map_err(|error| at_sample(error, path_idx, sample_idx))?;
            samples.push(sample);
        }
        Ok(PathMotion { samples })
    }

    /// Joint angles, continuous with `previous`, and their derivatives at one phase.
    fn joint_motion(
        &self,
        path: &FigureOfEight,
        phi: f64,
        previous: Option<&[f64; N_JOINTS]>,
    ) -> Result<([f64; N_JOINTS], JointMotion), DynError> {
        let tip = path.motion(phi);
        let mut q = inverse_kinematics(&self.tool.wrist_pose(&tip.point), self.branch)?;
        for (angle, &before) in q.iter_mut().zip(previous.into_iter().flatten()) {
            *angle -= 2.0 * PI * ((*angle - before) / (2.0 * PI)).round();
        }
        // The tool does not turn, so the wrist moves as the tip does.
        let motion = inverse_rates(&q, &tip.velocity, &tip.acceleration)?;
        Ok((q, motion))
    }

    /// The motion along a path, traced at a speed.
    fn timed(&self, motion: &PathMotion, path_idx: usize, speed_idx: usize) -> Trajectory {
        let duration = self.durations[speed_idx];
        let rate = 2.0 * PI / duration; // dφ/dt, rad/s
        let mut states = Vec::with_capacity(motion.samples.len() * N_STATE);
        for (q, JointMotion { qd, qdd }) in &motion.samples {
            states.extend(q);
            states.extend(qd.map(|derivative| rate * derivative));
            states.extend(qdd.map(|derivative| rate * rate * derivative));
        }
        Trajectory {
            path: format!("p{}", path_idx + 1),
            speed: format!("s{}", speed_idx + 1),
            time: (0..self.n_samples)
                .map(|k| duration * k as f64 / self.n_samples as f64)
                .collect(),
            states,
        }
    }
}

impl Load {
    fn new(model: &Model, load: &LoadSection) -> Result<Self, DynError> {
        let named = |error: DynError| DynError::Scenario {
            reason: format!("load `{}`: {error}", load.name),
        };
        let payload =
            Payload::cuboid(load.mass, load.size, load.centre, load.rpy).map_err(named)?;
        // The last frame is that of the last link, to which the loads are fixed.
        let context = model.attach(model.frames().len() - 1, &payload)?.into();
        Ok(Self {
            name: load.name.clone(),
            payload,
            context,
        })
    }
}

impl PathMotion {
    /// Smallest and largest angle of a joint, rad.
    fn extent(&self, joint_idx: usize) -> (f64, f64) {
        let angles = self.samples.iter().map(|(q, _)| q[joint_idx]);
        angles.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), angle| {
            (low.min(angle), high.max(angle))
        })
    }
}

/// The paths of a file, with the shoulder as origin.
fn figures(section: &PathSection, shoulder_height: f64) -> Vec<FigureOfEight> {
    let centres = section.centre_x.iter().zip(&section.centre_z);
    let figure = |((&x, &z), rotation): ((&f64, &f64), &f64)| FigureOfEight {
        centre: [x, 0.0, z - shoulder_height],
        rotation: rotation.to_radians(),
        half_width: section.half_width,
        half_height: section.half_height,
    };
    centres.zip(&section.rotation).map(figure).collect()
}

/// Adds the path and the sample to the reason of an unreachable pose.
fn at_sample(error: DynError, path_idx: usize, sample_idx: usize) -> DynError {
    match error {
        DynError::Unreachable { position, reason } => DynError::Unreachable {
            position,
            reason: format!("{reason} (path p{}, sample {sample_idx})", path_idx + 1),
        },
        other => other,
    }
}

fn numbered(letter: char, count: usize) -> Vec<String> {
    (1..=count)
        .map(|number| format!("{letter}{number}"))
        .collect()
}

fn index_of(what: &'static str, name: &str, known: &[String]) -> Result<usize, DynError> {
    known
        .iter()
        .position(|candidate| candidate == name)
        .ok_or_else(|| DynError::UnknownName {
            what,
            name: name.to_owned(),
            known: known.join(", "),
        })
}
