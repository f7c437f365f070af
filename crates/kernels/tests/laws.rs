//! The laws of covariances, on all of them.

use faer::Mat;
use kernels::laws::{self, Subject};
use kernels::{
    Constant, ContinuousJoints, Coulomb, Covariance, Jitter, LinearArd, OnColumns, RigidBody,
    SeArd, Sum, TorqueCovariance, TorqueForm, TorqueParams,
};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Two joints: six covariates (q, q̇, q̈).
const D: usize = 6;

/// More than one block of the squared-exponential term (64), and not a multiple.
const SIZES: [usize; 3] = [1, 7, 83];

fn uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

fn inputs(rng: &mut ChaCha8Rng, n: usize) -> Mat<f64> {
    let mut x = Mat::from_fn(n, D, |_, _| 0.0);
    for row in 0..n {
        for col in 0..D {
            x[(row, col)] = uniform(rng, -2.0, 3.0);
        }
    }
    // A joint at rest and a repeated sample, where sgn and distance have their edges.
    x[(0, 2)] = 0.0;
    if n > 2 {
        for col in 0..D {
            x[(2, col)] = x[(1, col)];
        }
    }
    x
}

fn vector(rng: &mut ChaCha8Rng, n: usize) -> Vec<f64> {
    (0..n).map(|_| uniform(rng, 0.3, 2.0)).collect()
}

fn turning<const C: usize>(covariance: &TorqueCovariance, joints: [usize; C]) -> TorqueCovariance {
    let continuous = ContinuousJoints::of(joints);
    covariance.with_continuous(continuous).unwrap()
}

/// Every covariance of the crate; new ones are added here.
fn all(rng: &mut ChaCha8Rng) -> Vec<(&'static str, Box<dyn Covariance>)> {
    let torque = |rng: &mut ChaCha8Rng, form: TorqueForm| {
        TorqueCovariance::new(TorqueParams {
            bias_std: 0.7,
            linear_std: vector(rng, D),
            signal_std: 1.3,
            length_scales: vector(rng, D),
            coulomb_std: (form == TorqueForm::Coulomb).then(|| vector(rng, D / 3)),
        })
        .unwrap()
    };
    let linear = LinearArd::new(vector(rng, D)).unwrap();
    let se = SeArd::new(1.4, vector(rng, D)).unwrap();
    // Parameters that are correlated, of rank 4 of 6.
    let root = Mat::from_fn(D, 4, |row, col| 1.0 / (1.0 + (row + 2 * col) as f64));
    let rigid_body = RigidBody::new(root.as_ref(), 0.9).unwrap();
    let of_two = RigidBody::independent(&[0.5, 0.0], 1.1).unwrap();
    vec![
        ("constant", Box::new(Constant::new(0.8).unwrap())),
        ("linear", Box::new(linear.clone())),
        ("se", Box::new(se.clone())),
        ("jitter", Box::new(Jitter::new(0.3).unwrap())),
        (
            "coulomb",
            Box::new(Coulomb::new(vector(rng, D / 3)).unwrap()),
        ),
        ("rigid body", Box::new(rigid_body)),
        (
            "columns",
            Box::new(Sum::new(OnColumns::new(of_two, 4..6), se.clone())),
        ),
        ("sum", Box::new(Sum::new(linear, se))),
        ("smooth torque", Box::new(torque(rng, TorqueForm::Smooth))),
        ("torque", Box::new(torque(rng, TorqueForm::Coulomb))),
        (
            "continuous smooth torque",
            Box::new(turning(&torque(rng, TorqueForm::Smooth), [1])),
        ),
        (
            "continuous torque",
            Box::new(turning(&torque(rng, TorqueForm::Coulomb), [0, 1])),
        ),
    ]
}

/// Runs a law on every covariance at every size.
fn for_all(law: impl Fn(&mut Subject<'_>)) {
    for n in SIZES {
        let mut rng = ChaCha8Rng::seed_from_u64(5 + n as u64);
        for (name, mut cov) in all(&mut rng) {
            let (x, other) = (inputs(&mut rng, n), inputs(&mut rng, 70));
            let tolerance =
                entry_tolerance(cov.as_ref(), &x).max(entry_tolerance(cov.as_ref(), &other));
            law(&mut Subject {
                name: &format!("{name}, n={n}"),
                cov: cov.as_mut(),
                x: &x,
                other: &other,
                tolerance,
                draw: &mut || rng.random(),
            });
        }
    }
}

/// Rounding of one entry: about 4 operations per covariate on terms no larger than
/// the prior variances, times the squared scaled distance for the exponential.
fn entry_tolerance(cov: &dyn Covariance, x: &Mat<f64>) -> f64 {
    let scale = cov.diag(x.as_ref()).into_iter().fold(0.0, f64::max);
    // |z|² ≤ 6 (3/0.3)² = 600 in se_ard's bound (d + 2) ε max|z|².
    (D as f64 + 2.0) * 600.0 * f64::EPSILON * scale
}

/// A law that jitter is exempt from: its delta is between observations, not inputs.
fn of_inputs(law: impl Fn(&mut Subject<'_>)) -> impl Fn(&mut Subject<'_>) {
    move |s| {
        if !s.name.starts_with("jitter") {
            law(s);
        }
    }
}

#[test]
fn cross_of_a_set_with_itself_is_its_gram_matrix() {
    for_all(of_inputs(
        laws::cross_of_a_set_with_itself_is_its_gram_matrix,
    ));
}

#[test]
fn cross_is_symmetric_in_its_arguments() {
    for_all(laws::cross_is_symmetric_in_its_arguments);
}

#[test]
fn diag_is_the_diagonal_of_the_gram_matrix() {
    for_all(laws::diag_is_the_diagonal_of_the_gram_matrix);
}

#[test]
fn gram_matrix_is_positive_semi_definite() {
    for_all(laws::gram_matrix_is_positive_semi_definite);
}

#[test]
fn gram_and_cross_accumulate_on_what_is_there() {
    for_all(laws::gram_and_cross_accumulate_on_what_is_there);
}

#[test]
fn transposed_views_give_the_same_values() {
    for_all(laws::transposed_views_give_the_same_values);
}

#[test]
fn layout_names_every_parameter() {
    for_all(laws::layout_names_every_parameter);
}

#[test]
fn adjoint_is_the_gradient_by_central_differences() {
    for_all(laws::adjoint_is_the_gradient_by_central_differences);
}

#[test]
fn cross_adjoint_is_the_gradient_by_central_differences() {
    for_all(laws::cross_adjoint_is_the_gradient_by_central_differences);
}

#[test]
fn adjoint_accumulates() {
    for_all(laws::adjoint_accumulates);
}

#[test]
fn cross_adjoint_of_a_set_with_itself_is_its_gram_adjoint() {
    for_all(of_inputs(|s| {
        let (name, cov, x) = (s.name, &mut s.cov, s.x);
        let n = x.nrows();
        let q = Mat::from_fn(n, n, |row, col| 1.0 / (1.0 + row as f64 + col as f64));
        let mut of_gram = vec![0.0; cov.n_params()];
        cov.gram_adjoint(x.as_ref(), q.as_ref(), &mut of_gram);
        let mut of_cross = vec![0.0; cov.n_params()];
        cov.cross_adjoint(x.as_ref(), x.as_ref(), q.as_ref(), &mut of_cross);
        let scale = of_gram.iter().fold(0.0, |l: f64, g| l.max(g.abs()));
        for (a, b) in of_gram.iter().zip(&of_cross) {
            // Entries to 1e3 ε (see entry_tolerance), magnified by z² ≤ 600 in (z − z′)².
            let tolerance = 6e5 * f64::EPSILON * scale;
            assert!((a - b).abs() <= tolerance, "{name}: {a} {b}");
        }
    }));
}

#[test]
fn sum_is_the_sum_of_its_terms() {
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let x = inputs(&mut rng, 20);
    let linear = LinearArd::new(vector(&mut rng, D)).unwrap();
    let se = SeArd::new(1.4, vector(&mut rng, D)).unwrap();
    let (k_linear, k_se) = (linear.gram(x.as_ref()), se.gram(x.as_ref()));
    let k_sum = Sum::new(linear, se).gram(x.as_ref());
    for row in 0..20 {
        for col in 0..20 {
            let parts = k_linear[(row, col)] + k_se[(row, col)];
            let difference = (k_sum[(row, col)] - parts).abs();
            assert!(
                difference <= 4.0 * f64::EPSILON * parts.abs().max(1.0),
                "{difference}"
            );
        }
    }
}
