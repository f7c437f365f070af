//! The file of a model: a header that names what it is, then the model itself.
//!
//! ```text
//! bytes 0–7    TORQUEGP
//! bytes 8–11   kind and format version, one u32: version in the low 16 bits, kind above
//! bytes 12–19  length of the payload in bytes, u64
//! bytes 20–51  SHA-256 of bytes 0–19 followed by the payload
//! bytes 52–    payload: a record in bincode 2, integers of fixed width
//! ```
//! All numbers are little-endian.
//! This module alone knows the encoding of the payload, in one `encode` and one
//! `decode`, so that another can take its place under the next format version.

use std::fmt;

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

/// Version of the file format written here, and the newest that can be read.
pub const FORMAT_VERSION: u32 = 1;

const MAGIC: &[u8; 8] = b"TORQUEGP";
const PREFIX: usize = 20;
const HEADER: usize = 52;

/// Longest payload that is read, 4 GiB.
///
/// Every length in the payload is counted against it before memory is taken.
const MAX_PAYLOAD: usize = u32::MAX as usize;

type Encoding = Configuration<LittleEndian, Fixint, Limit<MAX_PAYLOAD>>;

fn encoding() -> Encoding {
    bincode::config::standard()
        .with_fixed_int_encoding()
        .with_limit()
}

/// What kind of model a file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ModelFileKind {
    /// A torque model for each joint, of one load.
    OneContext,
    /// One for each joint that covers several contexts.
    ManyContexts,
    /// One for each joint, of one load, with the robot whose parameters it knows.
    RigidBody,
}

impl ModelFileKind {
    const ALL: [Self; 3] = [Self::OneContext, Self::ManyContexts, Self::RigidBody];

    /// The upper 16 bits of the header's word.
    fn code(self) -> u32 {
        match self {
            Self::OneContext => 0,
            Self::ManyContexts => 1,
            Self::RigidBody => 2,
        }
    }

    /// The kind in the bytes of a whole, unaltered model file.
    ///
    /// # Errors
    /// [`ModelFileError`], as for reading the model.
    pub fn of(bytes: &[u8]) -> Result<Self, ModelFileError> {
        checked_payload(bytes).map(|(kind, _)| kind)
    }
}

impl fmt::Display for ModelFileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OneContext => "a model of one context",
            Self::ManyContexts => "a model of several contexts",
            Self::RigidBody => "a model with a rigid-body prior",
        })
    }
}

/// Why the bytes of a file are not a model.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelFileError {
    /// The file does not begin as a model file does.
    #[error("not a model file: it does not begin with TORQUEGP")]
    NotAModelFile,
    /// The file ends early.
    #[error("model file is truncated: {found} bytes of {expected}")]
    Truncated {
        /// Bytes that the file should have, as far as it tells.
        expected: u64,
        /// Bytes that it has.
        found: u64,
    },
    /// The checksum does not match.
    #[error("model file was altered after it was written: its checksum does not match")]
    Altered,
    /// The file was written by a newer version of this library.
    #[error("model file has format version {found}, but this program reads up to {supported}")]
    NewerVersion {
        /// Version of the file.
        found: u32,
        /// Newest version known here.
        supported: u32,
    },
    /// The file holds a model of another kind.
    #[error("model file holds {found}, not {expected}")]
    OtherKind {
        /// What it holds.
        found: ModelFileKind,
        /// What was to be read.
        expected: ModelFileKind,
    },
    /// The file is whole, but what it holds is not a model.
    #[error("model file is malformed: {what}")]
    Malformed {
        /// What is wrong.
        what: String,
    },
}

impl ModelFileError {
    pub(crate) fn malformed(what: impl Into<String>) -> Self {
        Self::Malformed { what: what.into() }
    }

    /// Of what is wrong with the parts of a model.
    pub(crate) fn of(error: impl fmt::Display) -> Self {
        Self::malformed(error.to_string())
    }
}

/// The bytes of a model file with a record of numbers, strings and lists.
///
/// # Panics
/// If the record has no encoding, as one with a list of unknown length.
pub(crate) fn encode_model(kind: ModelFileKind, record: &impl Serialize) -> Vec<u8> {
    let payload = bincode::serde::encode_to_vec(record, encoding())
        .expect("a record of numbers, strings and lists has an encoding");
    framed((kind.code() << 16) | FORMAT_VERSION, &payload)
}

/// The record in the bytes of a model file.
///
/// # Errors
/// [`ModelFileError`]: anything but a whole, unaltered file of this kind and a version known here.
pub(crate) fn decode_model<R: DeserializeOwned>(
    kind: ModelFileKind,
    bytes: &[u8],
) -> Result<R, ModelFileError> {
    let (found, payload) = checked_payload(bytes)?;
    if found != kind {
        let expected = kind;
        return Err(ModelFileError::OtherKind { found, expected });
    }
    let (record, consumed): (R, usize) = bincode::serde::decode_from_slice(payload, encoding())
        .map_err(|error| ModelFileError::malformed(error.to_string()))?;
    if consumed != payload.len() {
        let surplus = payload.len() - consumed;
        return Err(ModelFileError::malformed(format!(
            "{surplus} bytes of payload after the model"
        )));
    }
    Ok(record)
}

/// A payload behind its header.
fn framed(kind_and_version: u32, payload: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER + payload.len());
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&kind_and_version.to_le_bytes());
    bytes.extend_from_slice(&(payload.len() as u64).to_le_bytes());
    let checksum = checksum(&bytes, payload);
    bytes.extend_from_slice(&checksum);
    bytes.extend_from_slice(payload);
    bytes
}

fn checksum(prefix: &[u8], payload: &[u8]) -> [u8; 32] {
    let mut hash = Sha256::new();
    hash.update(prefix);
    hash.update(payload);
    hash.finalize().into()
}

/// The kind and the payload, if the header is one and its checksum matches.
fn checked_payload(bytes: &[u8]) -> Result<(ModelFileKind, &[u8]), ModelFileError> {
    let found = bytes.len() as u64;
    let truncated = |expected: u64| ModelFileError::Truncated { expected, found };
    let n_magic = bytes.len().min(MAGIC.len());
    if bytes[..n_magic] != MAGIC[..n_magic] {
        return Err(ModelFileError::NotAModelFile);
    }
    let (header, payload) = bytes
        .split_at_checked(HEADER)
        .ok_or_else(|| truncated(HEADER as u64))?;

    let kind_and_version = u32::from_le_bytes(array(&header[8..12]));
    let (code, version) = (kind_and_version >> 16, kind_and_version & 0xffff);
    if version > FORMAT_VERSION {
        return Err(ModelFileError::NewerVersion {
            found: version,
            supported: FORMAT_VERSION,
        });
    }
    let length = u64::from_le_bytes(array(&header[12..PREFIX]));
    let expected = length.saturating_add(HEADER as u64);
    if found < expected {
        return Err(truncated(expected));
    }
    if found > expected {
        let surplus = found - expected;
        return Err(ModelFileError::malformed(format!(
            "{surplus} bytes after the end of the file"
        )));
    }
    if header[PREFIX..] != checksum(&header[..PREFIX], payload) {
        return Err(ModelFileError::Altered);
    }
    if version == 0 {
        return Err(ModelFileError::malformed("format version 0"));
    }
    let kind = (ModelFileKind::ALL.into_iter()).find(|kind| kind.code() == code);
    let kind = kind.ok_or_else(|| ModelFileError::malformed(format!("kind {code} of model")))?;
    Ok((kind, payload))
}

fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut array = [0; N];
    array.copy_from_slice(bytes);
    array
}

#[cfg(test)]
mod tests {
    use faer::Mat;
    use kernels::{TorqueCovariance, TorqueForm};
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::model::{
        FitSummary, JointModel, ProcessModel, Provenance, TorqueModel, TrainingRanges,
    };
    use crate::posterior::Posterior;
    use crate::{BayesLinear, LikelihoodOptions, LinearForm, Method};

    fn process(x: &Mat<f64>, targets: &[f64], method: Method) -> JointModel {
        let options = LikelihoodOptions {
            method,
            certificate: 1e-4,
        };
        let covariance = TorqueCovariance::unit(3, TorqueForm::Coulomb);
        JointModel::Process(Box::new(ProcessModel {
            posterior: Posterior::new(covariance, 0.1, x.as_ref(), targets, options).unwrap(),
            summary: FitSummary {
                log_marginal: 1.0,
                start: "given".to_owned(),
                n_starts: 1,
                evaluations: 1,
                bounds_hit: vec!["noise_std".to_owned()],
                condition_lower_bound: 1.0,
                method: "dense".to_owned(),
                rank: 1,
                error_bound: Some(0.5),
            },
        }))
    }

    /// Three joints: linear, on training points, on pivots.
    fn small_model() -> TorqueModel {
        let x = Mat::from_fn(4, 9, |i, j| ((5 * i + 3 * j) % 7) as f64 - 3.0);
        let targets = [1.0, -2.0, 0.5, 3.0];
        let linear = BayesLinear::fit(x.as_ref(), &targets, LinearForm::Coulomb).unwrap();
        TorqueModel::new(
            ["a", "b", "c"].map(str::to_owned).into(),
            vec![
                (0, linear.into()),
                (1, process(&x, &targets, Method::Dense)),
                (2, process(&x, &targets, Method::Certified)),
            ],
            TrainingRanges::of(x.as_ref()).unwrap(),
            Provenance {
                data_sha256: [1; 32],
                robot_sha256: Some([2; 32]),
                program: "p".to_owned(),
                context: String::new(),
            },
        )
        .unwrap()
    }

    /// A forger can write a checksum; what passes it may be another model, but never a panic.
    #[test]
    fn payloads_altered_behind_a_valid_checksum_are_refused_or_still_predict() {
        let payload = small_model().to_bytes().split_off(HEADER);
        let x = Mat::from_fn(2, 9, |i, j| (i + j) as f64 * 0.25);
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let mut n_refused = 0;
        for trial in 0..20_000 {
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
            let Ok(model) = TorqueModel::from_bytes(&framed(FORMAT_VERSION, &altered)) else {
                n_refused += 1;
                continue;
            };
            let _ = model.predict(x.as_ref());
            let predictor = model.predictor();
            let n = predictor.n_learned();
            let (mut mean, mut var) = (vec![0.0; n], vec![0.0; n]);
            let state = vec![0.5; 3 * model.n_joints()];
            let _ = predictor.predict_into(&mut predictor.scratch(), &state, &mut mean, &mut var);
        }
        assert!(n_refused > 4_000, "{n_refused}");
    }

    #[test]
    fn hostile_lengths_behind_a_valid_checksum_are_refused() {
        // The first field is the list of joint names: its length asks for 2⁶⁰ strings.
        for length in [1_u64 << 60, u64::MAX, 1 << 40, 1 << 31] {
            let mut payload = length.to_le_bytes().to_vec();
            payload.extend_from_slice(&[0; 64]);
            let error = TorqueModel::from_bytes(&framed(FORMAT_VERSION, &payload)).unwrap_err();
            assert!(
                matches!(error, ModelFileError::Malformed { .. }),
                "{error:?}"
            );
        }
    }

    #[test]
    fn version_zero_with_a_valid_checksum_is_malformed() {
        let error = TorqueModel::from_bytes(&framed(0, &[])).unwrap_err();
        assert_eq!(error, ModelFileError::malformed("format version 0"));
    }

    #[test]
    fn a_kind_that_is_not_known_or_not_asked_for_is_named() {
        let payload = small_model().to_bytes().split_off(HEADER);
        let of_kind = |code: u32| framed((code << 16) | FORMAT_VERSION, &payload);
        let error = TorqueModel::from_bytes(&of_kind(1)).unwrap_err();
        let expected = "model file holds a model of several contexts, not a model of one context";
        assert_eq!(error.to_string(), expected);
        let error = ModelFileKind::of(&of_kind(3)).unwrap_err();
        assert_eq!(error, ModelFileError::malformed("kind 3 of model"));
        let kind = ModelFileKind::of(&of_kind(0));
        assert_eq!(kind, Ok(ModelFileKind::OneContext));
    }

    #[test]
    fn a_newer_version_is_named() {
        let error = TorqueModel::from_bytes(&framed(FORMAT_VERSION + 1, &[])).unwrap_err();
        let expected = ModelFileError::NewerVersion {
            found: FORMAT_VERSION + 1,
            supported: FORMAT_VERSION,
        };
        assert_eq!(error, expected);
    }
}
