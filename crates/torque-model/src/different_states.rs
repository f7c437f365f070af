//! How many different states rows are of, as a model sees them.

use faer::MatRef;
use kernels::{Covariance, KernelError, LinearArd, SeArd, Sum, TorqueCovariance};
use mtgp::prior::TaskMatrix;

use crate::error::TorqueError;
use crate::process::TaskProcess;
use crate::rows::require_states;

/// A state whose torque is known from others to this part of its standard deviation is none of its own.
///
/// What a state adds is magnified by the inverse before it tells two latent functions apart.
const SAME: f64 = 1e-2;

/// Covariance of embedded states: of the torque without what all states share, and without signs, which flip in the noise of an arm at rest.
type OfStates = Sum<LinearArd, SeArd>;

/// Number of states among rows that say something which the others do not, counted up to `most`.
///
/// ```text
/// pivots of K with  c(x, x | pivots before) > max(σ², 10⁻⁴ c̄)      c = K̄^ρ (Σ u_j² x_j x′_j + v² exp(…))
/// ```
/// with K̄^ρ the mean of the diagonal of K^ρ and c̄ that of K: the numerical rank of K at the rows, with the noise of one
/// measurement as what is nothing.
/// So many rows of one posture count as one, whatever the noise of their positions, as long as its effect on the torque
/// is within that of the torque.
/// # Shapes
/// `x` (n, 3ℓ).
/// # Errors
/// States that are not finite or of another robot.
/// # Source
/// Pivoted Cholesky: Harbrecht, Peters & Schneider 2012, algorithm 1.
pub fn different_states(
    process: &TaskProcess,
    x: MatRef<'_, f64>,
    most: usize,
) -> Result<usize, TorqueError> {
    let prior = process.covariance();
    require_states(x, prior.input().n_joints())?;
    let embedded = prior.input().continuous().embed(x);
    let x = embedded.as_ref();
    let covariance = of_states(prior.input())?;
    let k_task = prior.task().k_task();
    let of_task = (0..k_task.nrows()).map(|task| k_task[(task, task)]);
    let of_task = of_task.sum::<f64>() / k_task.nrows() as f64;
    let noise = process.posterior.noise_std().powi(2) / of_task;
    let mean = covariance.diag(x).iter().sum::<f64>() / x.nrows().max(1) as f64;
    Ok(n_pivots(
        &covariance,
        x,
        noise.max(SAME * SAME * mean),
        most,
    ))
}

fn of_states(covariance: &TorqueCovariance) -> Result<OfStates, KernelError> {
    let params = covariance.embedded_params();
    let linear = LinearArd::new(params.linear_std)?;
    let se = SeArd::new(params.signal_std, params.length_scales)?;
    Ok(Sum::new(linear, se))
}

/// Pivots whose remaining variance is above `nothing`, largest first.
fn n_pivots(covariance: &impl Covariance, x: MatRef<'_, f64>, nothing: f64, most: usize) -> usize {
    let mut left = covariance.diag(x);
    let mut columns: Vec<Vec<f64>> = Vec::new();
    while columns.len() < most {
        let of_larger = |best: usize, row: usize| if left[row] > left[best] { row } else { best };
        let pivot = (0..left.len()).fold(0, of_larger);
        if left.get(pivot).is_none_or(|left| *left <= nothing) {
            break;
        }
        let root = left[pivot].sqrt();
        let with_pivot = covariance.cross(x, x.subrows(pivot, 1)); // (n, 1)
        let column: Vec<f64> = (0..left.len())
            .map(|row| {
                let known: f64 = columns.iter().map(|of| of[row] * of[pivot]).sum();
                (with_pivot[(row, 0)] - known) / root
            })
            .collect();
        for (left, entry) in left.iter_mut().zip(&column) {
            *left -= entry * entry;
        }
        columns.push(column);
    }
    columns.len()
}

#[cfg(test)]
mod tests {
    use faer::Mat;

    use super::*;

    /// Rows around some postures of one joint, as encoders report them.
    fn rows(postures: &[f64], of_each: usize, noise: f64) -> Mat<f64> {
        Mat::from_fn(postures.len() * of_each, 3, |row, col| {
            let shake = noise * (1.3 * (3 * row + col) as f64).sin();
            let at = if col == 0 {
                postures[row / of_each]
            } else {
                0.0
            };
            at + shake
        })
    }

    fn count(x: &Mat<f64>) -> usize {
        let linear = LinearArd::new(vec![1.0; 3]).expect("positive");
        let se = SeArd::new(10.0, vec![1.0; 3]).expect("positive");
        // A noise of 0.01 N·m, and slopes of 10 N·m/rad.
        n_pivots(&Sum::new(linear, se), x.as_ref(), 1e-4, 9)
    }

    #[test]
    fn rows_count_by_posture_and_not_by_their_number() {
        for (postures, expected) in [
            (vec![0.3], 1),
            (vec![0.3, 1.1], 2),
            (vec![-1.0, 0.0, 2.0], 3),
        ] {
            assert_eq!(count(&rows(&postures, 50, 1e-4)), expected, "{postures:?}");
            assert_eq!(count(&rows(&postures, 1, 0.0)), expected, "{postures:?}");
        }
        assert_eq!(count(&Mat::zeros(0, 3)), 0);
    }

    #[test]
    fn shaking_by_more_than_the_noise_is_motion() {
        assert!(count(&rows(&[0.3], 50, 0.3)) >= 4);
    }
}
