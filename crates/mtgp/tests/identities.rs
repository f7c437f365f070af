//! Special cases of eq. (16) that single-task regression knows the answer to.

use faer::Mat;
use gp_core::evidence::log_marginal_likelihood_with_gradient;
use gp_core::{Posterior, log_marginal_likelihood};
use kernels::{Covariance, TorqueCovariance};
use mtgp::prior::TaskMatrix;
use mtgp::{MultiTaskCovariance, Stacked, TaskCovariance, TaskFactor, with_task};

use crate::fixture::{Case, D, M, case};

/// Value and gradient of a prior on the data of a case.
fn of(case: &Case, input: &TorqueCovariance, task: TaskCovariance) -> (f64, Vec<f64>) {
    let data = case.stacked();
    let targets = data.stack(&case.torques);
    let prior = MultiTaskCovariance::new(input.clone(), task);
    log_marginal_likelihood_with_gradient(&prior, case.noise_std[0], data.inputs(), &targets)
        .unwrap()
}

/// Inputs and torques of one context.
fn samples_of(case: &Case, task: usize) -> (Mat<f64>, Vec<f64>) {
    let rows: Vec<usize> = (0..case.tasks.len())
        .filter(|&row| case.tasks[row] == task)
        .collect();
    let x = Mat::from_fn(rows.len(), D, |row, col| case.x[(rows[row], col)]);
    (x, rows.iter().map(|&row| case.torques[row]).collect())
}

/// Rounding of likelihoods near 1e2 by n ε κ(K) with n = 24 and κ near 1e5: far below 1e-9.
fn assert_close(name: &str, a: f64, b: f64) {
    let error = (a - b).abs() / b.abs().max(1.0);
    assert!(error <= 1e-10, "{name}: {a} {b} {error:e}");
}

#[test]
fn identity_task_matrix_is_the_sum_of_independent_processes() {
    let case = case("five");
    let input = case.covariance.input();
    let (value, gradient) = of(&case, input, TaskCovariance::Identity { n_tasks: M });

    let mut sum = 0.0;
    let mut gradient_sum = vec![0.0; input.n_params() + 1];
    for task in 0..M {
        let (x, torques) = samples_of(&case, task);
        let noise_std = case.noise_std[0];
        let (one, slopes) =
            log_marginal_likelihood_with_gradient(input, noise_std, x.as_ref(), &torques).unwrap();
        sum += one;
        for (total, slope) in gradient_sum.iter_mut().zip(slopes) {
            *total += slope;
        }
    }
    assert_close("value", value, sum);
    assert_eq!(gradient.len(), gradient_sum.len());
    for (idx, (a, b)) in gradient.iter().zip(&gradient_sum).enumerate() {
        assert_close(&format!("gradient {idx}"), *a, *b);
    }
}

#[test]
fn all_ones_task_matrix_is_one_process_on_the_pooled_data() {
    let case = case("five");
    let input = case.covariance.input();
    let (value, gradient) = of(&case, input, TaskCovariance::Ones { n_tasks: M });
    let x = case.x.as_ref();
    let (pooled, slopes) =
        log_marginal_likelihood_with_gradient(input, case.noise_std[0], x, &case.torques).unwrap();
    assert_close("value", value, pooled);
    for (idx, (a, b)) in gradient.iter().zip(&slopes).enumerate() {
        assert_close(&format!("gradient {idx}"), *a, *b);
    }

    // A factor of one column of ones is the same prior, with slopes of its own as well.
    let ones = TaskFactor::from_entries(M, 1, &[1.0; M]).unwrap();
    let (value, gradient) = of(&case, input, TaskCovariance::Factor(ones));
    assert_close("factor", value, pooled);
    for idx in 0..input.n_params() {
        assert_close(&format!("factor {idx}"), gradient[idx], slopes[idx]);
    }
}

#[test]
fn one_task_of_unit_variance_is_ordinary_regression() {
    let five = case("five");
    let (x, torques) = samples_of(&five, 3);
    let (input, noise_std) = (five.covariance.input(), five.noise_std[0]);
    let data = Stacked::new(x.as_ref(), &vec![0; torques.len()], 1).unwrap();
    let one = TaskCovariance::Factor(TaskFactor::from_entries(1, 1, &[1.0]).unwrap());
    let prior = MultiTaskCovariance::new(input.clone(), one);
    let found =
        log_marginal_likelihood_with_gradient(&prior, noise_std, data.inputs(), &torques).unwrap();
    let alone =
        log_marginal_likelihood_with_gradient(input, noise_std, x.as_ref(), &torques).unwrap();
    assert_close("value", found.0, alone.0);
    let n_input = input.n_params();
    for idx in 0..n_input {
        assert_close(&format!("gradient {idx}"), found.1[idx], alone.1[idx]);
    }
    assert_close("noise", found.1[n_input + 1], alone.1[n_input]);

    let points = five.x.as_ref();
    let ours = Posterior::dense(prior, noise_std, data.inputs(), &torques).unwrap();
    let theirs = Posterior::dense(input.clone(), noise_std, x.as_ref(), &torques).unwrap();
    let ours = ours.predict(with_task(points, 0).as_ref()).unwrap();
    let theirs = theirs.predict(points).unwrap();
    for idx in 0..points.nrows() {
        assert_close("mean", ours.mean[idx], theirs.mean[idx]);
        assert_close("var", ours.var[idx], theirs.var[idx]);
    }
}

/// Every amplitude of c^x times `factor`, so that c^x is multiplied by its square.
fn louder(input: &TorqueCovariance, factor: f64) -> TorqueCovariance {
    let layout = input.layout();
    let mut theta = input.params();
    for (value, spec) in theta.iter_mut().zip(layout.specs()) {
        if spec.name != "length_scales" {
            *value *= factor;
        }
    }
    let mut scaled = input.clone();
    scaled.set_params(&theta);
    scaled
}

#[test]
fn scale_may_move_between_the_two_covariances() {
    let case = case("five");
    let input = case.covariance.input();
    let factor = |scale: f64| {
        let entries = case.covariance.task().params();
        let entries: Vec<f64> = entries.iter().map(|entry| scale * entry).collect();
        TaskCovariance::Factor(TaskFactor::from_entries(M, 3, &entries).unwrap())
    };
    let (value, gradient) = of(&case, input, factor(1.0));
    for scale in [0.03, 2.5, 40.0] {
        let (moved, slopes) = of(&case, &louder(input, 1.0 / scale), factor(scale));
        assert_close(&format!("{scale}"), moved, value);
        let last = gradient.len() - 1;
        assert_close(&format!("{scale} noise"), slopes[last], gradient[last]);
    }
    // The same as a statement about slopes: along the common scale the likelihood is flat.
    let (theta, layout) = (case.covariance.params(), case.covariance.layout());
    let along = |is_kind: &dyn Fn(&str) -> bool| -> f64 {
        let specs = layout.specs().iter().zip(&theta).zip(&gradient);
        let of_kind = specs.filter(|((spec, _), _)| is_kind(spec.name));
        of_kind.map(|((_, value), slope)| value * slope).sum()
    };
    let of_task = along(&|name| name == "task_factor");
    let of_input = along(&|name| name != "task_factor" && name != "length_scales");
    assert_close("scale", of_task, of_input);
}

#[test]
fn sign_of_a_column_of_the_factor_changes_nothing() {
    let case = case("five");
    let lambda = match case.covariance.task() {
        TaskCovariance::Factor(factor) => factor.lambda().to_owned(),
        other => panic!("{other:?}"),
    };
    let flipped = Mat::from_fn(M, 3, |row, col| {
        if col == 1 {
            -lambda[(row, col)]
        } else {
            lambda[(row, col)]
        }
    });
    let flipped = TaskCovariance::Factor(TaskFactor::new(flipped).unwrap());
    let (value, _) = of(&case, case.covariance.input(), flipped);
    assert_close("value", value, case.expected[0].value);
}

#[test]
fn order_of_the_samples_does_not_matter() {
    let case = case("five");
    let given = Mat::from_fn(case.tasks.len(), D + 1, |row, col| {
        if col == D {
            case.tasks[row] as f64
        } else {
            case.x[(row, col)]
        }
    });
    let (prior, noise_std) = (&case.covariance, case.noise_std[0]);
    let value = log_marginal_likelihood(prior, noise_std, given.as_ref(), &case.torques).unwrap();
    assert_close("value", value, case.expected[0].value);
}
