//! The predictor of a control loop against the model it is made from.

use faer::{Mat, RowRef};
use gp_core::{JointModel, LinearForm, Method, ProcessModel, TorqueModel};
use kernels::{Covariance, TorqueForm};

use crate::samples::uniform_inputs;
use crate::torque_models::{
    N_JOINTS, all_kinds, curve, linear, low_rank, names, process, provenance, ranges, torques,
};

fn state(x: &Mat<f64>, row: usize) -> Vec<f64> {
    x.row(row).iter().copied().collect()
}

/// L⁻¹b, or L⁻ᵀb, by substitution.
fn solve(l: &Mat<f64>, rhs: &[f64], is_transposed: bool) -> Vec<f64> {
    let n = rhs.len();
    let mut solution = rhs.to_vec();
    for step in 0..n {
        let row = if is_transposed { n - 1 - step } else { step };
        let known = if is_transposed { row + 1..n } else { 0..row };
        let entry = |i: usize| {
            if is_transposed {
                l[(i, row)]
            } else {
                l[(row, i)]
            }
        };
        let sum: f64 = known.map(|i| entry(i) * solution[i]).sum();
        solution[row] = (solution[row] - sum) / l[(row, row)];
    }
    solution
}

/// |L||v| for a lower triangle.
fn absolute_product(l: &Mat<f64>, v: &[f64]) -> Vec<f64> {
    let row = |row: usize| (0..=row).map(|i| (l[(row, i)] * v[i]).abs()).sum();
    (0..v.len()).map(row).collect()
}

/// Bounds on the rounding errors of mean and variance of a process, both ways of computing together.
///
/// ```text
/// |δk_p| ≤ (d + 2) ε v² max|z|² + (2d + ℓ + 2) ε c̄_p      module docs of the squared exponential; sums of c
/// |δmean| ≤ Σ_p |β_p| (|δk_p| + 2 r ε c̄_p)
/// φ = L⁻¹k:   |δ|φ|²| ≤ 2 |a|ᵀ(|δk| + 2 r ε |L||φ|) + 2 r ε |φ|²,   a = L⁻ᵀφ
/// ψ = R⁻ᵀφ:   |δ|ψ|²| ≤ 2 |L⁻ᵀb|ᵀ(|δk| + 2 r ε |L||φ|) + 4 r ε |b|ᵀ|Rᵀ||ψ| + 2 r ε |ψ|²,   b = R⁻¹ψ
/// ```
/// with c̄_p the sum of the absolute terms of c(p, x); a substitution solves a system
/// within |ΔL| ≤ r ε |L| of the one given (Higham 2002, theorem 8.5), here done twice.
fn tolerances(process: &ProcessModel, x: &[f64]) -> (f64, f64) {
    let eps = f64::EPSILON;
    let covariance = process.posterior.covariance();
    let basis = process.posterior.basis();
    let (points, weights) = (basis.points.as_ref(), &basis.weights);
    let l = basis.factor.l().to_owned();
    let noise_var = process.posterior.noise_std().powi(2);
    let noise = basis.noise_factor.as_ref();
    let noise = noise.map(|r| (r.transpose().to_owned(), noise_var));
    let (r, d) = (points.nrows(), points.ncols());
    let params = covariance.named_params();
    let largest_z = |p: usize| -> f64 {
        let reach = |j: usize| points[(p, j)].abs() + x[j].abs() + 4.0;
        (0..d)
            .map(|j| (reach(j) / params.length_scales[j]).powi(2))
            .sum()
    };
    let absolute = |p: usize| -> f64 {
        let linear = |j: usize| params.linear_std[j].powi(2) * (x[j] * points[(p, j)]).abs();
        let coulomb = params.coulomb_std.iter().flatten().map(|w| w * w);
        params.bias_std.powi(2)
            + params.signal_std.powi(2)
            + (0..d).map(linear).sum::<f64>()
            + coulomb.sum::<f64>()
    };
    let delta_k: Vec<f64> = (0..r)
        .map(|p| {
            (d + 2) as f64 * eps * params.signal_std.powi(2) * largest_z(p)
                + (2 * d + N_JOINTS + 2) as f64 * eps * absolute(p)
        })
        .collect();
    let mean = (0..r).map(|p| weights[p].abs() * (delta_k[p] + 2.0 * r as f64 * eps * absolute(p)));

    let sum = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| (a * b).abs()).sum() };
    let rounding = 2.0 * r as f64 * eps;
    let k = covariance.cross(points, RowRef::from_slice(x).as_mat());
    let phi = solve(&l, k.col_as_slice(0), false);
    let residual: Vec<f64> = (absolute_product(&l, &phi).iter().zip(&delta_k))
        .map(|(product, delta)| delta + rounding * product)
        .collect();
    let mut var = 2.0 * sum(&solve(&l, &phi, true), &residual) + rounding * sum(&phi, &phi);
    if let Some((r_transposed, noise_var)) = noise {
        let psi = solve(&r_transposed, &phi, false);
        let b = solve(&r_transposed, &psi, true);
        let of_phi = 2.0 * sum(&solve(&l, &b, true), &residual);
        let of_solve = 2.0 * rounding * sum(&b, &absolute_product(&r_transposed, &psi));
        var += noise_var * (of_phi + of_solve + rounding * sum(&psi, &psi));
    }
    (mean.sum(), var)
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

/// Largest error of mean and variance as a part of its tolerance, over the rows of `x`.
fn largest_errors(model: &TorqueModel, x: &Mat<f64>) -> (f64, f64) {
    let predictor = model.predictor();
    let mut scratch = predictor.scratch();
    let expected = model.predict(x.as_ref()).unwrap();
    let (mut mean, mut var) = (vec![0.0; expected.len()], vec![0.0; expected.len()]);
    let mut largest = (0.0_f64, 0.0_f64);
    for row in 0..x.nrows() {
        let x = state(x, row);
        predictor
            .predict_into(&mut scratch, &x, &mut mean, &mut var)
            .unwrap();
        for (joint, (_, joint_model)) in model.learned().iter().enumerate() {
            let (m, v) = (expected[joint].mean[row], expected[joint].var[row]);
            let (of_mean, of_var) = tolerance_of(joint_model, &x, m, v);
            largest.0 = largest.0.max((mean[joint] - m).abs() / of_mean);
            largest.1 = largest.1.max((var[joint] - v).abs() / of_var);
        }
    }
    largest
}

#[test]
fn predictor_equals_the_model_within_rounding() {
    // Orders on both sides of every multiple of the solver's panel and of the lanes.
    for n in [1, 2, 5, 8, 12, 61, 150] {
        let x = uniform_inputs(n as u64, 50, 3 * N_JOINTS);
        let (mean, var) = largest_errors(&all_kinds(n), &x);
        assert!(mean <= 1.0 && var <= 1.0, "{n}: {mean} {var}");
    }
}

#[test]
fn predictor_on_pivots_equals_the_model_within_rounding() {
    let model = low_rank(400);
    for (_, joint) in model.learned() {
        let JointModel::Process(process) = joint else {
            unreachable!()
        };
        let rank = process.posterior.rank();
        assert!((5..200).contains(&rank), "{rank}");
    }
    // On the curve, between its samples, and far from it.
    for x in [curve(400), uniform_inputs(3, 100, 3 * N_JOINTS)] {
        let (mean, var) = largest_errors(&model, &x);
        assert!(mean <= 1.0 && var <= 1.0, "{mean} {var}");
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
        assert!(
            var.iter().all(|var| *var > 0.0 || var.is_nan()),
            "{size}: {var:?}"
        );
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
        (3, process(&x, 3, TorqueForm::Coulomb, Method::Automatic)),
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
