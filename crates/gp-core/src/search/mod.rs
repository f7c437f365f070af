//! The search for the highest likelihood, for any covariance.

mod climb;
mod options;
mod plan;
mod report;
mod start;

pub use climb::{Found, SearchEnd, climb, refine, search};
pub use options::{FitOptions, Limits, SearchScheme, Starts};
pub use plan::{Further, Plan, Stage, Tried};
pub use report::{FitReport, StageReport, StartReport};
pub use start::{Distance, Origin, Start};
