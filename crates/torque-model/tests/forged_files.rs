//! A forger can write a checksum; what passes it may be another model, but never a panic.

use faer::Mat;
use gp_core::{BayesLinear, LikelihoodOptions, LinearForm, Method, Posterior};
use kernels::{TorqueCovariance, TorqueForm};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sha2::{Digest, Sha256};
use torque_model::file::FORMAT_VERSION;
use torque_model::{
    JointModel, ModelFileError, ModelFileKind, ModelParts, Process, RobotModel, States,
    TrainingRanges,
};

use crate::multi_task_models::model as many_loads;
use crate::rigid_body_models::small_rigid_body;
use crate::shared_parameters;
use crate::torque_models::{provenance, summary};

const HEADER: usize = 52;

/// A payload behind a header that fits it.
pub fn framed(kind_and_version: u32, payload: &[u8]) -> Vec<u8> {
    let mut bytes = b"TORQUEGP".to_vec();
    bytes.extend_from_slice(&kind_and_version.to_le_bytes());
    bytes.extend_from_slice(&(payload.len() as u64).to_le_bytes());
    let hash = Sha256::new().chain_update(&bytes).chain_update(payload);
    bytes.extend_from_slice(&hash.finalize());
    bytes.extend_from_slice(payload);
    bytes
}

fn process(x: &Mat<f64>, targets: &[f64], method: Method) -> JointModel {
    let options = LikelihoodOptions {
        method,
        certificate: 1e-4,
    };
    let covariance = TorqueCovariance::unit(3, TorqueForm::Coulomb);
    JointModel::Process(Box::new(Process {
        posterior: Posterior::new(covariance, 0.1, x.as_ref(), targets, options).unwrap(),
        rows: States { n_joints: 3 },
        summary: summary(1),
    }))
}

/// Three joints: linear, on training points, on pivots.
fn small_model() -> RobotModel {
    let x = Mat::from_fn(4, 9, |i, j| ((5 * i + 3 * j) % 7) as f64 - 3.0);
    let targets = [1.0, -2.0, 0.5, 3.0];
    let linear = BayesLinear::fit(x.as_ref(), &targets, LinearForm::Coulomb).unwrap();
    RobotModel::new(ModelParts {
        joint_names: ["a", "b", "c"].map(str::to_owned).into(),
        contexts: Vec::new(),
        learned: vec![
            (0, linear.into()),
            (1, process(&x, &targets, Method::Dense)),
            (2, process(&x, &targets, Method::Certified)),
        ],
        ranges: TrainingRanges::of(x.as_ref()).unwrap(),
        context_ranges: Vec::new(),
        selection: None,
        robot: None,
        provenance: provenance(),
    })
    .unwrap()
}

/// Number of altered payloads that are refused; the others are asked for predictions.
fn n_refused(model: &RobotModel, n_trials: usize) -> usize {
    let code = match model.kind() {
        ModelFileKind::OneContext => 0,
        ModelFileKind::ManyContexts => 1,
        ModelFileKind::RigidBody => 2,
        ModelFileKind::SharedParameters => 3,
    };
    let payload = model.to_bytes().split_off(HEADER);
    assert_eq!(model.to_bytes(), framed((code << 16) | 1, &payload));
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut n_refused = 0;
    for trial in 0..n_trials {
        let mut altered = payload.clone();
        let position = rng.random_range(0..altered.len());
        altered[position] = match trial % 3 {
            0 => 0,
            1 => 255,
            _ => rng.random(),
        };
        if trial % 5 == 0 {
            altered.truncate(rng.random_range(0..payload.len()));
        }
        let Ok(model) = RobotModel::from_bytes(&framed((code << 16) | FORMAT_VERSION, &altered))
        else {
            n_refused += 1;
            continue;
        };
        let d = model.n_covariates();
        let x = Mat::from_fn(2, d, |i, j| (i + j) as f64 * 0.25);
        let last = model.contexts().len().saturating_sub(1);
        let _ = model.predict_joint(0, last, x.as_ref());
        if trial % 50 == 0 {
            let _ = model.predict(last, x.as_ref());
        }
        let predictor = model.predictor();
        let n = predictor.n_learned();
        let (mut mean, mut var) = (vec![0.0; n], vec![0.0; n]);
        let state = vec![0.5; d];
        let scratch = &mut predictor.scratch();
        let _ = predictor.predict_into(0, scratch, &state, &mut mean, &mut var);
    }
    n_refused
}

#[test]
fn payloads_altered_behind_a_valid_checksum_are_refused_or_still_predict() {
    let found = n_refused(&small_model(), 20_000);
    assert!(found > 4_000, "{found}");
    for model in [
        many_loads(12, false),
        small_rigid_body(),
        shared_parameters::model(),
    ] {
        let found = n_refused(&model, 1_000);
        assert!(found > 200, "{found}");
    }
}

#[test]
fn hostile_lengths_behind_a_valid_checksum_are_refused() {
    // The first field is a list of names, or whether there is a URDF: its length asks for 2⁶⁰ strings.
    for kind in 0..3 {
        for length in [1_u64 << 60, u64::MAX, 1 << 40, 1 << 31] {
            let mut payload = length.to_le_bytes().to_vec();
            payload.extend_from_slice(&[0; 64]);
            let bytes = framed((kind << 16) | FORMAT_VERSION, &payload);
            let error = RobotModel::from_bytes(&bytes).unwrap_err();
            assert!(
                matches!(error, ModelFileError::Malformed { .. }),
                "{error:?}"
            );
        }
    }
}

fn malformed(what: &str) -> ModelFileError {
    let what = what.to_owned();
    ModelFileError::Malformed { what }
}

#[test]
fn version_zero_with_a_valid_checksum_is_malformed() {
    let error = RobotModel::from_bytes(&framed(0, &[])).unwrap_err();
    assert_eq!(error, malformed("format version 0"));
}

#[test]
fn a_kind_that_is_not_known_is_named_and_another_payload_is_malformed() {
    let payload = small_model().to_bytes().split_off(HEADER);
    let of_kind = |code: u32| framed((code << 16) | FORMAT_VERSION, &payload);
    for code in [1, 2, 3] {
        let error = RobotModel::from_bytes(&of_kind(code)).unwrap_err();
        assert!(
            matches!(error, ModelFileError::Malformed { .. }),
            "{error:?}"
        );
    }
    for error in [
        ModelFileKind::of(&of_kind(4)).unwrap_err(),
        RobotModel::from_bytes(&of_kind(4)).unwrap_err(),
    ] {
        assert_eq!(error, malformed("kind 4 of model"));
    }
    let kind = ModelFileKind::of(&of_kind(0));
    assert_eq!(kind, Ok(ModelFileKind::OneContext));
}

#[test]
fn a_newer_version_is_named() {
    let error = RobotModel::from_bytes(&framed(FORMAT_VERSION + 1, &[])).unwrap_err();
    let expected = ModelFileError::NewerVersion {
        found: FORMAT_VERSION + 1,
        supported: FORMAT_VERSION,
    };
    assert_eq!(error, expected);
}
