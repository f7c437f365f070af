//! Reading a model file; what is in it is gp-core's.

use std::path::Path;

use gp_core::TorqueModel;

use crate::columns::{Naming, StateColumns};
use crate::error::CliError;
use crate::joints::Joints;
use crate::messages;

/// Reads a model.
///
/// # Errors
/// A file that cannot be read, or is not a whole, unaltered model of a version known here.
pub fn load(path: &Path) -> Result<TorqueModel, CliError> {
    let file = path.display().to_string();
    let bytes = std::fs::read(path).map_err(CliError::io("read", file.clone()))?;
    TorqueModel::from_bytes(&bytes).map_err(|cause| CliError::ModelFile { file, cause })
}

/// The joints of a model, for reading a table of their states.
pub fn joints(model: &TorqueModel) -> Joints {
    Joints::by_name("model", model.joint_names().to_vec())
}

/// Says in which order numbered columns were taken, where the model knows its joints by other names.
pub fn note_order(file: &str, columns: &StateColumns, model: &TorqueModel) {
    let names = model.joint_names();
    let is_numbered = |(idx, name): (usize, &String)| *name == format!("joint{}", idx + 1);
    if columns.naming == Naming::Numbered && !names.iter().enumerate().all(is_numbered) {
        messages::note(format!(
            "{file}: joints 1 to {} are taken to be the model's {}",
            names.len(),
            names.join(", ")
        ));
    }
}
