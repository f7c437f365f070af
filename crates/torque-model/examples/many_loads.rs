//! Three loads learned together, and a fourth from ten of its torques.
//!
//! ```text
//! cargo run --release -p torque-model --example many_loads
//! ```
#![expect(clippy::print_stdout, reason = "an example shows what it found")]

use std::error::Error;

use mtgp::MultiTaskOptions;
use torque_model::learn::{ManyContexts, Ranks, Tasks};
use torque_model::{Adapt, Provenance, RobotModel, Samples, adapt};

mod simulated;

fn main() -> Result<(), Box<dyn Error>> {
    let joints = [1, 2];
    let known = simulated::log(&["c3", "c9", "c14"], ("p2", "s3"), 40, &joints)?;
    let few = simulated::log(&["c6"], ("p2", "s3"), 10, &joints)?;
    let elsewhere = simulated::log(&["c6"], ("p2", "s2"), 400, &joints)?;

    // mGP of rank 2: how the loads are related is learned with the rest, joint by joint.
    let learner = ManyContexts {
        tasks: Tasks::Transfer(Ranks::Given(2)),
        options: MultiTaskOptions::chapter(),
    };
    let provenance = Provenance::new("example", b"simulated");
    let model = RobotModel::learn(&known, &learner, provenance.clone())?;
    println!("RMS error for load c6, N·m, joints 2 and 3");
    for (number, context) in model.contexts().iter().enumerate() {
        println!("{context:>10} {}", errors(&model, number, &elsewhere)?);
    }

    // One more row of Λ; the other loads are predicted from all torques together then.
    let adapted = adapt(&model, "c6", &few, Adapt::default(), provenance)?;
    let new = adapted.number_of("c6")?;
    println!("{:>10} {}", "adapted", errors(&adapted, new, &elsewhere)?);
    Ok(())
}

fn errors(model: &RobotModel, context: usize, test: &Samples) -> Result<String, Box<dyn Error>> {
    let found = model.predict(context, test.x.as_ref())?;
    let rms = found.iter().zip(&test.torques).map(|(found, torques)| {
        let squares = found.mean.iter().zip(&torques.values);
        let sum: f64 = squares.map(|(mean, torque)| (mean - torque).powi(2)).sum();
        format!("{:8.4}", (sum / torques.values.len() as f64).sqrt())
    });
    Ok(rms.collect::<Vec<_>>().join(" "))
}
