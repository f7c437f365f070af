//! Samples of the built-in arm, which carries loads along a path: what a log of a robot would hold.

use std::error::Error;

use faer::Mat;
use puma_dyn::Scenario;
use torque_model::{ContinuousJoints, JointTorques, Samples, Timeline};

/// One round of a path at a speed with each of some loads: `n` states per load, the torques of some joints.
pub fn log(
    loads: &[&str],
    (path, speed): (&str, &str),
    n: usize,
    joints: &[usize],
) -> Result<Samples, Box<dyn Error>> {
    let scenario = Scenario::reference();
    let n_joints = scenario.model().n_joints();
    let run = scenario.trajectory(scenario.path_idx(path)?, scenario.speed_idx(speed)?)?;
    let rows: Vec<usize> = (0..n).map(|row| row * run.n_samples() / n).collect();
    let torques: Vec<Vec<f64>> = (loads.iter())
        .map(|load| Ok(scenario.torques(&run, scenario.load_idx(load)?)))
        .collect::<Result<_, puma_dyn::DynError>>()?;
    let of_joint = |&joint_idx: &usize| JointTorques {
        joint_idx,
        values: (torques.iter())
            .flat_map(|of_load| rows.iter().map(|row| of_load[row * n_joints + joint_idx]))
            .collect(),
    };
    let states = Mat::from_fn(loads.len() * n, 3 * n_joints, |row, col| {
        run.states[rows[row % n] * 3 * n_joints + col]
    });
    let samples = Samples {
        joint_names: scenario.model().joint_names().to_vec(),
        contexts: loads.iter().map(|load| (*load).to_owned()).collect(),
        context_of: (0..loads.len() * n).map(|row| row / n).collect(),
        x: states,
        torques: joints.iter().map(of_joint).collect(),
        timeline: Timeline::default(),
        continuous: ContinuousJoints::none(),
    };
    samples.check()?;
    Ok(samples)
}
