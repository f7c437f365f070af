//! Eqs. (23)–(26): likelihood, derivative and maximum over K^ρ of a complete block without noise.

use faer::{Mat, mat};
use gp_core::GpError;
use kernels::{Constant, Covariance, TorqueCovariance, TorqueParams};
use mtgp::MtgpError;
use mtgp::block::NoiseFreeBlock;

use crate::textbook::{assert_close, cholesky, complete_case, entries, random};

const N_INPUTS: usize = 10;
const N_TASKS: usize = 3;

/// θ^x with a Gram matrix that is well conditioned without noise.
const THETA: [f64; 9] = [0.3, 0.2, 0.3, 0.4, 1.0, 0.5, 0.6, 0.7, 0.3];

fn covariance(theta: &[f64]) -> TorqueCovariance {
    TorqueCovariance::new(TorqueParams {
        bias_std: theta[0],
        linear_std: theta[1..4].to_vec(),
        signal_std: theta[4],
        length_scales: theta[5..8].to_vec(),
        coulomb_std: Some(vec![theta[8]]),
    })
    .unwrap()
}

fn block(theta: &[f64], targets: &Mat<f64>) -> NoiseFreeBlock<TorqueCovariance> {
    let x = random(targets.nrows(), 3, 22);
    NoiseFreeBlock::new(covariance(theta), x.as_ref(), targets.as_ref()).unwrap()
}

fn targets() -> Mat<f64> {
    random(N_INPUTS, N_TASKS, 23)
}

fn some_k_task() -> Mat<f64> {
    let lambda = random(N_TASKS, N_TASKS, 21);
    &lambda * lambda.transpose() + 0.2 * Mat::<f64>::identity(N_TASKS, N_TASKS)
}

/// Third derivatives of the likelihoods here, per unit of a parameter cubed: an order of magnitude.
const THIRD: f64 = 1e4;

/// Fails unless a slope is that of central differences.
fn assert_slope(what: &str, slope: f64, value: impl Fn(f64) -> f64) {
    let step = 1e-5;
    let difference = (value(step) - value(-step)) / (2.0 * step);
    // Values near 1e2 rounded to 1e-13.
    let tolerance = 1e-12 / step + THIRD * step * step;
    let error = (slope - difference).abs();
    assert!(error <= tolerance, "{what}: {slope} {difference} {error:e}");
}

#[test]
fn likelihood_is_that_of_the_whole_matrix() {
    let (k_task, targets, x) = (some_k_task(), targets(), random(N_INPUTS, 3, 22));
    let value = block(&THETA, &targets).log_marginal_likelihood(k_task.as_ref());
    let case = complete_case(covariance(&THETA), &k_task, &[0.0; N_TASKS], &x, &targets);
    assert_close(
        "eq. (23)",
        &[value.unwrap()],
        &[case.likelihood().value],
        1e-10,
    );
}

#[test]
fn derivative_by_k_task_is_that_of_central_differences() {
    let (k_task, block) = (some_k_task(), block(&THETA, &targets()));
    let gradient = block.k_task_gradient(k_task.as_ref()).unwrap();
    for row in 0..N_TASKS {
        for col in 0..=row {
            let at = |shift: f64| {
                let mut moved = k_task.clone();
                moved[(row, col)] += shift;
                if row != col {
                    moved[(col, row)] += shift;
                }
                block.log_marginal_likelihood(moved.as_ref()).unwrap()
            };
            let entries = if row == col { 1.0 } else { 2.0 };
            assert_slope("eq. (24)", entries * gradient[(row, col)], at);
        }
    }
}

#[test]
fn k_task_in_closed_form_is_the_stationary_point_and_the_maximum() {
    let block = block(&THETA, &targets());
    let best = block.k_task();
    let size = block
        .k_task_gradient(some_k_task().as_ref())
        .unwrap()
        .norm_max();
    let slope = block.k_task_gradient(best.as_ref()).unwrap().norm_max();
    assert!(slope <= 1e-12 * size, "{slope:e} {size:e}");

    let at_best = block.log_marginal_likelihood(best.as_ref()).unwrap();
    for seed in 0..20 {
        let lambda = random(N_TASKS, N_TASKS, 100 + seed);
        let moved = &best + 0.05 * (&lambda + lambda.transpose());
        let there = block.log_marginal_likelihood(moved.as_ref());
        assert!(there.is_err() || there.unwrap() < at_best, "seed {seed}");
    }
}

#[test]
fn profile_is_the_likelihood_at_the_maximum_and_half_of_eq_18s_objective() {
    let targets = targets();
    let block = block(&THETA, &targets);
    let profile = block.profile_log_marginal_likelihood().unwrap();
    let full = block
        .log_marginal_likelihood(block.k_task().as_ref())
        .unwrap();
    assert_close("eq. (26)", &[profile], &[full], 1e-12);

    // −m log|K^x| − ν log|Tᵀ(K^x)⁻¹T|, worked here by substitution.
    let k_x = covariance(&THETA).gram(random(N_INPUTS, 3, 22).as_ref());
    let log_det = |k: &Mat<f64>| -> f64 {
        let l = cholesky(k);
        (0..k.nrows()).map(|i| 2.0 * l[(i, i)].ln()).sum()
    };
    let (m, n) = (N_TASKS as f64, N_INPUTS as f64);
    let gram = n * block.k_task();
    let objective = -m * log_det(&k_x) - n * log_det(&gram);
    let constant = m * n * (n.ln() - 1.0 - (2.0 * std::f64::consts::PI).ln());
    assert_close("eq. (18)", &[2.0 * profile], &[objective + constant], 1e-12);
}

#[test]
fn profile_gradient_is_that_of_central_differences() {
    let targets = targets();
    let gradient = block(&THETA, &targets).profile_gradient().unwrap();
    for (idx, slope) in gradient.iter().enumerate() {
        let at = |shift: f64| {
            let mut theta = THETA;
            theta[idx] += shift;
            block(&theta, &targets)
                .profile_log_marginal_likelihood()
                .unwrap()
        };
        assert_slope(&format!("theta[{idx}]"), *slope, at);
    }
}

#[test]
fn scale_of_the_input_covariance_does_not_matter() {
    let targets = targets();
    let scaled = THETA.iter().enumerate().map(|(idx, value)| match idx {
        5..8 => *value, // length scales
        _ => 3.0 * value,
    });
    let scaled = block(&scaled.collect::<Vec<_>>(), &targets);
    let block = block(&THETA, &targets);
    let (a, b) = (
        scaled.profile_log_marginal_likelihood().unwrap(),
        block.profile_log_marginal_likelihood().unwrap(),
    );
    assert_close("value", &[a], &[b], 1e-11);
    let ninth = entries(&scaled.k_task())
        .iter()
        .map(|v| 9.0 * v)
        .collect::<Vec<_>>();
    assert_close("k_task", &ninth, &entries(&block.k_task()), 1e-11);
}

#[test]
fn one_input_by_hand() {
    // K^x = 4, T = (6): G = 9, K^ρ = 9, L = −½(log 9 + log 4 + 1 + log 2π).
    let (x, t) = (mat![[0.0]], mat![[6.0]]);
    let block = NoiseFreeBlock::new(Constant::new(2.0).unwrap(), x.as_ref(), t.as_ref()).unwrap();
    assert_close(
        "k_task",
        &entries(&block.k_task()),
        &[9.0],
        4.0 * f64::EPSILON,
    );
    let by_hand = -0.5 * (36.0_f64.ln() + 1.0 + (2.0 * std::f64::consts::PI).ln());
    let value = block.profile_log_marginal_likelihood().unwrap();
    assert_close("value", &[value], &[by_hand], 8.0 * f64::EPSILON);
}

#[test]
fn dependent_contexts_are_refused_with_their_rank() {
    let few = random(2, N_TASKS, 23);
    let mut dependent = targets();
    for j in 0..N_INPUTS {
        dependent[(j, 2)] = 0.3 * dependent[(j, 0)] - 1.7 * dependent[(j, 1)];
    }
    for targets in [few, dependent] {
        let error = MtgpError::DependentContexts {
            rank: 2,
            n_tasks: 3,
        };
        let block = block(&THETA, &targets);
        assert_eq!(block.profile_log_marginal_likelihood(), Err(error.clone()));
        assert_eq!(block.profile_gradient(), Err(error));
        assert_eq!(rank(&block.k_task()), 2);
    }
}

#[test]
fn contexts_of_very_different_size_are_not_dependent() {
    let mut targets = targets();
    for j in 0..N_INPUTS {
        targets[(j, 1)] *= 1e-9;
    }
    assert!(
        block(&THETA, &targets)
            .profile_log_marginal_likelihood()
            .is_ok()
    );
}

#[test]
fn equal_inputs_without_noise_are_refused() {
    let (x, t) = (Mat::zeros(2, 3), random(2, 1, 23));
    let error = NoiseFreeBlock::new(covariance(&THETA), x.as_ref(), t.as_ref());
    assert!(matches!(
        error,
        Err(MtgpError::Gp(GpError::NotPositiveDefinite {
            pivot: 1,
            order: 2
        }))
    ));
}

/// Singular values above a gap of 10⁶.
fn rank(matrix: &Mat<f64>) -> usize {
    let values = matrix.singular_values().unwrap();
    values
        .iter()
        .filter(|value| **value > 1e-9 * values[0])
        .count()
}

#[test]
fn all_joints_have_task_matrices_of_the_rank_of_the_parameters() {
    // Sec. 4.3.2: τ_i^γ = z_iᵀ A_i π^γ with A_i square and of full rank. Six contexts whose
    // parameters span s dimensions; eq. (25) gives each joint's K^ρ.
    let (n_parameters, n_tasks) = (11, 6);
    for s in 1..=4 {
        let parameters = random(n_parameters, s, 31) * random(s, n_tasks, 32); // Π
        assert_eq!(rank(&parameters), s);
        for joint in 0..3 {
            let a = random(n_parameters, n_parameters, 40 + joint);
            let z = random(20, n_parameters, 50 + joint); // z_i at twenty inputs
            let k_task = block(&THETA, &(z * a * &parameters)).k_task();
            assert_eq!(rank(&k_task), s, "joint {joint}");
        }
    }
}
