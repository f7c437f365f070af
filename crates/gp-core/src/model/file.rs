//! The file of a model.

use crate::model::torque_model::TorqueModel;

/// Version of the file format written here.
pub const FORMAT_VERSION: u32 = 1;

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
        /// Bytes that the file should have.
        expected: u64,
        /// Bytes that it has.
        found: u64,
    },
    /// The checksum does not match.
    #[error("model file was altered after it was written: its checksum does not match")]
    Altered,
    /// The file was written by a newer version of this library.
    #[error("model file has format version {found}; this program reads versions up to {supported}")]
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

pub(crate) fn encode(_model: &TorqueModel) -> Vec<u8> {
    Vec::new()
}

pub(crate) fn decode(_bytes: &[u8]) -> Result<TorqueModel, ModelFileError> {
    Err(ModelFileError::NotAModelFile)
}
