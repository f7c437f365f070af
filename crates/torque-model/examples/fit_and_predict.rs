//! From a log of one load to a model file and torques elsewhere.
//!
//! ```text
//! cargo run --release -p torque-model --example fit_and_predict
//! ```
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::error::Error;

use gp_core::FitOptions;
use kernels::TorqueForm;
use torque_model::learn::{Learn, Linear, RigidBody, RigidBodyForm, SingleProcess};
use torque_model::{Provenance, Robot, RobotModel, RobotSource};

mod simulated;

fn main() -> Result<(), Box<dyn Error>> {
    // 1. Samples: states (q, qd, qdd) and torques of two joints, learned at one speed, tried at another.
    let train = simulated::log(&["c10"], ("p2", "s3"), 100, &[1, 2])?;
    let test = simulated::log(&["c10"], ("p2", "s2"), 500, &[1, 2])?;

    // 2. Learners: the chapter's, and two that know the robot, though not its load.
    let robot = Robot::new(RobotSource::puma560(), "puma560")?;
    let options = FitOptions::chapter();
    let process = SingleProcess {
        form: TorqueForm::Coulomb,
        options: options.clone(),
    };
    let of_robot = |form| RigidBody::new(robot.clone(), form, options.clone());
    let (rbd, both) = (
        of_robot(RigidBodyForm::Alone),
        of_robot(RigidBodyForm::WithProcess),
    );
    let learners: [&dyn Learn; 4] = [&Linear::coulomb(), &process, &rbd, &both];

    println!("RMS error at another speed, N·m");
    for learner in learners {
        // 3. A model, its file, and the model again.
        let provenance = Provenance::new("example", b"simulated");
        let model = RobotModel::learn(&train, learner, provenance)?;
        let bytes = model.to_bytes();
        let model = RobotModel::from_bytes(&bytes)?;

        // 4. Torques with their uncertainty, for many states at once.
        let errors = model.predict(0, test.x.as_ref())?;
        let rms = errors.iter().zip(&test.torques).map(|(found, torques)| {
            let squares = found.mean.iter().zip(&torques.values);
            let sum: f64 = squares.map(|(mean, torque)| (mean - torque).powi(2)).sum();
            (sum / torques.values.len() as f64).sqrt()
        });
        let rms: Vec<String> = rms.map(|rms| format!("{rms:8.4}")).collect();
        println!(
            "{:>8} {} {:>8} bytes",
            learner.name(),
            rms.join(" "),
            bytes.len()
        );
    }
    Ok(())
}
