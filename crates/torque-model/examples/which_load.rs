//! Which of the loads that a model knows is in the hand: eq. (21), from a log of torques.
//!
//! ```text
//! cargo run --release -p torque-model --example which_load
//! ```
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::error::Error;

use mtgp::MultiTaskOptions;
use mtgp::context::{ContextPrior, JointTorques, context_evidence};
use torque_model::learn::{ManyContexts, Ranks, Tasks};
use torque_model::{Provenance, RobotModel};

mod simulated;

fn main() -> Result<(), Box<dyn Error>> {
    let joints = [1, 2];
    let known = simulated::log(&["c3", "c9", "c14"], ("p2", "s3"), 40, &joints)?;
    let learner = ManyContexts {
        tasks: Tasks::Transfer(Ranks::Given(2)),
        options: MultiTaskOptions::chapter(),
    };
    let provenance = Provenance::new("example", b"simulated");
    let model = RobotModel::learn(&known, &learner, provenance)?;

    // Five states at another speed, with c9 in the hand, and c11, which the model does not know.
    for load in ["c9", "c11"] {
        let log = simulated::log(&[load], ("p2", "s2"), 5, &joints)?;
        let of_joint = |((_, process), torques): ((usize, _), _)| joint_torques(process, torques);
        let of_joints: Vec<JointTorques<'_>> =
            model.tasks().zip(&log.torques).map(of_joint).collect();
        let evidence = context_evidence(&of_joints, log.x.as_ref())?;
        let posterior = evidence.posterior(&ContextPrior::uniform(model.contexts().len())?)?;
        println!("{load} in the hand");
        let shown = model.contexts().iter().zip(posterior.probabilities());
        for ((context, probability), p_value) in shown.zip(evidence.p_values()) {
            println!("  {context:>4}  probability {probability:.4}  p-value {p_value:.1e}");
        }
    }
    Ok(())
}

/// A joint's posterior knows the density of torques under every load.
fn joint_torques<'a>(
    process: &'a torque_model::TaskProcess,
    torques: &'a torque_model::JointTorques,
) -> JointTorques<'a> {
    JointTorques {
        model: &process.posterior,
        torques: &torques.values,
    }
}
