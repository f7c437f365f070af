//! Hyperparameters that have faded, brought back to where they are still heard at given inputs.

use faer::MatRef;

use crate::continuous::ContinuousJoints;
use crate::torque_params::TorqueParams;

/// Raises weights and lowers length scales to where each adds `amplitude` to the function.
///
/// ```text
/// b, w_j, v ≥ a,   u_j ≥ a/√⟨x_j²⟩,   l_j ≤ v √(⟨x_j²⟩ − ⟨x_j⟩²)/a
/// ```
/// as ½ v² ⟨(x_j − x′_j)²⟩/l_j² = a² for two samples at random.
/// A covariate that is the same in all samples is left alone.
/// Of the angle of a continuous joint ⟨x_j²⟩ is 1, and the spread that of its places in the plane.
pub(crate) fn revive(
    params: &mut TorqueParams,
    continuous: &ContinuousJoints,
    x: MatRef<'_, f64>,
    amplitude: f64,
) {
    let (embedded, d) = (continuous.embed(x), x.ncols());
    let moments = |column| moments(embedded.as_ref(), continuous.columns_of(column, d));
    let raise = |weight: &mut f64, least: f64| {
        if least.is_finite() {
            *weight = weight.max(least);
        }
    };
    raise(&mut params.bias_std, amplitude);
    raise(&mut params.signal_std, amplitude);
    for weight in params.coulomb_std.iter_mut().flatten() {
        raise(weight, amplitude);
    }
    for (column, weight) in params.linear_std.iter_mut().enumerate() {
        raise(weight, amplitude / moments(column).0);
    }
    for (column, length_scale) in params.length_scales.iter_mut().enumerate() {
        let most = params.signal_std * moments(column).1 / amplitude;
        if most > 0.0 && most.is_finite() {
            *length_scale = length_scale.min(most);
        }
    }
}

/// Root mean square and standard deviation of a column, or of the points that some columns are the coordinates of.
fn moments(z: MatRef<'_, f64>, columns: impl Iterator<Item = usize>) -> (f64, f64) {
    let n = z.nrows() as f64;
    let (mut mean_square, mut variance) = (0.0, 0.0);
    for column in columns {
        let values = || (0..z.nrows()).map(|row| z[(row, column)]);
        let mean = values().sum::<f64>() / n;
        mean_square += values().map(|v| v * v).sum::<f64>() / n;
        variance += values().map(|v| (v - mean) * (v - mean)).sum::<f64>() / n;
    }
    (mean_square.sqrt(), variance.sqrt())
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "bounds are taken over as they are")]
mod tests {
    use faer::Mat;

    use super::*;
    use crate::{Covariance, TorqueCovariance};

    fn params() -> TorqueParams {
        TorqueParams {
            bias_std: 1e-30,
            linear_std: vec![1e-30, 2.0, 1e-30],
            signal_std: 3.0,
            length_scales: vec![1e20, 1e20, 0.5],
            coulomb_std: Some(vec![1e-30]),
        }
    }

    /// q in {−1, 1}, q̇ always 0, q̈ in {0, 4}.
    fn inputs() -> Mat<f64> {
        Mat::from_fn(4, 3, |row, col| match col {
            0 => [-1.0, 1.0, -1.0, 1.0][row],
            1 => 0.0,
            _ => [0.0, 4.0, 4.0, 0.0][row],
        })
    }

    #[test]
    fn faded_hyperparameters_come_back_to_the_edge_and_others_stay() {
        let mut found = params();
        revive(
            &mut found,
            &ContinuousJoints::none(),
            inputs().as_ref(),
            0.01,
        );
        assert_eq!(found.bias_std, 0.01);
        assert_eq!(found.coulomb_std, Some(vec![0.01]));
        assert!((found.linear_std[0] - 0.01).abs() < 1e-15);
        assert_eq!(found.linear_std[1], 2.0);
        // √⟨q̈²⟩ = √8
        assert!((found.linear_std[2] - 0.01 / 8.0_f64.sqrt()).abs() < 1e-15);
        // 3 · 1/0.01
        assert!((found.length_scales[0] - 300.0).abs() < 1e-10);
        assert_eq!(found.length_scales[1], 1e20);
        assert_eq!(found.length_scales[2], 0.5);
    }

    #[test]
    fn each_term_at_the_edge_adds_about_the_amplitude() {
        let x = inputs();
        let before = TorqueCovariance::new(params()).unwrap();
        let mut after = before.clone();
        after.set_params(&before.revived(x.as_ref(), 0.01));
        let difference = before.gram(x.as_ref()) - after.gram(x.as_ref());
        // b, u_1, u_3, l_1 and w: five terms, and the squared exponential twice for the farthest pair.
        assert!(difference.norm_max() <= 8.0 * 1e-4, "{difference:?}");
        assert!(difference.norm_max() >= 1e-4);
    }
}
