//! Torques of any model file, one state at a time, as a control loop asks for them.
//!
//! ```text
//! cargo run --release -p torque-model --example control_loop -- MODEL.tgp STATES.csv [--context NAME]
//! ```
//! The states have columns q1, …, qd1, …, qdd1, … or `q_<joint>`, …, in any order; the torques are
//! those of `torque-gp predict`, to the bit. A model whose friction remembers wants a column `t` as well, and the
//! rows of one motion in their order.
#![expect(clippy::print_stdout, reason = "the torques are the result")]

use std::error::Error;

use torque_model::{RobotModel, TorqueError};

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
    let remembers = model.n_covariates() > 3 * model.n_joints();
    let log = read_states(states_path, model.joint_names(), remembers)?;
    let learned = model.learned().iter().map(|(idx, _)| &log.suffixes[*idx]);
    let of_joints = learned.map(|name| format!("tau{name},tau{name}_std"));
    let header: Vec<String> = (remembers.then(|| "t".to_owned()).into_iter())
        .chain(of_joints)
        .collect();

    let torques = torques(&model, context, &log)
        .map_err(|(row, error)| format!("{states_path}: row {}: {error}", row + 1))?;

    println!("{}", header.join(","));
    for (row, torques) in torques.chunks_exact(2 * model.learned().len()).enumerate() {
        let numbers = torques.iter().map(|number| format!("{number:?}"));
        let fields: Vec<String> = log
            .times
            .get(row)
            .cloned()
            .into_iter()
            .chain(numbers)
            .collect();
        println!("{}", fields.join(","));
    }
    Ok(())
}

/// Mean and standard deviation of every learned joint at each state, or the row that has none, and why.
fn torques(
    model: &RobotModel,
    context: usize,
    log: &Log,
) -> Result<Vec<f64>, (usize, TorqueError)> {
    // All that a loop needs is made before it: afterwards nothing is allocated.
    let predictor = model.predictor();
    let (mut scratch, mut memory) = (predictor.scratch(), model.hysteresis());
    let (n, n_joints) = (predictor.n_learned(), model.n_joints());
    let (mut mean, mut var) = (vec![0.0; n], vec![0.0; n]);
    let mut x = vec![0.0; predictor.n_covariates()];
    let mut torques = Vec::with_capacity(log.states.len() * 2 * n);
    for (row, state) in log.states.iter().enumerate() {
        if let Some(step) = log.steps.get(row) {
            memory.advance(&state[n_joints..2 * n_joints], *step);
        }
        x[..3 * n_joints].copy_from_slice(state);
        x[3 * n_joints..].copy_from_slice(memory.states());
        (predictor.predict_into(context, &mut scratch, &x, &mut mean, &mut var))
            .map_err(|error| (row, error))?;
        for (mean, var) in mean.iter().zip(&var) {
            torques.extend([*mean, var.sqrt()]);
        }
    }
    Ok(torques)
}

/// What a file of states holds.
struct Log {
    /// What follows `q` and `tau` in the names of each joint's columns.
    suffixes: Vec<String>,
    /// (q, qd, qdd) each.
    states: Vec<Vec<f64>>,
    /// Times as they are written, and the seconds since the row before, of a model with memory.
    times: Vec<String>,
    steps: Vec<f64>,
}

/// The states in a file, with their times where friction remembers.
fn read_states(path: &str, joints: &[String], with_times: bool) -> Result<Log, Box<dyn Error>> {
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
    let time = position("t").filter(|_| with_times);
    if with_times && time.is_none() {
        return Err(format!("{path}: no column `t`, which friction that remembers needs").into());
    }
    let (mut states, mut times, mut seconds) = (Vec::new(), Vec::new(), Vec::new());
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
        if let Some(time) = &time {
            times.push(record[*time].to_owned());
            seconds.push(number(time)?);
        }
    }
    let before = seconds.first().into_iter().chain(&seconds);
    Ok(Log {
        suffixes,
        states,
        times,
        steps: seconds
            .iter()
            .zip(before)
            .map(|(t, before)| t - before)
            .collect(),
    })
}
