//! The prior of eqs. (13)–(16): K^ρ, rows of samples with their task, and the two as one covariance.

mod described_tasks;
mod gradient;
mod layout;
mod multi_task_covariance;
mod rank_part;
mod runs;
mod task_cov;
mod task_matrix;
mod task_noise;
mod task_regression;
mod task_row;

pub use described_tasks::{DescribedParams, DescribedTasks};
pub(crate) use layout::with_every_task;
pub use layout::{Stacked, are_rows_of_tasks, split, with_task};
pub use multi_task_covariance::MultiTaskCovariance;
pub use rank_part::{RankPart, rank_part};
pub use task_cov::{TaskCovariance, TaskFactor};
pub use task_matrix::TaskMatrix;
pub use task_noise::TaskNoise;
pub use task_regression::TaskRegression;
pub use task_row::TaskRow;
