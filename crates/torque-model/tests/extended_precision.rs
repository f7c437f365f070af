//! A rigid body's torque in a loop against the same linear model in 50 digits.

use std::path::PathBuf;
use std::sync::Arc;

use faer::Mat;
use gp_core::fit::ParameterPrior;
use gp_core::{LikelihoodOptions, Method, Posterior};
use torque_model::{JointModel, Process, RegressorRows, Robot, RobotModel, RobotSource, Rows};

use crate::rigid_body_models::{self, N_JOINTS, NOISE_STD};
use crate::torque_models::summary;

const JOINT: usize = 2;
const SPREAD: f64 = 1.25;

fn path(name: &str) -> PathBuf {
    let mut path = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    path.extend(["../../fixtures", name]);
    path
}

/// The columns of a fixture, without its header.
fn columns(name: &str) -> Mat<f64> {
    let mut file = csv::Reader::from_path(path(&format!("torque-model/{name}.csv"))).unwrap();
    let rows: Vec<Vec<f64>> = (file.records())
        .map(|row| row.unwrap().iter().map(|v| v.parse().unwrap()).collect())
        .collect();
    Mat::from_fn(rows.len(), rows[0].len(), |row, col| rows[row][col])
}

fn column(matrix: &Mat<f64>, col: usize) -> Vec<f64> {
    matrix.col(col).iter().copied().collect()
}

fn robot() -> Robot {
    let source = RobotSource {
        urdf: Some(std::fs::read_to_string(path("puma560.urdf")).unwrap()),
        sidecar: None,
        gravity: None,
    };
    Robot::new(source, "puma560.urdf").unwrap()
}

/// rbd of joint 3, conditioned on the fixture's samples.
fn model(method: Method) -> RobotModel {
    let (robot, prior) = (robot(), columns("rigid_body_prior"));
    let samples = columns("rigid_body_samples");
    let x = samples.subcols(0, 3 * N_JOINTS).to_owned();
    let rows = RegressorRows {
        robot: Arc::clone(&robot.model),
        joint_idx: JOINT,
        prior: ParameterPrior {
            mean: column(&prior, 0),
            std: column(&prior, 1),
        },
    };
    let at = rows.rows(0, x.as_ref()).unwrap();
    let known = rows.known_mean(at.as_ref()).unwrap();
    let targets: Vec<f64> = (column(&samples, 3 * N_JOINTS).iter().zip(known))
        .map(|(torque, known)| torque - known)
        .collect();
    let options = LikelihoodOptions {
        method,
        certificate: 1e-4,
    };
    let covariance = rows.prior.covariance_at(3 * N_JOINTS, SPREAD).unwrap();
    let posterior = Posterior::new(covariance, NOISE_STD, at.as_ref(), &targets, options).unwrap();
    let joint = JointModel::RigidBody(Box::new(Process {
        summary: summary(posterior.rank()),
        posterior,
        rows,
    }));
    rigid_body_models::model(&robot, vec![(JOINT, joint)], &x)
}

/// Largest relative errors of mean and standard deviation.
fn errors(mean: &[f64], var: &[f64]) -> (f64, f64) {
    let expected = columns("rigid_body_posterior");
    let d = 3 * N_JOINTS;
    let mut largest = (0.0_f64, 0.0_f64);
    for row in 0..expected.nrows() {
        let (m, std) = (expected[(row, d)], expected[(row, d + 1)].sqrt());
        largest.0 = largest.0.max((mean[row] - m).abs() / m.abs());
        // A negative variance is no standard deviation, and NaN would be lost in a maximum.
        largest.1 = largest.1.max((var[row].max(0.0).sqrt() - std).abs() / std);
    }
    largest
}

#[test]
fn the_loop_has_ten_digits_of_a_rigid_body_where_the_batch_has_fewer() {
    let elsewhere = columns("rigid_body_posterior");
    let x = elsewhere.subcols(0, 3 * N_JOINTS);
    let model = model(Method::Dense);
    let found = model.predict(0, x).unwrap();
    let batch = model.predict_joint(0, 0, x).unwrap();
    let of_loop = errors(&found[0].mean, &found[0].var);
    let of_batch = errors(&batch.mean, &batch.var);
    println!("loop {of_loop:?}, batch {of_batch:?}");
    assert!(of_loop.0 < 1e-10 && of_loop.1 < 1e-10, "{of_loop:?}");
    assert!(of_batch.1 > 10.0 * of_loop.1, "{of_batch:?} {of_loop:?}");
}

/// Here the pivots themselves decide how many digits there are.
#[test]
fn on_pivots_the_standard_deviation_is_that_of_the_samples() {
    let elsewhere = columns("rigid_body_posterior");
    let found = model(Method::Certified);
    let found = found
        .predict(0, elsewhere.subcols(0, 3 * N_JOINTS))
        .unwrap();
    let of_loop = errors(&found[0].mean, &found[0].var);
    println!("pivots {of_loop:?}");
    assert!(of_loop.0 < 1e-6 && of_loop.1 < 1e-3, "{of_loop:?}");
}
