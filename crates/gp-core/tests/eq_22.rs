//! Eq. (22): the starting values, worked by hand, and where the formula has none.

use faer::{Mat, mat};
use gp_core::fit::{chapter_start, varied_start};
use gp_core::search::Origin;
use kernels::{ContinuousJoints, TorqueForm};

#[test]
fn starting_values_of_a_small_data_set() {
    // t̄² = (4 + 36)/2 = 20, ¼t̄² = 5; ℓ = 1.
    let x = mat![[1.0, 2.0, 0.0], [3.0, 2.0, -4.0]];
    let start = chapter_start(
        x.as_ref(),
        &[2.0, 6.0],
        TorqueForm::Coulomb,
        &ContinuousJoints::none(),
    )
    .unwrap();
    let params = start.covariance.named_params();
    let close = |a: f64, b: f64| (a - b).abs() <= 8.0 * f64::EPSILON * b;
    assert!(close(params.bias_std, 5.0_f64.sqrt()));
    assert!(close(params.signal_std, 5.0_f64.sqrt()));
    assert!(close(params.coulomb_std.unwrap()[0], 5.0_f64.sqrt()));
    assert!(close(start.noise_std, 0.2_f64.sqrt()));
    // s = (5, 4, 8), m = (2, 2, −2): u² = (5/3)/s, l² = s − m² = (1, 0 → 1, 4).
    for (u, s) in params.linear_std.iter().zip([5.0, 4.0, 8.0_f64]) {
        assert!(close(*u, (5.0 / 3.0 / s).sqrt()), "{u}");
    }
    assert_eq!(params.length_scales, [1.0, 1.0, 2.0]);
}

#[test]
fn the_start_of_a_continuous_joint_is_that_of_its_place_in_the_plane() {
    // Angles 0 and ½π, some turns apart: cos (1, 0), sin (0, 1), each of mean ½ and mean square ½.
    let quarter = std::f64::consts::FRAC_PI_2;
    let x = mat![[0.0, 2.0, 0.0], [17.0 * quarter, 2.0, -4.0]];
    let continuous = ContinuousJoints::of([0]);
    let form = TorqueForm::Coulomb;
    let start = chapter_start(x.as_ref(), &[2.0, 6.0], form, &continuous).unwrap();
    let params = start.covariance.named_params();
    let close = |a: f64, b: f64| (a - b).abs() <= 64.0 * f64::EPSILON * b;
    // s = ½ + ½ and l² = ¼ + ¼.
    assert!(close(params.linear_std[0], (5.0 / 3.0_f64).sqrt()));
    assert!(close(params.length_scales[0], 0.5_f64.sqrt()));
    assert_eq!(params.length_scales[2], 2.0);
    assert_eq!(start.covariance.continuous(), &continuous);
    let varied = varied_start(&start, Origin::TypicalPairs).unwrap();
    assert_eq!(varied.covariance.continuous(), &continuous);
    let none = ContinuousJoints::of([1]);
    assert!(chapter_start(x.as_ref(), &[2.0, 6.0], form, &none).is_err());
}

#[test]
fn variations_stretch_the_length_scales() {
    let x = mat![[1.0, 2.0, 0.0], [3.0, 2.0, -4.0]];
    let chapter = chapter_start(
        x.as_ref(),
        &[2.0, 6.0],
        TorqueForm::Smooth,
        &ContinuousJoints::none(),
    )
    .unwrap();
    let stretched = |kind| {
        let start = varied_start(&chapter, kind).unwrap();
        start.covariance.named_params().length_scales
    };
    let typical = 3.0_f64.sqrt();
    assert_eq!(stretched(Origin::Chapter), [1.0, 1.0, 2.0]);
    assert_eq!(
        stretched(Origin::TypicalPairs),
        [typical, typical, 2.0 * typical]
    );
    // Position, velocity and acceleration of the one joint.
    assert_eq!(
        stretched(Origin::SlowInRates),
        [typical, 10.0 * typical, 2.0 * (30.0 * typical)]
    );
}

#[test]
fn degenerate_data_has_usable_starting_values() {
    let zeros = Mat::zeros(5, 3);
    let start = chapter_start(
        zeros.as_ref(),
        &[0.0; 5],
        TorqueForm::Coulomb,
        &ContinuousJoints::none(),
    )
    .unwrap();
    // 0.01 t̄² = 1e-4 is the floor itself; the start is moved inside.
    assert!((start.noise_std.powi(2) - 2e-4).abs() <= 1e-18);
    assert_eq!(start.covariance.named_params().length_scales, [1.0; 3]);

    // A constant column whose mean does not round back to itself.
    let constant = Mat::from_fn(7, 3, |_, _| 0.1);
    let start = chapter_start(
        constant.as_ref(),
        &[1.0; 7],
        TorqueForm::Coulomb,
        &ContinuousJoints::none(),
    )
    .unwrap();
    assert_eq!(start.covariance.named_params().length_scales, [1.0; 3]);

    // Tiny covariates would ask for weights beyond the bound u ≤ 100.
    let tiny = Mat::from_fn(4, 3, |row, _| 1e-9 * row as f64);
    let start = chapter_start(
        tiny.as_ref(),
        &[50.0; 4],
        TorqueForm::Smooth,
        &ContinuousJoints::none(),
    )
    .unwrap();
    assert_eq!(start.covariance.named_params().linear_std, [90.0; 3]);
}
