//! None of these: a test of whether new torques can come from any known context at all.

use crate::context::estimate::{ContextEvidence, ContextPosterior};
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
        let n = self.n_independent();
        let part = n as f64 / self.n_torques().max(1) as f64;
        let tail = |squares: &f64| chi_squared_upper_tail(part * squares, n);
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

/// Scores of held-out torques of known contexts, to judge new scores by.
///
/// ```text
/// p = (1 + Σ_g #{held out in group g: score ≥ s}/n_g)/(G + 1)
/// ```
/// for G groups of n_g scores; of groups of one it is (1 + #{held out: score ≥ s})/(n + 1).
/// If the groups and that of the new score are exchangeable, and so are the scores in each (the new
/// torques come from a known context, and were drawn like the held-out ones), then P(p ≤ α) ≤ α for
/// every α, whatever the model gets wrong; the smallest p possible is 1/(G + 1), so that a level α
/// needs G ≥ 1/α − 1 groups.
/// The probability is over the held-out scores as well as the new one.
///
/// Torques at one place, under one load after another, err alike: they are one group, as are
/// neighbouring samples of one trajectory. Taken for independent scores, they make p too small.
/// # Source
/// Vovk, Gammerman & Shafer 2005, sec. 2.2 (conformal prediction), for one-sided scores; Lee, Barber
/// & Willett 2023, "Distribution-free inference with hierarchical data", for groups.
#[derive(Debug, Clone, PartialEq)]
pub struct Calibration {
    /// Each in increasing order.
    groups: Vec<Vec<f64>>,
}

impl Calibration {
    /// Keeps held-out scores that are exchangeable one by one.
    ///
    /// # Errors
    /// [`MtgpError::NoCalibration`] without scores; [`MtgpError::NonFinite`] for one that is NaN
    /// or infinite.
    pub fn new(scores: Vec<f64>) -> Result<Self, MtgpError> {
        Self::of_groups(scores.into_iter().map(|score| vec![score]).collect())
    }

    /// Keeps held-out scores that are exchangeable group by group.
    ///
    /// # Errors
    /// [`MtgpError::NoCalibration`] without groups or with an empty one; [`MtgpError::NonFinite`] for
    /// a score that is NaN or infinite, with its group as the row.
    pub fn of_groups(mut groups: Vec<Vec<f64>>) -> Result<Self, MtgpError> {
        if groups.is_empty() || groups.iter().any(Vec::is_empty) {
            return Err(MtgpError::NoCalibration);
        }
        for (row, group) in groups.iter_mut().enumerate() {
            if let Some(column) = group.iter().position(|score| !score.is_finite()) {
                let (what, value) = ("held-out score", group[column]);
                return Err(MtgpError::NonFinite {
                    what,
                    row,
                    column,
                    value,
                });
            }
            group.sort_by(f64::total_cmp);
        }
        Ok(Self { groups })
    }

    /// The p-value of a new score; NaN for NaN.
    pub fn p_value(&self, score: f64) -> f64 {
        if score.is_nan() {
            return score;
        }
        let share = |group: &Vec<f64>| {
            let n_below = group.partition_point(|held_out| *held_out < score);
            (group.len() - n_below) as f64 / group.len() as f64
        };
        let above: f64 = self.groups.iter().map(share).sum();
        (1.0 + above) / (1 + self.groups.len()) as f64
    }
}

/// The largest p-value of a new score by several calibrations, each of torques that came about in one way.
///
/// ```text
/// p = max_w p_w,   P(p ≤ α) ≤ α if the new torques came about in any one of these ways
/// ```
/// On a trajectory that is none of the held-out ones a model may err more than on all of them, and no
/// calibration says how often: with trajectories as the groups of [`Calibration`] that takes 1/α − 1 of
/// them. To have to be unusual on each of a few trajectories is the most careful that few allow.
/// NaN for NaN or without a calibration.
/// # Source
/// Berger 1982, as for [`known_or_unknown`].
pub fn largest_p_value(calibrations: &[Calibration], score: f64) -> f64 {
    let p_values = calibrations
        .iter()
        .map(|calibration| calibration.p_value(score));
    p_values.fold(f64::NAN, f64::max)
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
