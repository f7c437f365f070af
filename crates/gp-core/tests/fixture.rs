//! Reads the 50-digit values of `fixtures/gp-core`.

use std::path::PathBuf;

use faer::Mat;
use kernels::{TorqueCovariance, TorqueParams};

/// Number of covariates of every fixture: two joints.
pub const D: usize = 6;

/// Training data and hyperparameters of one case.
pub struct Case {
    pub x: Mat<f64>,
    pub targets: Vec<f64>,
    pub covariance: TorqueCovariance,
    pub noise_std: f64,
}

/// Rows of one fixture file, without its header.
pub fn rows(name: &str) -> Vec<Vec<String>> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../fixtures/gp-core")
        .join(name);
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader
        .records()
        .map(|record| record.unwrap().iter().map(str::to_owned).collect())
        .collect()
}

pub fn numbers(cells: &[String]) -> Vec<f64> {
    cells.iter().map(|cell| cell.parse().unwrap()).collect()
}

/// The matrix whose rows are given.
pub fn matrix(rows: &[Vec<f64>]) -> Mat<f64> {
    Mat::from_fn(rows.len(), rows[0].len(), |row, col| rows[row][col])
}

/// Rows of `log_marginal.csv` of one case: (name, θ, value).
pub fn likelihood_rows(case: &str) -> Vec<(String, Option<f64>, f64)> {
    rows("log_marginal.csv")
        .into_iter()
        .filter(|row| row[0] == case)
        .map(|row| (row[1].clone(), row[3].parse().ok(), row[4].parse().unwrap()))
        .collect()
}

pub fn case(name: &str) -> Case {
    let data: Vec<Vec<f64>> = rows(&format!("inputs_{name}.csv"))
        .iter()
        .map(|row| numbers(row))
        .collect();
    let thetas = likelihood_rows(name);
    let named = |wanted: &str| -> Vec<f64> {
        let matching = thetas.iter().filter(|row| row.0 == wanted);
        matching.map(|row| row.1.unwrap()).collect()
    };
    let coulomb_std = named("coulomb_std");
    Case {
        x: Mat::from_fn(data.len(), D, |row, col| data[row][col]),
        targets: data.iter().map(|row| row[D]).collect(),
        noise_std: named("noise_std")[0],
        covariance: TorqueCovariance::new(TorqueParams {
            bias_std: named("bias_std")[0],
            linear_std: named("linear_std"),
            signal_std: named("signal_std")[0],
            length_scales: named("length_scales"),
            coulomb_std: (!coulomb_std.is_empty()).then_some(coulomb_std),
        })
        .unwrap(),
    }
}

/// Relative error that n roundings of K leave in K⁻¹: n ε κ(K).
pub fn conditioning_error(case: &Case) -> f64 {
    let posterior = gp_core::Posterior::dense(
        case.covariance.clone(),
        case.noise_std,
        case.x.as_ref(),
        &case.targets,
    )
    .unwrap();
    let n = case.targets.len() as f64;
    n * f64::EPSILON * posterior.basis().factor.condition_lower_bound()
}
