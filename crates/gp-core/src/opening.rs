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
        let nats = rounding_bound(evidence, covariance, noise_std);
        let mut opening = Self {
            noise_std: raised(noise_std, nats, max_rounding),
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

/// σ, or what it takes for a search to set out where rounding would be more than the limit in nats.
pub(crate) fn enough_noise<C: Covariance>(
    evidence: &impl Likelihood<C>,
    covariance: &C,
    noise_std: f64,
    max_rounding: f64,
) -> f64 {
    let nats = rounding_bound(evidence, covariance, noise_std);
    if nats > max_rounding && nats.is_finite() {
        raised(noise_std, nats, max_rounding)
    } else {
        noise_std
    }
}

/// σ at which rounding of so many nats, which goes with 1/σ², is well inside the limit; never a smaller one.
fn raised(noise_std: f64, nats: f64, max_rounding: f64) -> f64 {
    noise_std * (nats / (INSIDE * max_rounding)).max(1.0).sqrt()
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "bounds are taken over as they are")]
mod tests {
    use faer::Mat;
    use kernels::{Constant, SeArd};

    use super::*;
    use crate::evidence::LikelihoodOptions;
    use crate::log_marginal::LogMarginal;

    /// Twenty samples of size 3 with signs in turn, at inputs far from one another.
    fn data() -> (Mat<f64>, Vec<f64>) {
        let x = Mat::from_fn(20, 1, |row, _| 100.0 * row as f64);
        let t = (0..20).map(|row| if row % 2 == 0 { 3.0 } else { -3.0 });
        (x, t.collect())
    }

    #[test]
    fn noise_that_is_too_small_is_raised_to_the_residuals() {
        let (x, t) = data();
        let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::automatic());
        // A function that hardly varies: the residuals are the targets.
        let covariance = Constant::new(1e-6).unwrap();
        let opening = Opening::find(&mut evidence, &covariance, 0.1, 0.1).unwrap();
        // ρ = 900, then about 1.
        assert!((opening.noise_std - 3.0).abs() < 0.01, "{opening:?}");
        assert_eq!(opening.evaluations, 2);
        // −½ Σ t²/σ² − n ln σ − ½ n ln 2π at σ = 3.
        let expected = -10.0 - 20.0 * 3.0_f64.ln() - 10.0 * std::f64::consts::TAU.ln();
        assert!((opening.log_marginal - expected).abs() < 1e-3);
    }

    #[test]
    fn noise_that_suits_stays() {
        let (x, t) = data();
        let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::automatic());
        let covariance = SeArd::new(3.0, vec![1.0]).unwrap();
        let opening = Opening::find(&mut evidence, &covariance, 0.5, 0.1).unwrap();
        assert_eq!((opening.noise_std, opening.evaluations), (0.5, 1));
    }

    #[test]
    fn noise_is_raised_to_where_rounding_allows_a_search() {
        let (x, t) = data();
        let mut evidence = LogMarginal::new(x.as_ref(), &t, LikelihoodOptions::automatic());
        let covariance = SeArd::new(1e6, vec![1.0]).unwrap();
        let opening = Opening::find(&mut evidence, &covariance, 0.01, 0.1).unwrap();
        let bound = rounding_bound(&evidence, &covariance, opening.noise_std);
        assert!(bound <= 0.1, "{bound}");
        assert!(opening.noise_std > 0.01);
    }
}
