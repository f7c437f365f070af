//! Repeated inputs in incomplete designs: the reduction to pseudo-observations changes nothing.

use faer::{Mat, mat};
use gp_core::{Posterior, log_marginal_likelihood_with_gradient};
use kernels::{Constant, Covariance, TorqueCovariance};
use mtgp::{
    CompleteBlock, MtgpError, MultiTaskCovariance, RepeatedInputs, SharedObservations, Stacked,
    TaskCovariance, TaskFactor, with_task,
};

use crate::textbook::{Case, assert_close, entries, random, torque_covariance};

/// What a structured method must agree to, relative to the largest entry.
const AGREEMENT: f64 = 1e-8;

const N_TASKS: usize = 5;
const NOISE_STD: [f64; N_TASKS] = [0.2, 0.15, 0.3, 0.25, 0.18];

/// Which (input, task) pairs are observed.
type Design = Vec<(usize, usize)>;

/// Eight inputs: some seen by all tasks, some by a few, one by one task alone, one twice by the same.
fn incomplete() -> Design {
    let mut design: Design = (0..N_TASKS)
        .flat_map(|task| [(0, task), (1, task)])
        .collect();
    design.extend([
        (2, 0),
        (2, 3),
        (2, 4),
        (3, 1),
        (4, 2),
        (4, 2),
        (4, 1),
        (4, 0),
    ]);
    design.extend([(5, 4), (5, 4), (6, 3), (6, 2), (6, 1), (6, 0), (7, 0)]);
    // In no order, as in a log.
    design.sort_by_key(|(input, task)| (31 * input + 17 * task) % 23);
    design
}

fn conditioned(lambda: &Mat<f64>, design: &Design) -> (RepeatedInputs<TorqueCovariance>, Case) {
    let n_inputs = design.iter().map(|(input, _)| input + 1).max().unwrap();
    let x = random(n_inputs, 6, 2);
    let (input_idx, tasks): (Vec<usize>, Vec<usize>) = design.iter().copied().unzip();
    let targets = entries(&random(design.len(), 1, 3));
    let observations = SharedObservations {
        x: x.as_ref(),
        input_idx: &input_idx,
        tasks: &tasks,
        targets: &targets,
    };
    let covariance = torque_covariance();
    let found = RepeatedInputs::new(
        covariance.clone(),
        lambda.as_ref(),
        &NOISE_STD,
        observations,
    );
    let case = Case {
        covariance,
        k_task: lambda * lambda.transpose(),
        noise_std: NOISE_STD.to_vec(),
        x: Mat::from_fn(design.len(), 6, |row, col| x[(input_idx[row], col)]),
        tasks: tasks.clone(),
        targets: targets.clone(),
    };
    assert!(case.rounding() <= 0.1 * AGREEMENT, "{:e}", case.rounding());
    (found.unwrap(), case)
}

#[test]
fn likelihood_and_gradient_equal_the_dense_ones() {
    for rank in [1, 2, 3, 5] {
        let lambda = random(N_TASKS, rank, 1);
        let (found, case) = conditioned(&lambda, &incomplete());
        let (gradient, expected) = (found.gradient(), case.likelihood());
        let value = found.log_marginal_likelihood().unwrap();
        assert_close("value", &[value], &[expected.value], AGREEMENT);
        assert_close("theta", &gradient.theta, &expected.theta, AGREEMENT);
        let by_factor = 2.0 * &expected.k_task * &lambda; // (m, r)
        let (found, wanted) = (entries(&gradient.lambda), entries(&by_factor));
        assert_close("lambda", &found, &wanted, AGREEMENT);
        assert_close("noise", &gradient.noise_std, &expected.noise_std, AGREEMENT);
    }
}

#[test]
fn posterior_of_every_context_equals_the_dense_one() {
    let x_test = random(6, 6, 4);
    for rank in [1, 2, 5] {
        let (found, case) = conditioned(&random(N_TASKS, rank, 1), &incomplete());
        for task in 0..N_TASKS {
            let prediction = found.predict(task, x_test.as_ref()).unwrap();
            let (mean, var) = case.predict(task, x_test.as_ref());
            assert_close("mean", &prediction.mean, &mean, AGREEMENT);
            assert_close("var", &prediction.var, &var, AGREEMENT);
        }
    }
}

#[test]
fn order_is_the_rank_of_what_each_input_shows() {
    // Eight inputs with 5, 5, 3, 1, 3, 1, 4 and 1 tasks: min(tasks, rank) each.
    for (rank, order) in [(1, 8), (2, 13), (3, 18), (5, 23)] {
        let (found, _) = conditioned(&random(N_TASKS, rank, 1), &incomplete());
        assert_eq!(found.order(), order, "rank {rank}");
    }
}

#[test]
fn a_complete_block_is_that_of_eq_17() {
    let design: Design = (0..N_TASKS)
        .flat_map(|task| (0..6).map(move |input| (input, task)))
        .collect();
    let lambda = random(N_TASKS, 2, 1);
    let (found, case) = conditioned(&lambda, &design);
    let targets = Mat::from_fn(6, N_TASKS, |j, task| case.targets[6 * task + j]);
    let (x, k_task) = (random(6, 6, 2), &lambda * lambda.transpose());
    let (k, t) = (k_task.as_ref(), targets.as_ref());
    let block = CompleteBlock::new(case.covariance, k, &NOISE_STD, x.as_ref(), t).unwrap();
    let of_block = block.log_marginal_likelihood().unwrap();
    let value = found.log_marginal_likelihood().unwrap();
    assert_close("value", &[value], &[of_block], AGREEMENT);
    let (of_block, gradient) = (block.gradient(), found.gradient());
    assert_close("theta", &gradient.theta, &of_block.theta, AGREEMENT);
    let by_factor = entries(&of_block.of_factor(lambda.as_ref()));
    assert_close("lambda", &entries(&gradient.lambda), &by_factor, AGREEMENT);
}

#[test]
fn two_readings_at_one_input_by_hand() {
    // K^ρ = 4, c^x = 1, d = 1: K = [5 4; 4 5], |K| = 9, K⁻¹ = [5 −4; −4 5]/9.
    // t = (2, 1): tᵀK⁻¹t = (20 − 16 + 5)/9 = 1; mean 4·(α_1 + α_2) = 4·3/9, var 4 − 16·2/9.
    let x = mat![[0.0]];
    let observations = SharedObservations {
        x: x.as_ref(),
        input_idx: &[0, 0],
        tasks: &[0, 0],
        targets: &[2.0, 1.0],
    };
    let covariance = Constant::new(1.0).unwrap();
    let found = RepeatedInputs::new(covariance, mat![[2.0]].as_ref(), &[1.0], observations);
    let found = found.unwrap();
    assert_eq!(found.order(), 1);
    let by_hand = -0.5 - 3.0_f64.ln() - (2.0 * std::f64::consts::PI).ln();
    let tolerance = 32.0 * f64::EPSILON;
    let value = found.log_marginal_likelihood().unwrap();
    assert_close("value", &[value], &[by_hand], tolerance);
    let posterior = found.predict(0, x.as_ref()).unwrap();
    assert_close("mean", &posterior.mean, &[12.0 / 9.0], tolerance);
    assert_close("var", &posterior.var, &[4.0 / 9.0], tolerance);
}

#[test]
fn an_unknown_task_is_named() {
    let x = mat![[0.0]];
    let observations = SharedObservations {
        x: x.as_ref(),
        input_idx: &[0, 0],
        tasks: &[0, 2],
        targets: &[2.0, 1.0],
    };
    let covariance = Constant::new(1.0).unwrap();
    let lambda = mat![[1.0], [1.0]];
    let error = RepeatedInputs::new(covariance, lambda.as_ref(), &[1.0, 1.0], observations);
    let (row, task, n_tasks) = (1, 2, 2);
    assert_eq!(
        error.map(|_| ()),
        Err(MtgpError::UnknownTask { row, task, n_tasks })
    );
}

#[test]
fn samples_as_they_are_stacked_equal_the_dense_engine() {
    let (n_tasks, rank, noise_std) = (6, 3, 0.3);
    let lambda = Mat::from_fn(n_tasks, rank, |row, col| {
        if col <= row {
            random(n_tasks, rank, 5)[(row, col)]
        } else {
            0.0
        }
    });
    let task = TaskCovariance::Factor(TaskFactor::new(lambda.clone()).unwrap());
    let prior = MultiTaskCovariance::new(torque_covariance(), task.clone());
    // Thirty inputs, of which task γ sees those whose number γ + 2 does not divide.
    let distinct = random(30, 6, 6);
    let seen: Vec<(usize, usize)> = (0..30)
        .flat_map(|input| (0..n_tasks).map(move |task| (input, task)))
        .filter(|(input, task)| input % (task + 2) != 0)
        .collect();
    let x = Mat::from_fn(seen.len(), 6, |row, col| distinct[(seen[row].0, col)]);
    let tasks: Vec<usize> = seen.iter().map(|(_, task)| *task).collect();
    let stacked = Stacked::new(x.as_ref(), &tasks, n_tasks).unwrap();
    let targets = stacked.stack(random(seen.len(), 1, 7).col_as_slice(0));

    let (unique, input_idx) = stacked.unique_inputs();
    let observations = SharedObservations {
        x: unique.as_ref(),
        input_idx: &input_idx,
        tasks: stacked.tasks(),
        targets: &targets,
    };
    let noise = vec![noise_std; n_tasks];
    let found = RepeatedInputs::new(torque_covariance(), lambda.as_ref(), &noise, observations);
    let found = found.unwrap();
    assert!(found.order() < seen.len(), "{}", found.order());

    let (rows, t) = (stacked.inputs(), &targets);
    let (value, dense) = log_marginal_likelihood_with_gradient(&prior, noise_std, rows, t).unwrap();
    let ours = found.log_marginal_likelihood().unwrap();
    assert_close("value", &[ours], &[value], AGREEMENT);
    let gradient = found.gradient();
    let (of_prior, of_noise) = dense.split_at(prior.n_params());
    let (of_theta, of_entries) = of_prior.split_at(gradient.theta.len());
    assert_close("theta", &gradient.theta, of_theta, AGREEMENT);
    let free: Vec<f64> = (0..n_tasks)
        .flat_map(|row| (0..rank.min(row + 1)).map(move |col| (row, col)))
        .map(|at| gradient.lambda[at])
        .collect();
    assert_close("task_factor", &free, of_entries, AGREEMENT);
    let shared: f64 = gradient.noise_std.iter().sum();
    assert_close("noise_std", &[shared], of_noise, AGREEMENT);

    let posterior = Posterior::dense(prior, noise_std, rows, t).unwrap();
    let x_test = random(130, 6, 8); // more than one block of test points
    for task in 0..n_tasks {
        let found = found.predict(task, x_test.as_ref()).unwrap();
        let dense = posterior
            .predict(with_task(x_test.as_ref(), task).as_ref())
            .unwrap();
        assert_close("mean", &found.mean, &dense.mean, AGREEMENT);
        assert_close("var", &found.var, &dense.var, AGREEMENT);
    }
}
