//! Where a model comes from and what it was learned from, as plain records.

use serde::{Deserialize, Serialize};

use crate::file::format::ModelFileError;
use crate::file::matrix_record::malformed;
use crate::provenance::Provenance;
use crate::ranges::TrainingRanges;

/// The range of every covariate in the training data.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct RangesRecord {
    min: Vec<f64>,
    max: Vec<f64>,
    n_samples: usize,
}

/// Data, robot and program of a model.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ProvenanceRecord {
    data_sha256: [u8; 32],
    robot_sha256: Option<[u8; 32]>,
    program: String,
    context: String,
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

impl ProvenanceRecord {
    /// The record of a provenance.
    pub fn of(provenance: &Provenance) -> Self {
        Self {
            data_sha256: provenance.data_sha256,
            robot_sha256: provenance.robot_sha256,
            program: provenance.program.clone(),
            context: provenance.context.clone(),
        }
    }

    /// The provenance.
    pub fn into_provenance(self) -> Provenance {
        Provenance {
            data_sha256: self.data_sha256,
            robot_sha256: self.robot_sha256,
            program: self.program,
            context: self.context,
        }
    }
}
