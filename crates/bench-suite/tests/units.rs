//! Units of the many-contexts experiments: the same bits for any number of threads, and resumable.

use std::collections::BTreeSet;

use bench_suite::multi::run::{run, run_shared};
use bench_suite::multi::shared::{SharedRecord, SharedScope, SharedUnit};
use bench_suite::multi::unit::{ContextScore, Unit, UnitRecord};
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
        model.log_marginal_likelihood.expect("a process")
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

/// The same samples for the models with the prior of section 3.2.
fn rigid_body_units() -> BTreeSet<Unit> {
    let of_unit = |unit: Unit| Unit {
        models: ["rbd+gp", "rbd-shared-signs"]
            .map(|name| name.parse().expect("a model's name"))
            .to_vec(),
        ..unit
    };
    units().into_iter().map(of_unit).collect()
}

#[test]
fn a_rigid_body_prior_has_units_of_its_own_and_knows_the_arm() {
    let dir = tempfile::tempdir().unwrap();
    let store = Store::open(dir.path()).unwrap();
    let work = rigid_body_units();
    let outcome = run(&work, &store, Reuse::Fits, 2).unwrap();
    assert!(outcome.failures.is_empty(), "{:?}", outcome.failures);
    let one_thread = run(&work, &store, Reuse::Scratch, 1).unwrap();
    assert_eq!(
        without_seconds(&outcome.records),
        without_seconds(&one_thread.records)
    );
    let again = run(&work, &store, Reuse::Results, 1).unwrap();
    assert_eq!((again.n_reused, again.missing.len()), (2, 0));
    for record in &outcome.records {
        assert_eq!(record.models.len(), 2);
        for model in &record.models {
            assert_eq!(model.scores.len(), 3, "{}", model.model);
            // Six samples a load cannot tell a torque, but they can tell a load.
            let is_close = |score: &ContextScore| score.extrap < 1e-2 && score.interp < 1e-2;
            assert!(model.scores.iter().all(is_close), "{:?}", model.scores);
        }
    }
}

/// Two joints with one K^ρ, after their own fits.
fn shared_with(n_threads: usize) -> (tempfile::TempDir, Vec<UnitRecord>, Vec<SharedRecord>) {
    let dir = tempfile::tempdir().expect("a directory");
    let store = Store::open(dir.path()).expect("a store");
    let own = run(&units(), &store, Reuse::Fits, n_threads)
        .expect("their own fits")
        .records;
    let scope = SharedScope {
        up_to: 18,
        ranks: vec![1, 2],
    };
    let shared: BTreeSet<SharedUnit> = SharedUnit::all(&own, &[1, 3], &scope).into_iter().collect();
    assert_eq!(shared.len(), 1);
    let outcome = run_shared(&shared, &own, &store, Reuse::Fits, n_threads).expect("a run");
    assert!(outcome.failures.is_empty(), "{:?}", outcome.failures);
    let again = run_shared(&shared, &own, &store, Reuse::Results, n_threads).expect("a run");
    assert_eq!((again.n_reused, &again.records), (1, &outcome.records));
    (dir, own, outcome.records)
}

#[test]
fn one_matrix_for_all_joints_climbs_from_their_own_fits_and_pays_for_its_entries_once() {
    let (_dir, own, records) = shared_with(1);
    let fits = &records[0].fits;
    assert_eq!(fits.len(), 2);
    for (fit, entries) in fits.iter().zip([3, 5]) {
        let log_marginal: f64 = fit.log_marginals.iter().sum();
        assert!(log_marginal > fit.initial_log_marginal, "{fit:?}");
        // 44 hyperparameters and σ of each joint, Λ once; 36 torques.
        let expected = -2.0 * log_marginal + f64::from(2 * 45 + entries) * 36.0_f64.ln();
        assert!((fit.bic / expected - 1.0).abs() < 1e-12, "{}", fit.bic);
        assert_eq!((fit.scores.len(), fit.scores[0].len()), (2, 3));
        assert_eq!(
            (fit.task_factor.len(), fit.task_factor[0].len()),
            (3, fit.rank)
        );
    }
    let least = fits.iter().map(|fit| fit.bic).fold(f64::INFINITY, f64::min);
    let chosen = records[0].chosen().unwrap();
    assert_eq!(chosen.bic.to_bits(), least.to_bits());
    // The joints are predicted by processes of their own.
    assert_ne!(fits[1].scores[0], fits[1].scores[1]);
    let name = "mGP-2".parse().unwrap();
    let apart: f64 = (own.iter())
        .map(|record| record.of(name).unwrap().log_marginal_likelihood.unwrap())
        .sum();
    // A common K^ρ is a special case: above the sum of the joints' own optima only by what their searches left.
    let together: f64 = fits[1].log_marginals.iter().sum();
    assert!(together < apart + 1.0, "{together} {apart}");

    let (_dir, _, mut with_two) = shared_with(2);
    let mut with_one = records;
    for fit in with_one
        .iter_mut()
        .chain(&mut with_two)
        .flat_map(|r| &mut r.fits)
    {
        fit.seconds_fit = 0.0;
    }
    assert_eq!(with_one, with_two);
}
