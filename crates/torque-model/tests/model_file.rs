//! Model files: what goes in comes out, and nothing else is taken for a model.

use gp_core::{FORMAT_VERSION, GpError, ModelFileError, TorqueModel, TrainingRanges};
use proptest::prelude::*;

use crate::damaged_file::{every_truncation_is_named, flipped_bytes_are_refused};
use crate::samples::uniform_inputs;
use crate::torque_models::{N_JOINTS, all_kinds, linear, low_rank, names, provenance, ranges};

#[test]
fn a_loaded_model_is_the_model_and_predicts_bit_for_bit_the_same() {
    for model in [all_kinds(40), low_rank(200)] {
        round_trip(&model);
    }
}

fn round_trip(model: &TorqueModel) {
    let loaded = TorqueModel::from_bytes(&model.to_bytes()).unwrap();
    let x = uniform_inputs(6, 300, 3 * N_JOINTS);

    let bits = |model: &TorqueModel| -> Vec<u64> {
        let predictions = model.predict(x.as_ref()).unwrap();
        let values = predictions.iter().flat_map(|joint| {
            joint
                .mean
                .iter()
                .chain(&joint.var)
                .chain([&joint.noise_var])
        });
        values.map(|value| value.to_bits()).collect()
    };
    assert_eq!(bits(&loaded), bits(model));
    assert_eq!(loaded.joint_names(), model.joint_names());
    assert_eq!(loaded.ranges(), model.ranges());
    assert_eq!(loaded.provenance(), model.provenance());
    for ((idx, one), (loaded_idx, other)) in model.learned().iter().zip(loaded.learned()) {
        assert_eq!(
            (idx, one.kind(), one.summary()),
            (loaded_idx, other.kind(), other.summary())
        );
    }
    assert_eq!(loaded.to_bytes(), model.to_bytes());
}

#[test]
fn the_four_kinds_have_the_names_of_the_chapter() {
    let model = all_kinds(12);
    let kinds: Vec<String> = (model.learned().iter())
        .map(|(_, joint)| joint.kind().to_string())
        .collect();
    assert_eq!(kinds, ["LR¬c", "LRc", "GP¬c", "GPc"]);
}

#[test]
fn every_truncation_is_named_with_both_lengths() {
    every_truncation_is_named(&all_kinds(12).to_bytes(), TorqueModel::from_bytes);
}

#[test]
fn ten_thousand_flipped_bytes_are_all_refused() {
    flipped_bytes_are_refused(all_kinds(12).to_bytes(), 10_000, TorqueModel::from_bytes);
}

#[test]
fn the_checksum_covers_the_header() {
    let mut bytes = all_kinds(12).to_bytes();
    bytes[8] = 0;
    let error = TorqueModel::from_bytes(&bytes).unwrap_err();
    assert_eq!(error, ModelFileError::Altered);
}

#[test]
fn surplus_bytes_are_refused() {
    let mut bytes = all_kinds(12).to_bytes();
    bytes.push(0);
    let error = TorqueModel::from_bytes(&bytes).unwrap_err();
    let what = "1 bytes after the end of the file".to_owned();
    assert_eq!(error, ModelFileError::Malformed { what });
}

#[test]
fn other_files_and_newer_files_are_named() {
    let error = TorqueModel::from_bytes(b"context,run,t,q1\n").unwrap_err();
    assert_eq!(error, ModelFileError::NotAModelFile);

    let mut bytes = all_kinds(12).to_bytes();
    bytes[8..12].copy_from_slice(&(FORMAT_VERSION + 1).to_le_bytes());
    let error = TorqueModel::from_bytes(&bytes).unwrap_err();
    let named = ModelFileError::NewerVersion {
        found: FORMAT_VERSION + 1,
        supported: FORMAT_VERSION,
    };
    assert_eq!(error, named);
}

proptest! {
    #[test]
    fn garbage_is_refused(garbage in prop::collection::vec(any::<u8>(), 0..200)) {
        prop_assert!(TorqueModel::from_bytes(&garbage).is_err());
        let mut behind_magic = b"TORQUEGP".to_vec();
        behind_magic.extend(garbage);
        prop_assert!(TorqueModel::from_bytes(&behind_magic).is_err());
    }
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let x = uniform_inputs(5, 12, 3 * N_JOINTS);
    let lr = || linear(&x, 0, gp_core::LinearForm::Smooth);
    let new = |names, learned, ranges| TorqueModel::new(names, learned, ranges, provenance());
    let narrow = TrainingRanges::new(vec![0.0; 3], vec![1.0; 3], 5).unwrap();
    let twins = vec!["waist".to_owned(); N_JOINTS];
    for refused in [
        new(names(), vec![], ranges(&x)),
        new(names(), vec![(4, lr())], ranges(&x)),
        new(names(), vec![(1, lr()), (1, lr())], ranges(&x)),
        new(names(), vec![(2, lr()), (1, lr())], ranges(&x)),
        new(names(), vec![(0, lr())], narrow),
        new(names()[..2].to_vec(), vec![(0, lr())], ranges(&x)),
        new(twins, vec![(0, lr())], ranges(&x)),
    ] {
        assert!(
            matches!(refused, Err(GpError::InconsistentModel { .. })),
            "{refused:?}"
        );
    }
}

#[test]
fn covariates_outside_the_training_range_are_told() {
    let model = all_kinds(12);
    let mut x: Vec<f64> = model.ranges().min().to_vec();
    assert!(model.outside_training_range(&x).is_empty());
    x[2] -= 1e-9;
    x[7] = model.ranges().max()[7] + 1e-9;
    x[9] = f64::NAN;
    assert_eq!(model.outside_training_range(&x), [2, 7, 9]);
}
