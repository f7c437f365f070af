//! Noise beyond σ, densities of a growing number of torques, and rows drawn like the known ones.

use faer::{Mat, MatRef};
use gp_core::optimize::MinimizeOptions;
use mtgp::context::{
    ContextModel, ContextPrior, ContextTracker, ContextTransition, JointTorques, WithTorqueNoise,
    context_evidence,
};
use mtgp::latent::{LatentFunctions, PredictiveDensity};
use mtgp::novel::{
    Border, NewTorques, RowPopulation, fit_row, fit_row_from_population, log_density_of_row,
};
use mtgp::prior::TaskRow;
use mtgp::{MtgpError, with_task};

use crate::eq_21::{assert_close, dense};
use crate::icm_draws::four_tasks_of_rank_two;

const NOISE: f64 = 0.3;

/// States away from the samples, and torques that no context made.
fn new_samples(k: usize) -> (Mat<f64>, Vec<f64>) {
    let x = Mat::from_fn(k, 3, |row, col| {
        1.8 * (1.3 * row as f64 + 0.9 * col as f64).sin()
    });
    let torques = (0..k).map(|row| (0.7 * row as f64).cos()).collect();
    (x, torques)
}

fn options() -> MinimizeOptions {
    MinimizeOptions {
        gradient_tolerance: 1e-8,
        value_tolerance: 0.0,
        max_evaluations: 500,
        max_recoveries: 5,
    }
}

#[test]
fn noise_of_the_new_torques_adds_to_the_covariance_of_the_posterior() {
    let posterior = dense(&four_tasks_of_rank_two(1, 10));
    let (x, torques) = new_samples(5);
    let noisy = WithTorqueNoise {
        posterior: &posterior,
        noise_std: NOISE,
    };
    let total = posterior.noise_std().hypot(NOISE);
    let densities = noisy.predictive_densities(x.as_ref()).unwrap();
    assert_eq!(densities.len(), noisy.n_contexts());
    for (task, density) in densities.iter().enumerate() {
        let rows = with_task(x.as_ref(), task);
        let mean = posterior.predict_mean(rows.as_ref()).unwrap();
        let covariance = posterior.predict_covariance(rows.as_ref()).unwrap();
        let expected = PredictiveDensity::new(mean, covariance, total).unwrap();
        let value = |density: &PredictiveDensity| density.log_density(&torques).unwrap().0;
        assert_close("density", value(density), value(&expected));
    }
}

#[test]
fn running_densities_are_those_of_the_first_torques_alone() {
    let posterior = dense(&four_tasks_of_rank_two(1, 10));
    let (x, torques) = new_samples(6);
    let all = posterior.predictive_densities(x.as_ref()).unwrap();
    let running: Vec<_> = (all.iter())
        .map(|density| density.running_log_densities(&torques).unwrap())
        .collect();
    for k in 1..=6 {
        let first: MatRef<'_, f64> = x.subrows(0, k);
        let alone = posterior.predictive_densities(first).unwrap();
        for (running, density) in running.iter().zip(&alone) {
            let (value, squares) = density.log_density(&torques[..k]).unwrap();
            assert_close("log density", running[k - 1].0, value);
            assert_close("squares", running[k - 1].1, squares);
        }
    }
    let wrong = all[0].running_log_densities(&torques[..5]);
    assert!(matches!(wrong, Err(MtgpError::CountMismatch { .. })));
}

#[test]
fn a_tracker_with_noise_that_forgets_nothing_is_the_batch_with_noise() {
    let posteriors = [1, 2].map(|seed| dense(&four_tasks_of_rank_two(seed, 10)));
    let (x, torques) = new_samples(8);
    let prior = ContextPrior::uniform(4).unwrap();
    let tracker = ContextTracker::new(&posteriors, 8, &prior, ContextTransition::none(4)).unwrap();
    assert!(tracker.clone().with_torque_noise(&[NOISE]).is_err());
    assert!(tracker.clone().with_torque_noise(&[NOISE, -0.1]).is_err());
    let mut tracker = tracker.with_torque_noise(&[NOISE, 0.0]).unwrap();
    for (row, torque) in torques.iter().enumerate() {
        let state: Vec<f64> = x.row(row).iter().copied().collect();
        tracker
            .step(&state, &[Some(*torque), Some(-torque)])
            .unwrap();
    }
    let negative: Vec<f64> = torques.iter().map(|torque| -torque).collect();
    let noisy = |posterior, noise_std| WithTorqueNoise {
        posterior,
        noise_std,
    };
    let (first, second) = (noisy(&posteriors[0], NOISE), noisy(&posteriors[1], 0.0));
    let joints = [
        JointTorques {
            model: &first,
            torques: &torques,
        },
        JointTorques {
            model: &second,
            torques: &negative,
        },
    ];
    let evidence = context_evidence(&joints, x.as_ref()).unwrap();
    let expected = evidence.posterior(&prior).unwrap();
    let logs = tracker.filter().log_probabilities();
    for (log, expected) in logs.iter().zip(expected.log_probabilities()) {
        assert_close("log probability", *log, *expected);
    }
}

/// λ̄ ± √r · column of L for V = LLᵀ: their mean and covariance are λ̄ and V.
fn sigma_rows(population: &RowPopulation) -> Vec<TaskRow> {
    let l = linalg::Factor::new(population.covariance().clone()).unwrap();
    let rank = population.mean().len();
    let row = |column: usize, sign: f64| {
        let step = |c: usize| sign * (rank as f64).sqrt() * l.l()[(c, column)];
        let shifted = population.mean().iter().enumerate();
        TaskRow::in_span(
            shifted
                .map(|(c, mean)| mean + if c >= column { step(c) } else { 0.0 })
                .collect(),
        )
    };
    (0..rank)
        .flat_map(|column| [row(column, 1.0), row(column, -1.0)])
        .collect()
}

#[test]
fn moments_of_a_drawn_row_are_those_of_the_mixture_over_rows() {
    let posterior = dense(&four_tasks_of_rank_two(1, 10));
    let (x, torques) = new_samples(4);
    let latent = LatentFunctions::new(&posterior, x.as_ref()).unwrap();
    let population = RowPopulation::of(&posterior.covariance().task().rows()).unwrap();
    // The mean is linear and the covariance quadratic in λ: six sigma points integrate both exactly.
    let rows = sigma_rows(&population);
    let weight = 1.0 / rows.len() as f64;
    let means: Vec<Vec<f64>> = rows
        .iter()
        .map(|row| latent.mean_of(&row.entries))
        .collect();
    let mean = latent.mean_of(population.mean());
    let mut covariance = Mat::zeros(4, 4);
    for (row, of_row) in rows.iter().zip(&means) {
        covariance += faer::Scale(weight) * latent.covariance_of(row);
        covariance += Mat::from_fn(4, 4, |a, b| {
            weight * (of_row[a] - mean[a]) * (of_row[b] - mean[b])
        });
    }
    let total = latent.noise_std().hypot(NOISE);
    let expected = PredictiveDensity::new(mean, covariance, total).unwrap();
    let density = population.density(&latent, NOISE).unwrap();
    let value = |density: &PredictiveDensity| density.log_density(&torques).unwrap();
    assert_close("log density", value(&density).0, value(&expected).0);
    assert_close("squares", value(&density).1, value(&expected).1);
}

/// log p(D* | D, λ) + log N(λ; λ̄, V), by definition, without constants.
fn penalised(joints: &[NewTorques<'_>], population: &RowPopulation, row: &TaskRow) -> f64 {
    let entries = &row.entries;
    let v = linalg::Factor::new(population.covariance().clone()).unwrap();
    let deviation: Vec<f64> = (entries.iter().zip(population.mean()))
        .map(|(entry, mean)| entry - mean)
        .collect();
    let squares = v.quadratic_form_and_solve(&deviation).0;
    log_density_of_row(joints, row).unwrap() - 0.5 * squares
}

#[test]
fn a_row_from_the_population_is_the_top_of_density_times_prior() {
    let posterior = dense(&four_tasks_of_rank_two(1, 10));
    let known = posterior.covariance().task().rows();
    let population = RowPopulation::of(&known).unwrap();
    for k in [1, 4, 12] {
        let (x, torques) = new_samples(k);
        let latent = LatentFunctions::new(&posterior, x.as_ref()).unwrap();
        let joints = [NewTorques {
            latent: &latent,
            torques: &torques,
        }];
        for border in [Border::InSpan, Border::WithOwnVariance] {
            let fit = fit_row_from_population(&joints, &known, border, 2, &options()).unwrap();
            assert!((fit.row.own_std > 0.0) <= (border == Border::WithOwnVariance));
            assert_close(
                "density of the torques alone",
                fit.log_density,
                log_density_of_row(&joints, &fit.row).unwrap(),
            );
            is_top(&joints, &population, &fit.row, border);
            // Without the prior the torques alone are more probable, or as much.
            let free = fit_row(&joints, &known, border, 2, &options()).unwrap();
            assert!(free.log_density >= fit.log_density - 1e-9, "{k}");
        }
    }
}

/// Fails if a step in any direction that is free leads higher.
fn is_top(joints: &[NewTorques<'_>], population: &RowPopulation, row: &TaskRow, border: Border) {
    let top = penalised(joints, population, row);
    let n_free = row.entries.len() + usize::from(border == Border::WithOwnVariance);
    for c in 0..n_free {
        for step in [1e-3, -1e-3] {
            let mut other = row.clone();
            match other.entries.get_mut(c) {
                Some(entry) => *entry += step,
                None => other.own_std += step,
            }
            let there = penalised(joints, population, &other);
            assert!(there <= top, "{border:?}, {c}: {there} {top}");
        }
    }
}
