//! A small robot with one model of each kind of one load.

use faer::Mat;
use gp_core::{BayesLinear, LikelihoodOptions, LinearForm, Method, Posterior};
use kernels::{TorqueCovariance, TorqueForm, TorqueParams};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use torque_model::{
    FitSummary, JointModel, ModelParts, Process, Provenance, RobotModel, States, TrainingRanges,
};

pub const N_JOINTS: usize = 4;

/// Hyperparameters that are all different, so that none can take another's place.
pub fn covariance(form: TorqueForm) -> TorqueCovariance {
    let ramp = |from: f64, step: f64, n: usize| -> Vec<f64> {
        (0..n).map(|i| from + step * i as f64).collect()
    };
    TorqueCovariance::new(TorqueParams {
        bias_std: 0.7,
        linear_std: ramp(0.2, 0.05, 3 * N_JOINTS),
        signal_std: 1.3,
        length_scales: ramp(1.5, 0.25, 3 * N_JOINTS),
        coulomb_std: match form {
            TorqueForm::Smooth => None,
            TorqueForm::Coulomb => Some(ramp(0.3, 0.1, N_JOINTS)),
        },
    })
    .unwrap()
}

/// Torques of joint `joint_idx` as a smooth function with friction.
pub fn torques(x: &Mat<f64>, joint_idx: usize) -> Vec<f64> {
    (0..x.nrows())
        .map(|row| {
            let (q, qd) = (x[(row, joint_idx)], x[(row, N_JOINTS + joint_idx)]);
            3.0 * q.sin() + 0.5 * qd + 0.8 * qd.signum() + 0.2 * x[(row, 2 * N_JOINTS)]
        })
        .collect()
}

pub fn process(x: &Mat<f64>, joint_idx: usize, form: TorqueForm, method: Method) -> JointModel {
    let targets = torques(x, joint_idx);
    let options = LikelihoodOptions {
        method,
        certificate: 1e-4,
    };
    let cov = covariance(form);
    let posterior = Posterior::new(cov, 0.05, x.as_ref(), &targets, options).unwrap();
    JointModel::Process(Box::new(Process {
        rows: States { n_joints: N_JOINTS },
        summary: summary(posterior.rank()),
        posterior,
    }))
}

/// A summary in which all numbers differ.
pub fn summary(rank: usize) -> FitSummary {
    FitSummary {
        log_marginal: -12.5,
        start: "given".to_owned(),
        n_starts: 1,
        evaluations: 17,
        bounds_hit: vec!["linear_std[3]".to_owned()],
        condition_lower_bound: 1e3,
        method: "dense".to_owned(),
        rank,
        error_bound: Some(1e-3),
    }
}

pub fn linear(x: &Mat<f64>, joint_idx: usize, form: LinearForm) -> JointModel {
    let targets = torques(x, joint_idx);
    BayesLinear::fit(x.as_ref(), &targets, form).unwrap().into()
}

/// LR¬c, LRc, GP¬c and GPc for joints 0 to 3, from `n` samples.
pub fn all_kinds(n: usize) -> RobotModel {
    let x = uniform_inputs(5, n, 3 * N_JOINTS);
    let learned = vec![
        (0, linear(&x, 0, LinearForm::Smooth)),
        (1, linear(&x, 1, LinearForm::Coulomb)),
        (2, process(&x, 2, TorqueForm::Smooth, Method::Dense)),
        (3, process(&x, 3, TorqueForm::Coulomb, Method::Dense)),
    ];
    RobotModel::new(parts(&x, learned)).unwrap()
}

/// GP¬c and GPc on pivots for joints 0 and 2, from `n` samples on a curve of low rank.
pub fn low_rank(n: usize) -> RobotModel {
    let x = curve(n);
    let learned = vec![
        (0, process(&x, 0, TorqueForm::Smooth, Method::Certified)),
        (2, process(&x, 2, TorqueForm::Coulomb, Method::Certified)),
    ];
    RobotModel::new(parts(&x, learned)).unwrap()
}

/// The parts of a model of one load, learned at the rows of `x`.
pub fn parts(x: &Mat<f64>, learned: Vec<(usize, JointModel)>) -> ModelParts {
    ModelParts {
        joint_names: names(),
        contexts: Vec::new(),
        learned,
        ranges: ranges(x),
        context_ranges: Vec::new(),
        selection: None,
        robot: None,
        provenance: provenance(),
    }
}

/// Uniform between −2 and 2.
pub fn uniform_inputs(seed: u64, n: usize, d: usize) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut x = Mat::zeros(n, d);
    for row in 0..n {
        for col in 0..d {
            x[(row, col)] = 4.0 * rng.random::<f64>() - 2.0;
        }
    }
    x
}

/// A closed curve with its rates: each joint swings at its own frequency.
pub fn curve(n: usize) -> Mat<f64> {
    Mat::from_fn(n, 3 * N_JOINTS, |row, col| {
        let rate = 1.0 + 0.5 * (col % N_JOINTS) as f64;
        let phase = rate * 0.05 * row as f64;
        [phase.sin(), rate * phase.cos(), -rate * rate * phase.sin()][col / N_JOINTS]
    })
}

pub fn names() -> Vec<String> {
    ["waist", "shoulder", "elbow", "wrist"]
        .map(str::to_owned)
        .into()
}

pub fn ranges(x: &Mat<f64>) -> TrainingRanges {
    TrainingRanges::of(x.as_ref()).unwrap()
}

pub fn provenance() -> Provenance {
    Provenance {
        data_sha256: [7; 32],
        robot_sha256: Some([9; 32]),
        program: "tests 0.1".to_owned(),
        context: "c2".to_owned(),
    }
}
