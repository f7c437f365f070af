//! Eq. (5): each term against a value worked by hand.

use faer::mat;
use kernels::{Constant, Covariance, Jitter, KernelError, LinearArd, SeArd};

#[test]
fn bias_is_the_square_of_its_std() {
    let x = mat![[1.0], [2.0]];
    let k = Constant::new(3.0).unwrap().gram(x.as_ref());
    assert_eq!([k[(0, 0)], k[(1, 0)], k[(0, 1)]], [9.0, 9.0, 9.0]);
}

#[test]
fn linear_term_weights_each_covariate() {
    let x = mat![[1.0, 2.0], [3.0, -1.0]];
    let k = LinearArd::new(vec![2.0, 3.0]).unwrap().gram(x.as_ref());
    // 4·1·3 + 9·2·(−1) = −6;  4·1 + 9·4 = 40;  4·9 + 9·1 = 45
    assert_eq!([k[(1, 0)], k[(0, 0)], k[(1, 1)]], [-6.0, 40.0, 45.0]);
}

#[test]
fn squared_exponential_scales_each_covariate() {
    let x = mat![[1.0, 2.0], [3.0, -1.0]];
    let k = SeArd::new(2.0, vec![2.0, 1.5]).unwrap().gram(x.as_ref());
    // 4 exp(−½((2/2)² + (3/1.5)²)) = 4 exp(−2.5)
    let expected = 4.0 * (-2.5_f64).exp();
    assert!((k[(1, 0)] - expected).abs() <= 16.0 * f64::EPSILON * expected);
    assert_eq!(k[(0, 0)], 4.0);
}

#[test]
fn noise_is_on_the_diagonal_only() {
    let x = mat![[1.0], [1.0]];
    let noise = Jitter::new(0.5).unwrap();
    let k = noise.gram(x.as_ref());
    assert_eq!([k[(0, 0)], k[(1, 0)]], [0.25, 0.0]);
    assert_eq!(noise.cross(x.as_ref(), x.as_ref())[(0, 0)], 0.0);
}

#[test]
fn hyperparameter_that_is_not_positive_is_named() {
    let error = SeArd::new(1.0, vec![1.0, 0.0]).unwrap_err();
    assert_eq!(
        error,
        KernelError::NotPositive {
            name: "length_scales[1]".into(),
            value: 0.0
        }
    );
    assert!(LinearArd::new(vec![1.0, f64::NAN]).is_err());
    assert!(Constant::new(f64::INFINITY).is_err());
}

#[test]
fn overflowing_hyperparameters_show_in_the_gram_matrix() {
    let mut se = SeArd::new(1.0, vec![1.0]).unwrap();
    se.set_params(&[1.0, 1e-320]);
    let k = se.gram(mat![[0.0], [1.0]].as_ref());
    assert!(k[(1, 0)].is_nan() || k[(0, 0)].is_nan());
}
