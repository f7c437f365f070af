//! Eq. (7): the torque covariance against a value worked by hand, and its layout.

use faer::mat;
use kernels::{
    ContinuousJoints, Covariance, KernelError, TorqueCovariance, TorqueForm, TorqueParams,
    Transform,
};

fn params() -> TorqueParams {
    TorqueParams {
        bias_std: 0.5,
        linear_std: vec![1.0, 2.0, 3.0],
        signal_std: 2.0,
        length_scales: vec![1.0, 2.0, 4.0],
        coulomb_std: Some(vec![1.5]),
    }
}

#[test]
fn torque_covariance_adds_its_four_terms() {
    let x = mat![[1.0, 2.0, 4.0], [2.0, -2.0, 0.0]];
    let with = TorqueCovariance::new(params()).unwrap().gram(x.as_ref())[(1, 0)];
    let without = TorqueCovariance::new(TorqueParams {
        coulomb_std: None,
        ..params()
    })
    .unwrap()
    .gram(x.as_ref())[(1, 0)];

    // 0.25 + (1·2 − 4·4 + 9·0) + 4 exp(−½(1 + 4 + 1)), and −2.25 of friction.
    let smooth = 0.25 - 14.0 + 4.0 * (-3.0_f64).exp();
    assert!(
        (without - smooth).abs() <= 32.0 * f64::EPSILON * 14.0,
        "{without} {smooth}"
    );
    assert!(
        (with - (smooth - 2.25)).abs() <= 32.0 * f64::EPSILON * 14.0,
        "{with}"
    );
}

#[test]
fn a_continuous_joint_is_seen_as_its_place_on_the_circle() {
    use std::f64::consts::{FRAC_PI_2, TAU};
    let of_circle = TorqueCovariance::new(params()).unwrap();
    let of_circle = of_circle
        .with_continuous(ContinuousJoints::of([0]))
        .unwrap();
    // A quarter of a turn apart, one of them three turns further.
    let x = mat![[0.0, 2.0, 4.0], [FRAC_PI_2 + 3.0 * TAU, -2.0, 0.0]];
    let found = of_circle.gram(x.as_ref());
    // 0.25 + (1·cos ½π − 4·4 + 9·0) + 4 exp(−½(2 + 4 + 1)) − 2.25: the chord of a quarter has the square 2.
    let expected = 0.25 - 16.0 + 4.0 * (-3.5_f64).exp() - 2.25;
    // The angle is known to 10π ε.
    let tolerance = 64.0 * f64::EPSILON * 20.0;
    assert!((found[(1, 0)] - expected).abs() <= tolerance, "{found:?}");
    // 0.25 + (1 + 16 + 144) + 4 + 2.25, and without the acceleration: the angle does not matter.
    let diag = of_circle.diag(x.as_ref());
    for (found, expected) in diag.into_iter().zip([167.5, 23.5]) {
        assert!((found - expected).abs() <= 64.0 * f64::EPSILON * expected);
    }
    // As many hyperparameters as before, by the same names.
    let as_given = TorqueCovariance::new(params()).unwrap();
    assert_eq!(of_circle.layout(), as_given.layout());
    assert_eq!(of_circle.params(), as_given.params());
    assert_eq!(of_circle.named_params(), params());
    assert_eq!(of_circle.n_joints(), 1);
}

#[test]
fn a_continuous_joint_that_there_is_not_is_refused() {
    let covariance = TorqueCovariance::new(params()).unwrap();
    let error = covariance
        .with_continuous(ContinuousJoints::of([1]))
        .unwrap_err();
    let expected = KernelError::WrongCount {
        name: "continuous joints",
        found: 1,
        expected: 2,
    };
    assert_eq!(error, expected);
}

#[test]
fn theta_has_the_chapters_counts() {
    // θ ∈ R^{7ℓ+3} with σ, which is not part of the covariance.
    for n_joints in [1, 2, 6] {
        let with = TorqueCovariance::unit(n_joints, TorqueForm::Coulomb);
        let without = TorqueCovariance::unit(n_joints, TorqueForm::Smooth);
        assert_eq!(with.n_params(), 7 * n_joints + 2);
        assert_eq!(without.n_params(), 6 * n_joints + 2);
    }
}

#[test]
fn layout_is_in_theta_order_with_the_chapters_bounds() {
    let cov = TorqueCovariance::new(params()).unwrap();
    let layout = cov.layout();
    assert_eq!(cov.params(), [0.5, 1.0, 2.0, 3.0, 2.0, 1.0, 2.0, 4.0, 1.5]);
    assert_eq!(layout.range("bias_std"), Some(0..1));
    assert_eq!(layout.range("linear_std"), Some(1..4));
    assert_eq!(layout.range("signal_std"), Some(4..5));
    assert_eq!(layout.range("length_scales"), Some(5..8));
    assert_eq!(layout.range("coulomb_std"), Some(8..9));
    assert_eq!(layout.range("noise_std"), None);
    let below_100 = Transform::Below { ceiling: 100.0 };
    assert_eq!(layout.specs()[2].transform, below_100);
    assert_eq!(layout.specs()[5].transform, Transform::Positive);
}

#[test]
fn named_parameters_survive_the_round_trip() {
    let cov = TorqueCovariance::new(params()).unwrap();
    assert_eq!(cov.named_params(), params());
}

#[test]
fn wrong_counts_are_named() {
    let short = TorqueParams {
        length_scales: vec![1.0],
        ..params()
    };
    let error = TorqueCovariance::new(short).unwrap_err();
    let expected = KernelError::WrongCount {
        name: "length_scales",
        found: 1,
        expected: 3,
    };
    assert_eq!(error, expected);
    let two_joints_of_friction = TorqueParams {
        coulomb_std: Some(vec![1.0, 1.0]),
        ..params()
    };
    assert!(TorqueCovariance::new(two_joints_of_friction).is_err());
}

#[test]
fn a_weighted_sum_follows_from_its_gradient() {
    let x = mat![[1.0, 2.0, 4.0], [2.0, -2.0, 0.0], [0.3, 0.1, -1.0]];
    let q = mat![[0.5, -1.0, 0.2], [-1.0, 2.0, 0.7], [0.2, 0.7, -0.3]];
    for coulomb_std in [None, Some(vec![1.5])] {
        let cov = TorqueCovariance::new(TorqueParams {
            coulomb_std,
            ..params()
        })
        .unwrap();
        let turning = cov.with_continuous(ContinuousJoints::of([0])).unwrap();
        for cov in [cov, turning] {
            let k = cov.gram(x.as_ref());
            let expected: f64 = (0..9).map(|i| q[(i / 3, i % 3)] * k[(i / 3, i % 3)]).sum();
            let mut gradient = vec![0.0; cov.n_params()];
            cov.gram_adjoint(x.as_ref(), q.as_ref(), &mut gradient);
            let found = cov.sum_of_its_gradient(&gradient);
            // Terms of up to 2 · 160.
            assert!(
                (found - expected).abs() <= 64.0 * f64::EPSILON * 320.0,
                "{found} {expected}"
            );
        }
    }
}
