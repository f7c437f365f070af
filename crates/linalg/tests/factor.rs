//! The Cholesky factor: small ones by hand, and where there is none.

use faer::{Mat, mat};
use linalg::{Factor, LinalgError};

#[test]
fn factor_reads_the_lower_triangle_and_gives_solutions() {
    let k = mat![[4.0, f64::NAN], [2.0, 10.0]];
    let factor = Factor::new(k.clone()).unwrap();
    // L = [2 0; 1 3]: |K| = 36, K⁻¹ = [10 −2; −2 4]/36.
    assert!((factor.log_det() - 36.0_f64.ln()).abs() <= 4.0 * f64::EPSILON * 4.0);
    let solution = factor.solve(&[36.0, 0.0]);
    assert!((solution[0] - 10.0).abs() + (solution[1] + 2.0).abs() <= 1e-14);
    let mut scratch = Mat::zeros(2, 2);
    let inverse = factor.into_inverse(&mut scratch);
    assert!(
        (inverse[(1, 0)] * 36.0 + 2.0).abs() <= 1e-14,
        "{}",
        inverse[(1, 0)]
    );
    assert!((inverse[(1, 1)] * 36.0 - 4.0).abs() <= 1e-14);
}

#[test]
fn matrix_that_is_not_positive_definite_is_refused_at_its_pivot() {
    let indefinite = mat![[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 2.0, 1.0]];
    let error = Factor::new(indefinite).unwrap_err();
    assert_eq!(
        error,
        LinalgError::NotPositiveDefinite { pivot: 2, order: 3 }
    );
    let missing = mat![[1.0, 0.0], [f64::NAN, 1.0]];
    assert!(matches!(
        Factor::new(missing),
        Err(LinalgError::NotPositiveDefinite { .. })
    ));
}

/// K_ij = 1 + min(i, j): large enough for tiles, L is 1 on and below the diagonal.
fn counts(order: usize) -> Mat<f64> {
    Mat::from_fn(order, order, |i, j| 1.0 + i.min(j) as f64)
}

#[test]
fn first_pivot_that_is_not_positive_is_named() {
    let order = 900;
    for pivot in [0, 5, 127, 128, 500, 899] {
        let mut k = counts(order);
        k[(pivot, pivot)] -= 2.0; // 1 before, −1 now
        let error = Factor::new(k).unwrap_err();
        assert_eq!(error, LinalgError::NotPositiveDefinite { pivot, order });
    }
}

#[test]
fn nan_anywhere_is_no_factor() {
    for (row, col) in [(0, 0), (3, 2), (640, 1), (899, 0), (899, 898), (700, 300)] {
        let mut k = counts(900);
        k[(row, col)] = f64::NAN;
        assert!(Factor::new(k).is_err(), "({row}, {col})");
    }
}
