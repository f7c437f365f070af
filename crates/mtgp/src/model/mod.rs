//! What is learned for a robot under several loads: one process per joint, its file, and its predictor for a control loop.

mod context_predictor;
mod multi_task_model;
mod record;
mod task_process;

pub use context_predictor::ContextPredictor;
pub use multi_task_model::{ModelParts, MultiTaskModel, RankSelection};
pub use task_process::TaskProcess;
