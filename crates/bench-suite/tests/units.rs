//! Units of the many-contexts experiments: the same bits for any number of threads, and resumable.

use std::collections::BTreeSet;

use bench_suite::multi::run::run;
use bench_suite::multi::unit::{Unit, UnitRecord};
use bench_suite::run::Reuse;
use bench_suite::store::Store;

/// Two joints of three contexts with six samples each.
fn units() -> BTreeSet<Unit> {
    let unit = |joint| Unit {
        seed: "test".to_string(),
        split_seed: "split".to_string(),
        repeat: 0,
        joint,
        n_contexts: 3,
        n_total: 18,
        models: ["sGP", "iGP", "pGP", "mGP-1", "mGP-2"]
            .map(|name| name.parse().expect("a model's name"))
            .to_vec(),
    };
    [1, 3].map(unit).into()
}

/// The records without what no two runs share.
fn without_seconds(records: &[UnitRecord]) -> Vec<UnitRecord> {
    let mut records = records.to_vec();
    for model in records.iter_mut().flat_map(|record| &mut record.models) {
        (model.seconds_fit, model.seconds_predict) = (0.0, 0.0);
    }
    records
}

#[test]
fn threads_do_not_change_the_bits_and_finished_units_are_not_computed_again() {
    let dirs = [1, 2].map(|n_threads| {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        let outcome = run(&units(), &store, Reuse::Fits, n_threads).unwrap();
        assert!(outcome.failures.is_empty(), "{:?}", outcome.failures);
        (dir, outcome)
    });
    let [(dir, one), (_, two)] = dirs;
    assert_eq!(without_seconds(&one.records), without_seconds(&two.records));
    assert_eq!(one.records.len(), 2);

    let store = Store::open(dir.path()).unwrap();
    let again = run(&units(), &store, Reuse::Fits, 1).unwrap();
    assert_eq!((again.n_reused, again.records), (2, one.records));
}

#[test]
fn a_record_has_a_score_of_every_context_and_the_likelihood_grows_with_the_rank() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let only_first: BTreeSet<Unit> = units().into_iter().take(1).collect();
    let outcome = run(&only_first, &store, Reuse::Fits, 1).unwrap();
    let record = &outcome.records[0];
    for model in &record.models {
        let contexts: Vec<usize> = model.scores.iter().map(|score| score.context).collect();
        assert_eq!(contexts, [1, 2, 3], "{}", model.model);
        assert!(
            model
                .scores
                .iter()
                .all(|s| s.interp > 0.0 && s.extrap > 0.0)
        );
        let n_fits = if model.model.to_string() == "sGP" {
            3
        } else {
            1
        };
        assert_eq!(model.fits.len(), n_fits, "{}", model.model);
    }
    let log = |name: &str| {
        let model = record.of(name.parse().unwrap()).unwrap();
        model.log_marginal_likelihood
    };
    // mGP-1 contains pGP and sets out near it; mGP-2 sets out from mGP-1 too.
    assert!(
        log("mGP-2") >= log("mGP-1") - 1.0,
        "{} {}",
        log("mGP-2"),
        log("mGP-1")
    );
    let factor = &record.of("mGP-2".parse().unwrap()).unwrap().task_factor;
    assert_eq!((factor.len(), factor[0].len()), (3, 2));
}
