//! The log marginal likelihood of eq. (8) and its gradient.

use std::mem;

use faer::{Mat, MatRef};
use kernels::Covariance;

use super::dense::Dense;
use super::likelihood::Likelihood;
use super::low_rank::LowRank;
use super::options::{Evaluation, LikelihoodOptions, Method, MethodUsed};
use super::pivoted::{Extent, PivotedCholesky};
use super::subsets::subset;
use crate::data::{require_noise, require_training_data};
use crate::error::GpError;

/// Log marginal likelihood of the targets under a zero-mean Gaussian process.
///
/// ```text
/// log p(t | X, θ) = −½ tᵀK⁻¹t − ½ log|K| − ½ n log 2π      K = c(X, X) + σ²I
/// ```
/// Natural logarithm, summed over the data.
/// # Shapes
/// `x` (n, d); `targets` (n,).
/// # Errors
/// Data that is not finite or does not match, σ that is not positive, K that is
/// not positive definite, or a value that overflows.
/// # Panics
/// If `x` does not have the number of columns that the covariance needs.
/// # Source
/// Eq. (8); Rasmussen & Williams 2006, algorithm 2.1.
pub fn log_marginal_likelihood<C: Covariance>(
    covariance: &C,
    noise_std: f64,
    x: MatRef<'_, f64>,
    targets: &[f64],
) -> Result<f64, GpError> {
    require_training_data(x, targets, 1)?;
    require_noise(noise_std)?;
    LogMarginal::new(x, targets, LikelihoodOptions::dense()).value(covariance, noise_std)
}

/// Log marginal likelihood and its gradient with respect to every hyperparameter.
///
/// The gradient is with respect to natural parameters (standard deviations and
/// length scales), in the order of the covariance's layout, σ last.
/// ```text
/// ∂/∂θ_i log p = tr(QᵀK_i),   Q = ½(αα′ − K⁻¹),   α = K⁻¹t,   K_i = ∂K/∂θ_i
/// ```
/// # Errors
/// As for [`log_marginal_likelihood`].
/// # Panics
/// If `x` does not have the number of columns that the covariance needs.
/// # Source
/// Eq. (8); Rasmussen & Williams 2006, eq. (5.9).
pub fn log_marginal_likelihood_with_gradient<C: Covariance>(
    covariance: &C,
    noise_std: f64,
    x: MatRef<'_, f64>,
    targets: &[f64],
) -> Result<(f64, Vec<f64>), GpError> {
    let evidence = evidence(
        covariance,
        noise_std,
        x,
        targets,
        LikelihoodOptions::dense(),
    )?;
    Ok((
        evidence.evaluation.log_marginal_likelihood,
        evidence.gradient,
    ))
}

/// Value and gradient of eq. (8).
#[derive(Debug, Clone, PartialEq)]
pub struct Evidence {
    /// The value, its error bound and its method.
    pub evaluation: Evaluation,
    /// Gradient with respect to natural parameters, in the order of the covariance's
    /// layout, σ last.
    pub gradient: Vec<f64>,
}

/// Log marginal likelihood and gradient at given hyperparameters, by a method of choice.
///
/// ```text
/// log p(t | X, θ) = −½ tᵀK⁻¹t − ½ log|K| − ½ n log 2π      K = c(X, X) + σ²I
/// ```
/// The gradient of the low-rank path is the exact gradient of the value it returns,
/// with its pivots held fixed.
/// # Shapes
/// `x` (n, d); `targets` (n,).
/// # Errors
/// Data that is not finite or does not match, σ that is not positive, K that is
/// not positive definite, or a value that overflows.
/// # Panics
/// If `x` does not have the number of columns that the covariance needs.
/// # Source
/// Eq. (8); the error bound is derived in the README under "Certificate".
pub fn evidence<C: Covariance>(
    covariance: &C,
    noise_std: f64,
    x: MatRef<'_, f64>,
    targets: &[f64],
    options: LikelihoodOptions,
) -> Result<Evidence, GpError> {
    require_training_data(x, targets, 1)?;
    require_noise(noise_std)?;
    let mut gradient = vec![0.0; covariance.n_params() + 1];
    let evaluation =
        LogMarginal::new(x, targets, options).evaluate(covariance, noise_std, &mut gradient)?;
    Ok(Evidence {
        evaluation,
        gradient,
    })
}

/// n below which the automatic choice is always dense.
///
/// Measured: at n = 100 the dense path takes 0.2 ms and the other 0.5 ms or more.
const SMALLEST: usize = 128;

/// Part of n beyond which the automatic choice takes the dense path.
///
/// Measured: at n = 400 and 1004 both paths take equal time near 0.28 n.
const LARGEST_RANK: f64 = 0.25;

/// Rank beyond which the automatic choice has no low-rank path, however many samples there are.
const LARGEST_AFFORDABLE_RANK: usize = 2048;

/// Samples beyond which the automatic choice has no dense path: two matrices of this order are 4.3 GB.
const LARGEST_DENSE: usize = 16_384;

/// Samples whose likelihood shows which pivots all samples need.
const SAMPLE: usize = 512;

/// Nats beyond which an error bound makes the automatic choice the dense path; what it may leave out
/// where there is no dense path.
const MAX_DOUBT: f64 = 0.1;

/// Rounds of tightening before a certificate is given up.
const MAX_ROUNDS: usize = 4;

/// Trimming leaves the trace below this part of its target, so that the next
/// evaluation does not have to put back what this one dropped.
const TRIM: f64 = 0.1;

/// Eq. (8) on one data set, with memory that later evaluations use again.
///
/// The low-rank path starts from the pivots of the evaluation before, so its value
/// depends on them, by less than its error bound.
#[derive(Debug)]
pub struct LogMarginal<'a> {
    x: MatRef<'a, f64>,
    targets: &'a [f64],
    options: LikelihoodOptions,
    dense: Dense,
    pivots: Vec<usize>,
    /// σ² max(1/σ², |α̂|²) of the evaluation before.
    sensitivity: f64,
    /// Memory for Φ.
    buffer: Mat<f64>,
    /// α̂ of the low-rank path; empty where the last evaluation was dense.
    low_rank_alpha: Vec<f64>,
}

/// One of each of `count` stretches of equal length, at a place that never repeats, so
/// that a pattern in the order of the samples does not show.
fn sample_rows(n: usize, count: usize) -> Vec<usize> {
    (0..count)
        .map(|idx| {
            let (first, end) = (idx * n / count, (idx + 1) * n / count);
            // Multiples of the golden ratio, with 16 bits of fraction.
            first + ((idx * 40_503) % 65_536) * (end - first) / 65_536
        })
        .collect()
}

impl<'a> LogMarginal<'a> {
    /// The likelihood of these targets; allocates nothing yet.
    ///
    /// # Panics
    /// If there is not one target per row of `x`.
    pub fn new(x: MatRef<'a, f64>, targets: &'a [f64], options: LikelihoodOptions) -> Self {
        assert_eq!(x.nrows(), targets.len());
        Self {
            x,
            targets,
            options,
            dense: Dense::new(),
            pivots: Vec::new(),
            sensitivity: 1.0,
            buffer: Mat::new(),
            low_rank_alpha: Vec::new(),
        }
    }

    /// The inputs, (n, d).
    pub fn x(&self) -> MatRef<'a, f64> {
        self.x
    }

    /// α = K⁻¹t of the last [`LogMarginal::evaluate`], (n,), by the path it took.
    ///
    /// ```text
    /// ∂/∂t log p(t | X, θ) = −α
    /// ```
    /// Empty before the first evaluation; of no meaning after one that failed.
    pub fn alpha(&self) -> &[f64] {
        match self.low_rank_alpha.as_slice() {
            [] => self.dense.alpha(),
            alpha => alpha,
        }
    }

    /// The value of eq. (8), always by the dense path.
    ///
    /// # Errors
    /// [`GpError::NotPositiveDefinite`] or [`GpError::NonFiniteLikelihood`].
    pub fn value<C: Covariance>(&mut self, covariance: &C, noise_std: f64) -> Result<f64, GpError> {
        let dense = (self.dense).value(covariance, noise_std, self.x, self.targets)?;
        self.require_finite(dense.value)?;
        Ok(dense.value)
    }

    /// The value of eq. (8) and its gradient with respect to (θ, σ).
    ///
    /// # Errors
    /// [`GpError::NotPositiveDefinite`] or [`GpError::NonFiniteLikelihood`];
    /// [`GpError::RankTooHigh`] for more than 16,384 samples with the automatic choice,
    /// where the certificate needs a rank above 2048.
    /// # Panics
    /// If `gradient` does not have one entry per hyperparameter and one for σ.
    pub fn evaluate<C: Covariance>(
        &mut self,
        covariance: &C,
        noise_std: f64,
        gradient: &mut [f64],
    ) -> Result<Evaluation, GpError> {
        let evaluation = if let Some(low_rank) = self.low_rank(covariance, noise_std)? {
            low_rank.gradient(covariance, self.x, gradient);
            self.low_rank_alpha = low_rank.alpha().to_vec();
            let evaluation = Evaluation {
                log_marginal_likelihood: low_rank.log_marginal(),
                error_bound: low_rank.error_bound(),
                method: MethodUsed::Certified,
                rank: low_rank.pivoted().rank(),
            };
            self.buffer = low_rank.into_pivoted().into_buffer();
            evaluation
        } else {
            let (x, targets) = (self.x, self.targets);
            self.low_rank_alpha.clear();
            let dense =
                (self.dense).value_and_gradient(covariance, noise_std, x, targets, gradient)?;
            Evaluation {
                log_marginal_likelihood: dense.value,
                error_bound: dense.rounding,
                method: MethodUsed::Dense,
                rank: targets.len(),
            }
        };
        self.require_finite(gradient.iter().sum())?;
        self.require_finite(evaluation.log_marginal_likelihood)?;
        Ok(evaluation)
    }

    /// The low-rank process, or `None` where the dense path is asked for or pays.
    ///
    /// # Errors
    /// [`GpError::NotPositiveDefinite`] if the low-rank path was asked for and broke down;
    /// [`GpError::RankTooHigh`].
    pub(crate) fn low_rank<C: Covariance>(
        &mut self,
        covariance: &C,
        noise_std: f64,
    ) -> Result<Option<LowRank>, GpError> {
        let n = self.targets.len();
        let max_rank = match self.options.method {
            Method::Dense => return Ok(None),
            Method::Automatic if n < SMALLEST => return Ok(None),
            // A fraction of a count: the rounding down is meant.
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "n is positive and far below 2^52"
            )]
            Method::Automatic => ((LARGEST_RANK * n as f64) as usize).min(LARGEST_AFFORDABLE_RANK),
            Method::Certified => n,
        };
        let outcome = self.certified(covariance, noise_std, max_rank);
        if self.options.method == Method::Certified {
            return outcome;
        }
        if n > LARGEST_DENSE {
            let largest = max_rank;
            let beyond = GpError::RankTooHigh {
                n_samples: n,
                largest,
            };
            return outcome?.ok_or(beyond).map(Some);
        }
        // Rounding can end the search for pivots before the certificate is met.
        let largest = MAX_DOUBT.max(self.options.certificate);
        Ok(outcome
            .ok()
            .flatten()
            .filter(|p| p.error_bound() <= largest))
    }

    /// Nats that the low-rank path may leave out.
    ///
    /// tr E and |α̂|² grow with n, so that the same pivots leave out some n² as many nats.
    fn certificate(&self) -> f64 {
        let asked = self.options.certificate;
        let has_no_dense_path =
            self.options.method == Method::Automatic && self.targets.len() > LARGEST_DENSE;
        if has_no_dense_path {
            asked.max(MAX_DOUBT)
        } else {
            asked
        }
    }

    /// The process at the rank that the certificate needs; `None` beyond `max_rank`.
    fn certified<C: Covariance>(
        &mut self,
        covariance: &C,
        noise_std: f64,
        max_rank: usize,
    ) -> Result<Option<LowRank>, GpError> {
        let (x, noise_var) = (self.x, noise_std * noise_std);
        let certificate = self.certificate();
        let trace_for = |sensitivity: f64| 2.0 * certificate / sensitivity;
        if self.pivots.is_empty() {
            self.learn_from_sample(covariance, noise_std);
        }
        let mut target = trace_for(self.sensitivity / noise_var);
        let mut pivoted =
            PivotedCholesky::empty(covariance, x, mem::replace(&mut self.buffer, Mat::new()));
        pivoted.seed(covariance, x, &self.pivots);
        for round in 0..MAX_ROUNDS {
            let extent = pivoted.extend(covariance, x, target, max_rank);
            if extent == Extent::RankLimit && max_rank < x.nrows() {
                self.give_up(pivoted);
                return Ok(None);
            }
            self.pivots = pivoted.pivots().to_vec();
            if round == 0 {
                pivoted.trim(TRIM * target);
                self.pivots = pivoted.pivots().to_vec();
            }
            let low_rank = LowRank::new(pivoted, noise_std, self.targets)?;
            self.sensitivity = noise_var * low_rank.sensitivity();
            let is_certified = low_rank.truncation_bound() <= certificate;
            if is_certified || extent != Extent::Reached || round + 1 == MAX_ROUNDS {
                return Ok(Some(low_rank));
            }
            target = 0.5 * trace_for(low_rank.sensitivity());
            pivoted = low_rank.into_pivoted();
        }
        Ok(None)
    }

    /// Keeps the memory of a factor of too high a rank, and its pivots where they show soon that the
    /// dense path pays.
    ///
    /// Where there is none, a search steps back to where the pivots of before suffice.
    fn give_up(&mut self, pivoted: PivotedCholesky) {
        if self.targets.len() <= LARGEST_DENSE {
            self.pivots = pivoted.pivots().to_vec();
        } else {
            self.buffer = pivoted.into_buffer();
        }
    }

    /// Pivots and sensitivity to begin with, from the likelihood of a few of the samples.
    ///
    /// With a part p of the samples, tr E and |α̂|² are about p times those of all, so that a
    /// certificate of p² times the wanted one asks for the same pivots.
    fn learn_from_sample<C: Covariance>(&mut self, covariance: &C, noise_std: f64) {
        let n = self.targets.len();
        if n < 3 * SAMPLE {
            return;
        }
        let indices = sample_rows(n, SAMPLE.max(n / 8));
        let part = indices.len() as f64 / n as f64;
        let (x, targets) = subset(self.x, self.targets, &indices);
        let options = LikelihoodOptions {
            method: Method::Certified,
            certificate: self.certificate() * part * part,
        };
        let mut sample = LogMarginal::new(x.as_ref(), &targets, options);
        // Where it fails or needs too many pivots, those it found are as good a beginning.
        let found = sample.certified(covariance, noise_std, indices.len() / 3);
        if matches!(found, Ok(Some(_))) {
            self.sensitivity = (sample.sensitivity / part).max(1.0);
        }
        self.pivots = sample.pivots.iter().map(|&idx| indices[idx]).collect();
    }

    fn require_finite(&self, value: f64) -> Result<(), GpError> {
        if value.is_finite() {
            return Ok(());
        }
        Err(GpError::NonFiniteLikelihood {
            n_samples: self.targets.len(),
        })
    }
}

impl<C: Covariance> Likelihood<C> for LogMarginal<'_> {
    fn evaluate(
        &mut self,
        covariance: &C,
        noise_std: f64,
        gradient: &mut [f64],
    ) -> Result<Evaluation, GpError> {
        LogMarginal::evaluate(self, covariance, noise_std, gradient)
    }

    fn parts(&self) -> Vec<MatRef<'_, f64>> {
        vec![self.x()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sample_takes_one_row_of_each_stretch_and_no_pattern_of_them() {
        for (n, count) in [(1536, 512), (4000, 512), (56_000, 7000), (10, 10)] {
            let rows = sample_rows(n, count);
            assert_eq!(rows.len(), count);
            for (idx, row) in rows.iter().enumerate() {
                assert!((idx * n / count..(idx + 1) * n / count).contains(row));
            }
        }
        // Data in a cycle of 8: every phase is seen about equally often.
        let mut phases = [0; 8];
        for row in sample_rows(4096, 512) {
            phases[row % 8] += 1;
        }
        assert!(
            phases.iter().all(|count| (60..=68).contains(count)),
            "{phases:?}"
        );
    }
}
