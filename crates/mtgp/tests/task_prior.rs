//! Sec. 5: priors of K^ρ, and the block that is averaged over it, against integration by sums at m = 2.

use faer::{Mat, mat};
use gp_core::{FitOptions, Likelihood, LikelihoodOptions, LogMarginal, Start, search};
use kernels::{Covariance, TorqueCovariance, TorqueParams};
use mtgp::{
    IntegratedBlock, MtgpError, MultiTaskCovariance, NoiseFreeBlock, Stacked, TaskCovariance,
    TaskFactor, TaskMeasure, TaskPrior, WithTaskPrior,
};

use crate::textbook::random;

fn covariance() -> TorqueCovariance {
    TorqueCovariance::new(TorqueParams {
        bias_std: 0.3,
        linear_std: vec![0.2, 0.3, 0.4],
        signal_std: 1.0,
        length_scales: vec![0.5, 0.6, 0.7],
        coulomb_std: None,
    })
    .unwrap()
}

fn block(n: usize) -> NoiseFreeBlock<TorqueCovariance> {
    let (x, targets) = (random(n, 3, 41), random(n, 2, 42));
    NoiseFreeBlock::new(covariance(), x.as_ref(), targets.as_ref()).unwrap()
}

fn wishart() -> TaskPrior {
    TaskPrior::inverse_wishart(4.5, mat![[1.0, 0.3], [0.3, 0.7]].as_ref()).unwrap()
}

/// ∫ f(K) dK over positive definite K, (2, 2), with K = [[a, ρ√(ab)], [·, b]].
///
/// ```text
/// dK = √(ab) da db dρ = (ab)^{3/2} d(log a) d(log b) (1 − ρ²) dη,   ρ = tanh η
/// ```
/// All three are from −∞ to ∞, where sums at even distances converge faster than any power.
fn integrate(f: impl Fn(&Mat<f64>) -> f64) -> f64 {
    let grid = |reach: f64, n: i32| {
        let step = 2.0 * reach / f64::from(n);
        (0..=n).map(move |i| (-reach + step * f64::from(i), step))
    };
    let mut sum = 0.0;
    for (log_a, step_a) in grid(9.0, 72) {
        for (log_b, step_b) in grid(9.0, 72) {
            for (eta, step_eta) in grid(6.0, 48) {
                let (a, b, rho) = (log_a.exp(), log_b.exp(), eta.tanh());
                let (size, narrow) = ((a * b).sqrt(), eta.cosh().powi(-2));
                let k = mat![[a, rho * size], [rho * size, b]];
                sum += f(&k) * size.powi(3) * narrow * step_a * step_b * step_eta;
            }
        }
    }
    sum
}

/// exp(log p(T | K)) p(K), without factors that overflow.
fn joint(block: &NoiseFreeBlock<TorqueCovariance>, prior: &TaskPrior, k: &Mat<f64>) -> f64 {
    let likelihood = block.log_marginal_likelihood(k.as_ref());
    match (likelihood, prior.log_density(k.as_ref())) {
        (Ok(likelihood), Ok(prior)) => (likelihood + prior).exp(),
        _ => 0.0, // singular in double precision: at the edge of the grid
    }
}

#[test]
fn inverse_wishart_is_a_density_with_its_known_mean() {
    let prior = wishart();
    let density = |k: &Mat<f64>| prior.log_density(k.as_ref()).map_or(0.0, f64::exp);
    let total = integrate(density);
    assert!((total - 1.0).abs() < 1e-3, "{total}");
    // Ψ/(ν₀ − m − 1); what is beyond e⁹ falls with the power 3/4 only: a part below 10⁻³.
    let mean = integrate(|k| density(k) * k[(1, 0)]);
    assert!((mean - 0.3 / 1.5).abs() < 2e-3, "{mean}");
}

#[test]
fn block_averaged_over_k_task_is_the_integral() {
    let block = block(6);
    for prior in [wishart(), TaskPrior::non_informative(2)] {
        let by_sums = integrate(|k| joint(&block, &prior, k)).ln();
        let averaged = IntegratedBlock::new(block.clone(), prior).unwrap();
        let value = averaged.log_marginal_likelihood();
        assert!((value - by_sums).abs() < 1e-3, "{value} {by_sums}");
    }
}

#[test]
fn predictions_are_the_ratio_of_two_likelihoods() {
    // p(t* | T) = p(T, t*)/p(T)
    let (x, targets) = (random(7, 3, 41), random(7, 2, 42));
    let part = |n: usize| {
        let block = NoiseFreeBlock::new(covariance(), x.subrows(0, n), targets.subrows(0, n));
        IntegratedBlock::new(block.unwrap(), wishart()).unwrap()
    };
    let (before, after) = (part(6), part(7));
    let expected = after.log_marginal_likelihood() - before.log_marginal_likelihood();
    let new: Vec<f64> = x.row(6).iter().copied().collect();
    let values: Vec<f64> = targets.row(6).iter().copied().collect();
    let prediction = before.predict(&new).unwrap();
    let value = prediction.log_density(&values).unwrap();
    // Two values of some tens of nats, with a condition below 10³.
    assert!((value - expected).abs() < 1e-9, "{value} {expected}");
    assert_eq!(prediction.degrees_of_freedom, 4.5 + 6.0 - 1.0);
    assert!(prediction.variances()[0] > prediction.scale[(0, 0)]);
}

#[test]
fn mode_of_k_task_is_where_the_joint_density_is_highest() {
    let block = block(6);
    for prior in [wishart(), TaskPrior::non_informative(2)] {
        let averaged = IntegratedBlock::new(block.clone(), prior.clone()).unwrap();
        let mode = averaged.k_task_mode();
        let log_joint = |k: &Mat<f64>| {
            let likelihood = block.log_marginal_likelihood(k.as_ref()).unwrap();
            likelihood + prior.log_density(k.as_ref()).unwrap()
        };
        let highest = log_joint(&mode);
        for (row, col) in [(0, 0), (1, 0), (1, 1)] {
            for shift in [-0.02, 0.02] {
                let mut moved = mode.clone();
                let size = mode[(row, row)];
                moved[(row, col)] += shift * size;
                if row != col {
                    moved[(col, row)] += shift * size;
                }
                assert!(log_joint(&moved) < highest, "({row}, {col})");
            }
        }
    }
}

/// Two tasks with noise, all six hyperparameters of c^x and three of Λ.
fn noisy() -> (Stacked, Vec<f64>, MultiTaskCovariance) {
    let (x, torques) = (random(12, 3, 43), random(12, 1, 44));
    let tasks: Vec<usize> = (0..12).map(|i| i % 2).collect();
    let data = Stacked::new(x.as_ref(), &tasks, 2).unwrap();
    let targets = data.stack(torques.col_as_slice(0));
    let factor = TaskFactor::from_entries(2, 2, &[0.9, -0.4, 0.7]).unwrap();
    let task = TaskCovariance::Factor(factor);
    (data, targets, MultiTaskCovariance::new(covariance(), task))
}

#[test]
fn gradients_under_both_measures_are_central_differences() {
    let (data, targets, covariance) = noisy();
    for measure in [TaskMeasure::Matrix, TaskMeasure::Factor] {
        let likelihood = LogMarginal::new(data.inputs(), &targets, LikelihoodOptions::dense());
        let mut posterior = WithTaskPrior::new(likelihood, wishart(), measure);
        let theta = covariance.params();
        let mut gradient = vec![0.0; theta.len() + 1];
        posterior.evaluate(&covariance, 0.3, &mut gradient).unwrap();
        for idx in covariance.input().n_params()..theta.len() {
            let step = 1e-5;
            let mut at = |shift: f64| {
                let mut moved = theta.clone();
                moved[idx] += shift;
                let mut other = covariance.clone();
                other.set_params(&moved);
                let mut unused = vec![0.0; theta.len() + 1];
                let value = posterior.evaluate(&other, 0.3, &mut unused).unwrap();
                value.log_marginal_likelihood
            };
            let difference = (at(step) - at(-step)) / (2.0 * step);
            // Values of some tens rounded to 10⁻¹³, third derivatives up to 10³.
            let error = (gradient[idx] - difference).abs();
            assert!(error < 1e-7, "{measure:?} {idx}: {error:e}");
        }
    }
}

#[test]
fn density_of_the_factor_integrates_to_that_of_the_matrix() {
    // log p(Λ) − log p(K) is log|∂K/∂Λ| = log(4 Λ₁₁² |Λ₂₂|) at m = 2.
    let (data, targets, covariance) = noisy();
    let value = |measure| {
        let likelihood = LogMarginal::new(data.inputs(), &targets, LikelihoodOptions::dense());
        let mut posterior = WithTaskPrior::new(likelihood, wishart(), measure);
        let mut gradient = vec![0.0; covariance.n_params() + 1];
        let evaluation = posterior.evaluate(&covariance, 0.3, &mut gradient);
        evaluation.unwrap().log_marginal_likelihood
    };
    let difference = value(TaskMeasure::Factor) - value(TaskMeasure::Matrix);
    let expected = (4.0 * 0.81 * 0.7_f64).ln();
    assert!((difference - expected).abs() < 1e-12, "{difference}");
}

#[test]
fn a_strong_prior_pulls_the_most_probable_k_task_to_it() {
    let (data, targets, covariance) = noisy();
    let psi = mat![[2.0, 1.0], [1.0, 2.0]];
    let correlation = |degrees_of_freedom: f64| {
        let prior = TaskPrior::inverse_wishart(
            degrees_of_freedom,
            ((degrees_of_freedom + 3.0) * &psi).as_ref(), // mode Ψ/(ν₀ + m + 1)
        );
        let likelihood = LogMarginal::new(data.inputs(), &targets, LikelihoodOptions::dense());
        let mut posterior = WithTaskPrior::new(likelihood, prior.unwrap(), TaskMeasure::Matrix);
        let limits = FitOptions::chapter().limits();
        let start = Start::given(covariance.clone(), 0.3);
        let end = search(&mut posterior, &start, &limits);
        let k = end.covariance.task().k_task();
        k[(1, 0)] / (k[(0, 0)] * k[(1, 1)]).sqrt()
    };
    assert!((correlation(1e5) - 0.5).abs() < 1e-3);
    assert!((correlation(3.0) - 0.5).abs() > 1e-2);
}

#[test]
fn improper_priors_and_singular_blocks_are_refused_with_their_numbers() {
    let error = TaskPrior::inverse_wishart(1.0, Mat::<f64>::identity(2, 2).as_ref()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "1 degrees of freedom of an inverse Wishart prior of 2 tasks, which must be finite and above 1"
    );
    // One input cannot tell two contexts apart, unless the prior can.
    let flat = IntegratedBlock::new(block(1), TaskPrior::non_informative(2));
    assert!(matches!(flat, Err(MtgpError::DependentContexts { .. })));
    assert!(IntegratedBlock::new(block(1), wishart()).is_ok());
    let other = IntegratedBlock::new(block(6), TaskPrior::non_informative(3));
    assert!(matches!(other, Err(MtgpError::CountMismatch { .. })));
}
