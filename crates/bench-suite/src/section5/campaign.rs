//! One run of experiments of section 5: each divides into pieces of work that are read, computed, or left to other shards.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::Instant;

use serde::Serialize;
use serde::de::DeserializeOwned;

use super::bench::Bench;
use super::part::{Part, PartRecord, Task, measured_by};
use crate::error::BenchError;
use crate::run::{Reuse, Seconds, complete, side_by_side};
use crate::section_experiment::SectionExperiment;
use crate::shard::Shard;
use crate::spec::Profile;
use crate::store::{Store, Work};
use crate::tally::Tally;

/// Directory of an experiment's finished parts inside an output directory.
///
/// # Errors
/// `UnknownName` if there is no such experiment.
pub fn store_of(output: &Path, experiment: &str) -> Result<PathBuf, BenchError> {
    let directory = output.join("section5").join(experiment);
    Ok(directory.join(measured_by(experiment)?))
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What is asked for, and what has been done of it.
pub struct Campaign {
    /// Amount of work.
    pub profile: Profile,
    output: PathBuf,
    reuse: Reuse,
    shard: Shard,
    n_threads: usize,
    /// Keys of the pieces that may be computed; all if none.
    only: Option<BTreeSet<String>>,
    /// Keys of all pieces so far.
    asked: Mutex<BTreeSet<String>>,
    /// Data and models, from the first piece on that has to be computed.
    bench: OnceLock<Bench>,
    /// Over all pieces so far.
    tally: Mutex<Tally>,
}

impl Campaign {
    /// The whole work, on one thread a core, with results in a directory.
    pub fn new(profile: Profile, output: &Path, reuse: Reuse) -> Self {
        Self {
            profile,
            output: output.to_path_buf(),
            reuse,
            shard: Shard::WHOLE,
            n_threads: 0,
            only: None,
            asked: Mutex::default(),
            bench: OnceLock::new(),
            tally: Mutex::default(),
        }
    }

    /// The same with only a part of the work computed.
    #[must_use]
    pub fn with_shard(self, shard: Shard) -> Self {
        Self { shard, ..self }
    }

    /// The same on a number of threads, 0 for one a core.
    #[must_use]
    pub fn with_threads(self, n_threads: usize) -> Self {
        Self { n_threads, ..self }
    }

    /// The same with nothing computed but the pieces of some keys.
    #[must_use]
    pub fn with_only(self, keys: BTreeSet<String>) -> Self {
        Self {
            only: Some(keys),
            ..self
        }
    }

    /// Keys of all pieces that were asked for.
    pub fn into_asked(self) -> BTreeSet<String> {
        let asked = self.asked.into_inner();
        asked.unwrap_or_else(PoisonError::into_inner)
    }

    /// How the work went.
    pub fn into_tally(self) -> Tally {
        let tally = self.tally.into_inner();
        tally.unwrap_or_else(PoisonError::into_inner)
    }

    /// The results of all pieces, in their order; `None` if one of them is missing or failed, or belongs to another shard.
    ///
    /// They are kept in `section5/<experiment>/<fingerprint>` of the output directory.
    /// `prepare` makes what the pieces share, and is called if one of them has to be computed.
    ///
    /// # Errors
    /// Those of [`complete`] and of `prepare`. A piece that cannot be computed is no error here but counted.
    pub fn complete<'a, W: Work, S: Sync>(
        &'a self,
        experiment: &str,
        work: BTreeSet<W>,
        prepare: impl FnOnce(&'a Bench) -> Result<S, BenchError> + Send,
        measure: impl Fn(&S, &W) -> Result<W::Record, BenchError> + Sync + Send,
    ) -> Result<Option<Vec<W::Record>>, BenchError> {
        let store = Store::open(store_of(&self.output, experiment)?)?;
        let n_all = work.len();
        let n_dealt = self.tally().count_dealt(n_all);
        let keys = work.iter().map(Work::key);
        lock(&self.asked).extend(keys);
        let mut own = self.shard.after(n_dealt).of(work);
        if let Some(only) = &self.only {
            own.retain(|one| only.contains(&one.key()));
        }
        let outcome = complete(
            &own,
            &store,
            self.reuse,
            self.n_threads,
            |open, n_reused| {
                let start = Instant::now();
                let bench = self.bench()?;
                let data_set = start.elapsed().as_secs_f64();
                let start = Instant::now();
                let shared = prepare(bench)?;
                let results = side_by_side(open, &store, n_reused, |one| measure(&shared, one))?;
                let cells = start.elapsed().as_secs_f64();
                Ok((results, Seconds { data_set, cells }))
            },
        )?;
        self.tally().add(&outcome);
        Ok((outcome.records.len() == n_all).then_some(outcome.records))
    }

    /// The same for parts of an experiment, whose results are of any type that TOML can hold.
    ///
    /// # Errors
    /// As [`Self::complete`]; `Malformed` if a result cannot be written or read as TOML.
    pub fn parts<'a, T: Sync, S: Sync, F: Serialize + DeserializeOwned>(
        &'a self,
        experiment: &SectionExperiment,
        tasks: &[Task<T>],
        prepare: impl FnOnce(&'a Bench) -> Result<S, BenchError> + Send,
        measure: impl Fn(&S, &T) -> Result<F, BenchError> + Sync + Send,
    ) -> Result<Option<Vec<F>>, BenchError> {
        let name = &experiment.name;
        let fingerprint = measured_by(name)?;
        let settings: toml::Table = experiment.settings(self.profile)?;
        let part = |(place, task): (usize, &Task<T>)| Part {
            place,
            experiment: name.clone(),
            label: task.label.clone(),
            measured_by: fingerprint.to_string(),
            settings: settings.to_string(),
            cost: task.cost,
        };
        let work = tasks.iter().enumerate().map(part).collect();
        let records = self.complete(name, work, prepare, |shared, part: &Part| {
            let found = measure(shared, &tasks[part.place].task)?;
            let found = toml::Value::try_from(found);
            Ok(PartRecord {
                found: found.map_err(|error| BenchError::malformed(&part.label, error))?,
                part: part.clone(),
            })
        })?;
        let read = |record: PartRecord| {
            let found: Result<F, toml::de::Error> = record.found.try_into();
            found.map_err(|error| BenchError::malformed(&record.part.label, error))
        };
        records
            .map(|records| records.into_iter().map(read).collect())
            .transpose()
    }

    fn tally(&self) -> MutexGuard<'_, Tally> {
        lock(&self.tally)
    }

    /// Data and models, made at the first call.
    fn bench(&self) -> Result<&Bench, BenchError> {
        if let Some(bench) = self.bench.get() {
            return Ok(bench);
        }
        let bench = Bench::new(&self.output, self.reuse, self.shard)?;
        Ok(self.bench.get_or_init(|| bench))
    }
}
