//! K^ρ as regressions: by hand, back and forth, and the same prior.

use faer::{Mat, mat};
use kernels::{Covariance, TorqueCovariance, TorqueForm};
use mtgp::prior::{TaskMatrix, TaskRegression};
use mtgp::{MtgpError, MultiTaskCovariance, TaskCovariance, TaskFactor, with_task};

/// K^ρ = 4ΛΛᵀ of three tasks and rank 2.
fn by_hand() -> Mat<f64> {
    let lambda = [[0.5, 0.25], [1.5, 0.5], [1.0, 0.0]];
    let product = |a: usize, b: usize| lambda[a][0] * lambda[b][0] + lambda[a][1] * lambda[b][1];
    Mat::from_fn(3, 3, |a, b| 4.0 * product(a, b))
}

fn assert_close(found: &Mat<f64>, expected: &Mat<f64>, tolerance: f64) {
    for row in 0..expected.nrows() {
        for col in 0..expected.ncols() {
            let error = (found[(row, col)] - expected[(row, col)]).abs();
            assert!(error <= tolerance, "({row}, {col}): {error:e}");
        }
    }
}

#[test]
fn regressions_worked_by_hand() {
    let (mut regression, variance) = TaskRegression::of(by_hand().as_ref(), 2).unwrap();
    // f_2 has the largest variance, 4 · 2.5; of f_3 it leaves 1 − 1.5²/2.5 = 0.1, of f_1 less.
    assert_eq!(regression.order(), [1, 2, 0]);
    assert!((variance - 10.0).abs() < 1e-14);
    let names: Vec<String> =
        (regression.layout().specs().iter().map(ToString::to_string)).collect();
    let expected = [
        "task_std[0]",
        "task_regression[2,1]",
        "task_regression[0,1]",
        "task_regression[0,2]",
    ];
    assert_eq!(names, expected);
    // s_2² = 0.1/2.5; f_3 = 1.5/2.5 f_2 + …; (½, ¼) = ½ (1½, ½) − ¼ (1, 0).
    let found = regression.params();
    for (found, expected) in found.iter().zip([0.2, 0.6, 0.5, -0.25]) {
        assert!((found - expected).abs() < 1e-13, "{found} {expected}");
    }

    // Back to rows of our choice.
    regression.set_params(&[0.5, 2.0, 3.0, -1.0]);
    // Λ of task 2: (1, 0); of task 3: (2, 0.5); of task 1: 3 (1, 0) − (2, 0.5).
    let expected = mat![[1.0, -0.5], [1.0, 0.0], [2.0, 0.5]];
    assert_eq!(regression.root(), expected);
}

#[test]
fn the_prior_is_the_same_in_both_forms() {
    let entries = [0.9, -0.4, 1.1, 0.3, -0.8, 0.6, 1.2, 0.1, -0.5];
    let factor = TaskFactor::from_entries(4, 3, &entries).unwrap();
    let input = TorqueCovariance::unit(1, TorqueForm::Coulomb);
    let prior = MultiTaskCovariance::new(input, TaskCovariance::Factor(factor));
    let regressions = prior.with_regression().unwrap();
    let x = Mat::from_fn(8, 3, |row, col| (0.9 * row as f64 + 1.7 * col as f64).sin());
    let rows: Vec<Mat<f64>> = (0..4).map(|task| with_task(x.as_ref(), task)).collect();
    let all = Mat::from_fn(32, 4, |row, col| rows[row / 8][(row % 8, col)]);
    let expected = prior.gram(all.as_ref());
    // Entries up to 3 · 8; the condition of the first tasks' block is some hundred.
    assert_close(&regressions.gram(all.as_ref()), &expected, 1e-11);
    let first = regressions.task().k_task();
    assert_eq!((regressions.n_params(), prior.n_params()), (17, 18));
    let largest = (0..4).map(|i| first[(i, i)]).fold(0.0, f64::max);
    assert!(
        (largest - 1.0).abs() < 1e-14,
        "the first task has the largest variance"
    );
}

#[test]
fn tasks_without_anything_of_their_own_and_bad_ranks() {
    let ones = TaskCovariance::Ones { n_tasks: 3 }.k_task();
    let (regression, _) = TaskRegression::of(ones.as_ref(), 2).unwrap();
    assert_close(&regression.k_task(), &ones, 1e-7);
    let error = TaskRegression::of(ones.as_ref(), 4).unwrap_err();
    assert_eq!(
        error,
        MtgpError::BadRank {
            rank: 4,
            n_tasks: 3
        }
    );
}
