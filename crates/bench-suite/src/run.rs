//! All cells of a run: the finished ones read, the others computed side by side.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use rayon::prelude::*;

use crate::cell::Cell;
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::measure::measure;
use crate::progress::Progress;
use crate::rigid_body::rows::Regressors;
use crate::split::Split;
use crate::store::{Store, Work};

/// What may be taken from earlier runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Reuse {
    /// Compute nothing: draw what is finished, and say what is missing
    Results,
    /// Take what is finished and compute the rest
    Fits,
    /// Compute everything again
    Scratch,
}

/// What a run produced, in the order of the cells.
#[derive(Debug)]
pub struct RunOutcome<W: Work = Cell> {
    /// Results, reused and new.
    pub records: Vec<W::Record>,
    /// Cells that could not be computed, with the reason.
    pub failures: Vec<(W, BenchError)>,
    /// Cells that were neither finished nor computed.
    pub missing: Vec<W>,
    /// Number of results taken from the store.
    pub n_reused: usize,
    /// Where the time went.
    pub seconds: Seconds,
}

impl<W: Work> RunOutcome<W> {
    /// Sentences that name what could not be computed, with the reason.
    pub fn reasons(&self) -> Vec<String> {
        (self.failures.iter())
            .map(|(work, error)| format!("{work}: {error}."))
            .collect()
    }
}

/// Wall-clock seconds of the parts of a run.
#[derive(Debug, Default, Clone, serde::Serialize)]
pub struct Seconds {
    /// Simulation of the data set.
    pub data_set: f64,
    /// All cells, side by side.
    pub cells: f64,
}

/// Results in the order of the work, each an error of its own, and where the time went.
pub type Computed<W> = (Vec<Result<<W as Work>::Record, BenchError>>, Seconds);

/// Runs the cells on `n_threads` threads (0: one a core).
///
/// Cells run in parallel, each sequential inside, and are collected in their own order:
/// the results are the same bits for every number of threads.
///
/// # Errors
/// `Threads` if the pool cannot be started; `Dynamics` if the data cannot be simulated;
/// `Io` if a result cannot be kept. A cell that cannot be fitted is no error here but listed in `failures`.
pub fn run(
    cells: &BTreeSet<Cell>,
    store: &Store,
    reuse: Reuse,
    n_threads: usize,
) -> Result<RunOutcome, BenchError> {
    complete(cells, store, reuse, n_threads, |open, n_reused| {
        compute(open, store, n_reused)
    })
}

/// Takes finished work from the store and has the rest computed, on a pool of `n_threads` threads.
///
/// `compute` gets what is open, in order, and the number of results that were found.
///
/// # Errors
/// As for [`run`].
pub fn complete<W: Work>(
    work: &BTreeSet<W>,
    store: &Store,
    reuse: Reuse,
    n_threads: usize,
    compute: impl FnOnce(&[W], usize) -> Result<Computed<W>, BenchError> + Send,
) -> Result<RunOutcome<W>, BenchError> {
    let mut finished: BTreeMap<W, W::Record> = BTreeMap::new();
    if reuse != Reuse::Scratch {
        finished.extend(
            work.iter()
                .filter_map(|w| Some((w.clone(), store.load(w)?))),
        );
    }
    let n_reused = finished.len();
    let open: Vec<W> = work
        .iter()
        .filter(|one| !finished.contains_key(one))
        .cloned()
        .collect();
    if reuse == Reuse::Results || open.is_empty() {
        return Ok(RunOutcome {
            records: finished.into_values().collect(),
            failures: Vec::new(),
            missing: open,
            n_reused,
            seconds: Seconds::default(),
        });
    }

    let pool = thread_pool(n_threads)?;
    let (computed, seconds) = pool.install(|| compute(&open, n_reused))?;
    let mut failures = Vec::new();
    for (one, result) in open.into_iter().zip(computed) {
        match result {
            Ok(record) => drop(finished.insert(one, record)),
            Err(error) => failures.push((one, error)),
        }
    }
    Ok(RunOutcome {
        records: finished.into_values().collect(),
        failures,
        missing: Vec::new(),
        n_reused,
        seconds,
    })
}

/// Results in the order of `cells`, each kept in the store as soon as it is there.
fn compute(cells: &[Cell], store: &Store, n_reused: usize) -> Result<Computed<Cell>, BenchError> {
    let start = Instant::now();
    let loads: BTreeSet<usize> = cells.iter().map(|cell| cell.load).collect();
    let data = DataSet::simulate(&loads)?;
    let draws: BTreeSet<(&str, usize)> = cells.iter().map(|c| (c.seed.as_str(), c.load)).collect();
    let splits: BTreeMap<(&str, usize), Split> = draws
        .into_iter()
        .map(|(seed, load)| ((seed, load), Split::draw(seed, load)))
        .collect();
    let data_set = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let regressors = Regressors::new(&data);
    let results = side_by_side(cells, store, n_reused, |cell| {
        measure(
            cell,
            &data,
            &regressors,
            &splits[&(cell.seed.as_str(), cell.load)],
        )
    })?;
    let cells = start.elapsed().as_secs_f64();
    Ok((results, Seconds { data_set, cells }))
}

/// Results in the order of `work`, what takes longest started first; each is kept as soon as it is there.
///
/// # Errors
/// `Io` if a result cannot be kept; then no further work is begun.
pub(crate) fn side_by_side<W: Work>(
    work: &[W],
    store: &Store,
    n_reused: usize,
    measure: impl Fn(&W) -> Result<W::Record, BenchError> + Sync,
) -> Result<Vec<Result<W::Record, BenchError>>, BenchError> {
    let progress = Progress::start(work.len(), n_reused);
    let one = |i: usize| {
        let record = measure(&work[i]);
        if let Ok(record) = &record {
            store.save(record)?;
        }
        progress.finished(&work[i]);
        Ok((i, record))
    };
    let results: Result<Vec<_>, BenchError> = longest_first(work)
        .into_iter()
        .par_bridge() // one after another to whoever is free; halves would not keep the order
        .map(one)
        .collect();
    progress.end();
    let mut results = results?;
    results.sort_by_key(|(i, _)| *i);
    Ok(results.into_iter().map(|(_, result)| result).collect())
}

/// Indices of the work, what takes longest first, so that no thread is left alone with a long piece at the end.
pub(crate) fn longest_first<W: Work>(work: &[W]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..work.len()).collect();
    order.sort_by(|&a, &b| work[b].cost().cmp(&work[a].cost()));
    order
}

/// A pool of `n_threads` threads, 0 for one a core.
///
/// Decompositions that faer would share out among the threads of a pool stay on one from here on: how it divides
/// them moves their last bits.
pub(crate) fn thread_pool(n_threads: usize) -> Result<rayon::ThreadPool, BenchError> {
    faer::set_global_parallelism(faer::Par::Seq);
    rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build()
        .map_err(|e| BenchError::Threads {
            n_threads,
            message: e.to_string(),
        })
}
