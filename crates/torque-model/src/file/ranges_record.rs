//! The range of every covariate in the training data, as a plain record.

use serde::{Deserialize, Serialize};

use crate::file::format::ModelFileError;
use crate::file::matrix_record::malformed;
use crate::ranges::TrainingRanges;

/// The range of every covariate in the training data.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct RangesRecord {
    min: Vec<f64>,
    max: Vec<f64>,
    n_samples: usize,
}

impl RangesRecord {
    /// The record of given ranges.
    pub fn of(ranges: &TrainingRanges) -> Self {
        Self {
            min: ranges.min().to_vec(),
            max: ranges.max().to_vec(),
            n_samples: ranges.n_samples(),
        }
    }

    /// The ranges.
    ///
    /// # Errors
    /// [`ModelFileError::Malformed`] for ends that are no ranges.
    pub fn into_ranges(self) -> Result<TrainingRanges, ModelFileError> {
        TrainingRanges::new(self.min, self.max, self.n_samples).map_err(malformed)
    }
}
