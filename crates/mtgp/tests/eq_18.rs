//! Eq. (18): without noise a context learns nothing from the others at the same inputs.

use faer::{Mat, MatRef};
use kernels::{TorqueCovariance, TorqueParams};
use mtgp::block::{CompleteBlock, NoiseFreeBlock};

use crate::textbook::{Case, assert_close, random};

/// What the cancellation must hold to, relative to the largest prediction.
const CANCELLATION: f64 = 1e-8;

const N_INPUTS: usize = 8;
const N_TASKS: usize = 3;

/// A covariance so rough that its Gram matrix is well conditioned without noise.
fn rough() -> TorqueCovariance {
    TorqueCovariance::new(TorqueParams {
        bias_std: 0.3,
        linear_std: vec![0.2, 0.3, 0.4],
        signal_std: 1.0,
        length_scales: vec![0.5, 0.6, 0.7],
        coulomb_std: Some(vec![0.3]),
    })
    .unwrap()
}

/// A K^ρ of full rank with strong correlations.
fn k_task() -> Mat<f64> {
    let lambda = random(N_TASKS, N_TASKS, 11);
    &lambda * lambda.transpose() + 0.1 * Mat::<f64>::identity(N_TASKS, N_TASKS)
}

/// The observations of a design of (input, task) pairs, dense and with one noise level.
fn observed(design: &[(usize, usize)], noise_std: f64) -> Case {
    let (x, targets) = (random(N_INPUTS, 3, 12), random(N_INPUTS, N_TASKS, 13));
    Case {
        covariance: rough(),
        k_task: k_task(),
        noise_std: vec![noise_std; N_TASKS],
        x: Mat::from_fn(design.len(), 3, |row, col| x[(design[row].0, col)]),
        tasks: design.iter().map(|(_, task)| *task).collect(),
        targets: design.iter().map(|&at| targets[at]).collect(),
    }
}

/// All inputs of one task.
fn alone(task: usize) -> Vec<(usize, usize)> {
    (0..N_INPUTS).map(|input| (input, task)).collect()
}

/// All inputs of all tasks.
fn complete() -> Vec<(usize, usize)> {
    (0..N_TASKS).flat_map(alone).collect()
}

/// Largest difference of two predictions' means.
fn shift(a: &Case, b: &Case, task: usize, x_test: MatRef<'_, f64>) -> f64 {
    let (a, b) = (a.predict(task, x_test).0, b.predict(task, x_test).0);
    a.iter()
        .zip(&b)
        .fold(0.0, |s: f64, (a, b)| s.max((a - b).abs()))
}

#[test]
fn transfer_cancels_in_a_complete_block_without_noise() {
    let (x_test, all) = (random(6, 3, 14), observed(&complete(), 0.0));
    let (x, targets) = (random(N_INPUTS, 3, 12), random(N_INPUTS, N_TASKS, 13));
    let block = NoiseFreeBlock::new(rough(), x.as_ref(), targets.as_ref()).unwrap();
    for task in 0..N_TASKS {
        let (mean, var) = all.predict(task, x_test.as_ref());
        let (own_mean, own_var) = observed(&alone(task), 0.0).predict(task, x_test.as_ref());
        assert_close("mean", &mean, &own_mean, CANCELLATION);
        assert_close("var", &var, &own_var, CANCELLATION);

        let found = block.predict(task, x_test.as_ref()).unwrap();
        assert_close("mean", &found.mean, &own_mean, CANCELLATION);
        // The block's K^ρ is its own, that of eq. (25).
        let ratio = block.k_task()[(task, task)] / k_task()[(task, task)];
        let var: Vec<f64> = own_var.iter().map(|v| ratio * v).collect();
        assert_close("var", &found.var, &var, CANCELLATION);
    }
}

#[test]
fn transfer_cancels_where_the_others_saw_a_subset_of_the_inputs() {
    let x_test = random(6, 3, 14);
    let mut design = alone(0);
    design.extend([(1, 1), (4, 1), (5, 1), (0, 2), (5, 2)]);
    let (mean, var) = observed(&design, 0.0).predict(0, x_test.as_ref());
    let (own_mean, own_var) = observed(&alone(0), 0.0).predict(0, x_test.as_ref());
    assert_close("mean", &mean, &own_mean, CANCELLATION);
    assert_close("var", &var, &own_var, CANCELLATION);

    // The contexts with fewer inputs do learn from it.
    let (few, own) = (observed(&design, 0.0), observed(&design[8..11], 0.0));
    assert!(shift(&few, &own, 1, x_test.as_ref()) > 0.01);
}

#[test]
fn an_input_that_only_another_context_saw_is_transfer() {
    let x_test = random(6, 3, 14);
    let own: Vec<_> = alone(0).into_iter().skip(1).collect();
    let mut design = own.clone();
    design.push((0, 1));
    let moved = shift(
        &observed(&design, 0.0),
        &observed(&own, 0.0),
        0,
        x_test.as_ref(),
    );
    assert!(moved > 0.01, "{moved}");
}

#[test]
fn noise_brings_transfer_back() {
    let x_test = random(6, 3, 14);
    for noise_std in [0.03, 0.1, 0.3] {
        let (all, own) = (
            observed(&complete(), noise_std),
            observed(&alone(0), noise_std),
        );
        let moved = shift(&all, &own, 0, x_test.as_ref());
        // To first order in σ², and every other number here is of order one.
        assert!(moved > 0.1 * noise_std * noise_std, "{noise_std}: {moved}");

        let (x, targets) = (random(N_INPUTS, 3, 12), random(N_INPUTS, N_TASKS, 13));
        let (k, noise) = (k_task(), [noise_std; N_TASKS]);
        let block = CompleteBlock::new(x.as_ref(), targets.as_ref()).unwrap();
        let block = block.condition(rough(), k.as_ref(), &noise).unwrap();
        let found = block.predict(0, x_test.as_ref()).unwrap().mean;
        assert_close(
            "mean",
            &found,
            &all.predict(0, x_test.as_ref()).0,
            CANCELLATION,
        );
    }
}
