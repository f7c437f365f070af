//! Models of the PUMA 560 that know its parameters, to save, load and ask.

use std::sync::Arc;

use faer::Mat;
use gp_core::fit::ParameterPrior;
use gp_core::{LikelihoodOptions, Method, Posterior};
use kernels::{Covariance, OnColumns, Sum, TorqueCovariance, TorqueParams};
use puma_dyn::{Effects, Model};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use torque_model::learn::{RigidBody, RigidBodyForm};
use torque_model::{
    JointModel, ModelParts, Process, RegressorRows, Robot, RobotModel, RobotSource, Rows,
    TrainingRanges,
};

use crate::torque_models::{provenance, summary};

pub const N_JOINTS: usize = 6;
/// σ, N·m.
pub const NOISE_STD: f64 = 0.01;
const SPREAD: f64 = 1.25;

pub fn puma() -> Robot {
    Robot::new(RobotSource::puma560(), "puma560").unwrap()
}

/// States of the arm: rad, rad/s, rad/s².
pub fn states(seed: u64, n: usize) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut x = Mat::zeros(n, 3 * N_JOINTS);
    for row in 0..n {
        for col in 0..3 * N_JOINTS {
            let scale = [3.0, 2.0, 6.0][col / N_JOINTS];
            x[(row, col)] = scale * (2.0 * rng.random::<f64>() - 1.0);
        }
    }
    x
}

/// What is known of the PUMA's parameters, with one mass known almost exactly.
pub fn prior() -> ParameterPrior {
    let options = gp_core::FitOptions::several();
    let mut prior = RigidBody::new(puma(), RigidBodyForm::Alone, options).prior;
    prior.std[30] = 1e-7;
    prior
}

fn remainder() -> TorqueCovariance {
    TorqueCovariance::new(TorqueParams {
        bias_std: 0.3,
        linear_std: vec![0.05; 3 * N_JOINTS],
        signal_std: 0.8,
        length_scales: vec![4.0; 3 * N_JOINTS],
        coulomb_std: Some(vec![0.2; N_JOINTS]),
    })
    .unwrap()
}

/// Torques of the robot with drives as described and a little that its parameters do not say.
fn torques(robot: &Model, joint_idx: usize, x: &Mat<f64>) -> Vec<f64> {
    let mut workspace = puma_dyn::Workspace::new(robot);
    let mut tau = [0.0; N_JOINTS];
    let mut of_row = |row: usize| {
        let state: Vec<f64> = x.row(row).iter().copied().collect();
        let (q, rates) = state.split_at(N_JOINTS);
        let (qd, qdd) = rates.split_at(N_JOINTS);
        let load = puma_dyn::Context::empty();
        puma_dyn::rnea(
            robot,
            &mut workspace,
            Effects::ALL,
            &load,
            q,
            qd,
            qdd,
            &mut tau,
        );
        tau[joint_idx] + 0.05 * (2.0 * q[joint_idx]).sin()
    };
    (0..x.nrows()).map(&mut of_row).collect()
}

fn process<C: Covariance>(
    covariance: C,
    rows: RegressorRows,
    x: &Mat<f64>,
    method: Method,
) -> Process<C, RegressorRows> {
    let at = rows.rows(0, x.as_ref()).unwrap();
    let known = rows.known_mean(at.as_ref()).unwrap();
    let targets: Vec<f64> = (torques(&rows.robot, rows.joint_idx, x).iter().zip(known))
        .map(|(torque, known)| torque - known)
        .collect();
    let options = LikelihoodOptions {
        method,
        certificate: 1e-4,
    };
    let posterior = Posterior::new(covariance, NOISE_STD, at.as_ref(), &targets, options).unwrap();
    Process {
        summary: summary(posterior.rank()),
        posterior,
        rows,
    }
}

pub fn joint_model(
    robot: &Robot,
    joint_idx: usize,
    form: RigidBodyForm,
    x: &Mat<f64>,
    method: Method,
) -> JointModel {
    let rows = RegressorRows {
        robot: Arc::clone(&robot.model),
        joint_idx,
        prior: prior(),
    };
    let n_inputs = 3 * N_JOINTS;
    let parameters = rows.prior.covariance_at(n_inputs, SPREAD).unwrap();
    match form {
        RigidBodyForm::Alone => {
            JointModel::RigidBody(Box::new(process(parameters, rows, x, method)))
        }
        RigidBodyForm::WithProcess => {
            let covariance = Sum::new(OnColumns::new(remainder(), 0..n_inputs), parameters);
            JointModel::RigidBodyAndProcess(Box::new(process(covariance, rows, x, method)))
        }
    }
}

/// rbd and rbd+gp for joints 0, 2, 3 and 5, from `n` samples.
pub fn rigid_body(n: usize, method: Method) -> RobotModel {
    let (robot, x) = (puma(), states(8, n));
    let forms = [
        (0, RigidBodyForm::Alone),
        (2, RigidBodyForm::Alone),
        (3, RigidBodyForm::WithProcess),
        (5, RigidBodyForm::WithProcess),
    ];
    let learned = forms.map(|(idx, form)| (idx, joint_model(&robot, idx, form, &x, method)));
    model(&robot, learned.into(), &x)
}

/// A model of a few samples, whose file is short.
pub fn small_rigid_body() -> RobotModel {
    let (robot, x) = (puma(), states(9, 3));
    let learned = [(2, RigidBodyForm::Alone), (5, RigidBodyForm::WithProcess)]
        .map(|(idx, form)| (idx, joint_model(&robot, idx, form, &x, Method::Dense)));
    model(&robot, learned.into(), &x)
}

pub fn model(robot: &Robot, learned: Vec<(usize, JointModel)>, x: &Mat<f64>) -> RobotModel {
    RobotModel::new(ModelParts {
        joint_names: robot.model.joint_names().to_vec(),
        contexts: Vec::new(),
        learned,
        ranges: TrainingRanges::of(x.as_ref()).unwrap(),
        context_ranges: Vec::new(),
        selection: None,
        robot: Some(robot.source.clone()),
        provenance: provenance(),
    })
    .unwrap()
}
