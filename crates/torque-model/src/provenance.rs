//! Where a model comes from: its data, robot, program and context.

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Where a model comes from, as the program that learned it says.
///
/// Nothing here takes part in a prediction; its fields stand in model files in this order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// SHA-256 of the training data, as the caller read it.
    pub data_sha256: [u8; 32],
    /// SHA-256 of the robot description, if there is one.
    pub robot_sha256: Option<[u8; 32]>,
    /// Name and version of the program that learned the model.
    pub program: String,
    /// Context of the data, such as the load carried; may be empty.
    pub context: String,
}

impl Provenance {
    /// Of data, such as the bytes of a file, and the program that learned from them.
    pub fn new(program: &str, data: &[u8]) -> Self {
        Self {
            data_sha256: Sha256::digest(data).into(),
            robot_sha256: None,
            program: program.to_owned(),
            context: String::new(),
        }
    }

    /// The same, of one context of the data.
    #[must_use]
    pub fn of_context(self, context: &str) -> Self {
        let context = context.to_owned();
        Self { context, ..self }
    }

    /// Of the same data and further ones: the hash of both hashes, one after the other.
    #[must_use]
    pub fn with_data(&self, program: &str, further_sha256: [u8; 32]) -> Self {
        let both = Sha256::new()
            .chain_update(self.data_sha256)
            .chain_update(further_sha256);
        Self {
            data_sha256: both.finalize().into(),
            program: program.to_owned(),
            ..self.clone()
        }
    }
}
