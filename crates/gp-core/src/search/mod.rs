//! The search for the highest likelihood, for any covariance.

mod climb;
mod options;
mod plan;
mod report;
mod start;

pub use climb::{SearchEnd, highest, no_usable_start, refine, search, search_near};
pub use options::{FitOptions, SearchScheme, Starts};
pub use report::{FitReport, StageReport, StartReport};
pub use start::{StartKind, StartPoint};

pub(crate) use climb::{Candidate, search_on};
pub(crate) use plan::stage_sizes;
