//! Laws that every covariance obeys, on the multi-task prior with each kind of K^ρ.

use faer::{Mat, Side};
use kernels::{Covariance, TorqueCovariance, TorqueForm, TorqueParams};
use mtgp::{MultiTaskCovariance, TaskCovariance, TaskFactor, with_task};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Two joints: six covariates (q, q̇, q̈).
const D: usize = 6;

const M: usize = 4;

/// More than one panel of columns (128), and not a multiple.
const SIZES: [usize; 4] = [1, 7, 83, 150];

/// How the rows of the tasks follow each other.
const ORDERS: [&str; 2] = ["sorted", "mixed"];

fn uniform(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.random::<f64>()
}

/// Rows (x, task), with a joint at rest and a repeated input.
fn rows(rng: &mut ChaCha8Rng, n: usize, order: &str) -> Mat<f64> {
    let mut x = Mat::zeros(n, D + 1);
    for row in 0..n {
        for col in 0..D {
            x[(row, col)] = uniform(rng, -2.0, 3.0);
        }
        x[(row, D)] = if order == "sorted" {
            (row * M / n) as f64
        } else {
            ((7 * row) % M) as f64
        };
    }
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

fn input(rng: &mut ChaCha8Rng, form: TorqueForm) -> TorqueCovariance {
    TorqueCovariance::new(TorqueParams {
        bias_std: 0.7,
        linear_std: vector(rng, D),
        signal_std: 1.3,
        length_scales: vector(rng, D),
        coulomb_std: (form == TorqueForm::Coulomb).then(|| vector(rng, D / 3)),
    })
    .unwrap()
}

/// Entries of either sign, and one that is zero.
fn factor(rng: &mut ChaCha8Rng, rank: usize) -> TaskCovariance {
    let mut entries: Vec<f64> = (0..TaskFactor::count(M, rank))
        .map(|_| uniform(rng, -1.5, 1.5))
        .collect();
    entries[1] = 0.0;
    TaskCovariance::Factor(TaskFactor::from_entries(M, rank, &entries).unwrap())
}

fn all(rng: &mut ChaCha8Rng) -> Vec<(&'static str, MultiTaskCovariance)> {
    let tasks = vec![
        ("identity", TaskCovariance::Identity { n_tasks: M }),
        ("ones", TaskCovariance::Ones { n_tasks: M }),
        ("rank 1", factor(rng, 1)),
        ("rank 3", factor(rng, 3)),
        ("full rank", factor(rng, M)),
    ];
    tasks
        .into_iter()
        .zip([
            TorqueForm::Coulomb,
            TorqueForm::Coulomb,
            TorqueForm::Smooth,
            TorqueForm::Coulomb,
            TorqueForm::Coulomb,
        ])
        .map(|((name, task), form)| (name, MultiTaskCovariance::new(input(rng, form), task)))
        .collect()
}

/// Runs a law on every kind at every size, sorted and mixed.
fn for_all(law: impl Fn(&str, &mut MultiTaskCovariance, &Mat<f64>, &mut ChaCha8Rng)) {
    for n in SIZES {
        for order in ORDERS {
            let mut rng = ChaCha8Rng::seed_from_u64(5 + n as u64);
            for (name, mut cov) in all(&mut rng) {
                let x = rows(&mut rng, n, order);
                law(&format!("{name}, {order}, n={n}"), &mut cov, &x, &mut rng);
            }
        }
    }
}

/// As for the covariances of inputs: 4 operations per covariate on terms no larger than the
/// prior variances, times the squared scaled distance of at most 6 (5/0.3)² for the exponential;
/// K^ρ enters as a factor.
fn entry_tolerance(cov: &MultiTaskCovariance, x: &Mat<f64>) -> f64 {
    let scale = cov.diag(x.as_ref()).into_iter().fold(1.0, f64::max);
    (D as f64 + 2.0) * 1700.0 * f64::EPSILON * scale
}

/// Eq. (16) entry by entry.
fn entry(cov: &MultiTaskCovariance, a: (usize, &Mat<f64>), b: (usize, &Mat<f64>)) -> f64 {
    let one = |(row, x): (usize, &Mat<f64>)| x.subrows(row, 1).subcols(0, D).to_owned();
    let task =
        |(row, x): (usize, &Mat<f64>)| (0..M).find(|task| *task as f64 == x[(row, D)]).unwrap();
    let between = cov.input().cross(one(a).as_ref(), one(b).as_ref());
    cov.task().k_task()[(task(a), task(b))] * between[(0, 0)]
}

#[test]
fn entries_are_products_of_the_two_covariances_eq_16() {
    for_all(|name, cov, x, rng| {
        let other = rows(rng, 70, "mixed");
        let (gram, cross) = (cov.gram(x.as_ref()), cov.cross(x.as_ref(), other.as_ref()));
        let tolerance = entry_tolerance(cov, x).max(entry_tolerance(cov, &other));
        for row in 0..x.nrows() {
            for col in (0..x.nrows()).step_by(5) {
                let (a, b) = (gram[(row, col)], entry(cov, (row, x), (col, x)));
                assert!((a - b).abs() <= tolerance, "{name} ({row}, {col}): {a} {b}");
            }
            for col in (0..70).step_by(9) {
                let (a, b) = (cross[(row, col)], entry(cov, (row, x), (col, &other)));
                assert!((a - b).abs() <= tolerance, "{name} ({row}, {col}): {a} {b}");
            }
        }
    });
}

#[test]
fn cross_of_a_set_with_itself_is_its_gram_matrix() {
    for_all(|name, cov, x, _| {
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
        let other = rows(rng, 70, "mixed");
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
            let error = (entry - variance).abs();
            assert!(error <= tolerance, "{name} {row}: {entry} {variance}");
        }
    });
}

#[test]
fn gram_matrix_is_positive_semi_definite() {
    for_all(|name, cov, x, _| {
        let gram = cov.gram(x.as_ref());
        let values = gram.self_adjoint_eigenvalues(Side::Lower).unwrap();
        let tolerance = x.nrows() as f64 * entry_tolerance(cov, x);
        let least = values[0];
        assert!(least >= -tolerance, "{name}: least eigenvalue {least}");
    });
}

#[test]
fn gram_and_cross_accumulate_on_what_is_there() {
    for_all(|name, cov, x, _| {
        let tolerance = entry_tolerance(cov, x);
        let once = cov.gram(x.as_ref());
        let mut gram = once.clone();
        cov.add_gram(x.as_ref(), gram.as_mut());
        let mut cross = once.clone();
        cov.add_cross(x.as_ref(), x.as_ref(), cross.as_mut());
        for row in 0..x.nrows() {
            for col in [0, row] {
                let expected = 2.0 * once[(row, col)];
                let (a, b) = (gram[(row, col)], cross[(row, col)]);
                assert!((a - expected).abs() <= tolerance, "{name} {row}: {a}");
                assert!((b - expected).abs() <= tolerance, "{name} {row}: {b}");
            }
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
        let layout = cov.layout();
        let changed: Vec<f64> = theta.iter().map(|value| 2.0 * value).collect();
        cov.set_params(&changed);
        assert_eq!(cov.params(), changed, "{name}");
        // A search counts in units that do not move with it.
        assert_eq!(cov.layout(), layout, "{name}");
    });
}

#[test]
fn entries_of_the_task_factor_are_named_by_task_and_column() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let cov = MultiTaskCovariance::new(input(&mut rng, TorqueForm::Smooth), factor(&mut rng, 2));
    let layout = cov.layout();
    let range = layout.range("task_factor").unwrap();
    let names: Vec<String> = layout.specs()[range]
        .iter()
        .map(ToString::to_string)
        .collect();
    let expected = [
        "[0,0]", "[1,0]", "[1,1]", "[2,0]", "[2,1]", "[3,0]", "[3,1]",
    ];
    assert_eq!(names, expected.map(|place| format!("task_factor{place}")));
}

/// Σ_ab Q_ab K_ab and the sum of the sizes of its terms.
fn weighted_sum(k: &Mat<f64>, q: &Mat<f64>) -> (f64, f64) {
    let (mut sum, mut size) = (0.0, 0.0);
    for col in 0..k.ncols() {
        for row in 0..k.nrows() {
            let term: f64 = q[(row, col)] * k[(row, col)];
            sum += term;
            size += term.abs();
        }
    }
    (sum, size)
}

/// Compares a gradient with central differences of Σ Q_ab K_ab.
fn check_gradient(
    name: &str,
    cov: &mut MultiTaskCovariance,
    q: &Mat<f64>,
    gradient: &[f64],
    matrix: impl Fn(&MultiTaskCovariance) -> Mat<f64>,
) {
    let theta = cov.params();
    for (idx, &value) in theta.iter().enumerate() {
        // A zero of Λ is of the size of the other entries.
        let scale = if value == 0.0 { 0.5 } else { value.abs() };
        let step = f64::EPSILON.cbrt() * scale;
        let mut at = |shift: f64| {
            let mut moved = theta.clone();
            moved[idx] += shift;
            cov.set_params(&moved);
            weighted_sum(&matrix(cov), q)
        };
        let ((high, size), (low, _)) = (at(step), at(-step));
        cov.set_params(&theta);
        let difference = (high - low) / (2.0 * step);
        // The bounds of the covariances' own laws.
        let rounding = 4e3 * f64::EPSILON * (size + 1e-3) / step;
        let truncation = 10.0 * step * step * size / scale.powi(3);
        let (slope, error) = (gradient[idx], (gradient[idx] - difference).abs());
        let tolerance = rounding + truncation;
        assert!(
            error <= tolerance,
            "{name}, parameter {idx}: {slope} {difference} {tolerance:e}"
        );
    }
}

fn random_matrix(rng: &mut ChaCha8Rng, n_rows: usize, n_cols: usize) -> Mat<f64> {
    let mut q = Mat::zeros(n_rows, n_cols);
    for col in 0..n_cols {
        for row in 0..n_rows {
            q[(row, col)] = uniform(rng, -1.0, 1.0);
        }
    }
    q
}

#[test]
fn adjoint_is_the_gradient_by_central_differences() {
    for_all(|name, cov, x, rng| {
        let n = x.nrows();
        let half = random_matrix(rng, n, n);
        let q = &half + half.transpose();
        // Only the lower triangle may be read.
        let lower = Mat::from_fn(
            n,
            n,
            |row, col| {
                if row >= col { q[(row, col)] } else { f64::NAN }
            },
        );
        let mut gradient = vec![0.0; cov.n_params()];
        cov.gram_adjoint(x.as_ref(), lower.as_ref(), &mut gradient);
        check_gradient(name, cov, &q, &gradient, |cov| cov.gram(x.as_ref()));
    });
}

#[test]
fn cross_adjoint_is_the_gradient_by_central_differences() {
    for_all(|name, cov, x, rng| {
        // More than one panel of columns, and not a multiple.
        let other = rows(rng, 140, "mixed");
        let q = random_matrix(rng, x.nrows(), 140);
        let mut gradient = vec![0.0; cov.n_params()];
        cov.cross_adjoint(x.as_ref(), other.as_ref(), q.as_ref(), &mut gradient);
        check_gradient(name, cov, &q, &gradient, |cov| {
            cov.cross(x.as_ref(), other.as_ref())
        });
        // As the rows of a matrix in memory.
        let transposed = q.transpose().to_owned();
        let mut again = vec![0.0; cov.n_params()];
        cov.cross_adjoint(
            x.as_ref(),
            other.as_ref(),
            transposed.transpose(),
            &mut again,
        );
        for (a, b) in gradient.iter().zip(&again) {
            assert!((a - b).abs() <= 1e-12 * a.abs().max(1.0), "{name}: {a} {b}");
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
            // Two panels at n = 150: the sum is rounded once more.
            let tolerance = 16.0 * f64::EPSILON * b.abs();
            assert!((2.0 * a - b).abs() <= tolerance, "{name}: {a} {b}");
        }
    });
}

#[test]
fn rows_of_a_task_the_model_does_not_have_are_refused() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let cov = MultiTaskCovariance::new(input(&mut rng, TorqueForm::Smooth), factor(&mut rng, 2));
    let x = Mat::zeros(3, D);
    assert_eq!(
        cov.rows_of(x.as_ref(), 1).unwrap(),
        with_task(x.as_ref(), 1)
    );
    let error = cov.rows_of(x.as_ref(), M).unwrap_err().to_string();
    assert_eq!(
        error,
        "row 0 belongs to task 4, but there are only 4, counted from zero"
    );
}
