//! Eq. (17): a complete block by eigendecompositions is the same process as by the whole matrix.

use faer::{Mat, mat};
use gp_core::{Posterior, log_marginal_likelihood_with_gradient};
use kernels::{Constant, Covariance};
use mtgp::block::CompleteBlock;
use mtgp::{MtgpError, MultiTaskCovariance, TaskCovariance, TaskFactor, with_task};

use crate::textbook::{Case, assert_close, complete_case, entries, random, torque_covariance};

/// What a structured method must agree to, relative to the largest entry.
const AGREEMENT: f64 = 1e-8;

const N_INPUTS: usize = 9;
const NOISE_STD: [f64; 4] = [0.2, 0.15, 0.3, 0.25];

/// Four tasks at nine inputs with K^ρ of a given rank.
fn block(rank: usize, noise_std: &[f64; 4]) -> (CompleteBlock<impl Covariance + use<>>, Case) {
    let lambda = random(4, rank, 1);
    let k_task = &lambda * lambda.transpose();
    let (x, targets) = (random(N_INPUTS, 6, 2), random(N_INPUTS, 4, 3));
    let (covariance, k) = (torque_covariance(), k_task.as_ref());
    let block = CompleteBlock::new(
        covariance.clone(),
        k,
        noise_std,
        x.as_ref(),
        targets.as_ref(),
    );
    let case = complete_case(covariance, &k_task, noise_std, &x, &targets);
    assert!(case.rounding() <= 0.1 * AGREEMENT, "{:e}", case.rounding());
    (block.unwrap(), case)
}

#[test]
fn likelihood_and_gradient_of_a_complete_block_equal_the_dense_ones() {
    for rank in [1, 2, 4] {
        let (block, case) = block(rank, &NOISE_STD);
        let (gradient, expected) = (block.gradient(), case.likelihood());
        let value = block.log_marginal_likelihood().unwrap();
        assert_close("value", &[value], &[expected.value], AGREEMENT);
        assert_close("theta", &gradient.theta, &expected.theta, AGREEMENT);
        let (found, wanted) = (entries(&gradient.k_task), entries(&expected.k_task));
        assert_close("k_task", &found, &wanted, AGREEMENT);
        assert_close("noise", &gradient.noise_std, &expected.noise_std, AGREEMENT);
    }
}

#[test]
fn posterior_of_every_context_of_a_complete_block_equals_the_dense_one() {
    let x_test = random(7, 6, 4);
    for rank in [1, 2, 4] {
        let (block, case) = block(rank, &NOISE_STD);
        for task in 0..4 {
            let found = block.predict(task, x_test.as_ref()).unwrap();
            let (mean, var) = case.predict(task, x_test.as_ref());
            assert_close("mean", &found.mean, &mean, AGREEMENT);
            assert_close("var", &found.var, &var, AGREEMENT);
            assert_eq!(found.n_clamped, 0);
        }
    }
}

#[test]
fn derivative_by_a_factor_is_that_of_central_differences() {
    let (x, targets) = (random(N_INPUTS, 6, 2), random(N_INPUTS, 4, 3));
    let lambda = random(4, 2, 1);
    let at = |lambda: &Mat<f64>| {
        let k_task = lambda * lambda.transpose();
        let (k, x, t) = (k_task.as_ref(), x.as_ref(), targets.as_ref());
        CompleteBlock::new(torque_covariance(), k, &NOISE_STD, x, t).unwrap()
    };
    let gradient = at(&lambda).gradient().of_factor(lambda.as_ref());
    let step = 1e-5;
    for row in 0..4 {
        for col in 0..2 {
            let shifted = |shift: f64| {
                let mut moved = lambda.clone();
                moved[(row, col)] += shift;
                at(&moved).log_marginal_likelihood().unwrap()
            };
            let difference = (shifted(step) - shifted(-step)) / (2.0 * step);
            // Values near 1e2 rounded to 1e-13; third derivatives below 1e3.
            let tolerance = 1e-12 / step + 1e3 * step * step;
            let error = (gradient[(row, col)] - difference).abs();
            assert!(error <= tolerance, "{} {difference}", gradient[(row, col)]);
        }
    }
}

#[test]
fn one_observation_is_a_normal_density() {
    // K = 2·3 + 4 = 10, t = 5: −½·25/10 − ½ ln 10 − ½ ln 2π; ∂/∂K^ρ = ½(t²/K² − 1/K)·3.
    let (one, x) = (mat![[2.0]], mat![[0.0]]);
    let covariance = Constant::new(3.0_f64.sqrt()).unwrap();
    let t = mat![[5.0]];
    let block = CompleteBlock::new(covariance, one.as_ref(), &[2.0], x.as_ref(), t.as_ref());
    let block = block.unwrap();
    let by_hand = -1.25 - 0.5 * 10.0_f64.ln() - 0.5 * (2.0 * std::f64::consts::PI).ln();
    let value = block.log_marginal_likelihood().unwrap();
    assert_close("value", &[value], &[by_hand], 16.0 * f64::EPSILON);
    let slope = block.gradient().k_task[(0, 0)];
    assert_close("slope", &[slope], &[0.225], 16.0 * f64::EPSILON);
    let posterior = block.predict(0, x.as_ref()).unwrap();
    assert_close("mean", &posterior.mean, &[3.0], 16.0 * f64::EPSILON);
    assert_close("var", &posterior.var, &[6.0 - 3.6], 16.0 * f64::EPSILON);
}

#[test]
fn bad_data_is_named() {
    let (k_task, x) = (Mat::identity(1, 1), mat![[0.0]]);
    let at = |std: f64, target: f64| {
        let (covariance, target) = (Constant::new(1.0).unwrap(), mat![[target]]);
        CompleteBlock::new(
            covariance,
            k_task.as_ref(),
            &[std],
            x.as_ref(),
            target.as_ref(),
        )
        .map(|_| ())
        .unwrap_err()
        .to_string()
    };
    assert!(at(0.0, 1.0).contains("noise_std is 0"));
    assert!(at(1.0, f64::NAN).contains("target at row 0 is NaN"));

    let spoilt = mat![[f64::INFINITY]];
    let covariance = Constant::new(1.0).unwrap();
    let error = CompleteBlock::new(covariance, spoilt.as_ref(), &[1.0], x.as_ref(), x.as_ref());
    assert_eq!(
        error.map(|_| ()),
        Err(MtgpError::NoSpectrum {
            rows: 1,
            columns: 1
        })
    );
}

#[test]
fn complete_block_equals_the_prior_of_eq_16_in_the_dense_engine() {
    let (n_inputs, n_tasks, noise_std) = (40, 6, 0.3);
    let entries: Vec<f64> = random(TaskFactor::count(n_tasks, 3), 1, 5)
        .col_as_slice(0)
        .to_vec();
    let factor = TaskFactor::from_entries(n_tasks, 3, &entries).unwrap();
    let task = TaskCovariance::Factor(factor);
    let prior = MultiTaskCovariance::new(torque_covariance(), task.clone());
    let (x, targets) = (random(n_inputs, 6, 6), random(n_inputs, n_tasks, 7));
    let (k_task, noise) = (task.k_task(), vec![noise_std; n_tasks]);
    let (k, t) = (k_task.as_ref(), targets.as_ref());
    let block = CompleteBlock::new(torque_covariance(), k, &noise, x.as_ref(), t).unwrap();

    let case = complete_case(torque_covariance(), &k_task, &noise, &x, &targets);
    assert!(case.rounding() <= AGREEMENT, "{:e}", case.rounding());
    let rows = Mat::from_fn(case.x.nrows(), 7, |row, col| match col {
        6 => case.tasks[row] as f64,
        _ => case.x[(row, col)],
    });
    let (rows, t) = (rows.as_ref(), &case.targets);
    let (value, dense) = log_marginal_likelihood_with_gradient(&prior, noise_std, rows, t).unwrap();
    let found = block.log_marginal_likelihood().unwrap();
    assert_close("value", &[found], &[value], AGREEMENT);

    let gradient = block.gradient();
    let mut of_factor = vec![0.0; task.n_params()];
    task.add_adjoint(gradient.k_task.as_ref(), &mut of_factor);
    let (of_prior, of_noise) = dense.split_at(prior.n_params());
    let (of_theta, of_entries) = of_prior.split_at(gradient.theta.len());
    assert_close("theta", &gradient.theta, of_theta, AGREEMENT);
    assert_close("task_factor", &of_factor, of_entries, AGREEMENT);
    let shared: f64 = gradient.noise_std.iter().sum();
    assert_close("noise_std", &[shared], of_noise, AGREEMENT);

    let posterior = Posterior::new(prior, noise_std, rows, t).unwrap();
    let x_test = random(130, 6, 8); // more than one block of test points
    for task in 0..n_tasks {
        let found = block.predict(task, x_test.as_ref()).unwrap();
        let dense = posterior
            .predict(with_task(x_test.as_ref(), task).as_ref())
            .unwrap();
        assert_close("mean", &found.mean, &dense.mean, AGREEMENT);
        assert_close("var", &found.var, &dense.var, AGREEMENT);
    }
}
