//! The same cells give the same bits, for any number of threads and however often a run was interrupted.

use std::collections::BTreeSet;

use bench_suite::cell::{Cell, CellRecord, ModelKind};
use bench_suite::run::{Reuse, run};
use bench_suite::store::Store;

fn cells(models: &[ModelKind]) -> BTreeSet<Cell> {
    let cell = |load, &model: &ModelKind| Cell {
        seed: "test".to_string(),
        load,
        joint: 3,
        model,
        n: 20,
    };
    [2, 9]
        .into_iter()
        .flat_map(|load| models.iter().map(move |model| cell(load, model)))
        .collect()
}

/// The records without what no two runs share.
fn without_seconds(records: &[CellRecord]) -> Vec<CellRecord> {
    let quiet = |record: &CellRecord| CellRecord {
        seconds_fit: 0.0,
        seconds_predict: 0.0,
        ..record.clone()
    };
    records.iter().map(quiet).collect()
}

#[test]
fn one_and_two_threads_give_the_same_bits() {
    let cells = cells(&ModelKind::ALL);
    let records = |n_threads| {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        let outcome = run(&cells, &store, Reuse::Fits, n_threads).unwrap();
        assert!(outcome.failures.is_empty(), "{:?}", outcome.failures);
        without_seconds(&outcome.records)
    };
    let one = records(1);
    let measured: Vec<&Cell> = one.iter().map(|record| &record.cell).collect();
    assert_eq!(measured, cells.iter().collect::<Vec<_>>());
    assert_eq!(one, records(2));
}

#[test]
fn a_continued_run_computes_only_what_is_missing() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let linear = [ModelKind::LrSmooth, ModelKind::LrCoulomb];

    let first = run(&cells(&linear[..1]), &store, Reuse::Fits, 1).unwrap();
    assert_eq!((first.n_reused, first.records.len()), (0, 2));
    let second = run(&cells(&linear), &store, Reuse::Fits, 1).unwrap();
    assert_eq!((second.n_reused, second.records.len()), (2, 4));
    let third = run(&cells(&linear), &store, Reuse::Fits, 1).unwrap();
    assert_eq!(third.n_reused, 4);
    assert_eq!(third.records, second.records);

    let all = run(&cells(&ModelKind::ALL), &store, Reuse::Results, 1).unwrap();
    assert_eq!((all.records.len(), all.missing.len()), (4, 10));
    let again = run(&cells(&linear), &store, Reuse::Scratch, 1).unwrap();
    assert_eq!(again.n_reused, 0);
    assert_eq!(
        without_seconds(&again.records),
        without_seconds(&third.records)
    );
}
