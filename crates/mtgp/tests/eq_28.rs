//! Eq. (28): the task matrix to start from, against the textbook formula.

use faer::linalg::solvers::Solve;
use faer::{Mat, MatRef};
use gp_core::LikelihoodOptions;
use kernels::Covariance;
use mtgp::fit::{augmented_k_task, augmented_targets};
use mtgp::{MultiTaskOptions, Stacked, StageOne, TaskFit, fit_pooled};

use crate::icm_draws::four_tasks_of_rank_two;

/// Three tasks that share some of their inputs; one sample is repeated.
fn shared_inputs() -> (Stacked, Vec<f64>) {
    let draw = four_tasks_of_rank_two(3, 5);
    let places = [0, 3, 7, 3, 9, 0, 5, 3, 3];
    let tasks = [0, 0, 0, 1, 1, 2, 2, 2, 2];
    let x = Mat::from_fn(9, 3, |row, col| draw.data.covariates()[(places[row], col)]);
    let targets = vec![1.5, -0.4, 0.9, -0.2, 0.3, 1.1, 0.8, -0.5, -0.7];
    (Stacked::new(x.as_ref(), &tasks, 3).unwrap(), targets)
}

fn start_only() -> MultiTaskOptions {
    MultiTaskOptions {
        max_evaluations: 3,
        ..MultiTaskOptions::chapter()
    }
}

/// k*ᵀ (K + σ²I)⁻¹ t by a general linear solver.
fn mean_by_the_textbook(
    fit: &TaskFit,
    data: &Stacked,
    targets: &[f64],
    x: MatRef<'_, f64>,
) -> Vec<f64> {
    let input = fit.covariance().input();
    let mut k = input.gram(data.covariates());
    for idx in 0..k.nrows() {
        k[(idx, idx)] += fit.noise_std().powi(2);
    }
    let t = Mat::from_fn(targets.len(), 1, |row, _| targets[row]);
    let alpha = k.partial_piv_lu().solve(&t);
    let means = input.cross(x, data.covariates()) * alpha;
    means.col_as_slice(0).to_vec()
}

#[test]
fn torques_are_those_observed_and_else_the_mean_of_the_pooled_model() {
    let (data, targets) = shared_inputs();
    let model = fit_pooled(&data, &targets, &start_only()).unwrap();
    let augmented = augmented_targets(&data, &targets, &model).unwrap();

    // Distinct inputs in the order of their first row: places 0, 3, 7, 9, 5.
    assert_eq!(augmented.x.nrows(), 5);
    let means = mean_by_the_textbook(&model, &data, &targets, augmented.x.as_ref());
    let observed = [
        [Some(1.5), Some(-0.4), Some(0.9), None, None],
        [None, Some(-0.2), None, Some(0.3), None],
        [Some(1.1), Some((-0.5 - 0.7) / 2.0), None, None, Some(0.8)],
    ];
    for (task, column) in observed.iter().enumerate() {
        for (input, value) in column.iter().enumerate() {
            let expected = value.unwrap_or(means[input]);
            let found = augmented.t_aug[(input, task)];
            // Two solvers of a system whose condition is below 10⁵.
            assert!(
                (found - expected).abs() <= 1e-10,
                "{task} {input} {found} {expected}"
            );
        }
    }
}

/// T'(K + η²I)⁻¹T / ν by a general linear solver.
fn k_aug_by_the_textbook(k_x: &Mat<f64>, t_aug: &Mat<f64>) -> Mat<f64> {
    let (n_inputs, n_tasks) = (t_aug.nrows(), t_aug.ncols());
    let trace: f64 = (0..n_tasks)
        .map(|task| t_aug.col(task).squared_norm_l2())
        .sum();
    let eta_var = trace / (n_tasks * n_inputs) as f64;
    let mut k = k_x.clone();
    for idx in 0..n_inputs {
        k[(idx, idx)] += eta_var;
    }
    t_aug.transpose() * k.partial_piv_lu().solve(t_aug) / n_inputs as f64
}

#[test]
fn task_matrix_is_that_of_the_textbook_formula() {
    let draw = four_tasks_of_rank_two(5, 40);
    let model = fit_pooled(&draw.data, &draw.targets, &start_only()).unwrap();
    let augmented = augmented_targets(&draw.data, &draw.targets, &model).unwrap();
    assert_eq!((augmented.t_aug.nrows(), augmented.t_aug.ncols()), (160, 4));

    let input = model.covariance().input();
    let expected = k_aug_by_the_textbook(&input.gram(augmented.x.as_ref()), &augmented.t_aug);
    let cases = [
        // ν ε times a condition below 10³.
        (LikelihoodOptions::dense(), 1e-10),
        // Twice the nats of the certificate over ν; see the proof of the bound.
        (LikelihoodOptions::automatic(), 2.0 * 1e-4 / 160.0),
    ];
    for (options, tolerance) in cases {
        let k_aug = augmented_k_task(input, &augmented, options).unwrap();
        let error = (&k_aug - &expected).norm_max();
        assert!(error <= tolerance, "{options:?} {error:e} {tolerance:e}");
    }
}

#[test]
fn trace_is_m_where_the_input_covariance_vanishes() {
    // The chapter's reason for η². u at its smallest, b, v and w nearly zero.
    let draw = four_tasks_of_rank_two(5, 10);
    let model = fit_pooled(&draw.data, &draw.targets, &start_only()).unwrap();
    let augmented = augmented_targets(&draw.data, &draw.targets, &model).unwrap();
    let mut nothing = model.covariance().input().clone();
    let tiny: Vec<f64> = nothing.params().iter().map(|_| 1e-9).collect();
    nothing.set_params(&tiny);
    let k_aug = augmented_k_task(&nothing, &augmented, LikelihoodOptions::dense()).unwrap();
    let trace: f64 = (0..4).map(|task| k_aug[(task, task)]).sum();
    assert!((trace - 4.0).abs() <= 1e-12, "{trace}");
}

#[test]
fn task_matrix_of_torques_that_are_all_zero_is_zero() {
    let (data, targets) = shared_inputs();
    let zeros = vec![0.0; targets.len()];
    let stage_one = StageOne::new(&data, &zeros, &start_only()).unwrap();
    assert!(stage_one.k_aug.norm_max() == 0.0);
}
