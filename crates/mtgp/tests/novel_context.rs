//! A new context: its density and gradient, its row, and its posterior against full refits.

use faer::{Mat, MatRef};
use gp_core::optimize::MinimizeOptions;
use gp_core::{GpError, LikelihoodOptions, Method, Posterior, log_marginal_likelihood};
use mtgp::latent::LatentFunctions;
use mtgp::novel::{
    Border, NewTorques, fit_row, log_density_of_row, log_density_of_row_with_gradient,
    predict_mean_of_new_context,
};
use mtgp::prior::TaskRow;
use mtgp::{MtgpError, MultiTaskCovariance, TaskCovariance, TaskFactor, with_task};

use crate::eq_21::{assert_close, dense};
use crate::icm_draws::{Draw, drawn, four_tasks_of_rank_two};

const M: usize = 4;

fn options() -> MinimizeOptions {
    MinimizeOptions {
        gradient_tolerance: 1e-8,
        value_tolerance: 0.0,
        max_evaluations: 500,
        max_recoveries: 5,
    }
}

/// Seven states of a new context and its torques.
fn new_samples() -> (Mat<f64>, Vec<f64>) {
    let x = Mat::from_fn(7, 3, |row, col| {
        1.8 * (1.1 * row as f64 + 0.7 * col as f64).sin()
    });
    let torques = (0..7).map(|row| (0.9 * f64::from(row)).cos()).collect();
    (x, torques)
}

/// Λ grown by a row, and by a column if the row has a part of its own.
fn grown(prior: &MultiTaskCovariance, row: &TaskRow) -> MultiTaskCovariance {
    let known = prior.task().root();
    let (m, r) = (known.nrows(), known.ncols());
    let rank = if row.own_std == 0.0 { r } else { r + 1 };
    let lambda = Mat::from_fn(m + 1, rank, |task, c| match (task == m, c == r) {
        (false, false) => known[(task, c)],
        (false, true) => 0.0,
        (true, false) => row.entries[c],
        (true, true) => row.own_std,
    });
    let factor = TaskFactor::new(lambda).unwrap();
    MultiTaskCovariance::new(prior.input().clone(), TaskCovariance::Factor(factor))
}

/// D ∪ D* as rows (x, task) and targets.
fn joined(draw: &Draw, x: &Mat<f64>, torques: &[f64]) -> (Mat<f64>, Vec<f64>) {
    let new = with_task(x.as_ref(), M);
    let n = draw.targets.len();
    let rows = Mat::from_fn(n + x.nrows(), 4, |row, col| {
        if row < n {
            draw.data.inputs()[(row, col)]
        } else {
            new[(row - n, col)]
        }
    });
    (rows, [&draw.targets, torques].concat())
}

fn rows() -> [TaskRow; 2] {
    let entries = vec![-0.7, 1.3];
    [
        TaskRow::in_span(entries.clone()),
        TaskRow {
            entries,
            own_std: 0.6,
        },
    ]
}

#[test]
fn density_of_a_row_is_the_ratio_of_marginal_likelihoods() {
    let draw = four_tasks_of_rank_two(4, 10);
    let (x, torques) = new_samples();
    let latent = LatentFunctions::new(&dense(&draw), x.as_ref()).unwrap();
    let joint = NewTorques {
        latent: &latent,
        torques: &torques,
    };
    let (all, targets) = joined(&draw, &x, &torques);
    for row in rows() {
        let prior = grown(&draw.truth, &row);
        let value = |x, t: &[f64]| log_marginal_likelihood(&prior, 0.05, x, t).unwrap();
        let expected = value(all.as_ref(), &targets) - value(draw.data.inputs(), &draw.targets);
        let one = log_density_of_row(&[joint], &row).unwrap();
        assert_close("density", one, expected);
        let two = log_density_of_row(&[joint, joint], &row).unwrap();
        assert_eq!(two, 2.0 * one);
    }
}

#[test]
fn gradient_of_the_density_is_its_slope() {
    let draw = four_tasks_of_rank_two(4, 10);
    let (x, torques) = new_samples();
    let latent = LatentFunctions::new(&dense(&draw), x.as_ref()).unwrap();
    let joints = [NewTorques {
        latent: &latent,
        torques: &torques,
    }; 2];
    for row in rows() {
        let (value, gradient) = log_density_of_row_with_gradient(&joints, &row).unwrap();
        assert_close("value", value, log_density_of_row(&joints, &row).unwrap());
        for (place, slope) in gradient.iter().enumerate() {
            // Error of the central difference: h² f‴/6 and ε f/h, least near h = 1e-5.
            let step = 1e-5;
            let at = |sign: f64| {
                let mut moved = row.clone();
                match moved.entries.get_mut(place) {
                    Some(entry) => *entry += sign * step,
                    None => moved.own_std += sign * step,
                }
                log_density_of_row(&joints, &moved).unwrap()
            };
            let expected = (at(1.0) - at(-1.0)) / (2.0 * step);
            let error = (slope - expected).abs() / gradient.iter().fold(1.0, |a, g| g.abs().max(a));
            assert!(error <= 1e-6, "{place}: {slope} {expected}");
        }
    }
}

/// Means of the new context, whose row is given.
fn means(
    posterior: &Posterior<MultiTaskCovariance>,
    row: &TaskRow,
    x: MatRef<'_, f64>,
    torques: &[f64],
    test: MatRef<'_, f64>,
) -> Result<Vec<f64>, MtgpError> {
    let latent = &LatentFunctions::new(posterior, x)?;
    let new = NewTorques { latent, torques };
    predict_mean_of_new_context(posterior, row, x, new, test)
}

#[test]
fn means_of_a_new_context_are_those_of_a_full_refit() {
    let draw = four_tasks_of_rank_two(6, 10);
    let (x, torques) = new_samples();
    let (all, targets) = joined(&draw, &x, &torques);
    let elsewhere = Mat::from_fn(140, 3, |row, col| {
        1.9 * (0.4 * row as f64 + 1.9 * col as f64).cos()
    });
    for row in rows() {
        let prior = grown(&draw.truth, &row);
        let refit = Posterior::dense(prior, 0.05, all.as_ref(), &targets).unwrap();
        let points = with_task(elsewhere.as_ref(), M);
        let expected = refit.predict_mean(points.as_ref()).unwrap();
        let posterior = dense(&draw);
        let found = means(&posterior, &row, x.as_ref(), &torques, elsewhere.as_ref()).unwrap();
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            assert_close("mean", *found, *expected);
        }
    }
}

#[test]
fn a_posterior_with_further_samples_is_a_full_refit_and_the_adapted_one() {
    let draw = four_tasks_of_rank_two(6, 40);
    let (x, torques) = new_samples();
    let (all, targets) = joined(&draw, &x, &torques);
    let new = with_task(x.as_ref(), M);
    let elsewhere = Mat::from_fn(140, 3, |row, col| {
        1.9 * (0.4 * row as f64 + 1.9 * col as f64).cos()
    });
    let options = LikelihoodOptions {
        method: Method::Certified,
        certificate: 1e-9,
    };
    let inputs = draw.data.inputs();
    let (truth, old) = (draw.truth.clone(), &draw.targets);
    let few = Posterior::new(truth, draw.noise_std, inputs, old, options).unwrap();
    assert!(few.basis().is_on_pivots());
    let row = &rows()[0];
    let prior = grown(&draw.truth, row);
    let refit = Posterior::dense(prior.clone(), 0.05, all.as_ref(), &targets).unwrap();
    for posterior in [dense(&draw), few] {
        let of_row = means(&posterior, row, x.as_ref(), &torques, elsewhere.as_ref()).unwrap();
        let with_row = posterior.with_covariance(prior.clone());
        let found = with_row.with_samples(new.as_ref(), &torques).unwrap();
        // The pivots leave out what their certificate allows.
        let is_dense = !found.basis().is_on_pivots();
        let tolerance = if is_dense { 1e-8 } else { 1e-4 };
        for context in 0..=M {
            let points = with_task(elsewhere.as_ref(), context);
            let found = found.predict(points.as_ref()).unwrap();
            let expected = refit.predict(points.as_ref()).unwrap();
            for (idx, of_row) in of_row.iter().enumerate() {
                let errors = [
                    found.mean[idx] - expected.mean[idx],
                    found.var[idx] - expected.var[idx],
                ];
                assert!(
                    errors.iter().all(|error| error.abs() <= tolerance),
                    "{is_dense} {context} {errors:?}"
                );
                let error = found.mean[idx] - of_row;
                assert!(context < M || error.abs() <= 1e-8, "{is_dense} {error}");
            }
        }
    }
}

#[test]
fn a_few_pivots_adapt_as_the_dense_path_does() {
    let draw = four_tasks_of_rank_two(6, 40);
    let options = LikelihoodOptions {
        method: Method::Certified,
        certificate: 1e-9,
    };
    let (truth, inputs) = (draw.truth.clone(), draw.data.inputs());
    let few = Posterior::new(truth, draw.noise_std, inputs, &draw.targets, options).unwrap();
    let (x, torques) = new_samples();
    for row in rows() {
        let of = |posterior| {
            let test = draw.data.covariates();
            means(posterior, &row, x.as_ref(), &torques, test).unwrap()
        };
        for (few, all) in of(&few).iter().zip(of(&dense(&draw))) {
            assert!((few - all).abs() <= 1e-4, "mean: {few} {all}");
        }
    }
}

/// Torques of five contexts, the last of which is new, at noise that tells the row.
fn five_contexts() -> (Draw, Mat<f64>, Vec<f64>, Vec<f64>) {
    let entries = [1.0, 0.8, 0.7, -0.6, 0.9, 1.1, -0.5, -0.4, 1.4];
    let factor = TaskFactor::from_entries(M + 1, 2, &entries).unwrap();
    let known = TaskFactor::from_entries(M, 2, &entries[..7]).unwrap();
    let input = four_tasks_of_rank_two(1, 1).truth.input().clone();
    let truth = MultiTaskCovariance::new(input.clone(), TaskCovariance::Factor(factor));
    let (data, targets) = drawn(&truth, 0.01, 21, 40);
    let n_old = 40 * M;
    let x_old = data.covariates().subrows(0, n_old);
    let old = mtgp::Stacked::new(x_old, &data.tasks()[..n_old], M).unwrap();
    let draw = Draw {
        data: old,
        targets: targets[..n_old].to_vec(),
        truth: MultiTaskCovariance::new(input, TaskCovariance::Factor(known)),
        noise_std: 0.01,
    };
    let x = data.covariates().subrows(n_old, 40).to_owned();
    (draw, x, targets[n_old..].to_vec(), vec![-0.4, 1.4])
}

#[test]
fn the_row_of_a_new_context_is_found() {
    let (draw, x, torques, truth) = five_contexts();
    let latent = LatentFunctions::new(&dense(&draw), x.as_ref()).unwrap();
    let joints = [NewTorques {
        latent: &latent,
        torques: &torques,
    }];
    let known = draw.truth.task().rows();
    let fit = fit_row(&joints, &known, Border::InSpan, 2, &options()).unwrap();
    for (found, truth) in fit.row.entries.iter().zip(&truth) {
        assert!((found - truth).abs() <= 0.05, "{:?} {truth}", fit.row);
    }
    assert_eq!((fit.row.own_std, fit.n_starts), (0.0, 3));
    let at_truth = log_density_of_row(&joints, &TaskRow::in_span(truth)).unwrap();
    assert!(fit.log_density >= at_truth, "{fit:?} {at_truth}");
    let (_, gradient) = log_density_of_row_with_gradient(&joints, &fit.row).unwrap();
    assert!(
        gradient[..2].iter().all(|slope| slope.abs() <= 1e-2),
        "{gradient:?}"
    );

    // A variance of its own can only raise the maximum, and is not asked for here.
    let free = fit_row(&joints, &known, Border::WithOwnVariance, 2, &options()).unwrap();
    assert!(
        free.log_density >= fit.log_density - 1e-6,
        "{free:?} {fit:?}"
    );
    assert!(free.row.own_std <= 0.1, "{free:?}");
}

#[test]
fn a_row_from_one_sample_is_defined() {
    let (draw, x, torques, _) = five_contexts();
    let latent = LatentFunctions::new(&dense(&draw), x.subrows(0, 1)).unwrap();
    let joints = [NewTorques {
        latent: &latent,
        torques: &torques[..1],
    }];
    let known = draw.truth.task().rows();
    for border in [Border::InSpan, Border::WithOwnVariance] {
        let fit = fit_row(&joints, &known, border, 1, &options()).unwrap();
        assert!(fit.log_density.is_finite(), "{fit:?}");
    }
}

#[test]
fn rows_and_torques_that_do_not_fit_are_refused() {
    let draw = four_tasks_of_rank_two(4, 5);
    let (x, mut torques) = new_samples();
    let latent = LatentFunctions::new(&dense(&draw), x.as_ref()).unwrap();
    let known = draw.truth.task().rows();
    let refused = |torques: &[f64], row: TaskRow| {
        let joint = NewTorques {
            latent: &latent,
            torques,
        };
        log_density_of_row_with_gradient(&[joint], &row).unwrap_err()
    };
    let short = refused(&torques, TaskRow::in_span(vec![1.0]));
    assert_eq!(short.to_string(), "1 entries of a task's row, expected 2");
    let nan = refused(&torques, TaskRow::in_span(vec![1.0, f64::NAN]));
    assert!(
        matches!(nan, MtgpError::NonFinite { column: 1, .. }),
        "{nan}"
    );
    let row = || TaskRow::in_span(vec![1.0, 0.5]);
    let few = refused(&torques[1..], row());
    assert_eq!(few.to_string(), "6 new torques of a joint, expected 7");
    torques[3] = f64::INFINITY;
    let infinite = refused(&torques, row());
    assert!(matches!(
        infinite,
        MtgpError::Gp(GpError::NonFiniteTarget { row: 3, .. })
    ));
    let joint = NewTorques {
        latent: &latent,
        torques: &torques,
    };
    assert!(fit_row(&[joint], &known, Border::InSpan, 1, &options()).is_err());
    let none = fit_row(&[], &known, Border::InSpan, 1, &options()).unwrap_err();
    assert_eq!(none, MtgpError::NoJoints);

    torques[3] = 0.0;
    let posterior = dense(&draw);
    let narrow: Mat<f64> = Mat::zeros(2, 2);
    assert!(means(&posterior, &row(), x.as_ref(), &torques, narrow.as_ref()).is_err());
}
