//! Model files: what goes in comes out, and nothing else is taken for a model.

use proptest::prelude::*;
use torque_model::file::FORMAT_VERSION;
use torque_model::{ModelFileError, ModelParts, RobotModel, TorqueError, TrainingRanges};

use crate::damaged_file::{every_truncation_is_named, flipped_bytes_are_refused};
use crate::torque_models::{N_JOINTS, all_kinds, linear, low_rank, names, parts, uniform_inputs};

#[test]
fn a_loaded_model_is_the_model_and_predicts_bit_for_bit_the_same() {
    for model in [all_kinds(40), low_rank(200)] {
        round_trip(&model);
    }
}

fn round_trip(model: &RobotModel) {
    let loaded = RobotModel::from_bytes(&model.to_bytes()).unwrap();
    let x = uniform_inputs(6, 300, 3 * N_JOINTS);

    let bits = |model: &RobotModel| -> Vec<u64> {
        let predictions = model.predict(0, x.as_ref()).unwrap();
        let values = predictions
            .iter()
            .flat_map(|joint| joint.mean.iter().chain(&joint.var).chain(&joint.noise_var));
        values.map(|value| value.to_bits()).collect()
    };
    assert_eq!(bits(&loaded), bits(model));
    assert_eq!(loaded.joint_names(), model.joint_names());
    assert_eq!(loaded.ranges(), model.ranges());
    assert_eq!(loaded.provenance(), model.provenance());
    for ((idx, one), (loaded_idx, other)) in model.learned().iter().zip(loaded.learned()) {
        assert_eq!(
            (idx, one.name(), one.summary()),
            (loaded_idx, other.name(), other.summary())
        );
    }
    assert_eq!(loaded.to_bytes(), model.to_bytes());
}

#[test]
fn a_linear_model_keeps_the_noise_that_it_learned() {
    let x = uniform_inputs(5, 30, 3 * N_JOINTS);
    let targets: Vec<f64> = (0..30)
        .map(|row| x[(row, 0)] + x[(row, 5)].powi(2))
        .collect();
    let form = gp_core::LinearForm::Coulomb;
    let learned = gp_core::BayesLinear::fit_by_evidence(x.as_ref(), &targets, form).unwrap();
    let noise_var = learned.noise_var();
    assert!(noise_var > 1e-3, "{noise_var}");
    let model = RobotModel::new(parts(&x, vec![(0, learned.into())])).unwrap();
    round_trip(&model);
    let loaded = RobotModel::from_bytes(&model.to_bytes()).unwrap();
    let loaded = loaded.learned()[0].1.noise_var();
    assert_eq!(loaded.to_bits(), noise_var.to_bits());

    // A loop says the same as the batch: σ² is in the variance, too.
    let batch = model.learned()[0].1.predict(0, x.as_ref()).unwrap();
    let loop_var = model.predict(0, x.as_ref()).unwrap().remove(0).var;
    for (batch, of_loop) in batch.var.iter().zip(&loop_var) {
        assert!((of_loop / batch - 1.0).abs() < 1e-9, "{of_loop} {batch}");
    }
}

#[test]
fn the_four_kinds_have_the_names_of_the_chapter() {
    let model = all_kinds(12);
    let kinds: Vec<String> = (model.learned().iter())
        .map(|(_, joint)| joint.name())
        .collect();
    assert_eq!(kinds, ["LR¬c", "LRc", "GP¬c", "GPc"]);
}

#[test]
fn every_truncation_is_named_with_both_lengths() {
    every_truncation_is_named(&all_kinds(12).to_bytes(), RobotModel::from_bytes);
}

#[test]
fn ten_thousand_flipped_bytes_are_all_refused() {
    flipped_bytes_are_refused(all_kinds(12).to_bytes(), 10_000, RobotModel::from_bytes);
}

#[test]
fn the_checksum_covers_the_header() {
    let mut bytes = all_kinds(12).to_bytes();
    bytes[8] = 0;
    let error = RobotModel::from_bytes(&bytes).unwrap_err();
    assert_eq!(error, ModelFileError::Altered);
}

#[test]
fn surplus_bytes_are_refused() {
    let mut bytes = all_kinds(12).to_bytes();
    bytes.push(0);
    let error = RobotModel::from_bytes(&bytes).unwrap_err();
    let what = "1 bytes after the end of the file".to_owned();
    assert_eq!(error, ModelFileError::Malformed { what });
}

#[test]
fn other_files_and_newer_files_are_named() {
    let error = RobotModel::from_bytes(b"context,run,t,q1\n").unwrap_err();
    assert_eq!(error, ModelFileError::NotAModelFile);

    let mut bytes = all_kinds(12).to_bytes();
    bytes[8..12].copy_from_slice(&(FORMAT_VERSION + 1).to_le_bytes());
    let error = RobotModel::from_bytes(&bytes).unwrap_err();
    let named = ModelFileError::NewerVersion {
        found: FORMAT_VERSION + 1,
        supported: FORMAT_VERSION,
    };
    assert_eq!(error, named);
}

proptest! {
    #[test]
    fn garbage_is_refused(garbage in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(RobotModel::from_bytes(&garbage).is_err());
        let mut behind_magic = b"TORQUEGP".to_vec();
        behind_magic.extend(garbage);
        prop_assert!(RobotModel::from_bytes(&behind_magic).is_err());
    }
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let x = uniform_inputs(5, 12, 3 * N_JOINTS);
    let lr = || linear(&x, 0, gp_core::LinearForm::Smooth);
    let new = |learned| parts(&x, learned);
    let narrow = TrainingRanges::new(vec![0.0; 3], vec![1.0; 3], 5).unwrap();
    let whole = || new(vec![(0, lr())]);
    let refused = |parts: ModelParts, expected: &str| {
        let error = RobotModel::new(parts).unwrap_err();
        let what = expected.to_owned();
        assert_eq!(error, TorqueError::InconsistentModel { what });
    };
    refused(new(vec![]), "4 joints, 0 models");
    refused(new(vec![(4, lr())]), "a model for joint 4 of 4");
    let indices = "joint indices do not ascend";
    refused(new(vec![(1, lr()), (1, lr())]), indices);
    refused(new(vec![(2, lr()), (1, lr())]), indices);
    let ranges = "3 ranges for 4 joints";
    refused(
        ModelParts {
            ranges: narrow,
            ..whole()
        },
        ranges,
    );
    let fewer = names()[..2].to_vec();
    let other = "joint 0's model is for 4 joints, not 2";
    refused(
        ModelParts {
            joint_names: fewer,
            ..whole()
        },
        other,
    );
    let twins = vec!["waist".to_owned(); N_JOINTS];
    refused(
        ModelParts {
            joint_names: twins,
            ..whole()
        },
        "two joints are named waist",
    );
}

#[test]
fn covariates_outside_the_training_range_are_told() {
    let model = all_kinds(12);
    let mut x: Vec<f64> = model.ranges().min().to_vec();
    assert_eq!(model.ranges().outside(&x).count(), 0);
    x[2] -= 1e-9;
    x[7] = model.ranges().max()[7] + 1e-9;
    x[9] = f64::NAN;
    let outside: Vec<usize> = model.ranges().outside(&x).collect();
    assert_eq!(outside, [2, 7, 9]);
}
