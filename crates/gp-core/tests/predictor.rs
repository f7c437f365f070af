//! The predictor of a control loop against the model it is made from.

use faer::{Mat, RowRef};
use gp_core::{JointModel, LinearForm, ProcessModel, TorqueModel};
use kernels::{Covariance, TorqueForm};

use crate::samples::uniform_inputs;
use crate::torque_models::{
    N_JOINTS, all_kinds, linear, names, process, provenance, ranges, torques,
};

fn state(x: &Mat<f64>, row: usize) -> Vec<f64> {
    x.row(row).iter().copied().collect()
}

/// Bounds on the rounding errors of mean and variance of a process, both ways of computing together.
///
/// ```text
/// |δk_p| ≤ (d + 2) ε v² max|z|² + (2d + ℓ + 2) ε c̄_p      module docs of the squared exponential; sums of c
/// |δmean| ≤ Σ_p |β_p| (|δk_p| + 2 n ε c̄_p)
/// |δvar| ≤ 2 Σ_p |a_p| |δk_p| + 4 n ε (|a|ᵀ|L||φ| + |φ|²),   a = K⁻¹k, φ = L⁻¹k
/// ```
/// with c̄_p the sum of the absolute terms of c(p, x); the solve's part is the backward error of
/// substitution, |ΔL| ≤ n ε |L| (Higham 2002, theorem 8.5).
fn tolerances(process: &ProcessModel, x: &[f64]) -> (f64, f64) {
    let posterior = &process.posterior;
    let params = posterior.covariance().named_params();
    let (points, eps) = (posterior.x(), f64::EPSILON);
    let (n, d) = (points.nrows(), points.ncols());
    let factor = posterior.factor();

    let row = RowRef::from_slice(x).as_mat();
    let k = posterior.covariance().cross(points, row);
    let k: Vec<f64> = k.col_as_slice(0).to_vec();
    let a = factor.solve(&k);
    let mut phi = Mat::from_fn(n, 1, |p, _| k[p]);
    factor.half_solve_in_place(phi.as_mut());

    let largest_z = |p: usize| -> f64 {
        let scaled =
            (0..d).map(|j| (points[(p, j)].abs() + x[j].abs() + 4.0) / params.length_scales[j]);
        scaled.map(|z| z * z).sum()
    };
    let absolute = |p: usize| -> f64 {
        let linear = (0..d).map(|j| params.linear_std[j].powi(2) * (x[j] * points[(p, j)]).abs());
        let coulomb = params.coulomb_std.iter().flatten().map(|w| w * w);
        params.bias_std.powi(2)
            + params.signal_std.powi(2)
            + linear.sum::<f64>()
            + coulomb.sum::<f64>()
    };
    let (mut mean, mut var) = (0.0, 0.0);
    for p in 0..n {
        let sums = (2 * d + N_JOINTS + 2) as f64 * eps * absolute(p);
        let delta_k = (d + 2) as f64 * eps * params.signal_std.powi(2) * largest_z(p) + sums;
        mean += posterior.alpha()[p].abs() * (delta_k + 2.0 * n as f64 * eps * absolute(p));
        var += 2.0 * a[p].abs() * delta_k;
        let row: f64 = (0..=p)
            .map(|i| (factor.l()[(p, i)] * phi[(i, 0)]).abs())
            .sum();
        var += 4.0 * n as f64 * eps * (a[p].abs() * row + phi[(p, 0)].powi(2));
    }
    (mean, var)
}

fn tolerance_of(model: &JointModel, x: &[f64], mean: f64, var: f64) -> (f64, f64) {
    match model {
        JointModel::Process(process) => tolerances(process, x),
        // A backward stable product and solve with a well-conditioned R of order p ≤ 17.
        JointModel::Linear(_) => (
            1e3 * f64::EPSILON * (1.0 + mean.abs()),
            1e3 * f64::EPSILON * var,
        ),
    }
}

#[test]
fn predictor_equals_the_model_within_rounding() {
    // Orders on both sides of every multiple of the solver's panel and of the lanes.
    for n in [1, 2, 5, 8, 12, 61, 150] {
        let model = all_kinds(n);
        let predictor = model.predictor();
        let mut scratch = predictor.scratch();
        let x = uniform_inputs(n as u64, 50, 3 * N_JOINTS);
        let expected = model.predict(x.as_ref()).unwrap();
        let (mut mean, mut var) = ([0.0; N_JOINTS], [0.0; N_JOINTS]);
        for row in 0..x.nrows() {
            let x = state(&x, row);
            predictor
                .predict_into(&mut scratch, &x, &mut mean, &mut var)
                .unwrap();
            for (joint, (_, joint_model)) in model.learned().iter().enumerate() {
                let (m, v) = (expected[joint].mean[row], expected[joint].var[row]);
                let (of_mean, of_var) = tolerance_of(joint_model, &x, m, v);
                assert!(
                    (mean[joint] - m).abs() <= of_mean,
                    "{n} {joint}: {} {m} {of_mean:e}",
                    mean[joint]
                );
                assert!(
                    (var[joint] - v).abs() <= of_var,
                    "{n} {joint}: {} {v} {of_var:e}",
                    var[joint]
                );
            }
        }
    }
}

#[test]
fn a_joint_at_rest_has_no_friction() {
    let model = all_kinds(30);
    let predictor = model.predictor();
    let mut scratch = predictor.scratch();
    let (mut at_rest, mut moving, mut var) = ([0.0; N_JOINTS], [0.0; N_JOINTS], [0.0; N_JOINTS]);
    let mut x = [0.3; 3 * N_JOINTS];
    for (velocity, mean) in [(0.0, &mut at_rest), (1e-12, &mut moving)] {
        x[N_JOINTS..2 * N_JOINTS].fill(velocity);
        predictor
            .predict_into(&mut scratch, &x, mean, &mut var)
            .unwrap();
    }
    // Without signs nothing jumps; with them friction does.
    for (joint, jumps) in [false, true, false, true].into_iter().enumerate() {
        let jump = (moving[joint] - at_rest[joint]).abs();
        assert_eq!(jump > 1e-3, jumps, "{joint}: {jump}");
    }
}

#[test]
fn states_that_are_not_finite_leave_nan_and_an_error() {
    let predictor = all_kinds(12).predictor();
    let mut scratch = predictor.scratch();
    for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        for column in 0..3 * N_JOINTS {
            let mut x = [0.1; 3 * N_JOINTS];
            x[column] = value;
            let (mut mean, mut var) = ([1.0; N_JOINTS], [1.0; N_JOINTS]);
            let result = predictor.predict_into(&mut scratch, &x, &mut mean, &mut var);
            assert!(matches!(
                result,
                Err(gp_core::GpError::NonFiniteInput { row: 0, column: c, .. }) if c == column
            ));
            assert!(mean.iter().chain(&var).all(|value| value.is_nan()));
        }
    }
}

#[test]
fn states_of_any_size_never_panic_and_are_never_taken_for_certain() {
    let predictor = all_kinds(12).predictor();
    let mut scratch = predictor.scratch();
    let (mut mean, mut var) = ([0.0; N_JOINTS], [0.0; N_JOINTS]);
    for size in [f64::MAX, -f64::MAX, 1e200, -1e160, 5e-324, -0.0] {
        let x = [size; 3 * N_JOINTS];
        predictor
            .predict_into(&mut scratch, &x, &mut mean, &mut var)
            .unwrap();
        assert!(var.iter().all(|var| *var > 0.0 || var.is_nan()), "{size}: {var:?}");
    }
    // A call after an overflow is not touched by it.
    let x = [0.1; 3 * N_JOINTS];
    predictor
        .predict_into(&mut scratch, &x, &mut mean, &mut var)
        .unwrap();
    assert!(mean.iter().chain(&var).all(|value| value.is_finite()));
}

#[test]
fn a_predictor_of_some_joints_says_which() {
    let x = uniform_inputs(5, 20, 3 * N_JOINTS);
    let learned = vec![
        (1, linear(&x, 1, LinearForm::Coulomb)),
        (3, process(&x, 3, TorqueForm::Coulomb)),
    ];
    let model = TorqueModel::new(names(), learned, ranges(&x), provenance()).unwrap();
    let predictor = model.predictor();
    assert_eq!(predictor.joint_indices(), [1, 3]);
    assert_eq!(predictor.noise_vars(), [1e-4, 0.05 * 0.05]);

    let (mut mean, mut var) = ([0.0; 2], [0.0; 2]);
    let mut scratch = predictor.scratch();
    let first = state(&x, 0);
    predictor
        .predict_into(&mut scratch, &first, &mut mean, &mut var)
        .unwrap();
    // At a training point the process is within a few noise deviations of its target.
    assert!((mean[1] - torques(&x, 3)[0]).abs() < 4.0 * 0.05, "{mean:?}");
}
