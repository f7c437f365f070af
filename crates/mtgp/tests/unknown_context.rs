//! The test for an unknown context: uniform where the model is right, powerful where it is not.

use faer::Mat;
use kernels::Covariance;
use linalg::Factor;
use mtgp::context::{
    Calibration, ContextAnswer, ContextPosterior, ContextPrior, JointTorques,
    chi_squared_upper_tail, context_evidence, known_or_unknown, largest_p_value,
};
use mtgp::{MtgpError, MultiTaskCovariance, TaskCovariance, TaskFactor, with_task};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::eq_21::dense;
use crate::icm_draws::{Draw, four_tasks_of_rank_two, normal};

const TRIALS: usize = 200;

/// χ² tables: Abramowitz & Stegun 1964, table 26.8, and closed forms for two and four degrees.
#[test]
fn upper_tail_of_chi_squared_by_hand() {
    let cases = [
        (2.0, 2, (-1.0_f64).exp()),
        (6.0, 4, 4.0 * (-3.0_f64).exp()),
        (80.0, 4, 41.0 * (-40.0_f64).exp()),
    ];
    for (value, degrees, expected) in cases {
        let tail = chi_squared_upper_tail(value, degrees);
        assert!(
            (tail - expected).abs() <= 1e-13 * expected,
            "{tail} {expected}"
        );
    }
    for (value, degrees) in [(3.841_46, 1), (18.307_04, 10), (124.342_11, 100)] {
        let tail = chi_squared_upper_tail(value, degrees);
        assert!((tail - 0.05).abs() <= 1e-6, "{value}: {tail}");
    }
    assert_eq!(chi_squared_upper_tail(0.0, 3), 1.0);
    assert_eq!(chi_squared_upper_tail(f64::INFINITY, 3), 0.0);
    assert_eq!(chi_squared_upper_tail(1e5, 3), 0.0);
    assert!(chi_squared_upper_tail(f64::NAN, 3).is_nan());
}

/// Known contexts 0 to 3, and a fifth that no model has seen.
fn with_a_fifth(draw: &Draw) -> MultiTaskCovariance {
    let entries = [1.0, 0.8, 0.7, -0.6, 0.9, 1.1, -0.5, -3.0, 2.5];
    let factor = TaskFactor::from_entries(5, 2, &entries).unwrap();
    MultiTaskCovariance::new(draw.truth.input().clone(), TaskCovariance::Factor(factor))
}

/// Squared residuals and p-values of draws of a context, given one set of old samples.
///
/// The draws are from the prior conditioned on the old samples by a covariance matrix of old and
/// new together, which is not how the evidence is computed.
fn trials(context: usize) -> Vec<Vec<f64>> {
    let draw = four_tasks_of_rank_two(11, 10);
    let prior = with_a_fifth(&draw);
    let x = Mat::from_fn(4, 3, |row, col| {
        1.9 * (2.1 * row as f64 + 1.7 * col as f64 + 0.3).sin()
    });
    let (n, k) = (draw.targets.len(), x.nrows());
    let new = with_task(x.as_ref(), context);
    let all = Mat::from_fn(n + k, 4, |row, col| {
        if row < n {
            draw.data.inputs()[(row, col)]
        } else {
            new[(row - n, col)]
        }
    });
    let mut k_all = prior.gram(all.as_ref());
    for idx in 0..n + k {
        k_all[(idx, idx)] += draw.noise_std * draw.noise_std;
    }
    let factor = Factor::new(k_all).unwrap();
    let l = factor.l();
    // The old targets fix the first n of the standard normal numbers.
    let mut z = vec![0.0; n + k];
    for row in 0..n {
        let known: f64 = (0..row).map(|col| l[(row, col)] * z[col]).sum();
        z[row] = (draw.targets[row] - known) / l[(row, row)];
    }
    let model = dense(&draw);
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    (0..TRIALS)
        .map(|_| {
            for value in &mut z[n..] {
                *value = normal(&mut rng);
            }
            let torques: Vec<f64> = (n..n + k)
                .map(|row| (0..=row).map(|col| l[(row, col)] * z[col]).sum())
                .collect();
            let torques = &torques;
            let joint = JointTorques {
                model: &model,
                torques,
            };
            context_evidence(&[joint], x.as_ref()).unwrap().p_values()
        })
        .collect()
}

/// Largest distance between the empirical distribution of values and the uniform one.
fn kolmogorov_smirnov(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let distance = |(idx, p): (usize, &f64)| {
        (p - idx as f64 / n)
            .abs()
            .max((p - (idx + 1) as f64 / n).abs())
    };
    values.iter().enumerate().map(distance).fold(0.0, f64::max)
}

#[test]
fn p_values_are_uniform_under_the_right_context_and_small_under_none() {
    // Massart 1990: P(distance > d) ≤ 2 exp(−2 n d²), here 1e-4.
    let bound = ((2.0_f64 / 1e-4).ln() / (2.0 * TRIALS as f64)).sqrt();
    let of_known = trials(2);
    let distance = kolmogorov_smirnov(of_known.iter().map(|p| p[2]).collect());
    assert!(distance <= bound, "{distance} {bound}");
    let false_alarms = of_known
        .iter()
        .filter(|p| p.iter().all(|p| *p < 0.05))
        .count();
    // Binomial(200, 0.05): more than 25 has probability 1e-5.
    assert!(false_alarms <= 25, "{false_alarms}");

    // A context far from the known ones is found nearly always.
    let found = |p: &&Vec<f64>| p.iter().all(|p| *p < 0.05);
    let detected = trials(4).iter().filter(found).count();
    assert!(detected >= TRIALS * 9 / 10, "{detected} of {TRIALS}");
}

#[test]
fn held_out_scores_give_the_rank_of_a_new_one() {
    let calibration = Calibration::new(vec![3.0, 1.0, 2.0, 2.0]).unwrap();
    for (score, expected) in [(0.5, 1.0), (2.0, 0.8), (2.5, 0.4), (3.5, 0.2)] {
        assert_eq!(calibration.p_value(score), expected, "{score}");
    }
    assert!(calibration.p_value(f64::NAN).is_nan());
    assert_eq!(Calibration::new(Vec::new()), Err(MtgpError::NoCalibration));
    let nan = Calibration::new(vec![1.0, f64::NAN]);
    assert!(matches!(nan, Err(MtgpError::NonFinite { row: 1, .. })));
}

#[test]
fn conformal_p_values_are_valid_whatever_the_scores_are() {
    // Scores of a wrong model, heavy in the tail: the cube of a normal number.
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let mut score = || normal(&mut rng).powi(3);
    let (level, n, trials) = (0.1, 19, 2000);
    let rejected = (0..trials).filter(|_| {
        let held_out = (0..n).map(|_| score()).collect();
        Calibration::new(held_out).unwrap().p_value(score()) <= level
    });
    // Exactly level here, as level (n + 1) is whole: 200 ± 13.4, five deviations.
    let rejected = rejected.count();
    assert!(rejected.abs_diff(200) <= 67, "{rejected}");
}

#[test]
fn p_values_of_groups_are_valid_where_scores_of_a_group_are_alike() {
    // Nineteen places whose scores under five loads differ by a thousandth of their spread.
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let mut place = || {
        let common = normal(&mut rng).powi(3);
        let mut score = || common + 1e-3 * normal(&mut rng);
        vec![score(), score(), score(), score(), score()]
    };
    let (n_groups, n_trials) = (19, 2000);
    let mut rejected = [0_usize; 3];
    for _ in 0..n_trials {
        let held_out: Vec<Vec<f64>> = (0..n_groups).map(|_| place()).collect();
        let pooled = Calibration::new(held_out.concat()).unwrap();
        let grouped = Calibration::of_groups(held_out).unwrap();
        let score = place()[0];
        rejected[0] += usize::from(grouped.p_value(score) <= 0.1);
        rejected[1] += usize::from(grouped.p_value(score) <= 0.04);
        rejected[2] += usize::from(pooled.p_value(score) <= 0.04);
    }
    // At most 200 ± 13.4 at a tenth; none below 1/20; one in twenty if groups count as scores.
    assert!(rejected[0] <= 200 + 67, "{rejected:?}");
    assert_eq!(rejected[1], 0);
    assert!(rejected[2] > 90, "{rejected:?}");
    assert_eq!(
        Calibration::of_groups(vec![vec![1.0], Vec::new()]),
        Err(MtgpError::NoCalibration)
    );
}

#[test]
fn the_largest_p_value_holds_for_torques_of_either_of_two_kinds() {
    // Scores of one kind are ten times as large as those of the other.
    let mut rng = ChaCha8Rng::seed_from_u64(9);
    let (level, n, n_trials) = (0.1, 19, 2000);
    let mut rejected = [0_usize; 2];
    for _ in 0..n_trials {
        let mut scores = |scale: f64, n: usize| -> Vec<f64> {
            (0..n).map(|_| scale * normal(&mut rng).abs()).collect()
        };
        let held_out = [1.0, 10.0].map(|scale| Calibration::new(scores(scale, n)).unwrap());
        for (count, scale) in rejected.iter_mut().zip([1.0, 10.0]) {
            let p_value = largest_p_value(&held_out, scores(scale, 1)[0]);
            *count += usize::from(p_value <= level);
        }
    }
    // Five deviations of a binomial above the level; exact for the larger scores, but for the rare
    // case in which the smaller ones hold the largest.
    assert!(rejected[0] <= 20 && rejected[1] <= 267, "{rejected:?}");
    assert!(rejected[1] >= 133, "{rejected:?}");
    assert!(largest_p_value(&[], 1.0).is_nan());
}

#[test]
fn a_context_is_named_unless_all_are_rejected() {
    let prior = ContextPrior::uniform(2).unwrap();
    let posterior = ContextPosterior::new(&[0.0, 1.0], &prior).unwrap();
    let answer = |p_values: &[f64], level| known_or_unknown(&posterior, p_values, level);
    let expected = 1.0 / (1.0 + (-1.0_f64).exp());
    match answer(&[0.01, 0.2], 0.05) {
        Ok(ContextAnswer::Known {
            context: 1,
            probability,
            p_value,
        }) => {
            assert!((probability - expected).abs() <= 4.0 * f64::EPSILON);
            assert_eq!(p_value, 0.2);
        }
        other => panic!("{other:?}"),
    }
    let unknown = ContextAnswer::Unknown { p_value: 0.02 };
    assert_eq!(answer(&[0.01, 0.02], 0.05), Ok(unknown));
    assert!(answer(&[0.01], 0.05).is_err());
    assert!(answer(&[0.01, f64::NAN], 0.05).is_err());
    assert!(answer(&[0.01, 0.5], 1.5).is_err());
}
