//! Eq. (19): information criteria counted by hand.

use kernels::{Covariance, TorqueCovariance, TorqueForm};
use mtgp::fit::{RankCandidate, RankCounts};
use mtgp::{Criterion, MtgpError, choose_rank};

/// The chapter's robot at its smallest n: 6 joints, 14 loads, 280 samples per joint.
fn chapter_counts() -> RankCounts {
    RankCounts {
        n_tasks: 14,
        n_input_params: vec![44; 6],
        n_observations: vec![280; 6],
    }
}

fn candidate(rank: usize, log_marginals: &[f64]) -> RankCandidate {
    RankCandidate {
        rank,
        log_marginals: log_marginals.to_vec(),
    }
}

#[test]
fn input_covariance_of_six_joints_has_44_hyperparameters_without_the_noise() {
    // b, v, u and l for 18 covariates each, w for 6 joints: 1 + 1 + 18 + 18 + 6.
    let gpc = TorqueCovariance::unit(6, TorqueForm::Coulomb);
    assert_eq!(gpc.n_params(), 44);
}

#[test]
fn parameters_of_rank_4_are_570() {
    // Σ d_i = 6 · 44 = 264;  ℓ/2 · r(2m + 1 − r) = 3 · 4 · 25 = 300;  ℓ = 6.
    let counts = chapter_counts();
    assert_eq!(counts.n_params(4), 264 + 300 + 6);
    // 44 + ½ · 4 · 25 + 1
    assert_eq!(counts.n_params_of_joint(2, 4), 95);
    // Full rank: ½ · 14 · 15 = 105 entries.
    assert_eq!(counts.n_params_of_joint(0, 14), 44 + 105 + 1);
}

#[test]
fn criteria_are_those_of_the_formulas() {
    // Σ log L = −1000, k = 570, n = 6 · 280 = 1680, log 1680 = 7.42654907239…
    let candidates = [candidate(
        4,
        &[-500.0, -100.0, -100.0, -100.0, -100.0, -100.0],
    )];
    let cases = [
        (Criterion::Bic, 6_233.132_971_266_464),
        (Criterion::Aic, 2000.0 + 2.0 * 570.0),
        (Criterion::HannanQuinn, HANNAN_QUINN),
    ];
    for (criterion, expected) in cases {
        let choice = choose_rank(&candidates, &chapter_counts(), criterion).unwrap();
        let (rank, value) = choice.values[0];
        assert_eq!((rank, choice.rank), (4, 4));
        // A logarithm, a product and a sum of numbers below 10⁴.
        let tolerance = 8.0 * f64::EPSILON * expected;
        assert!(
            (value - expected).abs() <= tolerance,
            "{criterion:?} {value} {expected}"
        );
    }
}

/// 2000 + 2 · 570 · log log 1680.
const HANNAN_QUINN: f64 = 4_285.769_873_116_892;

#[test]
fn dearer_rank_wins_only_if_its_likelihood_pays() {
    // From r = 4 to r = 5: ½ · 5 · 24 − 50 = 10 more entries per joint, 60 in all,
    // which cost ½ · 60 · log 1680 = 222.796 nats.
    let counts = chapter_counts();
    for (gain, expected) in [(222.7, 4), (222.9, 5)] {
        let candidates = [
            candidate(4, &[100.0; 6]),
            candidate(5, &[100.0 + gain / 6.0; 6]),
        ];
        let choice = choose_rank(&candidates, &counts, Criterion::Bic).unwrap();
        assert_eq!(choice.rank, expected, "{choice:?}");
    }
}

#[test]
fn unusable_candidates_are_refused() {
    let counts = chapter_counts();
    let refuse = |candidates: &[RankCandidate]| {
        choose_rank(candidates, &counts, Criterion::Bic).unwrap_err()
    };
    assert!(matches!(
        refuse(&[]),
        MtgpError::CountMismatch { found: 0, .. }
    ));
    let (rank, n_tasks) = (15, 14);
    assert_eq!(
        refuse(&[candidate(15, &[0.0; 6])]),
        MtgpError::BadRank { rank, n_tasks }
    );
    assert!(matches!(
        refuse(&[candidate(4, &[0.0; 5])]),
        MtgpError::CountMismatch {
            found: 5,
            expected: 6,
            ..
        }
    ));
    let mut log_marginals = [0.0; 6];
    log_marginals[1] = f64::NEG_INFINITY;
    assert!(matches!(
        refuse(&[candidate(4, &log_marginals)]),
        MtgpError::NonFinite {
            row: 4,
            column: 1,
            ..
        }
    ));
}
