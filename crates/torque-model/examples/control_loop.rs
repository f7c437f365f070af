//! Torques of any model file, one state at a time, as a control loop asks for them.
//!
//! ```text
//! cargo run --release -p torque-model --example control_loop -- MODEL.tgp STATES.csv [--context NAME]
//! ```
//! The states have columns q1, …, qd1, …, qdd1, … or `q_<joint>`, …, in any order; the torques are
//! those of `torque-gp predict`, to the bit.
#![expect(clippy::print_stdout, reason = "the torques are the result")]

use std::error::Error;

use torque_model::RobotModel;

fn main() -> Result<(), Box<dyn Error>> {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let (model_path, states_path, context) = match &args[..] {
        [model, states] => (model, states, None),
        [model, states, option, name] if option == "--context" => (model, states, Some(name)),
        _ => return Err("usage: control_loop MODEL.tgp STATES.csv [--context NAME]".into()),
    };
    let bytes = std::fs::read(model_path).map_err(|error| format!("{model_path}: {error}"))?;
    let model = RobotModel::from_bytes(&bytes).map_err(|error| format!("{model_path}: {error}"))?;
    let context = match context {
        Some(name) => model.number_of(name)?,
        None if model.contexts().is_empty() => 0,
        None => return Err(format!("--context: one of {}", model.contexts().join(", ")).into()),
    };
    let (names, states) = read_states(states_path, model.joint_names())?;
    let learned = model.learned().iter().map(|(idx, _)| &names[*idx]);
    let header: Vec<String> = learned
        .map(|name| format!("tau{name},tau{name}_std"))
        .collect();

    // All that a loop needs is made before it: afterwards nothing is allocated.
    let predictor = model.predictor();
    let mut scratch = predictor.scratch();
    let n = predictor.n_learned();
    let (mut mean, mut var) = (vec![0.0; n], vec![0.0; n]);
    let mut torques = Vec::with_capacity(states.len() * 2 * n);
    for (row, x) in states.iter().enumerate() {
        (predictor.predict_into(context, &mut scratch, x, &mut mean, &mut var))
            .map_err(|error| format!("{states_path}: row {}: {error}", row + 1))?;
        for (mean, var) in mean.iter().zip(&var) {
            torques.extend([*mean, var.sqrt()]);
        }
    }

    println!("{}", header.join(","));
    for row in torques.chunks_exact(2 * n) {
        let numbers: Vec<String> = row.iter().map(|number| format!("{number:?}")).collect();
        println!("{}", numbers.join(","));
    }
    Ok(())
}

/// Suffixes of the joints' columns, and states.
type States = (Vec<String>, Vec<Vec<f64>>);

/// What follows `q` and `tau` in the names of each joint's columns, and the states, (q, qd, qdd) each.
fn read_states(path: &str, joints: &[String]) -> Result<States, Box<dyn Error>> {
    let mut file = csv::Reader::from_path(path).map_err(|error| format!("{path}: {error}"))?;
    let header = file.headers()?.clone();
    let position = |name: &str| header.iter().position(|column| column == name);
    let numbered = (1..=joints.len()).map(|number| number.to_string());
    let suffixes: Vec<String> = match position("q1") {
        Some(_) => numbered.collect(),
        None => joints.iter().map(|joint| format!("_{joint}")).collect(),
    };
    let mut columns = Vec::new();
    for quantity in ["q", "qd", "qdd"] {
        for suffix in &suffixes {
            let name = format!("{quantity}{suffix}");
            let found = position(&name).ok_or_else(|| format!("{path}: no column `{name}`"))?;
            columns.push(found);
        }
    }
    let mut states = Vec::new();
    for (row, record) in file.records().enumerate() {
        let record = record.map_err(|error| format!("{path}: {error}"))?;
        let number = |&column: &usize| -> Result<f64, String> {
            let (text, name) = (&record[column], &header[column]);
            let number = text.trim().parse().ok().filter(|n: &f64| n.is_finite());
            let row = row + 1;
            number.ok_or_else(|| {
                format!("{path}: row {row}, column `{name}`: `{text}` is not a finite number")
            })
        };
        states.push(columns.iter().map(number).collect::<Result<_, _>>()?);
    }
    Ok((suffixes, states))
}
