//! Arms drawn about the description of the PUMA 560, and logs of them: their truth is known.
//!
//! Torques are those of `rnea_with_hysteresis` on the drawn arm, which shares no code with the regressor that is fitted.

use std::f64::consts::TAU;
use std::sync::Arc;

use faer::Mat;
use puma_dyn::dynamics::{Hysteresis, N_PARAMETERS, inertial_parameters, rnea_with_hysteresis};
use puma_dyn::motion::TorqueNoise;
use puma_dyn::robot::{
    FrictionTerm, HysteresisFriction, Inertial, JointDescription, LoadHysteresisFriction,
    SmoothFriction, TanhFriction,
};
use puma_dyn::{Context, Effects, Model, Payload, Workspace, puma560};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use torque_model::rigid_body::{ParameterPosterior, body_std};
use torque_model::{JointTorques, Samples, Timeline};

const N_JOINTS: usize = puma560::N_JOINTS;
/// Coulomb friction of the joints, N·m, roughly that of the table.
const COULOMB: [f64; N_JOINTS] = [20.0, 10.0, 6.0, 1.0, 0.8, 0.6];
/// Standard deviation of noise as a part of the root mean square of a joint's torques.
const NOISE_PART: f64 = 0.01;
/// Seconds between rows.
pub const STEP: f64 = 0.01;

/// What friction the drawn arms have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrictionKind {
    /// A sum of terms of the fitted model.
    OfTheModel,
    /// Other widths, and another length of memory.
    Other,
}

/// An arm, what it carries, and its noise.
#[derive(Debug)]
pub struct SimulatedArm {
    /// The description that a fit sets out from.
    pub described: Arc<Model>,
    /// The arm as it is.
    pub arm: Model,
    /// Nothing, then each load.
    pub contexts: Vec<Context>,
    /// Standard deviation of each joint's noise, N·m.
    pub noise_std: [f64; N_JOINTS],
    /// Correlation time of noise, s.
    pub noise_time: f64,
    joints: Vec<JointDescription>,
    seed: u64,
}

fn rng(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    rng
}

fn uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

/// A standard normal number (Box & Muller 1958).
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    let radius = (-2.0 * (1.0 - rng.random::<f64>()).ln()).sqrt();
    radius * (TAU * rng.random::<f64>()).cos()
}

impl SimulatedArm {
    /// Links from the prior about the description, as far as their masses are positive; friction, loads and the
    /// correlation time of 1 % noise within ranges that arms have.
    pub fn draw(seed: u64, kind: FrictionKind, n_loads: usize) -> Self {
        let described = Arc::new(puma560::model());
        let mut rng = rng(seed, 0);
        let mut description = puma560::description();
        let pi = inertial_parameters(&described, &Context::empty());
        let std = body_std(&pi, false);
        for (joint, link) in description.links[1..].iter_mut().enumerate() {
            let of_link = 10 * joint..10 * (joint + 1);
            link.inertial = Some(drawn_body(&mut rng, &pi[of_link.clone()], &std[of_link]));
        }
        for (joint, of_joint) in description.joints.iter_mut().enumerate() {
            let drive = &mut of_joint.drive;
            drive.rotor_inertia *= uniform(&mut rng, 0.8, 1.2);
            drive.viscous_motor *= uniform(&mut rng, 0.7, 1.3);
            (drive.coulomb_motor_positive, drive.coulomb_motor_negative) = (0.0, 0.0);
            of_joint.smooth_friction = drawn_friction(&mut rng, COULOMB[joint], kind);
        }
        let arm = Model::new(&description).unwrap();
        let frame = arm.frame_idx(puma560::LAST_LINK).unwrap();
        let load = |_| {
            let payload = drawn_load(&mut rng);
            Context::from(arm.attach(frame, &payload).unwrap())
        };
        let loads: Vec<Context> = (0..n_loads).map(load).collect();
        let mut drawn = Self {
            described,
            contexts: [vec![Context::empty()], loads].concat(),
            arm,
            joints: description.joints,
            noise_std: [0.0; N_JOINTS],
            noise_time: uniform(&mut rng, 0.05, 0.1),
            seed,
        };
        drawn.noise_std = drawn.torque_rms().map(|rms| NOISE_PART * rms);
        drawn
    }

    /// The arm as the table describes it, with its jumps of friction; nothing, then each of these loads; white noise.
    pub fn as_described(seed: u64, loads: &[Payload], noise_std: f64) -> Self {
        let arm = puma560::model();
        let frame = arm.frame_idx(puma560::LAST_LINK).unwrap();
        let carried = (loads.iter()).map(|load| Context::from(arm.attach(frame, load).unwrap()));
        Self {
            described: Arc::new(puma560::model()),
            contexts: [Context::empty()].into_iter().chain(carried).collect(),
            arm,
            joints: puma560::description().joints,
            noise_std: [noise_std; N_JOINTS],
            noise_time: 0.0,
            seed,
        }
    }

    /// A log of runs, each in a context for some seconds; `label` makes it another one.
    pub fn log(&self, label: u64, runs: &[(usize, f64)]) -> Samples {
        let mut rows: Vec<[f64; 3 * N_JOINTS]> = Vec::new();
        let (mut torques, mut timeline, mut context_of) =
            (Vec::new(), Timeline::default(), Vec::new());
        for (run, (context, seconds)) in runs.iter().enumerate() {
            let motion = self.motion(1000 * label + run as u64, *seconds);
            torques.push(self.torques(&motion, &self.contexts[*context]));
            for (row, state) in motion.into_iter().enumerate() {
                timeline.t.push(STEP * row as f64);
                timeline.run_of.push(run);
                context_of.push(*context);
                rows.push(state);
            }
            timeline.run_names.push(format!("run {run}"));
        }
        self.add_noise(label, &timeline, &mut torques);
        let torques = torques.concat();
        let of_joint = |joint_idx| JointTorques {
            joint_idx,
            values: torques
                .iter()
                .skip(joint_idx)
                .step_by(N_JOINTS)
                .copied()
                .collect(),
        };
        Samples {
            joint_names: self.arm.joint_names().to_vec(),
            contexts: (0..self.contexts.len())
                .map(|load| format!("load {load}"))
                .collect(),
            context_of,
            x: Mat::from_fn(rows.len(), 3 * N_JOINTS, |row, col| rows[row][col]),
            torques: (0..N_JOINTS).map(of_joint).collect(),
            timeline,
            continuous: torque_model::ContinuousJoints::none(),
        }
    }

    /// Sums of three sines at each joint, row after row: q, q̇, q̈.
    fn motion(&self, label: u64, seconds: f64) -> Vec<[f64; 3 * N_JOINTS]> {
        let mut rng = rng(self.seed, label.wrapping_add(1));
        let waves: [[[f64; 3]; 3]; N_JOINTS] = std::array::from_fn(|_| {
            std::array::from_fn(|_| {
                [
                    uniform(&mut rng, 0.1, 0.5),
                    uniform(&mut rng, 0.5, 4.0),
                    uniform(&mut rng, 0.0, TAU),
                ]
            })
        });
        let centres: [f64; N_JOINTS] = std::array::from_fn(|_| uniform(&mut rng, -1.0, 1.0));
        let state = |row: usize| {
            let mut state = [0.0; 3 * N_JOINTS];
            for joint in 0..N_JOINTS {
                state[joint] = centres[joint];
                for [size, rate, phase] in waves[joint] {
                    let (sin, cos) = (rate * STEP * row as f64 + phase).sin_cos();
                    state[joint] += size * sin;
                    state[N_JOINTS + joint] += size * rate * cos;
                    state[2 * N_JOINTS + joint] -= size * rate * rate * sin;
                }
            }
            state
        };
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "rows of a run"
        )]
        let n = (seconds / STEP).round() as usize;
        (0..n).map(state).collect()
    }

    /// Torques without noise, row after row.
    fn torques(&self, motion: &[[f64; 3 * N_JOINTS]], context: &Context) -> Vec<f64> {
        let mut workspace = Workspace::new(&self.arm);
        let mut hysteresis = Hysteresis::new(&self.arm);
        let mut torques = vec![0.0; N_JOINTS * motion.len()];
        for (row, (state, tau)) in motion
            .iter()
            .zip(torques.chunks_exact_mut(N_JOINTS))
            .enumerate()
        {
            let (q, rates) = state.split_at(N_JOINTS);
            let (qd, qdd) = rates.split_at(N_JOINTS);
            if row > 0 {
                hysteresis.advance(qd, STEP);
            }
            let effects = Effects::ALL;
            rnea_with_hysteresis(
                &self.arm,
                &mut workspace,
                effects,
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

    /// Root mean squares of the torques of a motion without a load, N·m.
    fn torque_rms(&self) -> [f64; N_JOINTS] {
        let torques = self.torques(&self.motion(u64::MAX - 1, 60.0), &Context::empty());
        let n = (torques.len() / N_JOINTS) as f64;
        std::array::from_fn(|joint| {
            let of_joint = torques.iter().skip(joint).step_by(N_JOINTS);
            (of_joint.map(|tau| tau * tau).sum::<f64>() / n).sqrt()
        })
    }

    fn add_noise(&self, label: u64, timeline: &Timeline, torques: &mut [Vec<f64>]) {
        let noise = TorqueNoise::new(self.noise_std.to_vec(), self.noise_time).unwrap();
        let mut t = timeline.t.as_slice();
        for (run, torques) in torques.iter_mut().enumerate() {
            let (of_run, rest) = t.split_at(torques.len() / N_JOINTS);
            noise.add(
                self.seed,
                &format!("log {label}, run {run}"),
                of_run,
                torques,
            );
            t = rest;
        }
    }

    /// The unknowns of a posterior as they are in truth, (p,); friction of the model.
    pub fn unknowns(&self, posterior: &ParameterPosterior) -> Vec<f64> {
        let unknowns = posterior.unknowns();
        let mut w = vec![0.0; unknowns.len()];
        let bare = inertial_parameters(&self.arm, &Context::empty());
        let described = inertial_parameters(&self.described, &Context::empty());
        for (w, (bare, described)) in w.iter_mut().zip(bare.iter().zip(&described)) {
            *w = bare - described;
        }
        for joint in 0..N_JOINTS {
            for (term, unknown) in unknowns.terms().iter().zip(unknowns.friction(joint)) {
                w[unknown] = self.coefficient(joint, *term);
            }
        }
        for context in 0..posterior.n_contexts() {
            if let Some(load) = posterior.load_of(context) {
                w[unknowns.load(load)].copy_from_slice(&self.load(context));
            }
        }
        w
    }

    /// ψ of a context in truth, (10,).
    pub fn load(&self, context: usize) -> Vec<f64> {
        let loaded = inertial_parameters(&self.arm, &self.contexts[context]);
        let bare = inertial_parameters(&self.arm, &Context::empty());
        let carrier = bare.len() - N_PARAMETERS..bare.len();
        (loaded[carrier.clone()].iter().zip(&bare[carrier]))
            .map(|(loaded, bare)| loaded - bare)
            .collect()
    }

    /// θ of a joint's term in truth.
    fn coefficient(&self, joint: usize, term: FrictionTerm) -> f64 {
        let description = &self.joints[joint];
        let (drive, friction) = (description.drive, &description.smooth_friction);
        let gear = drive.gear_ratio.powi(2);
        match term {
            FrictionTerm::Acceleration => gear * drive.rotor_inertia,
            FrictionTerm::Speed => gear * drive.viscous_motor,
            _ => friction
                .terms()
                .find(|(of, _)| *of == term)
                .map_or(0.0, |(_, theta)| theta),
        }
    }
}

/// A body from the prior; one with a positive mass.
fn drawn_body(rng: &mut ChaCha8Rng, pi: &[f64], std: &[f64]) -> Inertial {
    let mass = loop {
        let mass = pi[0] + std[0] * normal(rng);
        if mass > 0.0 {
            break mass;
        }
    };
    let [x, y, z, xx, xy, yy, xz, yz, zz]: [f64; 9] =
        std::array::from_fn(|k| pi[k + 1] + std[k + 1] * normal(rng));
    let c = [x / mass, y / mass, z / mass];
    let square: f64 = c.iter().map(|c| c * c).sum();
    let at_origin = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let about_centre = |row: usize, col: usize| {
        let unit = if row == col { square } else { 0.0 };
        at_origin[row][col] - mass * (unit - c[row] * c[col])
    };
    Inertial {
        mass,
        centre: c,
        inertia: std::array::from_fn(|row| std::array::from_fn(|col| about_centre(row, col))),
    }
}

fn drawn_friction(rng: &mut ChaCha8Rng, coulomb: f64, kind: FrictionKind) -> SmoothFriction {
    let mut part = |low: f64, high: f64| uniform(rng, low, high);
    let (narrow, wide, short) = match kind {
        FrictionKind::OfTheModel => (0.02, 0.3, 5e-4),
        FrictionKind::Other => (0.03, 0.2, 8e-4),
    };
    let tanh = [(narrow, part(0.3, 0.7)), (wide, part(-0.3, 0.3))];
    SmoothFriction {
        offset: coulomb * part(-0.05, 0.05),
        tanh: tanh
            .map(|(width, part)| TanhFriction {
                width,
                torque: part * coulomb,
            })
            .into(),
        hysteresis: vec![HysteresisFriction {
            length: short,
            torque: coulomb * part(0.2, 0.6),
        }],
        load_hysteresis: vec![LoadHysteresisFriction {
            length: short,
            coefficient: part(0.01, 0.05),
        }],
        load_viscous: part(0.0, 0.03),
    }
}

/// A block of 0.5 to 3 kg within 0.1 m of the flange.
fn drawn_load(rng: &mut ChaCha8Rng) -> Payload {
    let mass = uniform(rng, 0.5, 3.0);
    let edges = std::array::from_fn(|_| uniform(rng, 0.05, 0.2));
    let centre = std::array::from_fn(|_| uniform(rng, -0.1, 0.1));
    let turn = std::array::from_fn(|_| uniform(rng, -3.0, 3.0));
    Payload::cuboid(mass, edges, centre, turn).unwrap()
}
