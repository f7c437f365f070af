//! All units of a run: the finished ones read, the others computed side by side.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Instant;

use super::bench::Bench;
use super::measure::measure;
use super::shared::{self, SharedUnit};
use super::unit::{Unit, UnitRecord};
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::run::{Computed, Reuse, RunOutcome, Seconds, complete, side_by_side};
use crate::split::Split;
use crate::store::Store;

/// Runs the units on `n_threads` threads (0: one a core).
///
/// Units run in parallel, each sequential inside, and are collected in their own order:
/// the results are the same bits for every number of threads.
///
/// # Errors
/// As for [`crate::run::run`].
pub fn run(
    units: &BTreeSet<Unit>,
    store: &Store,
    reuse: Reuse,
    n_threads: usize,
) -> Result<RunOutcome<Unit>, BenchError> {
    complete(units, store, reuse, n_threads, |open, n_reused| {
        compute(open, store, n_reused)
    })
}

/// Runs the units with one K^ρ for all joints, which set out from the joints' own `records`.
///
/// # Errors
/// As for [`crate::run::run`].
pub fn run_shared(
    units: &BTreeSet<SharedUnit>,
    records: &[UnitRecord],
    store: &Store,
    reuse: Reuse,
    n_threads: usize,
) -> Result<RunOutcome<SharedUnit>, BenchError> {
    complete(units, store, reuse, n_threads, |open, n_reused| {
        let of_joints: Vec<Unit> = open.iter().flat_map(|unit| unit.joints.clone()).collect();
        on_bench(&of_joints, |bench| {
            side_by_side(open, store, n_reused, |unit| {
                shared::measure(unit, records, bench)
            })
        })
    })
}

fn compute(units: &[Unit], store: &Store, n_reused: usize) -> Result<Computed<Unit>, BenchError> {
    on_bench(units, |bench| {
        side_by_side(units, store, n_reused, |unit| measure(unit, bench))
    })
}

/// What is measured on the data and splits of some units, and where the time went.
fn on_bench<T>(
    units: &[Unit],
    measure_all: impl FnOnce(&Bench<'_>) -> Result<T, BenchError>,
) -> Result<(T, Seconds), BenchError> {
    let start = Instant::now();
    let n_contexts = units.iter().map(|unit| unit.n_contexts).max().unwrap_or(0);
    let loads: BTreeSet<usize> = (1..=n_contexts).collect();
    let data = DataSet::simulate(&loads)?;
    let seeds: BTreeSet<&str> = units.iter().map(|unit| unit.split_seed.as_str()).collect();
    let splits_of = |seed: &str| -> BTreeMap<usize, Split> {
        let split = |&load: &usize| (load, Split::draw(seed, load));
        loads.iter().map(split).collect()
    };
    let splits = seeds.into_iter().map(|seed| (seed, splits_of(seed)));
    let splits: BTreeMap<&str, BTreeMap<usize, Split>> = splits.collect();
    let bench = Bench::new(&data, splits);
    let data_set = start.elapsed().as_secs_f64();

    let start = Instant::now();
    let results = measure_all(&bench)?;
    let cells = start.elapsed().as_secs_f64();
    Ok((results, Seconds { data_set, cells }))
}
