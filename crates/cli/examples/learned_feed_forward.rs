//! From a log of torques to a controller that needs a fraction of the gains, in five steps.
//!
//! ```text
//! cargo run --release -p cli --example learned_feed_forward
//! ```
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::error::Error;

use faer::Mat;
use gp_core::{FitOptions, JointModel, Provenance, TorqueModel, TrainingRanges};
use kernels::TorqueForm;
use puma_dyn::motion::{
    ClosedLoop, CompositeController, FeedForward, GravityFeedForward, JointState, NoFeedForward,
    Rate, ReferenceMotion,
};
use puma_dyn::{Context, DynError, Scenario};

const N_JOINTS: usize = 6;
/// A sample of the log out of so many: 125 in all.
const STRIDE: usize = 32;

#[allow(
    clippy::too_many_lines,
    reason = "an example is read from top to bottom"
)]
fn main() -> Result<(), Box<dyn Error>> {
    // 1. A robot that carries a load of 2 kg. Here it is simulated; it has friction, gears and rotors.
    let scenario = Scenario::reference();
    let (path, load) = (scenario.path_idx("p2")?, scenario.load_idx("c10")?);
    let (model, effects) = (scenario.model(), scenario.effects());
    let flange = model.frames().len() - 1;
    let carried: Context = model.attach(flange, scenario.payload(load))?.into();

    // 2. A log: states (q, q̇, q̈) and torques of one round at medium speed.
    let run = scenario.trajectory(path, scenario.speed_idx("s3")?)?;
    let torques = scenario.torques(&run, load);
    let rows: Vec<usize> = (0..run.n_samples()).step_by(STRIDE).collect();
    let x = Mat::from_fn(rows.len(), 3 * N_JOINTS, |row, col| {
        run.states[rows[row] * 3 * N_JOINTS + col]
    });

    // 3. A Gaussian process for every joint, learned from the log alone.
    let of_joint = |joint: usize| -> Vec<f64> {
        rows.iter()
            .map(|row| torques[row * N_JOINTS + joint])
            .collect()
    };
    let targets: Vec<Vec<f64>> = (0..N_JOINTS).map(of_joint).collect();
    let torque_model = learn(model.joint_names(), &x, &targets)?;

    // 4. The model as feed-forward: means at the desired state, without an allocation a tick.
    let predictor = torque_model.predictor();
    let mut scratch = predictor.scratch();
    let (mut state, mut var) = ([0.0; 3 * N_JOINTS], [0.0; N_JOINTS]);
    let mut from_log = |desired: &JointState, tau: &mut [f64]| {
        let numbers = desired.q.iter().chain(&desired.qd).chain(&desired.qdd);
        state
            .iter_mut()
            .zip(numbers)
            .for_each(|(x, number)| *x = *number);
        if predictor
            .predict_into(&mut scratch, &state, tau, &mut var)
            .is_err()
        {
            tau.fill(f64::NAN); // stops the loop with the joint's name
        }
    };

    // 5. The loop at 1 kHz: the same path again, under three feed-forwards and four bandwidths.
    let reference = ReferenceMotion::new(N_JOINTS, run.time.clone(), run.states.clone())?;
    let inertias = [3.0, 4.5, 1.2, 0.2, 0.18, 0.2]; // kg m², what each joint turns, roughly
    println!("RMS error over all joints, mrad");
    println!(" ω (rad/s)    nothing    gravity    learned");
    for bandwidth in [2.0, 4.0, 8.0, 16.0] {
        let controller = CompositeController::with_bandwidth(&inertias, bandwidth, 1.0)?;
        let robot = || {
            let rate = Rate {
                period: 1e-3,
                n_steps: 1,
            };
            ClosedLoop::new(model, effects, carried.clone(), &reference, rate)
        };
        let nothing = track(robot()?, &controller, &mut NoFeedForward)?;
        let mut gravity = GravityFeedForward::new(model, carried.clone());
        let with_gravity = track(robot()?, &controller, &mut gravity)?;
        let with_log = track(robot()?, &controller, &mut from_log)?;
        println!("{bandwidth:>10} {nothing:>10.3} {with_gravity:>10.3} {with_log:>10.3}");
    }
    Ok(())
}

/// Root mean square error over joints and time, mrad.
fn track(
    mut robot: ClosedLoop<'_>,
    controller: &CompositeController,
    feed_forward: &mut impl FeedForward,
) -> Result<f64, DynError> {
    let (mut squares, mut n) = (0.0, 0.0);
    robot.run(controller, feed_forward, f64::INFINITY, |tick| {
        let errors = tick.desired.q.iter().zip(tick.q);
        squares += errors
            .map(|(desired, q)| (desired - q).powi(2))
            .sum::<f64>();
        n += N_JOINTS as f64;
    })?;
    Ok(1e3 * (squares / n).sqrt())
}

/// A GPc of every joint: eqs. (3) to (8).
fn learn(
    joints: &[String],
    x: &Mat<f64>,
    targets: &[Vec<f64>],
) -> Result<TorqueModel, Box<dyn Error>> {
    let mut learned: Vec<(usize, JointModel)> = Vec::new();
    for (joint, targets) in targets.iter().enumerate() {
        let fit = gp_core::fit(
            x.as_ref(),
            targets,
            TorqueForm::Coulomb,
            &FitOptions::several(),
        )?;
        learned.push((joint, fit.into()));
    }
    let provenance = Provenance {
        data_sha256: [0; 32],
        robot_sha256: None,
        program: "example".to_owned(),
        context: "c10".to_owned(),
    };
    let ranges = TrainingRanges::of(x.as_ref())?;
    Ok(TorqueModel::new(
        joints.to_vec(),
        learned,
        ranges,
        provenance,
    )?)
}
