//! The arm that is controlled: what it follows, what it carries, and what came of a run.

use faer::Mat;
use puma_dyn::motion::{
    ClosedLoop, CompliantWall, CompositeController, FeedForward, JointState, Rate, ReferenceMotion,
};
use puma_dyn::{Context, Scenario, Workspace, crba};
use serde::{Deserialize, Serialize};

use super::settings::Obstacle;
use crate::dataset::N_JOINTS;
use crate::error::BenchError;
use crate::split::{REFERENCE, TrajectoryId};

/// Time between two ticks of the controller, s.
pub const PERIOD: f64 = 1e-3;
/// Distance of the tool's tip from the wrist centre along z6, m: `tool.offset` of the scenario.
const TOOL: f64 = 0.15;

/// The scenario's arm with the inertias that its gains are scaled by.
pub struct Plant {
    scenario: Scenario,
    inertias: [f64; N_JOINTS],
}

/// A motion under a load.
pub struct Run<'a> {
    /// What is followed.
    pub reference: &'a ReferenceMotion,
    /// What the arm carries.
    pub context: Context,
    /// What is in its way.
    pub wall: Option<CompliantWall>,
}

/// Gains and integration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Control {
    /// Bandwidth of the gains, rad/s.
    pub bandwidth: f64,
    /// Damping ratio of the gains.
    pub damping_ratio: f64,
    /// Steps of the integration from one tick to the next.
    pub n_steps: usize,
}

/// What came of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Root mean square of each joint's error, rad.
    pub errors: [f64; N_JOINTS],
    /// Root mean square of the corrective torque over that of the whole, mean of the joints.
    pub corrective_share: f64,
    /// Largest force between tip and wall at a tick, N.
    pub peak_force: f64,
}

impl Outcome {
    /// Root mean square error over joints and time, rad.
    pub fn error(&self) -> f64 {
        let squares = self.errors.map(|error| error * error);
        (squares.iter().sum::<f64>() / N_JOINTS as f64).sqrt()
    }
}

/// Sums of squares along a run.
#[derive(Default)]
pub struct Tally {
    errors: [f64; N_JOINTS],
    corrective: [f64; N_JOINTS],
    torques: [f64; N_JOINTS],
    n: f64,
    peak_force: f64,
}

impl Tally {
    /// Takes a tick in.
    pub fn add(&mut self, tick: &puma_dyn::motion::Tick<'_>) {
        for joint in 0..N_JOINTS {
            let error = tick.desired.q[joint] - tick.q[joint];
            let corrective = tick.tau[joint] - tick.feed_forward[joint];
            self.errors[joint] += error * error;
            self.corrective[joint] += corrective * corrective;
            self.torques[joint] += tick.tau[joint] * tick.tau[joint];
        }
        self.n += 1.0;
        self.peak_force = self.peak_force.max(tick.wall_force);
    }

    /// The result so far.
    pub fn outcome(&self) -> Outcome {
        let shares = self.corrective.iter().zip(&self.torques);
        let shares: f64 = shares.map(|(part, whole)| (part / whole).sqrt()).sum();
        Outcome {
            errors: self.errors.map(|sum| (sum / self.n).sqrt()),
            corrective_share: shares / N_JOINTS as f64,
            peak_force: self.peak_force,
        }
    }
}

impl Plant {
    /// The reference scenario's arm.
    ///
    /// # Errors
    /// `Dynamics` if the scenario has an unreachable point.
    pub fn new() -> Result<Self, BenchError> {
        let scenario = Scenario::reference();
        let inertias = mean_inertias(&scenario)?;
        Ok(Self { scenario, inertias })
    }

    /// The scenario.
    pub fn scenario(&self) -> &Scenario {
        &self.scenario
    }

    /// Mean diagonal of the unloaded arm's inertia matrix along T_r, rotors included, kg m².
    pub fn inertias(&self) -> &[f64; N_JOINTS] {
        &self.inertias
    }

    /// A trajectory of the data set as a motion to follow.
    ///
    /// # Errors
    /// `Dynamics`.
    pub fn reference(&self, id: TrajectoryId) -> Result<ReferenceMotion, BenchError> {
        let trajectory = self.scenario.trajectory(id.path_idx, id.speed_idx)?;
        let (time, states) = (trajectory.time, trajectory.states);
        Ok(ReferenceMotion::new(N_JOINTS, time, states)?)
    }

    /// Load c`load`, from 1.
    ///
    /// # Errors
    /// `Dynamics`.
    pub fn context(&self, load: usize) -> Result<Context, BenchError> {
        let model = self.scenario.model();
        let payload = self.scenario.payload(load - 1);
        Ok(model.attach(model.frames().len() - 1, payload)?.into())
    }

    /// Desired states at every tick, (n, 18).
    ///
    /// # Errors
    /// `Dynamics`.
    pub fn desired(&self, reference: &ReferenceMotion) -> Result<Mat<f64>, BenchError> {
        let n_ticks = self.control_loop(reference, Context::empty(), 1)?.n_ticks();
        let mut x = Mat::zeros(n_ticks, 3 * N_JOINTS);
        let mut state = JointState::zero(N_JOINTS);
        for row in 0..n_ticks {
            reference.at(PERIOD * row as f64, &mut state);
            let numbers = state.q.iter().chain(&state.qd).chain(&state.qdd);
            for (col, number) in numbers.enumerate() {
                x[(row, col)] = *number;
            }
        }
        Ok(x)
    }

    /// The loop before its first tick.
    ///
    /// # Errors
    /// `Dynamics`.
    pub fn control_loop<'a>(
        &'a self,
        reference: &'a ReferenceMotion,
        context: Context,
        n_steps: usize,
    ) -> Result<ClosedLoop<'a>, BenchError> {
        let rate = Rate {
            period: PERIOD,
            n_steps,
        };
        let (model, effects) = (self.scenario.model(), self.scenario.effects());
        Ok(ClosedLoop::new(model, effects, context, reference, rate)?)
    }

    /// The controller of a bandwidth.
    ///
    /// # Errors
    /// `Dynamics` for a gain that is none.
    pub fn controller(&self, control: Control) -> Result<CompositeController, BenchError> {
        let Control {
            bandwidth,
            damping_ratio,
            ..
        } = control;
        Ok(CompositeController::with_bandwidth(
            &self.inertias,
            bandwidth,
            damping_ratio,
        )?)
    }

    /// Follows a reference to its end.
    ///
    /// # Errors
    /// `Dynamics`.
    pub fn follow(
        &self,
        run: &Run<'_>,
        feed_forward: &mut impl FeedForward,
        control: Control,
    ) -> Result<Outcome, BenchError> {
        let mut robot = self.control_loop(run.reference, run.context.clone(), control.n_steps)?;
        if let Some(wall) = &run.wall {
            robot = robot.with_wall(wall.clone())?;
        }
        let controller = self.controller(control)?;
        let mut tally = Tally::default();
        robot.run(&controller, feed_forward, f64::INFINITY, |tick| {
            tally.add(tick);
        })?;
        Ok(tally.outcome())
    }

    /// A wall across a path, some way to its side.
    pub fn wall(&self, path_idx: usize, obstacle: &Obstacle) -> CompliantWall {
        let quarter = std::f64::consts::FRAC_PI_2;
        let [left, right] =
            [-quarter, quarter].map(|phase| self.scenario.path_point(path_idx, phase));
        let across = [0, 1].map(|axis| right[axis] - left[axis]);
        let width = across[0].hypot(across[1]);
        let at = |axis: usize| {
            let middle = 0.5 * (left[axis] + right[axis]);
            middle + 0.5 * obstacle.share * across[axis]
        };
        CompliantWall {
            frame_idx: self.scenario.model().frames().len() - 1,
            tip: [0.0, 0.0, TOOL],
            point: [at(0), at(1), 0.0],
            normal: [-across[0] / width, -across[1] / width, 0.0],
            stiffness: obstacle.stiffness,
            dissipation: obstacle.dissipation,
        }
    }
}

fn mean_inertias(scenario: &Scenario) -> Result<[f64; N_JOINTS], BenchError> {
    let model = scenario.model();
    let trajectory = scenario.trajectory(REFERENCE.path_idx, REFERENCE.speed_idx)?;
    let (mut workspace, mut matrix) = (Workspace::new(model), [0.0; N_JOINTS * N_JOINTS]);
    let mut sums = [0.0; N_JOINTS];
    for sample in 0..trajectory.n_samples() {
        let (q, _, _) = trajectory.state(sample);
        let (effects, empty) = (scenario.effects(), Context::empty());
        crba(model, &mut workspace, effects, &empty, q, &mut matrix);
        for (joint, sum) in sums.iter_mut().enumerate() {
            *sum += matrix[joint * N_JOINTS + joint];
        }
    }
    Ok(sums.map(|sum| sum / trajectory.n_samples() as f64))
}

#[cfg(test)]
mod tests {
    use puma_dyn::forward_kinematics;
    use puma_dyn::nalgebra::Vector3;

    use super::*;

    #[test]
    fn the_walls_tip_is_the_point_that_follows_the_path() {
        let plant = Plant::new().unwrap();
        let model = plant.scenario().model();
        let obstacle = Obstacle::sample();
        let wall = plant.wall(1, &obstacle);
        let trajectory = plant.scenario().trajectory(1, 3).unwrap();
        for sample in [0, 500, 1300] {
            let (q, _, _) = trajectory.state(sample);
            let pose = forward_kinematics(model, wall.frame_idx, q);
            let tip = pose.transform_point(&Vector3::from(wall.tip));
            let phase = std::f64::consts::TAU * sample as f64 / 4000.0;
            let point = plant.scenario().path_point(1, phase);
            for axis in [0, 1] {
                let error = (tip[axis] - point[axis]).abs();
                assert!(error < 1e-12, "{tip} {point:?}");
            }
        }
        // Half-way to the side of a path of half width 0.1 m.
        let centre = plant.scenario().path_point(1, 0.0);
        let distance = (0..2).map(|axis| (wall.point[axis] - centre[axis]).powi(2));
        assert!((distance.sum::<f64>().sqrt() - 0.05).abs() < 1e-12);
    }
}
