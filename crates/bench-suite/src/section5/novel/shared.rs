//! rbd of the known loads, which learns the new one in closed form, as `torque-gp adapt` does.

use torque_model::{Adapt, JointTorques, RobotModel, TorqueFunction, adapt};

use super::case::{Case, Samples, Test};
use super::learners::{Learner, Score};
use crate::error::BenchError;
use crate::metrics::nmse;
use crate::rigid_body::{Terms, shared};
use crate::section5::bench::Bench;
use crate::section5::training_set::TrainingSet;

/// The learner of the new load that a model of the known ones is.
pub fn learner(terms: Terms) -> Learner {
    match terms {
        Terms::Chosen => Learner::Shared,
        Terms::Signs => Learner::SharedSigns,
    }
}

/// The model of the known loads, of all joints.
///
/// # Errors
/// `Model` if it cannot be learned.
pub fn known(terms: Terms, set: &TrainingSet, bench: &Bench) -> Result<RobotModel, BenchError> {
    let loads: Vec<(usize, Vec<usize>)> = (1..=set.n_contexts)
        .map(|load| (load, set.rows(load)))
        .collect();
    terms.learn(&shared::samples(&bench.data, &loads))
}

/// The model with the new load, which is the last of its contexts.
///
/// # Errors
/// `Model`.
fn adapted(known: &RobotModel, samples: &Samples) -> Result<RobotModel, BenchError> {
    let of_joint = |(joint_idx, values): (usize, &Vec<f64>)| JointTorques {
        joint_idx,
        values: values.clone(),
    };
    let samples = torque_model::Samples::of_one_context(
        known.joint_names().to_vec(),
        samples.x.clone(),
        samples.torques.iter().enumerate().map(of_joint).collect(),
    )?;
    let provenance = known.provenance().clone();
    Ok(adapt(known, "new", &samples, Adapt::default(), provenance)?)
}

/// Scores of all joints.
///
/// # Errors
/// `Model`, and those of [`nmse`].
pub fn scores(
    (terms, known): (Terms, &RobotModel),
    samples: &Samples,
    test: &Test,
    case: Case,
) -> Result<Vec<Score>, BenchError> {
    let start = std::time::Instant::now();
    let grown = adapted(known, samples)?;
    let seconds = start.elapsed().as_secs_f64() / test.torques.len() as f64;
    let new = known.contexts().len();
    let of_joint = |(joint_idx, truth): (usize, &Vec<f64>)| {
        let joint = shared::joint_of(&grown, joint_idx + 1);
        let mean = joint.predict_mean(new, test.x.as_ref())?;
        Ok(Score {
            learner: learner(terms),
            draw: case.draw,
            noise_idx: case.noise_idx,
            count: case.count,
            joint: joint_idx + 1,
            // An exact prediction still has a place on a logarithmic axis.
            nmse: nmse(&mean, truth)?.max(f64::MIN_POSITIVE),
            seconds,
        })
    };
    test.torques.iter().enumerate().map(of_joint).collect()
}
