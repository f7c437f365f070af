//! What is learned for a robot: one torque model per joint, its file, and its predictor for a control loop.

mod file;
mod informed_model;
mod joint_model;
mod linear_predictor;
mod matrix_record;
mod origin_record;
mod predictor;
mod process_predictor;
mod process_record;
mod provenance;
mod record;
mod torque_model;
mod training_ranges;

pub use file::{FORMAT_VERSION, ModelFileError, ModelFileKind, decode_model, encode_model};
pub use informed_model::{InformedModel, InformedRecord};
pub use joint_model::{FitSummary, JointModel, ModelKind, ProcessModel};
pub use origin_record::{ProvenanceRecord, RangesRecord};
pub use predictor::{Predictor, PredictorScratch};
pub use process_predictor::{ProcessPredictor, Scaling};
pub use process_record::{ParamsRecord, PosteriorRecord, SummaryRecord};
pub use provenance::Provenance;
pub use torque_model::{JointPrediction, TorqueModel};
pub use training_ranges::TrainingRanges;
