//! From a log of torques to a controller that needs a fraction of the gains.
//!
//! ```text
//! cargo run --release -p torque-model --example learned_feed_forward
//! ```
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::error::Error;

use gp_core::FitOptions;
use kernels::TorqueForm;
use puma_dyn::motion::{
    ClosedLoop, CompositeController, FeedForward, GravityFeedForward, JointState, NoFeedForward,
    Rate, ReferenceMotion,
};
use puma_dyn::{Context, DynError, Scenario};
use torque_model::learn::SingleProcess;
use torque_model::{Provenance, RobotModel};

mod simulated;

const N_JOINTS: usize = 6;

fn main() -> Result<(), Box<dyn Error>> {
    // 1. A log of one round with a load of 2 kg, and a Gaussian process for every joint from it alone.
    let log = simulated::log(&["c10"], ("p2", "s3"), 125, &[0, 1, 2, 3, 4, 5])?;
    let process = SingleProcess {
        form: TorqueForm::Coulomb,
        options: FitOptions::chapter(),
    };
    let torque_model = RobotModel::learn(&log, &process, Provenance::new("example", b"simulated"))?;

    // 2. The model as feed-forward: means at the desired state, without an allocation a tick.
    let predictor = torque_model.predictor();
    let mut scratch = predictor.scratch();
    let (mut state, mut var) = ([0.0; 3 * N_JOINTS], [0.0; N_JOINTS]);
    let mut from_log = |desired: &JointState, tau: &mut [f64]| {
        let numbers = desired.q.iter().chain(&desired.qd).chain(&desired.qdd);
        state
            .iter_mut()
            .zip(numbers)
            .for_each(|(x, number)| *x = *number);
        // After an error the torques are NaN, which stops the loop with the joint's name.
        let _ = predictor.predict_into(0, &mut scratch, &state, tau, &mut var);
    };

    // 3. The loop at 1 kHz: the same path again, under three feed-forwards and one bandwidth.
    let scenario = Scenario::reference();
    let run = scenario.trajectory(scenario.path_idx("p2")?, scenario.speed_idx("s3")?)?;
    let (model, effects) = (scenario.model(), scenario.effects());
    let load = scenario.payload(scenario.load_idx("c10")?);
    let carried: Context = model.attach(model.frames().len() - 1, load)?.into();
    let reference = ReferenceMotion::new(N_JOINTS, run.time.clone(), run.states.clone())?;
    let inertias = [3.0, 4.5, 1.2, 0.2, 0.18, 0.2]; // kg m², what each joint turns, roughly
    let controller = CompositeController::with_bandwidth(&inertias, 8.0, 1.0)?;
    let robot = || {
        let (period, n_steps) = (1e-3, 1);
        let rate = Rate { period, n_steps };
        ClosedLoop::new(model, effects, carried.clone(), &reference, rate)
    };
    let nothing = rms_error(robot()?, &controller, &mut NoFeedForward)?;
    let mut of_gravity = GravityFeedForward::new(model, carried.clone());
    let gravity = rms_error(robot()?, &controller, &mut of_gravity)?;
    let learned = rms_error(robot()?, &controller, &mut from_log)?;
    println!("RMS error over all joints, mrad");
    println!("nothing {nothing:10.3}\ngravity {gravity:10.3}\nlearned {learned:10.3}");
    Ok(())
}

/// Root mean square error over joints and time, mrad.
fn rms_error(
    mut robot: ClosedLoop<'_>,
    controller: &CompositeController,
    feed_forward: &mut impl FeedForward,
) -> Result<f64, DynError> {
    let (mut squares, mut n) = (0.0, 0.0);
    robot.run(controller, feed_forward, f64::INFINITY, |tick| {
        let errors = tick.desired.q.iter().zip(tick.q);
        let of_tick: f64 = errors.map(|(desired, q)| (desired - q).powi(2)).sum();
        squares += of_tick;
        n += N_JOINTS as f64;
    })?;
    Ok(1e3 * (squares / n).sqrt())
}
