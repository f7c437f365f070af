//! The maps between natural and unconstrained hyperparameters.

use kernels::{ParamLayout, Transform};
use proptest::prelude::*;

const ALL: [Transform; 3] = [
    Transform::Positive,
    Transform::Below { ceiling: 100.0 },
    Transform::SquareAbove { floor: 1e-4 },
];

proptest! {
    #[test]
    fn natural_values_are_inside_their_bounds(z in -30.0..30.0_f64) {
        for transform in ALL {
            let theta = transform.natural(z);
            prop_assert!(theta > 0.0 && theta.is_finite());
            match transform {
                Transform::Positive | Transform::Free { .. } => {}
                Transform::Below { ceiling } => prop_assert!(theta <= ceiling),
                Transform::SquareAbove { floor } => {
                    prop_assert!(theta * theta >= floor * (1.0 - 4.0 * f64::EPSILON));
                }
            }
        }
    }

    #[test]
    fn unconstrained_inverts_natural(z in -5.0..5.0_f64) {
        for transform in ALL {
            let back = transform.unconstrained(transform.natural(z));
            // θ/(c − θ) or θ² − f magnify the rounding of θ by at most 1 + e⁵ or 1 + 1e-4 e⁵.
            prop_assert!((back - z).abs() <= 8.0 * 150.0 * f64::EPSILON, "{back} {z}");
        }
    }

    #[test]
    fn derivative_is_that_of_central_differences(z in -8.0..8.0_f64) {
        for transform in ALL {
            let step = 1e-5;
            let difference =
                (transform.natural(z + step) - transform.natural(z - step)) / (2.0 * step);
            let theta = transform.natural(z);
            // All derivatives of the maps are at most θ in size.
            let tolerance = theta * (4.0 * f64::EPSILON / step + step * step);
            let error = (transform.derivative(z) - difference).abs();
            prop_assert!(error <= tolerance, "{transform:?} {z}: {error} {tolerance}");
        }
    }
}

#[test]
fn free_values_have_either_sign_and_no_bound() {
    let free = Transform::Free { scale: 4.0 };
    assert_eq!(free.natural(-0.5), -2.0);
    assert_eq!(free.unconstrained(-2.0), -0.5);
    assert_eq!(free.derivative(17.0), 4.0);
    assert_eq!(free.clamp_inside(0.0), 0.0);
    assert!(!free.is_at_bound(0.0));
    assert!(free.admits(-2.0) && free.admits(0.0) && !free.admits(f64::NAN));
    assert!(Transform::Positive.admits(2.0) && !Transform::Positive.admits(0.0));
}

#[test]
fn entries_of_a_matrix_are_named_by_row_and_column() {
    let free = Transform::Free { scale: 1.0 };
    let layout = ParamLayout::new().with_entries("factor", [(0, 0), (1, 0), (1, 1)], free);
    let names: Vec<String> = layout.specs().iter().map(ToString::to_string).collect();
    assert_eq!(names, ["factor[0,0]", "factor[1,0]", "factor[1,1]"]);
    assert_eq!(layout.range("factor"), Some(0..3));
}

#[test]
fn values_beyond_their_bound_are_clamped_inside() {
    let below = Transform::Below { ceiling: 100.0 };
    let above = Transform::SquareAbove { floor: 1e-4 };
    assert!(below.unconstrained(below.clamp_inside(1e6)).is_finite());
    assert!(above.unconstrained(above.clamp_inside(0.0)).is_finite());
    assert!(below.is_at_bound(99.95) && !below.is_at_bound(99.0));
    assert!(above.is_at_bound(0.01) && !above.is_at_bound(0.011));
}
