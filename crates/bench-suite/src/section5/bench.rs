//! What the experiments of section 5 have in common: the profile, the data and the models.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::trained::{Shelf, Trained};
use super::training_set::TrainingSet;
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::run::{Reuse, RunOutcome, Seconds, complete, side_by_side};
use crate::spec::Profile;
use crate::split::UNIQUE;
use crate::store::{Store, Work};

/// Profile, data of all 15 loads, and the models that have been or will be fitted.
pub struct Bench {
    /// Amount of work.
    pub profile: Profile,
    /// States and torques under every load.
    pub data: DataSet,
    shelf: Shelf,
    output: PathBuf,
    reuse: Reuse,
}

impl Bench {
    /// Simulates the data; models are kept in `output`/models.
    ///
    /// # Errors
    /// As for [`DataSet::simulate`].
    pub fn new(profile: Profile, output: &Path, reuse: Reuse) -> Result<Self, BenchError> {
        let loads: BTreeSet<usize> = (1..=UNIQUE.len()).collect();
        Ok(Self {
            profile,
            data: DataSet::simulate(&loads)?,
            shelf: Shelf::new(output.join("models"), reuse),
            output: output.to_path_buf(),
            reuse,
        })
    }

    /// The models of a training set, fitted if they are not there.
    ///
    /// # Errors
    /// As for [`Shelf::trained`].
    pub fn trained(&self, set: &TrainingSet) -> Result<Arc<Trained>, BenchError> {
        self.shelf.trained(set, &self.data)
    }

    /// Pieces of work whose results are kept in `output`/`directory`: read, or computed side by side.
    ///
    /// # Errors
    /// As for [`complete`].
    pub fn complete<W: Work>(
        &self,
        directory: &str,
        work: &BTreeSet<W>,
        measure: impl Fn(&W) -> Result<W::Record, BenchError> + Sync + Send,
    ) -> Result<RunOutcome<W>, BenchError> {
        let store = Store::open(self.output.join(directory))?;
        let n_threads = rayon::current_num_threads();
        complete(work, &store, self.reuse, n_threads, |open, n_reused| {
            let results = side_by_side(open, &store, n_reused, measure)?;
            Ok((results, Seconds::default()))
        })
    }
}
