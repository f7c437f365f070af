//! Eq. (6): the Coulomb term against values worked by hand.

use faer::mat;
use kernels::{Coulomb, Covariance, sgn};

#[test]
fn sign_of_zero_is_zero() {
    assert_eq!(
        [sgn(0.0), sgn(-0.0), sgn(1e-300), sgn(-2.0)],
        [0.0, 0.0, 1.0, -1.0]
    );
    assert!(sgn(f64::NAN).is_nan());
}

#[test]
fn coulomb_term_multiplies_signs_of_velocities_only() {
    // Two joints: q1 q2 | qd1 qd2 | qdd1 qdd2.
    let x = mat![
        [-1.0, -1.0, 0.5, -0.1, -1.0, -1.0],
        [1.0, 1.0, 2.0, 3.0, 1.0, 1.0],
        [1.0, 1.0, 0.0, 3.0, 1.0, 1.0]
    ];
    let k = Coulomb::new(vec![2.0, 3.0]).unwrap().gram(x.as_ref());
    // 4·(+1)(+1) + 9·(−1)(+1) = −5;  4·1·0 + 9·(−1)(+1) = −9;  4·0 + 9 = 9
    assert_eq!([k[(1, 0)], k[(2, 0)], k[(2, 2)]], [-5.0, -9.0, 9.0]);
}
