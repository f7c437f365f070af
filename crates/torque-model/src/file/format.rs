//! The file of a model: a header that names what it is, then the model itself.
//!
//! ```text
//! bytes 0–7    TORQUEGP
//! bytes 8–11   kind and format version, one u32: version in the low 16 bits, kind above; in the kind, 256 is added
//!              where indices of continuous joints stand before the record
//! bytes 12–19  length of the payload in bytes, u64
//! bytes 20–51  SHA-256 of bytes 0–19 followed by the payload
//! bytes 52–    payload: a record in bincode 2, integers of fixed width
//! ```
//! All numbers are little-endian.
//! This module alone knows the encoding of the payload, in one `encode` and one
//! `decode`, so that another can take its place under the next format version.

use std::fmt;

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use kernels::ContinuousJoints;
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

/// Added to the code of a kind where a list of continuous joints stands before the record.
const OF_CONTINUOUS: u32 = 0x100;

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
    /// Parameters of a robot for all joints and loads together.
    SharedParameters,
}

impl ModelFileKind {
    const ALL: [Self; 4] = [
        Self::OneContext,
        Self::ManyContexts,
        Self::RigidBody,
        Self::SharedParameters,
    ];

    /// The upper 16 bits of the header's word.
    fn code(self) -> u32 {
        match self {
            Self::OneContext => 0,
            Self::ManyContexts => 1,
            Self::RigidBody => 2,
            Self::SharedParameters => 3,
        }
    }

    /// The kind in the bytes of a whole, unaltered model file.
    ///
    /// # Errors
    /// [`ModelFileError`], as for reading the model.
    pub fn of(bytes: &[u8]) -> Result<Self, ModelFileError> {
        checked_payload(bytes).map(|payload| payload.kind)
    }
}

impl fmt::Display for ModelFileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::OneContext => "a model of one context",
            Self::ManyContexts => "a model of several contexts",
            Self::RigidBody => "a model with a rigid-body prior",
            Self::SharedParameters => "a model of a robot's parameters",
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

/// The bytes of a model file with a record of numbers, strings and lists; of models without continuous joints they are
/// those of the record alone.
///
/// # Panics
/// If the record has no encoding, as one with a list of unknown length.
pub(crate) fn encode_model(
    kind: ModelFileKind,
    continuous: &ContinuousJoints,
    record: &impl Serialize,
) -> Vec<u8> {
    let (code, payload) = if continuous.is_empty() {
        (kind.code(), encoded(record))
    } else {
        let record = (continuous.indices(), record);
        (kind.code() | OF_CONTINUOUS, encoded(&record))
    };
    framed((code << 16) | FORMAT_VERSION, &payload)
}

fn encoded(record: &impl Serialize) -> Vec<u8> {
    bincode::serde::encode_to_vec(record, encoding())
        .expect("a record of numbers, strings and lists has an encoding")
}

/// The record in the bytes of a model file, with the continuous joints that stand before it.
///
/// # Errors
/// [`ModelFileError`]: anything but a whole, unaltered file of this kind and a version known here.
pub(crate) fn decode_model<R: DeserializeOwned>(
    kind: ModelFileKind,
    bytes: &[u8],
) -> Result<(ContinuousJoints, R), ModelFileError> {
    let Payload {
        kind: found,
        is_of_continuous,
        bytes,
    } = checked_payload(bytes)?;
    if found != kind {
        let expected = kind;
        return Err(ModelFileError::OtherKind { found, expected });
    }
    if !is_of_continuous {
        return Ok((ContinuousJoints::none(), decoded(bytes)?));
    }
    let (indices, record): (Vec<usize>, R) = decoded(bytes)?;
    if indices.is_empty() || !indices.is_sorted_by(|a, b| a < b) {
        let what = format!("continuous joints {indices:?}");
        return Err(ModelFileError::malformed(what));
    }
    Ok((ContinuousJoints::of(indices), record))
}

/// What a payload encodes, to its end.
fn decoded<R: DeserializeOwned>(payload: &[u8]) -> Result<R, ModelFileError> {
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

/// What stands behind a header.
struct Payload<'a> {
    kind: ModelFileKind,
    is_of_continuous: bool,
    bytes: &'a [u8],
}

/// The payload, if the header is one and its checksum matches.
fn checked_payload(bytes: &[u8]) -> Result<Payload<'_>, ModelFileError> {
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
    let of_kind = |kind: &ModelFileKind| kind.code() == code & !OF_CONTINUOUS;
    let kind = ModelFileKind::ALL.into_iter().find(of_kind);
    Ok(Payload {
        kind: kind.ok_or_else(|| ModelFileError::malformed(format!("kind {code} of model")))?,
        is_of_continuous: code & OF_CONTINUOUS != 0,
        bytes: payload,
    })
}

fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut array = [0; N];
    array.copy_from_slice(bytes);
    array
}
