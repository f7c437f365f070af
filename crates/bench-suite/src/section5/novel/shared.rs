//! rbd of the known loads, which learns the new one in closed form, as `torque-gp adapt` does.

use torque_model::{Adapt, JointTorques, RobotModel, TorqueFunction, adapt};

use super::case::{Case, Samples, Test};
use super::learners::{Learner, Score};
use crate::error::BenchError;
use crate::metrics::nmse;
use crate::rigid_body::{Terms, shared};

/// The learner of the new load that a model of the known ones is.
pub fn learner(terms: Terms) -> Learner {
    match terms {
        Terms::Chosen => Learner::Shared,
        Terms::Signs => Learner::SharedSigns,
    }
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use torque_model::Provenance;
    use torque_model::learn::SharedParameters;
    use torque_model::rigid_body::TermSet;

    use super::*;
    use crate::dataset::{DataSet, N_JOINTS};
    use crate::rigid_body::parameters;

    const NEW: usize = 15;

    fn of(data: &DataSet, load: usize, rows: &[usize]) -> Vec<Vec<f64>> {
        let joints = 1..=N_JOINTS;
        joints
            .map(|joint| data.torques(load, joint, rows))
            .collect()
    }

    #[test]
    fn a_load_is_learned_as_a_user_does_and_exactly_where_the_terms_are_right() {
        let data = DataSet::simulate(&BTreeSet::from([1, 2, NEW])).unwrap();
        let known_rows: Vec<usize> = (0..40).map(|i| 1_511 * i).collect();
        let rows: Vec<usize> = (0..12).map(|i| 5_000 * i).collect();
        let test_rows: Vec<usize> = (0..40).map(|i| 1_577 * i + 7).collect();
        let samples = Samples {
            x: data.x(&rows),
            torques: of(&data, NEW, &rows),
            noise_std: 0.0,
        };
        let test = Test {
            x: data.x(&test_rows),
            torques: of(&data, NEW, &test_rows),
        };
        let case = Case {
            draw: 0,
            noise_idx: 0,
            count: rows.len(),
        };
        let of_loads = shared::samples(&data, &[(1, &known_rows), (2, &known_rows)]);
        let known = Terms::Signs.learn(&of_loads).unwrap();
        let scores = scores((Terms::Signs, &known), &samples, &test, case).unwrap();

        let mut learner = SharedParameters::new(parameters::robot());
        learner.terms = Some(TermSet::Signs);
        let provenance = || Provenance::new("test", b"");
        let of_user = RobotModel::learn(&of_loads, &learner, provenance()).unwrap();
        let new = shared::samples(&data, &[(NEW, &rows)]);
        let of_user = adapt(&of_user, "c15", &new, Adapt::default(), provenance()).unwrap();
        for (joint_idx, score) in scores.iter().enumerate() {
            let found = of_user.predict_joint(joint_idx, 2, test.x.as_ref());
            let expected = nmse(&found.unwrap().mean, &test.torques[joint_idx]).unwrap();
            assert_eq!(score.nmse.to_bits(), expected.to_bits());
            // 72 torques say ten numbers, to the least noise: 1e-4 of the torques' root mean square. Squared, that is
            // 1e-8 of the variance; a hundred times that is left for states unlike those that were seen.
            assert!(score.nmse < 1e-6, "{score:?}");
        }
    }
}
