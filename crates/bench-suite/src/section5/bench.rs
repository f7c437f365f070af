//! What the experiments of section 5 have in common: the data and the models.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use torque_model::{RobotModel, Samples};

use super::trained::{Shelf, Trained};
use super::training_set::TrainingSet;
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::rigid_body::{Terms, shared};
use crate::run::Reuse;
use crate::shard::Shard;
use crate::split::UNIQUE;

/// Data of all 15 loads, and the models that have been or will be fitted.
pub struct Bench {
    /// States and torques under every load.
    pub data: DataSet,
    shelf: Shelf,
}

impl Bench {
    /// Simulates the data; models are kept in `output`/models.
    ///
    /// # Errors
    /// As for [`DataSet::simulate`].
    pub fn new(output: &Path, reuse: Reuse, shard: Shard) -> Result<Self, BenchError> {
        let loads: BTreeSet<usize> = (1..=UNIQUE.len()).collect();
        Ok(Self {
            data: DataSet::simulate(&loads)?,
            shelf: Shelf::new(output.join("models"), reuse, shard),
        })
    }

    /// The models of a training set, fitted if they are not there.
    ///
    /// # Errors
    /// As for [`Shelf::trained`].
    pub fn trained(&self, set: &TrainingSet) -> Result<Arc<Trained>, BenchError> {
        self.shelf.trained(set, &self.data)
    }

    /// rbd of all joints and loads of a training set, learned now: that takes seconds.
    ///
    /// # Errors
    /// `Model` if it cannot be learned.
    pub fn shared(&self, terms: Terms, set: &TrainingSet) -> Result<RobotModel, BenchError> {
        terms.learn(&self.samples_of_joints(set))
    }

    /// The samples of a training set with the torques of all joints, as a user has them.
    pub fn samples_of_joints(&self, set: &TrainingSet) -> Samples {
        let loads: Vec<(usize, Vec<usize>)> = (1..=set.n_contexts)
            .map(|load| (load, set.rows(load)))
            .collect();
        shared::samples(&self.data, &loads)
    }
}
