//! Normalised mean squared error, the only measure of section 3.4.

use crate::error::BenchError;
use crate::split::Split;

/// Mean squared error divided by the variance of the targets.
///
/// ```text
/// nMSE = Σᵢ (yᵢ − tᵢ)² / Σᵢ (tᵢ − t̄)²        0 exact; 1 as good as the mean of the targets
/// ```
/// The variance is the population's (divisor n), so that n cancels.
///
/// # Errors
/// `EmptyTestSet` without targets, `ConstantTargets` if all of them are equal,
/// `NonFinite` at the first prediction or target that is NaN or infinite.
/// # Panics
/// If the lengths differ.
/// # Source
/// Section 3.4: "dividing the mean square errors by the variances of the test data".
pub fn nmse(predictions: &[f64], targets: &[f64]) -> Result<f64, BenchError> {
    assert_eq!(predictions.len(), targets.len(), "one prediction a target");
    let first = *targets.first().ok_or(BenchError::EmptyTestSet)?;
    let pairs = || predictions.iter().zip(targets);
    if let Some(idx) = pairs().position(|(y, t)| !(y.is_finite() && t.is_finite())) {
        return Err(BenchError::NonFinite { idx });
    }
    if targets.iter().all(|t| t.to_bits() == first.to_bits()) {
        return Err(BenchError::ConstantTargets { value: first });
    }

    let mean = targets.iter().sum::<f64>() / targets.len() as f64;
    let spread: f64 = targets.iter().map(|t| (t - mean).powi(2)).sum();
    let error: f64 = pairs().map(|(y, t)| (y - t).powi(2)).sum();
    Ok(error / spread)
}

/// nMSE on interp and on extrap, from one pass over the rows of extrap, which contains interp.
///
/// # Shapes
/// `means` and `truth` (60,000,), at the rows of `split.extrap`.
/// # Errors
/// Those of [`nmse`].
pub fn nmse_of_sets(split: &Split, means: &[f64], truth: &[f64]) -> Result<[f64; 2], BenchError> {
    let interp = split.interp_in_extrap();
    let pick = |values: &[f64]| interp.iter().map(|&i| values[i]).collect::<Vec<_>>();
    Ok([nmse(&pick(means), &pick(truth))?, nmse(means, truth)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn worked_by_hand() {
        // Mean 2.5, spread 2.25 + 0.25 + 0.25 + 2.25 = 5; errors 0.25, 0, 1, 0 sum to 1.25.
        let value = nmse(&[1.5, 2.0, 4.0, 4.0], &[1.0, 2.0, 3.0, 4.0]).unwrap();
        assert!((value - 0.25).abs() <= 4.0 * f64::EPSILON, "{value}");
    }

    #[test]
    fn predicting_the_mean_costs_one() {
        let value = nmse(&[2.5; 4], &[1.0, 2.0, 3.0, 4.0]).unwrap();
        assert!((value - 1.0).abs() <= 4.0 * f64::EPSILON, "{value}");
    }

    #[test]
    fn offset_of_the_targets_does_not_change_the_variance() {
        let value = nmse(&[1e6 + 1.0, 1e6 + 3.0], &[1e6, 1e6 + 2.0]).unwrap();
        assert!((value - 1.0).abs() <= 4.0 * f64::EPSILON, "{value}");
    }

    #[test]
    fn undefined_cases_are_errors() {
        // 0.1 three times: its floating-point mean is not 0.1, so a test on the variance would miss it.
        let constant = nmse(&[0.0; 3], &[0.1; 3]);
        assert!(
            matches!(constant, Err(BenchError::ConstantTargets { value }) if value.to_bits() == 0.1_f64.to_bits())
        );
        assert!(matches!(nmse(&[], &[]), Err(BenchError::EmptyTestSet)));
        let not_finite = nmse(&[0.0, f64::NAN], &[1.0, 2.0]);
        assert!(matches!(not_finite, Err(BenchError::NonFinite { idx: 1 })));
    }
}
