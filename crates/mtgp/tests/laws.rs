//! The laws of covariances, on the multi-task prior with each kind of K^ρ.

use faer::Mat;
use kernels::laws::{self, Subject};
use kernels::{Covariance, TorqueCovariance, TorqueForm, TorqueParams};
use mtgp::prior::{DescribedParams, DescribedTasks, TaskMatrix, TaskRegression};
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

fn regression(rng: &mut ChaCha8Rng, rank: usize) -> TaskRegression {
    let k_task = factor(rng, rank).k_task();
    TaskRegression::of(k_task.as_ref(), rank).unwrap().0
}

fn described(rng: &mut ChaCha8Rng) -> DescribedTasks {
    let descriptors = Mat::from_fn(M, 2, |_, _| uniform(rng, -1.0, 2.0));
    let params = DescribedParams {
        bias_std: 0.6,
        linear_std: vector(rng, 2),
        signal_std: 0.8,
        length_scales: vector(rng, 2),
    };
    DescribedTasks::new(descriptors, params).unwrap()
}

/// A prior whatever its K^ρ is made of.
trait Prior: Covariance {
    fn between_inputs(&self) -> &TorqueCovariance;
    fn between_tasks(&self) -> Mat<f64>;
}

impl<T: TaskMatrix> Prior for MultiTaskCovariance<T> {
    fn between_inputs(&self) -> &TorqueCovariance {
        self.input()
    }

    fn between_tasks(&self) -> Mat<f64> {
        self.task().k_task()
    }
}

fn all(rng: &mut ChaCha8Rng) -> Vec<(&'static str, Box<dyn Prior>)> {
    let tasks = [
        ("identity", TaskCovariance::Identity { n_tasks: M }),
        ("ones", TaskCovariance::Ones { n_tasks: M }),
        ("rank 1", factor(rng, 1)),
        ("rank 3", factor(rng, 3)),
        ("full rank", factor(rng, M)),
    ];
    let regressions = [
        ("regressions", regression(rng, 3)),
        ("regressions on one", regression(rng, 1)),
    ];
    let (coulomb, smooth) = (TorqueForm::Coulomb, TorqueForm::Smooth);
    let mut all: Vec<(&'static str, Box<dyn Prior>)> = Vec::new();
    for ((name, task), form) in
        (tasks.into_iter()).zip([coulomb, coulomb, smooth, coulomb, coulomb])
    {
        let prior = MultiTaskCovariance::new(input(rng, form), task);
        all.push((name, Box::new(prior)));
    }
    for ((name, task), form) in regressions.into_iter().zip([smooth, coulomb]) {
        let prior = MultiTaskCovariance::new(input(rng, form), task);
        all.push((name, Box::new(prior)));
    }
    let own = &mut ChaCha8Rng::seed_from_u64(77);
    let (input, tasks) = (input(own, coulomb), described(own));
    let prior = MultiTaskCovariance::new(input, TaskCovariance::Described(tasks));
    all.push(("descriptors", Box::new(prior)));
    all
}

/// Runs a law on every kind at every size, sorted and mixed: its name, the prior, the rows and other rows.
fn for_all_kinds(law: impl Fn(&str, &mut dyn Prior, &Mat<f64>, &Mat<f64>, &mut ChaCha8Rng)) {
    for n in SIZES {
        for order in ORDERS {
            let mut rng = ChaCha8Rng::seed_from_u64(5 + n as u64);
            for (name, mut cov) in all(&mut rng) {
                let (x, other) = (rows(&mut rng, n, order), rows(&mut rng, 140, "mixed"));
                let name = format!("{name}, {order}, n={n}");
                law(&name, cov.as_mut(), &x, &other, &mut rng);
            }
        }
    }
}

/// Runs a law of all covariances.
fn for_all(law: impl Fn(&mut Subject<'_>)) {
    for_all_kinds(|name, cov, x, other, rng| {
        let tolerance = entry_tolerance(cov, x).max(entry_tolerance(cov, other));
        law(&mut Subject {
            name,
            cov,
            x,
            other,
            tolerance,
            draw: &mut || rng.random(),
        });
    });
}

/// As for the covariances of inputs: 4 operations per covariate on terms no larger than the
/// prior variances, times the squared scaled distance of at most 6 (5/0.3)² for the exponential;
/// K^ρ enters as a factor.
fn entry_tolerance(cov: &dyn Prior, x: &Mat<f64>) -> f64 {
    let scale = cov.diag(x.as_ref()).into_iter().fold(1.0, f64::max);
    (D as f64 + 2.0) * 1700.0 * f64::EPSILON * scale
}

/// Eq. (16) entry by entry.
fn entry(cov: &dyn Prior, a: (usize, &Mat<f64>), b: (usize, &Mat<f64>)) -> f64 {
    let one = |(row, x): (usize, &Mat<f64>)| x.subrows(row, 1).subcols(0, D).to_owned();
    let task =
        |(row, x): (usize, &Mat<f64>)| (0..M).find(|task| *task as f64 == x[(row, D)]).unwrap();
    let between = cov.between_inputs().cross(one(a).as_ref(), one(b).as_ref());
    cov.between_tasks()[(task(a), task(b))] * between[(0, 0)]
}

#[test]
fn entries_are_products_of_the_two_covariances_eq_16() {
    for_all_kinds(|name, cov, x, other, _| {
        let (gram, cross) = (cov.gram(x.as_ref()), cov.cross(x.as_ref(), other.as_ref()));
        let tolerance = entry_tolerance(cov, x).max(entry_tolerance(cov, other));
        for row in 0..x.nrows() {
            for col in (0..x.nrows()).step_by(5) {
                let (a, b) = (gram[(row, col)], entry(cov, (row, x), (col, x)));
                assert!((a - b).abs() <= tolerance, "{name} ({row}, {col}): {a} {b}");
            }
            for col in (0..other.nrows()).step_by(9) {
                let (a, b) = (cross[(row, col)], entry(cov, (row, x), (col, other)));
                assert!((a - b).abs() <= tolerance, "{name} ({row}, {col}): {a} {b}");
            }
        }
    });
}

#[test]
fn cross_of_a_set_with_itself_is_its_gram_matrix() {
    for_all(laws::cross_of_a_set_with_itself_is_its_gram_matrix);
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
