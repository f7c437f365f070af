//! None of these: a test of whether new torques can come from any known context at all.

use crate::context_estimate::{ContextEvidence, ContextPosterior};
use crate::error::{MtgpError, require_count};

/// Probability that a χ² variable of k degrees of freedom is at least `value`.
///
/// ```text
/// P(χ²_k ≥ v) = Γ(k/2, h)/Γ(k/2) = Σ_s h^s e^{−h}/Γ(s + 1) [+ erfc √h if k is odd],   h = v/2
/// s = 0, 1, …, k/2 − 1 (k even) or ½, 3/2, …, k/2 − 1 (k odd)
/// ```
/// A sum of k/2 positive terms, so that small tails keep their digits; zero below the smallest
/// positive number, NaN for NaN.
/// # Source
/// Abramowitz & Stegun 1964, 26.4.4 and 26.4.5.
pub fn chi_squared_upper_tail(value: f64, degrees_of_freedom: usize) -> f64 {
    if value.is_nan() || value <= 0.0 {
        return if value.is_nan() { value } else { 1.0 };
    }
    let half = 0.5 * value;
    let (mut s, mut tail, mut log_term) = if degrees_of_freedom.is_multiple_of(2) {
        (0.0, 0.0, -half)
    } else {
        let log_gamma = (0.5 * std::f64::consts::PI.sqrt()).ln(); // log Γ(3/2)
        let log_term = 0.5 * half.ln() - half - log_gamma;
        (0.5, libm::erfc(half.sqrt()), log_term)
    };
    for _ in 0..degrees_of_freedom / 2 {
        tail += log_term.exp();
        s += 1.0;
        log_term += (half / s).ln();
    }
    if half.is_finite() { tail.min(1.0) } else { 0.0 }
}

impl ContextEvidence {
    /// How probable, under each context, torques at least as far from the mean are, (m,).
    ///
    /// ```text
    /// p_γ = P(χ²_k ≥ Σ_i |L_iγ⁻¹(t*_i − mean_iγ)|²)
    /// ```
    /// for k torques of all joints together.
    /// Uniform under the right context if the model's own density is right. The variance of a
    /// process with fitted hyperparameters is too small away from its samples; there, calibrate
    /// with [`Calibration`].
    /// # Source
    /// The whitened residuals of the density in eq. (21) are standard normal.
    pub fn p_values(&self) -> Vec<f64> {
        let tail = |squares: &f64| chi_squared_upper_tail(*squares, self.n_torques());
        self.squares().iter().map(tail).collect()
    }

    /// Mean squared whitened residual under each context, (m,): one under the right one.
    ///
    /// A score for [`Calibration`]. NaN without torques.
    pub fn scores(&self) -> Vec<f64> {
        let k = self.n_torques() as f64;
        self.squares().iter().map(|squares| squares / k).collect()
    }
}

/// Scores of held-out torques under the context that made them, to judge new scores by.
///
/// ```text
/// p = (1 + #{held out: score ≥ s})/(n + 1)
/// ```
/// If the new score and the n held-out ones are exchangeable (the new torques come from a known
/// context, and were drawn like the held-out ones), then P(p ≤ α) ≤ α for every α, whatever the
/// model gets wrong; the smallest p possible is 1/(n + 1), so that a level α needs n ≥ 1/α − 1.
/// The probability is over the held-out scores as well as the new one.
///
/// Neighbouring samples of one trajectory are not exchangeable: let a score be that of one trial
/// of the length that will be judged, from a trajectory the model has not been trained on.
/// # Source
/// Vovk, Gammerman & Shafer 2005, sec. 2.2 (conformal prediction), for one-sided scores.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// In increasing order.
    scores: Vec<f64>,
}

impl Calibration {
    /// Keeps the held-out scores.
    ///
    /// # Errors
    /// [`MtgpError::NoCalibration`] without scores; [`MtgpError::NonFinite`] for one that is NaN
    /// or infinite.
    pub fn new(mut scores: Vec<f64>) -> Result<Self, MtgpError> {
        if scores.is_empty() {
            return Err(MtgpError::NoCalibration);
        }
        if let Some(row) = scores.iter().position(|score| !score.is_finite()) {
            let (what, column, value) = ("held-out score", 0, scores[row]);
            return Err(MtgpError::NonFinite {
                what,
                row,
                column,
                value,
            });
        }
        scores.sort_by(f64::total_cmp);
        Ok(Self { scores })
    }

    /// Number of held-out scores n.
    pub fn n_scores(&self) -> usize {
        self.scores.len()
    }

    /// The p-value of a new score; NaN for NaN.
    pub fn p_value(&self, score: f64) -> f64 {
        if score.is_nan() {
            return score;
        }
        let n_below = self.scores.partition_point(|held_out| *held_out < score);
        (1 + self.scores.len() - n_below) as f64 / (1 + self.scores.len()) as f64
    }
}

/// A context, or none of those that are known.
#[derive(Debug, Clone, PartialEq)]
pub enum ContextAnswer {
    /// The torques fit at least one known context.
    Known {
        /// The most probable one.
        context: usize,
        /// P(c_γ | D, D*) of that context, given that it is one of the known.
        probability: f64,
        /// The largest p-value of all contexts.
        p_value: f64,
    },
    /// No known context makes such torques.
    Unknown {
        /// The largest p-value of all contexts.
        p_value: f64,
    },
}

/// Names the most probable context, unless every one is rejected.
///
/// ```text
/// unknown  ⇔  max_γ p_γ < level
/// ```
/// Under a known context its own p-value is below the level with probability at most the level,
/// the largest no more often: false alarms are no more frequent than the level if the p-values hold.
/// # Shapes
/// `p_values` (m,): [`ContextEvidence::p_values`], or those of [`Calibration`].
/// # Errors
/// [`MtgpError::CountMismatch`]; [`MtgpError::NotProbabilities`] if the level or a p-value is not
/// between zero and one.
/// # Source
/// Berger 1982 (intersection–union test) for the hypothesis that the context is a known one.
pub fn known_or_unknown(
    posterior: &ContextPosterior,
    p_values: &[f64],
    level: f64,
) -> Result<ContextAnswer, MtgpError> {
    let n_contexts = posterior.log_probabilities().len();
    require_count("p-values of contexts", p_values.len(), n_contexts)?;
    for (row, &sum) in p_values.iter().chain([&level]).enumerate() {
        if !(0.0..=1.0).contains(&sum) {
            let what = "p-values and the level";
            return Err(MtgpError::NotProbabilities { what, row, sum });
        }
    }
    let p_value = p_values.iter().copied().fold(0.0, f64::max);
    if p_value < level {
        return Ok(ContextAnswer::Unknown { p_value });
    }
    let context = posterior.most_probable();
    Ok(ContextAnswer::Known {
        context,
        probability: posterior.log_probabilities()[context].exp(),
        p_value,
    })
}
