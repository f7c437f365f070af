//! Reads the 50-digit values of `fixtures/mtgp`.

use std::path::PathBuf;

use faer::Mat;
use kernels::{TorqueCovariance, TorqueParams};
use mtgp::{MultiTaskCovariance, Stacked, TaskCovariance, TaskFactor, with_task};

/// Number of covariates of every fixture: two joints.
pub const D: usize = 6;

/// Number of contexts of every fixture.
pub const M: usize = 5;

/// One value of `likelihood.csv`.
pub struct Row {
    pub name: String,
    pub theta: f64,
    pub value: f64,
}

/// Training data and hyperparameters of one case.
pub struct Case {
    pub x: Mat<f64>,
    pub tasks: Vec<usize>,
    pub torques: Vec<f64>,
    pub covariance: MultiTaskCovariance,
    /// One, or one per context.
    pub noise_std: Vec<f64>,
    /// The value first, then the gradient in θ order, noise last.
    pub expected: Vec<Row>,
}

impl Case {
    pub fn stacked(&self) -> Stacked {
        Stacked::new(self.x.as_ref(), &self.tasks, M).unwrap()
    }
}

/// Rows of one fixture file that belong to a case, without that first column.
fn rows(file: &str, case: &str) -> Vec<Vec<String>> {
    all_rows(file)
        .into_iter()
        .filter(|row| row[0] == case)
        .map(|row| row[1..].to_vec())
        .collect()
}

fn all_rows(file: &str) -> Vec<Vec<String>> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../fixtures/mtgp");
    let mut reader = csv::Reader::from_path(path.join(file)).unwrap();
    reader
        .records()
        .map(|record| record.unwrap().iter().map(str::to_owned).collect())
        .collect()
}

fn number(cell: &str) -> f64 {
    cell.parse().unwrap()
}

pub fn case(name: &str) -> Case {
    let data = all_rows(&format!("inputs_{name}.csv"));
    let expected: Vec<Row> = rows("likelihood.csv", name)
        .iter()
        .map(|row| Row {
            name: row[0].clone(),
            theta: row[3].parse().unwrap_or(f64::NAN),
            value: number(&row[4]),
        })
        .collect();
    let named = |wanted: &str| -> Vec<f64> {
        let matching = expected.iter().filter(|row| row.name == wanted);
        matching.map(|row| row.theta).collect()
    };
    let entries = named("task_factor");
    let rank = (1..=M).find(|&rank| TaskFactor::count(M, rank) == entries.len());
    let factor = TaskFactor::from_entries(M, rank.unwrap(), &entries).unwrap();
    let input = TorqueCovariance::new(TorqueParams {
        bias_std: named("bias_std")[0],
        linear_std: named("linear_std"),
        signal_std: named("signal_std")[0],
        length_scales: named("length_scales"),
        coulomb_std: Some(named("coulomb_std")),
    });
    let noise_std = [named("noise_std"), named("task_noise_std")].concat();
    Case {
        x: Mat::from_fn(data.len(), D, |row, col| number(&data[row][1 + col])),
        tasks: data.iter().map(|row| row[0].parse().unwrap()).collect(),
        torques: data.iter().map(|row| number(&row[1 + D])).collect(),
        covariance: MultiTaskCovariance::new(input.unwrap(), TaskCovariance::Factor(factor)),
        noise_std,
        expected,
    }
}

/// The test rows (x, task) of a case, (k, d + 1), and their posterior means.
pub fn predictions(case: &str) -> (Mat<f64>, Vec<f64>) {
    let rows = rows("predictions.csv", case);
    let mut points = Mat::zeros(rows.len(), D + 1);
    for (idx, row) in rows.iter().enumerate() {
        let x = Mat::from_fn(1, D, |_, col| number(&row[1 + col]));
        let point = with_task(x.as_ref(), row[0].parse().unwrap());
        points.as_mut().subrows_mut(idx, 1).copy_from(&point);
    }
    (points, rows.iter().map(|row| number(&row[1 + D])).collect())
}

/// Their joint posterior covariance, (k, k).
pub fn joint_covariance(case: &str, count: usize) -> Mat<f64> {
    let mut covariance = Mat::full(count, count, f64::NAN);
    for row in rows("joint_covariance.csv", case) {
        let (i, j): (usize, usize) = (row[0].parse().unwrap(), row[1].parse().unwrap());
        covariance[(i, j)] = number(&row[2]);
        covariance[(j, i)] = covariance[(i, j)];
    }
    covariance
}
