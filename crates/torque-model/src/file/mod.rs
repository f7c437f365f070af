//! Model files: their header, their payloads as plain records, and the checks that turn them back into models.

mod format;
mod matrix_record;
mod process_record;
mod ranges_record;
mod robot_record;
mod shared_record;

pub use format::{FORMAT_VERSION, ModelFileError, ModelFileKind};
pub(crate) use robot_record::{read_model, write_model};
