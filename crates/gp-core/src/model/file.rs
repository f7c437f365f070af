//! The file of a model: a header that names what it is, then the model itself.
//!
//! ```text
//! bytes 0–7    TORQUEGP
//! bytes 8–11   format version, u32
//! bytes 12–19  length of the payload in bytes, u64
//! bytes 20–51  SHA-256 of bytes 0–19 followed by the payload
//! bytes 52–    payload: a record in bincode 2, integers of fixed width
//! ```
//! All numbers are little-endian.
//! This module alone knows the encoding of the payload, in one `encode` and one
//! `decode`, so that another can take its place under the next format version.

use bincode::config::{Configuration, Fixint, Limit, LittleEndian};
use sha2::{Digest, Sha256};

use crate::model::record::ModelRecord;
use crate::model::torque_model::TorqueModel;

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
}

/// The bytes of a model file.
pub(crate) fn encode(model: &TorqueModel) -> Vec<u8> {
    let record = ModelRecord::of(model);
    let payload = bincode::serde::encode_to_vec(&record, encoding())
        .expect("a record of numbers, strings and lists has an encoding");
    framed(FORMAT_VERSION, &payload)
}

/// The model in the bytes of a model file.
pub(crate) fn decode(bytes: &[u8]) -> Result<TorqueModel, ModelFileError> {
    let payload = checked_payload(bytes)?;
    let (record, consumed): (ModelRecord, usize) =
        bincode::serde::decode_from_slice(payload, encoding())
            .map_err(|error| ModelFileError::malformed(error.to_string()))?;
    if consumed != payload.len() {
        let surplus = payload.len() - consumed;
        return Err(ModelFileError::malformed(format!(
            "{surplus} bytes of payload after the model"
        )));
    }
    record.into_model()
}

/// A payload behind its header.
fn framed(version: u32, payload: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER + payload.len());
    bytes.extend_from_slice(MAGIC);
    bytes.extend_from_slice(&version.to_le_bytes());
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

/// The payload, if the header is one and its checksum matches.
fn checked_payload(bytes: &[u8]) -> Result<&[u8], ModelFileError> {
    let found = bytes.len() as u64;
    let truncated = |expected: u64| ModelFileError::Truncated { expected, found };
    let n_magic = bytes.len().min(MAGIC.len());
    if bytes[..n_magic] != MAGIC[..n_magic] {
        return Err(ModelFileError::NotAModelFile);
    }
    let (header, payload) = bytes
        .split_at_checked(HEADER)
        .ok_or_else(|| truncated(HEADER as u64))?;

    let version = u32::from_le_bytes(array(&header[8..12]));
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
    Ok(payload)
}

fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    let mut array = [0; N];
    array.copy_from_slice(bytes);
    array
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hostile_lengths_behind_a_valid_checksum_are_refused() {
        // The first field is the list of joint names: its length asks for 2⁶⁰ strings.
        for length in [1_u64 << 60, u64::MAX, 1 << 40, 1 << 31] {
            let mut payload = length.to_le_bytes().to_vec();
            payload.extend_from_slice(&[0; 64]);
            let error = decode(&framed(FORMAT_VERSION, &payload)).unwrap_err();
            assert!(
                matches!(error, ModelFileError::Malformed { .. }),
                "{error:?}"
            );
        }
    }

    #[test]
    fn version_zero_with_a_valid_checksum_is_malformed() {
        let error = decode(&framed(0, &[])).unwrap_err();
        assert_eq!(error, ModelFileError::malformed("format version 0"));
    }

    #[test]
    fn a_newer_version_is_named() {
        let error = decode(&framed(FORMAT_VERSION + 1, &[])).unwrap_err();
        let expected = ModelFileError::NewerVersion {
            found: FORMAT_VERSION + 1,
            supported: FORMAT_VERSION,
        };
        assert_eq!(error, expected);
    }
}
