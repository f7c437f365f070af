//! Data at the edges: what is refused, and what has an answer although it says little.

use faer::Mat;
use gp_core::evidence::evidence;
use gp_core::{GpError, LikelihoodOptions, Method, Posterior};
use kernels::{TorqueCovariance, TorqueForm};
use mtgp::{MtgpError, MultiTaskCovariance, Stacked, TaskCovariance, TaskFactor, with_task};

const D: usize = 3;

fn inputs(n: usize) -> Mat<f64> {
    Mat::from_fn(n, D, |row, col| (0.7 * row as f64 + 1.3 * col as f64).sin())
}

fn prior(n_tasks: usize, rank: usize) -> MultiTaskCovariance {
    let entries: Vec<f64> = (0..TaskFactor::count(n_tasks, rank))
        .map(|idx| 1.0 + 0.3 * (idx as f64).sin())
        .collect();
    let factor = TaskFactor::from_entries(n_tasks, rank, &entries).unwrap();
    let input = TorqueCovariance::unit(1, TorqueForm::Coulomb);
    MultiTaskCovariance::new(input, TaskCovariance::Factor(factor))
}

#[test]
fn data_that_no_model_can_have_are_refused_with_the_numbers() {
    let x = inputs(3);
    let message = |tasks: &[usize], n_tasks| {
        Stacked::new(x.as_ref(), tasks, n_tasks)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(message(&[0, 0, 0], 0), "a model of no tasks");
    assert_eq!(message(&[0, 1], 2), "2 tasks of samples, expected 3");
    assert_eq!(
        message(&[0, 5, 1], 2),
        "row 1 belongs to task 5, but there are only 2, counted from zero"
    );
    assert_eq!(message(&[0, 2, 0], 3), "task 1 of 3 has no samples");
    let mut broken = inputs(3);
    broken[(2, 1)] = f64::NAN;
    let error = Stacked::new(broken.as_ref(), &[0, 1, 0], 2).unwrap_err();
    assert_eq!(
        error.to_string(),
        "input at row 2, column 1 is NaN, not a finite number"
    );
}

#[test]
fn factors_that_no_task_matrix_has_are_refused_with_the_numbers() {
    let message = |n_tasks, rank, entries: &[f64]| {
        TaskFactor::from_entries(n_tasks, rank, entries)
            .unwrap_err()
            .to_string()
    };
    let rank = "rank 3 of a task matrix of 2 tasks, which must be 1 to 2";
    assert_eq!(message(2, 3, &[1.0]), rank);
    assert_eq!(
        TaskFactor::from_root(Mat::full(2, 3, 1.0).as_ref())
            .unwrap_err()
            .to_string(),
        rank
    );
    assert_eq!(
        message(2, 0, &[]),
        "rank 0 of a task matrix of 2 tasks, which must be 1 to 2"
    );
    assert_eq!(message(0, 1, &[]), "a model of no tasks");
    assert_eq!(
        message(3, 2, &[1.0; 6]),
        "6 entries of task_factor, expected 5"
    );
    assert_eq!(
        message(2, 1, &[1.0, f64::INFINITY]),
        "task_factor at row 1, column 0 is inf, not a finite number"
    );
    let full = TaskFactor::new(Mat::full(2, 2, 0.5)).unwrap_err();
    assert_eq!(
        full,
        MtgpError::AboveDiagonal {
            row: 0,
            column: 1,
            value: 0.5
        }
    );
}

#[test]
fn context_with_one_sample_learns_from_the_others() {
    // Eleven samples of task 0, and one of task 1, whose torques are half as large again.
    let x = inputs(12);
    let mut tasks = [0; 12];
    tasks[5] = 1;
    let torque = |row: usize| 3.0 * x[(row, 0)] + x[(row, 2)];
    let torques: Vec<f64> = (0..12)
        .map(|row| torque(row) * (1.0 + 0.5 * tasks[row] as f64))
        .collect();
    let data = Stacked::new(x.as_ref(), &tasks, 2).unwrap();
    let factor = TaskFactor::from_entries(2, 1, &[1.0, 1.5]).unwrap();
    let input = TorqueCovariance::unit(1, TorqueForm::Coulomb);
    let prior = MultiTaskCovariance::new(input, TaskCovariance::Factor(factor));
    let posterior = Posterior::dense(prior, 0.05, data.inputs(), &data.stack(&torques)).unwrap();
    let means = posterior
        .predict_mean(with_task(x.as_ref(), 1).as_ref())
        .unwrap();
    for (row, mean) in means.iter().enumerate() {
        // A twentieth of the torque's scale: the noise of the samples it is learned from.
        assert!(
            (mean - 1.5 * torque(row)).abs() <= 0.2,
            "{row}: {mean} {}",
            torque(row)
        );
    }
}

#[test]
fn identical_inputs_have_a_likelihood_and_average() {
    // All rows of K are equal within a task: only the noise keeps K positive definite.
    let x = Mat::from_fn(8, D, |_, col| [0.3, -1.0, 0.5][col]);
    let torques = [1.0, 1.2, 0.9, 1.1, 3.0, 3.3, 2.8, 2.9];
    let tasks = [0, 0, 0, 0, 1, 1, 1, 1];
    let data = Stacked::new(x.as_ref(), &tasks, 2).unwrap();
    for method in [Method::Dense, Method::Certified] {
        let options = LikelihoodOptions {
            method,
            certificate: 1e-6,
        };
        let found = evidence(&prior(2, 2), 0.01, data.inputs(), &torques, options).unwrap();
        assert!(found.evaluation.log_marginal_likelihood.is_finite());
        assert!(found.gradient.iter().all(|slope| slope.is_finite()));
        let posterior =
            Posterior::new(prior(2, 2), 0.01, data.inputs(), &torques, options).unwrap();
        for (task, average) in [(0, 1.05), (1, 3.0)] {
            let point = with_task(x.subrows(0, 1), task);
            let mean = posterior.predict_mean(point.as_ref()).unwrap()[0];
            // Shrunk by σ²/(4 K_aa) of itself, with K_aa above 1: less than 1e-4.
            assert!((mean - average).abs() <= 1e-4, "{task}: {mean}");
        }
    }
    // Without noise there is nothing to tell the samples apart.
    let none = evidence(
        &prior(2, 2),
        0.0,
        data.inputs(),
        &torques,
        LikelihoodOptions::dense(),
    );
    assert_eq!(none.unwrap_err(), GpError::BadNoise { value: 0.0 });
}

#[test]
fn constant_torque_has_a_likelihood_and_is_predicted() {
    let x = inputs(20);
    let tasks: Vec<usize> = (0..20).map(|row| row % 3).collect();
    let data = Stacked::new(x.as_ref(), &tasks, 3).unwrap();
    for constant in [0.0, 2.5] {
        let torques = vec![constant; 20];
        let options = LikelihoodOptions::dense();
        let prior = prior(3, 3);
        let found = evidence(&prior, 0.01, data.inputs(), &torques, options).unwrap();
        assert!(found.evaluation.log_marginal_likelihood.is_finite());
        assert!(found.gradient.iter().all(|slope| slope.is_finite()));
        let posterior = Posterior::dense(prior, 0.01, data.inputs(), &torques).unwrap();
        let means = posterior.predict_mean(data.inputs()).unwrap();
        for (row, mean) in means.iter().enumerate() {
            // Nothing speaks against the constant but a shrinkage by σ²/K_aa < 1e-4 a sample.
            assert!((mean - constant).abs() <= 0.01, "{constant} {row}: {mean}");
        }
    }
}
