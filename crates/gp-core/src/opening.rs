//! The first likelihood on more samples than before, with noise enough for them.
//!
//! Hyperparameters of few samples may be sure of more than many samples bear out:
//! a step that fell between two of them, fitted with hardly any noise, costs
//! 10⁵ nats where samples come closer.
//! A search would spend its work on the way back, so σ is raised first.

use kernels::Covariance;

use crate::search::{Likelihood, n_samples, rounding_bound, work_of};

/// Mean squared standardised residual beyond which σ is raised.
const TOO_SURE: f64 = 4.0;

/// Times that σ is raised at most.
const MAX_RAISES: usize = 2;

/// Part of the limit on rounding at which a search may set out.
const INSIDE: f64 = 0.5;

/// Where a search on more samples sets out, with the likelihood there.
#[derive(Debug, Clone)]
pub(crate) struct Opening {
    pub noise_std: f64,
    pub log_marginal: f64,
    /// With respect to (θ, σ).
    pub gradient: Vec<f64>,
    pub evaluations: usize,
    pub work: f64,
}

impl Opening {
    /// Raises σ until the residuals are no surprise; `None` where there is no likelihood.
    ///
    /// ```text
    /// ρ = σ²|α|²/n ≈ 1 + (σ/n) ∂ log p/∂σ,    σ ← σ √ρ  while ρ > 4, at most twice
    /// ```
    /// as ∂ log p/∂σ = σ(|α|² − tr K⁻¹) and tr K⁻¹ ≤ n/σ²; σ²α are the residuals of the
    /// posterior mean, so that σ√ρ is their root mean square.
    /// # Source
    /// The update of the noise in the EM algorithm, without the posterior variance:
    /// Dempster, Laird & Rubin 1977, sec. 4.
    pub fn find<C: Covariance>(
        evidence: &mut impl Likelihood<C>,
        covariance: &C,
        noise_std: f64,
        max_rounding: f64,
    ) -> Option<Self> {
        let excess = rounding_bound(evidence, covariance, noise_std) / (INSIDE * max_rounding);
        let mut opening = Self {
            noise_std: noise_std * excess.max(1.0).sqrt(),
            log_marginal: f64::NEG_INFINITY,
            gradient: vec![0.0; covariance.n_params() + 1],
            evaluations: 0,
            work: 0.0,
        };
        for round in 0..=MAX_RAISES {
            let surprise = opening.evaluate(evidence, covariance)?;
            if surprise <= TOO_SURE || round == MAX_RAISES {
                break;
            }
            opening.noise_std *= surprise.sqrt();
        }
        Some(opening)
    }

    /// ρ at the present σ.
    fn evaluate<C: Covariance>(
        &mut self,
        evidence: &mut impl Likelihood<C>,
        covariance: &C,
    ) -> Option<f64> {
        let evaluation = evidence.evaluate(covariance, self.noise_std, &mut self.gradient);
        let n_samples = n_samples(evidence);
        self.evaluations += 1;
        self.work += work_of(evaluation.as_ref().ok(), n_samples);
        self.log_marginal = evaluation.ok()?.log_marginal_likelihood;
        let slope = self.gradient.last()?;
        Some(1.0 + self.noise_std * slope / n_samples as f64)
    }
}
