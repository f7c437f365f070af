//! Where a model comes from: its data, robot, program and context.

/// Where a model comes from, as the program that learned it says.
///
/// Nothing here takes part in a prediction.
#[derive(Debug, Clone, PartialEq, Eq)]
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
