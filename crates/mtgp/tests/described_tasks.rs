//! K^ρ of descriptors: against numbers from outside, the equivalent Λ, and a task that was never seen.

use std::path::PathBuf;

use faer::Mat;
use gp_core::evidence::evidence;
use gp_core::{LikelihoodOptions, Posterior, log_marginal_likelihood};
use kernels::{Covariance, TorqueCovariance, TorqueForm, TorqueParams};
use mtgp::fit::{Descriptors, MultiTaskOptions, fit_described};
use mtgp::prior::{DescribedParams, DescribedTasks, TaskMatrix};
use mtgp::{MtgpError, MultiTaskCovariance, Stacked, TaskCovariance, TaskFactor, with_task};

/// Covariates of two joints.
const COVARIATES: [&str; 6] = ["q1", "q2", "qd1", "qd2", "qdd1", "qdd2"];

/// The columns of a fixture by name; what is empty is NaN.
fn read(file: &str) -> impl Fn(&str) -> Vec<f64> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/mtgp");
    let mut reader = csv::Reader::from_path(path.join(file)).unwrap();
    let header = reader.headers().unwrap().clone();
    let rows: Vec<csv::StringRecord> = reader.records().map(Result::unwrap).collect();
    move |name: &str| {
        let column = header.iter().position(|of| of == name).unwrap();
        let cells = rows.iter().map(|row| row[column].parse());
        cells.map(|cell| cell.unwrap_or(f64::NAN)).collect()
    }
}

fn states(of: &impl Fn(&str) -> Vec<f64>) -> (Mat<f64>, Vec<usize>) {
    let columns = COVARIATES.map(of);
    let x = Mat::from_fn(columns[0].len(), 6, |row, col| columns[col][row]);
    let number = |task: f64| (0..3_usize).find(|known| *known as f64 == task);
    let tasks = of("task").into_iter().map(|task| number(task).unwrap());
    (x, tasks.collect())
}

fn tasks() -> DescribedTasks {
    let descriptors = faer::mat![[0.2, 0.1], [1.0, -0.3], [2.0, 0.4]];
    let params = DescribedParams {
        bias_std: 0.4,
        linear_std: vec![0.5, 0.2],
        signal_std: 0.6,
        length_scales: vec![1.2, 0.7],
    };
    DescribedTasks::new(descriptors, params).unwrap()
}

fn input() -> TorqueCovariance {
    TorqueCovariance::new(TorqueParams {
        bias_std: 0.5,
        linear_std: vec![0.3, 0.2, 0.4, 0.1, 0.6, 0.5],
        signal_std: 0.8,
        length_scales: vec![1.1, 0.9, 2.0, 1.7, 3.0, 2.5],
        coulomb_std: Some(vec![0.35, 0.15]),
    })
    .unwrap()
}

fn train() -> (Stacked, Vec<f64>) {
    let of = read("described_train.csv");
    let (x, tasks) = states(&of);
    let data = Stacked::new(x.as_ref(), &tasks, 3).unwrap();
    let targets = data.stack(&of("t"));
    (data, targets)
}

fn noise_std() -> f64 {
    0.003_f64.sqrt()
}

/// Names and values of the numbers from outside, in their order.
fn expected() -> Vec<(String, f64)> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/mtgp/described.csv");
    let mut reader = csv::Reader::from_path(path).unwrap();
    let rows = reader.records().map(Result::unwrap);
    rows.map(|row| (row[0].to_owned(), row[3].parse().unwrap()))
        .collect()
}

#[test]
fn value_and_gradient_are_those_of_complex_steps() {
    let (data, targets) = train();
    let covariance = MultiTaskCovariance::new(input(), TaskCovariance::Described(tasks()));
    let dense = LikelihoodOptions::dense();
    let found = evidence(&covariance, noise_std(), data.inputs(), &targets, dense).unwrap();
    let expected = expected();
    let (value, of_value) = (found.evaluation.log_marginal_likelihood, expected[0].1);
    // n ε κ with κ below 10⁵.
    assert!((value / of_value - 1.0).abs() <= 1e-9, "{value} {of_value}");
    let slopes = &expected[1..=found.gradient.len()];
    let layout = covariance.layout();
    let largest = slopes.iter().fold(0.0, |most: f64, s| most.max(s.1.abs()));
    for (idx, (slope, (name, expected))) in found.gradient.iter().zip(slopes).enumerate() {
        let label = layout.specs().get(idx).map(ToString::to_string);
        let label = label.unwrap_or("noise_std".to_owned());
        assert!(label.starts_with(name.as_str()), "{label} {name}");
        let error = (slope - expected).abs() / largest;
        assert!(error <= 1e-7, "{label}: {slope} {expected}");
    }
}

#[test]
fn predictions_are_those_of_eqs_3_and_4() {
    let (data, targets) = train();
    let covariance = MultiTaskCovariance::new(input(), TaskCovariance::Described(tasks()));
    let (x, tasks) = states(&read("described_test.csv"));
    let rows = Mat::from_fn(x.nrows(), 7, |row, col| match col {
        6 => tasks[row] as f64,
        col => x[(row, col)],
    });
    let posterior = Posterior::dense(covariance, noise_std(), data.inputs(), &targets).unwrap();
    let found = posterior.predict(rows.as_ref()).unwrap();
    let expected = expected();
    let of = |wanted: &str| -> Vec<f64> {
        let matching = expected.iter().filter(|(name, _)| name == wanted);
        matching.map(|(_, value)| *value).collect()
    };
    for (found, expected) in [(found.mean, of("mean")), (found.var, of("latent_var"))] {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(&expected) {
            assert!((found - expected).abs() <= 1e-9, "{found} {expected}");
        }
    }
}

#[test]
fn the_equivalent_factor_has_the_same_likelihood() {
    let (data, targets) = train();
    let described = TaskCovariance::Described(tasks());
    let factor = TaskCovariance::Factor(TaskFactor::new(described.root()).unwrap());
    let [a, b] = [described, factor].map(|task| {
        let covariance = MultiTaskCovariance::new(input(), task);
        log_marginal_likelihood(&covariance, noise_std(), data.inputs(), &targets).unwrap()
    });
    // The entries of K^ρ agree to a few ε, which K⁻¹ of condition below 10⁵ makes larger.
    assert!((a / b - 1.0).abs() <= 1e-9, "{a} {b}");
}

#[test]
fn a_new_task_has_the_covariances_of_its_descriptors() {
    let (before, after) = (tasks(), tasks().with_task(&[1.5, 0.4]).unwrap());
    let (old, new) = (before.k_task(), after.k_task());
    for row in 0..3 {
        for col in 0..3 {
            assert_eq!(old[(row, col)], new[(row, col)]);
        }
    }
    // 0.4² + 0.5²·1.5·2 + 0.2²·0.4² + 0.6² exp(−½ (0.5/1.2)²)
    let by_hand = 0.16 + 0.75 + 0.04 * 0.16 + 0.36 * (-0.5_f64 * (0.5_f64 / 1.2).powi(2)).exp();
    assert!((new[(3, 2)] - by_hand).abs() <= 1e-15, "{}", new[(3, 2)]);
    assert_eq!(
        tasks().with_task(&[1.0]),
        Err(MtgpError::CountMismatch {
            what: "descriptors of a task",
            found: 1,
            expected: 2,
        })
    );
    assert!(tasks().with_task(&[1.0, f64::NAN]).is_err());
}

/// τ = (1 + 0.4 s) q̈ + (2 + s) sin q + 0.3 sgn q̇: a pendulum whose load s adds to mass and moment.
fn pendulum(load: f64, x: &Mat<f64>) -> Vec<f64> {
    let torque = |row: usize| {
        let (q, qd, qdd) = (x[(row, 0)], x[(row, 1)], x[(row, 2)]);
        (1.0 + 0.4 * load) * qdd + (2.0 + load) * q.sin() + 0.3 * qd.signum()
    };
    (0..x.nrows()).map(torque).collect()
}

fn swing(first: usize, count: usize) -> Mat<f64> {
    Mat::from_fn(count, 3, |row, col| {
        let phase = (first + row) as f64;
        [
            (0.7 * phase).sin(),
            2.0 * (1.1 * phase).cos(),
            (1.9 * phase).sin(),
        ][col]
    })
}

#[test]
fn a_load_that_was_never_carried_is_predicted_by_its_descriptor() {
    let loads = [0.0, 1.0, 2.5, 4.0];
    let (mut rows, mut torques, mut tasks) = (Vec::new(), Vec::new(), Vec::new());
    for (task, load) in loads.into_iter().enumerate() {
        let x = swing(37 * task, 15);
        torques.extend(pendulum(load, &x));
        rows.extend(x.row_iter().map(|row| [row[0], row[1], row[2]]));
        tasks.extend([task; 15]);
    }
    let x = Mat::from_fn(rows.len(), 3, |row, col| rows[row][col]);
    let data = Stacked::new(x.as_ref(), &tasks, 4).unwrap();
    let descriptors = Descriptors {
        values: Mat::from_fn(4, 1, |task, _| loads[task]),
        units: vec![1.5],
    };
    let options = MultiTaskOptions {
        form: TorqueForm::Coulomb,
        ..MultiTaskOptions::several()
    };
    let targets = data.stack(&torques);
    let fit = fit_described(&data, &targets, &descriptors, &options).unwrap();
    let TaskCovariance::Described(known) = fit.covariance().task() else {
        panic!("not by descriptors");
    };
    let grown = TaskCovariance::Described(known.with_task(&[1.7]).unwrap());
    let grown = MultiTaskCovariance::new(fit.covariance().input().clone(), grown);
    let posterior = fit.posterior.with_covariance(grown);
    let test = swing(500, 60);
    let truth = pendulum(1.7, &test);
    let at = with_task(test.as_ref(), 4);
    let found = posterior.predict(at.as_ref()).unwrap();
    let square = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>();
    let errors = |mean: &[f64]| -> f64 {
        let differences = mean.iter().zip(&truth).map(|(m, t)| m - t);
        square(&differences.collect::<Vec<f64>>()) / square(&truth)
    };
    let of_known = |task: usize| errors(&fit.predict_mean(task, test.as_ref()).unwrap());
    let nearest = (0..4).map(of_known).fold(f64::INFINITY, f64::min);
    // The truth is in the model; a load 0.7 away changes a fifth of the torque.
    let error = errors(&found.mean);
    assert!(error <= 1e-3, "{error:e}");
    assert!(error <= 0.05 * nearest, "{error:e} {nearest:e}");
    let inside = found.mean.iter().zip(&found.var).zip(&truth);
    let inside = inside.filter(|((m, v), t)| (*m - *t).abs() <= 3.0 * v.sqrt() + 0.05);
    assert!(inside.count() >= 55);
}
