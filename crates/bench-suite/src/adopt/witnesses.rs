//! Computing witnesses again, in a directory that is removed afterwards.

use std::collections::BTreeSet;
use std::path::PathBuf;

use tempfile::TempDir;

use super::old::Olds;
use super::request::{Found, Request};
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::multi;
use crate::multi::shared::SharedUnit;
use crate::multi::unit::UnitRecord;
use crate::run::{Reuse, run, thread_pool};
use crate::section5;
use crate::section5::campaign::Campaign;
use crate::section5::trained;
use crate::split::UNIQUE;
use crate::store::{self, Store};

/// A directory beside the results, for what is computed again.
pub(super) struct Scratch<'a> {
    request: &'a Request,
    directory: TempDir,
}

impl<'a> Scratch<'a> {
    /// An empty directory.
    ///
    /// # Errors
    /// `Io` if it cannot be made.
    pub fn new(request: &'a Request) -> Result<Self, BenchError> {
        let output = &request.output;
        std::fs::create_dir_all(output).map_err(BenchError::io(output))?;
        let directory = tempfile::Builder::new()
            .prefix(".adopt-")
            .tempdir_in(output);
        Ok(Self {
            request,
            directory: directory.map_err(BenchError::io(output))?,
        })
    }

    fn output(&self) -> PathBuf {
        self.directory.path().to_path_buf()
    }

    /// Keys of all work that the experiments of section 5 consist of.
    ///
    /// # Errors
    /// `Experiment` for settings that are not of the form.
    pub fn keys_of_section5(&self) -> Result<BTreeSet<String>, BenchError> {
        let mut keys = BTreeSet::new();
        let nothing = self.output().join("nothing");
        for experiment in &self.request.experiments {
            for profile in experiment.profiles() {
                let campaign = Campaign::new(profile, &nothing, Reuse::Results);
                section5::make(experiment, &campaign)?;
                keys.extend(campaign.into_asked());
            }
        }
        Ok(keys)
    }

    /// What is not the same in the witnesses; those of section 5 are computed with the old models only if these are.
    ///
    /// # Errors
    /// Those of the runs.
    pub fn differences(&self, found: &Found) -> Result<Vec<String>, BenchError> {
        let n_threads = self.request.n_threads;
        let output = self.output();
        let cells = Store::open(store::of_cells(&output))?;
        let units = Store::open(store::of_units(&output))?;
        let (results, again) = (&found.results, Reuse::Scratch);

        let outcome = run(&results.witnessed(), &cells, again, n_threads)?;
        let mut lines = outcome.reasons();
        let outcome = multi::run::run(&results.witnessed(), &units, again, n_threads)?;
        lines.extend(outcome.reasons());
        let shared: BTreeSet<SharedUnit> = results.witnessed();
        let own = self.own_fits(results, &shared);
        let outcome = multi::run::run_shared(&shared, &own, &units, again, n_threads)?;
        lines.extend(outcome.reasons());
        lines.extend(results.compared(false, &output));
        let of_models = self.of_models(found)?;
        let are_same = of_models.is_empty();
        lines.extend(of_models);
        if are_same {
            lines.extend(self.of_section5(found)?);
        }
        Ok(lines)
    }

    /// The joints' own fits that one K^ρ for all sets out from: old ones, or today's.
    fn own_fits(&self, results: &Olds, shared: &BTreeSet<SharedUnit>) -> Vec<UnitRecord> {
        let today = Store::at(store::of_units(&self.request.output));
        let joints = shared.iter().flat_map(|unit| &unit.joints);
        let own = joints.filter_map(|unit| results.of(unit).or_else(|| today.load(unit)));
        own.collect()
    }

    /// Of each training set one joint's models, byte by byte.
    fn of_models(&self, found: &Found) -> Result<Vec<String>, BenchError> {
        let witnesses = found.models.witnesses();
        if witnesses.is_empty() {
            return Ok(Vec::new());
        }
        let pool = thread_pool(self.request.n_threads)?;
        let data = DataSet::simulate(&(1..=UNIQUE.len()).collect())?;
        let mut lines = Vec::new();
        for (set, joint_idx) in witnesses {
            let fitted = pool.install(|| trained::model_files(set, &data, joint_idx + 1))?;
            lines.extend(found.models.compared((set, joint_idx), &fitted));
        }
        Ok(lines)
    }

    fn of_section5(&self, found: &Found) -> Result<Vec<String>, BenchError> {
        let results = &found.results;
        let of_section5 = results.witnesses().filter(|old| old.is_of_section5());
        let keys: BTreeSet<String> = of_section5.map(|old| old.key.clone()).collect();
        if keys.is_empty() {
            return Ok(Vec::new());
        }
        let output = self.output();
        found.models.copy_finished(&self.request.output, &output)?;
        found.models.write(&output)?;
        for experiment in &self.request.experiments {
            for profile in experiment.profiles() {
                let campaign = Campaign::new(profile, &output, Reuse::Fits)
                    .with_threads(self.request.n_threads)
                    .with_only(keys.clone());
                section5::make(experiment, &campaign)?;
            }
        }
        Ok(results.compared(true, &output))
    }
}
