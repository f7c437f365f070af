//! Files of models of several contexts: what goes in comes out, and nothing else is taken for one.

use mtgp::prior::TaskMatrix;
use torque_model::{JointModel, ModelFileKind, RobotModel, TaskProcess};

use crate::damaged_file::{every_truncation_is_named, flipped_bytes_are_refused};
use crate::multi_task_models::{CONTEXTS, inputs, model};

fn task_matrix(model: &JointModel) -> faer::Mat<f64> {
    let tasks: &TaskProcess = model.tasks().unwrap();
    tasks.covariance().task().k_task()
}

#[test]
fn a_loaded_model_is_the_model_and_predicts_bit_for_bit_the_same() {
    for (n, has_fixed_tasks) in [(40, false), (200, false), (40, true)] {
        let model = model(n, has_fixed_tasks);
        let bytes = model.to_bytes();
        let loaded = RobotModel::from_bytes(&bytes).unwrap();
        let x = inputs(6, 50);
        for context in 0..CONTEXTS.len() {
            let predict = |model: &RobotModel| model.predict(context, x.as_ref()).unwrap();
            assert_eq!(predict(&loaded), predict(&model));
        }
        let (one, other) = (model.parts(), loaded.parts());
        assert_eq!(one.joint_names, other.joint_names);
        assert_eq!(one.contexts, other.contexts);
        assert_eq!(one.selection, other.selection);
        assert_eq!(
            (&one.ranges, &one.provenance),
            (&other.ranges, &other.provenance)
        );
        for ((idx, one), (other_idx, other)) in one.learned.iter().zip(&other.learned) {
            assert_eq!(
                (idx, one.summary(), one.name()),
                (other_idx, other.summary(), other.name())
            );
            assert_eq!(task_matrix(one), task_matrix(other));
        }
        assert_eq!(loaded.to_bytes(), bytes);
    }
}

#[test]
fn every_truncation_is_named_with_both_lengths() {
    every_truncation_is_named(&model(12, false).to_bytes(), RobotModel::from_bytes);
}

#[test]
fn two_thousand_flipped_bytes_are_all_refused() {
    flipped_bytes_are_refused(model(12, false).to_bytes(), 2_000, RobotModel::from_bytes);
}

#[test]
fn the_kinds_of_files_are_told_apart() {
    let bytes = model(12, false).to_bytes();
    let kind = ModelFileKind::of(&bytes);
    assert_eq!(kind, Ok(ModelFileKind::ManyContexts));
    assert_eq!(model(12, false).kind(), ModelFileKind::ManyContexts);
    let read = RobotModel::from_bytes(&bytes).unwrap();
    assert_eq!(read.kind(), ModelFileKind::ManyContexts);
}
