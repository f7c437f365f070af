//! Laws that every covariance obeys: one battery, run on all of them.

use faer::{Mat, Side};
use kernels::{
    Constant, Coulomb, Covariance, Jitter, LinearArd, OnColumns, RigidBody, SeArd, Sum,
    TorqueCovariance, TorqueForm, TorqueParams,
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
    ]
}

/// Runs a law on every covariance at every size.
fn for_all(law: impl Fn(&str, &mut dyn Covariance, &Mat<f64>, &mut ChaCha8Rng)) {
    for n in SIZES {
        let mut rng = ChaCha8Rng::seed_from_u64(5 + n as u64);
        for (name, mut cov) in all(&mut rng) {
            let x = inputs(&mut rng, n);
            law(name, cov.as_mut(), &x, &mut rng);
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

#[test]
fn cross_of_a_set_with_itself_is_its_gram_matrix() {
    for_all(|name, cov, x, _| {
        if name == "jitter" {
            return; // The delta is between observations, not inputs.
        }
        let (gram, cross) = (cov.gram(x.as_ref()), cov.cross(x.as_ref(), x.as_ref()));
        let tolerance = entry_tolerance(cov, x);
        for row in 0..x.nrows() {
            for col in 0..x.nrows() {
                let (a, b) = (gram[(row, col)], cross[(row, col)]);
                assert!((a - b).abs() <= tolerance, "{name} ({row}, {col}): {a} {b}");
            }
        }
    });
}

#[test]
fn cross_is_symmetric_in_its_arguments() {
    for_all(|name, cov, x, rng| {
        let other = inputs(rng, 70);
        let there = cov.cross(x.as_ref(), other.as_ref());
        let back = cov.cross(other.as_ref(), x.as_ref());
        let tolerance = entry_tolerance(cov, x).max(entry_tolerance(cov, &other));
        for row in 0..x.nrows() {
            for col in 0..other.nrows() {
                let (a, b) = (there[(row, col)], back[(col, row)]);
                assert!((a - b).abs() <= tolerance, "{name} ({row}, {col}): {a} {b}");
            }
        }
    });
}

#[test]
fn diag_is_the_diagonal_of_the_gram_matrix() {
    for_all(|name, cov, x, _| {
        let (gram, diag) = (cov.gram(x.as_ref()), cov.diag(x.as_ref()));
        let tolerance = 4.0 * D as f64 * f64::EPSILON * diag.iter().copied().fold(0.0, f64::max);
        for (row, variance) in diag.iter().enumerate() {
            let entry = gram[(row, row)];
            assert!(
                (entry - variance).abs() <= tolerance,
                "{name} {row}: {entry} {variance}"
            );
        }
    });
}

#[test]
fn gram_matrix_is_positive_semi_definite() {
    for_all(|name, cov, x, _| {
        let gram = cov.gram(x.as_ref());
        let values = gram.self_adjoint_eigenvalues(Side::Lower).unwrap();
        let tolerance = x.nrows() as f64 * entry_tolerance(cov, x);
        assert!(
            values[0] >= -tolerance,
            "{name}: least eigenvalue {}",
            values[0]
        );
    });
}

#[test]
fn gram_accumulates_on_what_is_there() {
    for_all(|name, cov, x, _| {
        let once = cov.gram(x.as_ref());
        let mut twice = once.clone();
        cov.add_gram(x.as_ref(), twice.as_mut());
        for row in 0..x.nrows() {
            let (a, b) = (2.0 * once[(row, 0)], twice[(row, 0)]);
            assert!(
                (a - b).abs() <= entry_tolerance(cov, x),
                "{name} {row}: {a} {b}"
            );
        }
    });
}

#[test]
fn transposed_views_give_the_same_values() {
    for_all(|name, cov, x, _| {
        let rows_in_memory = x.transpose().to_owned();
        let (a, b) = (cov.gram(x.as_ref()), cov.gram(rows_in_memory.transpose()));
        for row in 0..x.nrows() {
            let difference = (a[(row, 0)] - b[(row, 0)]).abs();
            assert!(
                difference <= entry_tolerance(cov, x),
                "{name} {row}: {difference}"
            );
        }
    });
}

#[test]
fn layout_names_every_parameter() {
    for_all(|name, cov, _, _| {
        let theta = cov.params();
        assert_eq!(cov.layout().len(), theta.len(), "{name}");
        assert_eq!(cov.n_params(), theta.len(), "{name}");
        let changed: Vec<f64> = theta.iter().map(|value| 2.0 * value).collect();
        cov.set_params(&changed);
        assert_eq!(cov.params(), changed, "{name}");
    });
}

/// tr(QᵀK) from the full matrices, its rounding error and the largest |Q_ab K_ab| sum.
fn weighted_sum(cov: &dyn Covariance, x: &Mat<f64>, q: &Mat<f64>) -> (f64, f64) {
    let gram = cov.gram(x.as_ref());
    let mut sum = 0.0;
    let mut size = 0.0;
    for col in 0..x.nrows() {
        for row in 0..x.nrows() {
            let term: f64 = q[(row, col)] * gram[(row, col)];
            sum += term;
            size += term.abs();
        }
    }
    (sum, size)
}

#[test]
fn adjoint_is_the_gradient_by_central_differences() {
    for_all(|name, cov, x, rng| {
        let n = x.nrows();
        let mut q = Mat::zeros(n, n);
        for col in 0..n {
            for row in col..n {
                q[(row, col)] = uniform(rng, -1.0, 1.0);
                q[(col, row)] = q[(row, col)];
            }
        }
        // Only the lower triangle may be read.
        let mut lower = q.clone();
        for col in 1..n {
            for row in 0..col {
                lower[(row, col)] = f64::NAN;
            }
        }
        let theta = cov.params();
        let mut gradient = vec![0.0; theta.len()];
        cov.gram_adjoint(x.as_ref(), lower.as_ref(), &mut gradient);

        for (idx, &value) in theta.iter().enumerate() {
            // The best step for third derivatives of size 1/θ³: ε^{1/3} θ.
            let step = f64::EPSILON.cbrt() * value;
            let mut at = |shift: f64| {
                let mut moved = theta.clone();
                moved[idx] += shift;
                cov.set_params(&moved);
                weighted_sum(cov, x, &q)
            };
            let ((high, size), (low, _)) = (at(step), at(-step));
            cov.set_params(&theta);
            let difference = (high - low) / (2.0 * step);
            // Rounding: the Gram entries carry 1e3 ε at most (see entry_tolerance) of
            // their size, n of them add up at random; truncation: step²/6 · f‴ with
            // f‴ ≤ 60·size/θ³, reached by e^{−s/2} as a function of a length scale.
            let rounding = 4e3 * f64::EPSILON * size / step;
            let truncation = 10.0 * step * step * size / value.powi(3);
            let error = (gradient[idx] - difference).abs();
            assert!(
                error <= rounding + truncation,
                "{name} n={n} parameter {idx}: {} {difference}",
                gradient[idx]
            );
        }
    });
}

/// Σ_ab Q_ab c(x1_a, x2_b) from the full matrix, and the sum of its terms' sizes.
fn weighted_cross_sum(
    cov: &dyn Covariance,
    x1: &Mat<f64>,
    x2: &Mat<f64>,
    q: &Mat<f64>,
) -> (f64, f64) {
    let cross = cov.cross(x1.as_ref(), x2.as_ref());
    let (mut sum, mut size) = (0.0, 0.0);
    for col in 0..x2.nrows() {
        for row in 0..x1.nrows() {
            let term: f64 = q[(row, col)] * cross[(row, col)];
            sum += term;
            size += term.abs();
        }
    }
    (sum, size)
}

#[test]
fn cross_adjoint_is_the_gradient_by_central_differences() {
    for_all(|name, cov, x, rng| {
        // More than one block of columns, and not a multiple.
        let other = inputs(rng, 70);
        let mut q = Mat::zeros(x.nrows(), 70);
        for col in 0..70 {
            for row in 0..x.nrows() {
                q[(row, col)] = uniform(rng, -1.0, 1.0);
            }
        }
        let theta = cov.params();
        let mut gradient = vec![0.0; theta.len()];
        cov.cross_adjoint(x.as_ref(), other.as_ref(), q.as_ref(), &mut gradient);

        for (idx, &value) in theta.iter().enumerate() {
            let step = f64::EPSILON.cbrt() * value;
            let mut at = |shift: f64| {
                let mut moved = theta.clone();
                moved[idx] += shift;
                cov.set_params(&moved);
                weighted_cross_sum(cov, x, &other, &q)
            };
            let ((high, size), (low, _)) = (at(step), at(-step));
            cov.set_params(&theta);
            let difference = (high - low) / (2.0 * step);
            // The same two errors as for the Gram matrix.
            let rounding = 4e3 * f64::EPSILON * size / step;
            let truncation = 10.0 * step * step * size / value.powi(3);
            let error = (gradient[idx] - difference).abs();
            assert!(
                error <= rounding + truncation,
                "{name} n={} parameter {idx}: {} {difference}",
                x.nrows(),
                gradient[idx]
            );
        }
    });
}

#[test]
fn cross_adjoint_of_a_set_with_itself_is_its_gram_adjoint() {
    for_all(|name, cov, x, _| {
        if name == "jitter" {
            return; // The delta is between observations, not inputs.
        }
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
    });
}

#[test]
fn adjoint_accumulates() {
    for_all(|name, cov, x, _| {
        let n = x.nrows();
        let q = Mat::from_fn(n, n, |row, col| if row == col { 1.0 } else { 0.25 });
        let mut once = vec![0.0; cov.n_params()];
        cov.gram_adjoint(x.as_ref(), q.as_ref(), &mut once);
        let mut again = once.clone();
        cov.gram_adjoint(x.as_ref(), q.as_ref(), &mut again);
        for (a, b) in once.iter().zip(&again) {
            assert!(
                (2.0 * a - b).abs() <= 4.0 * f64::EPSILON * b.abs(),
                "{name}: {a} {b}"
            );
        }
    });
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
