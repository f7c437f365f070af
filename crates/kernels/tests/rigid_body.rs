//! Sec. 3.2: the covariance of the linear-in-parameters model.

use faer::{Mat, mat};
use kernels::{Covariance, KernelError, OnColumns, RigidBody};

#[test]
fn covariance_of_two_rows_worked_by_hand() {
    // R = [[1, 0], [2, 3]], so Σ = [[1, 2], [2, 13]]; s² = 4.
    let prior = RigidBody::new(mat![[1.0, 0.0], [2.0, 3.0]].as_ref(), 2.0).unwrap();
    let k = prior.gram(mat![[1.0, 1.0], [0.5, -1.0]].as_ref());
    // (1, 1)Σ(1, 1)ᵀ = 18; (0.5, −1)Σ(1, 1)ᵀ = (−1.5, −12)·(1, 1) = −13.5
    assert_eq!([k[(0, 0)], k[(1, 0)]], [72.0, -54.0]);
    assert_eq!(prior.parameter_covariance()[(1, 1)], 52.0);
}

#[test]
fn parameters_that_are_known_have_no_covariance() {
    let prior = RigidBody::independent(&[0.0, 0.0], 1.0).unwrap();
    let k = prior.gram(mat![[1.0, 2.0], [3.0, 4.0]].as_ref());
    assert_eq!([k[(0, 0)], k[(1, 0)], k[(1, 1)]], [0.0; 3]);
    assert_eq!(prior.n_parameters(), 2);
}

#[test]
fn columns_outside_the_range_do_not_matter() {
    let prior = RigidBody::independent(&[2.0], 1.0).unwrap();
    let of_last = OnColumns::new(prior, 1..2);
    let k = of_last.cross(mat![[7.0, 3.0]].as_ref(), mat![[-1.0, 5.0]].as_ref());
    assert_eq!(k[(0, 0)], 60.0);
}

#[test]
fn unusable_numbers_are_refused_by_name() {
    let root = Mat::from_fn(
        2,
        2,
        |row, col| if (row, col) == (1, 0) { f64::NAN } else { 1.0 },
    );
    let error = RigidBody::new(root.as_ref(), 1.0).unwrap_err();
    assert_eq!(
        error.to_string(),
        "parameter_root[1,0] is NaN, not a finite number"
    );
    assert!(matches!(
        RigidBody::independent(&[1.0], 0.0),
        Err(KernelError::NotPositive { .. })
    ));
}
