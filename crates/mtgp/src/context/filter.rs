//! Which context is it now: eq. (21) sample after sample, with contexts that change.

use faer::MatRef;

use crate::context::estimate::{ContextPrior, most_probable, normalise};
use crate::error::{MtgpError, require_count};

/// How the context moves from one sample to the next: a Markov chain.
///
/// ```text
/// T_γδ = P(c_δ at the next sample | c_γ at this one),   Σ_δ T_γδ = 1
/// ```
/// # Source
/// Section 5: eq. (21) with a time-dependent Markov prior.
#[derive(Debug, Clone, PartialEq)]
pub struct ContextTransition {
    n_contexts: usize,
    /// log T, row after row.
    log_probabilities: Vec<f64>,
}

impl ContextTransition {
    /// The context never changes: T = I.
    pub fn none(n_contexts: usize) -> Self {
        Self::alike(n_contexts, 0.0, f64::NEG_INFINITY)
    }

    /// Every context stays with one probability, and becomes each of the others with another.
    fn alike(n_contexts: usize, log_stay: f64, log_other: f64) -> Self {
        let log = |idx| {
            if idx / n_contexts == idx % n_contexts {
                log_stay
            } else {
                log_other
            }
        };
        Self {
            n_contexts,
            log_probabilities: (0..n_contexts * n_contexts).map(log).collect(),
        }
    }

    /// The context changes at a constant rate, to each of the others alike.
    ///
    /// ```text
    /// T_γγ = exp(−rate · interval),   T_γδ = (1 − T_γγ)/(m − 1)
    /// ```
    /// One context alone never changes.
    /// # Shapes
    /// `rate` in changes per second, `interval` between samples in seconds.
    /// # Errors
    /// [`MtgpError::NoTasks`]; [`MtgpError::NotProbabilities`] unless rate and interval are
    /// finite and not negative.
    pub fn switching(n_contexts: usize, rate: f64, interval: f64) -> Result<Self, MtgpError> {
        if n_contexts == 0 {
            return Err(MtgpError::NoTasks);
        }
        let expected_changes = rate * interval;
        if !(rate >= 0.0 && interval >= 0.0 && expected_changes.is_finite()) {
            let (what, row, sum) = ("switching rate", 0, expected_changes);
            return Err(MtgpError::NotProbabilities { what, row, sum });
        }
        if n_contexts == 1 {
            return Ok(Self::none(1));
        }
        let log_stay = -expected_changes;
        let log_other = (-log_stay.exp_m1() / (n_contexts - 1) as f64).ln();
        Ok(Self::alike(n_contexts, log_stay, log_other))
    }

    /// Any chain.
    ///
    /// # Shapes
    /// `probabilities` T, (m, m), each row summing to one within 10⁻⁹.
    /// # Errors
    /// [`MtgpError::NoTasks`]; [`MtgpError::CountMismatch`] unless square;
    /// [`MtgpError::NotProbabilities`] with the row at fault.
    pub fn from_matrix(probabilities: MatRef<'_, f64>) -> Result<Self, MtgpError> {
        let n_contexts = probabilities.nrows();
        if n_contexts == 0 {
            return Err(MtgpError::NoTasks);
        }
        require_count("columns of transitions", probabilities.ncols(), n_contexts)?;
        let mut log_probabilities = Vec::with_capacity(n_contexts * n_contexts);
        for row in 0..n_contexts {
            let entries = || probabilities.row(row).iter();
            let sum: f64 = entries().sum();
            let is_one = (sum - 1.0).abs() <= 1e-9;
            if entries().any(|entry| *entry < 0.0) || !is_one {
                let what = "transitions";
                return Err(MtgpError::NotProbabilities { what, row, sum });
            }
            log_probabilities.extend(entries().map(|entry| (entry / sum).ln()));
        }
        Ok(Self {
            n_contexts,
            log_probabilities,
        })
    }

    /// Number of contexts m.
    pub fn n_contexts(&self) -> usize {
        self.n_contexts
    }

    /// log Σ_γ p_γ T_γδ for the context δ, given log p.
    fn log_moved(&self, log_probabilities: &[f64], to: usize) -> f64 {
        let terms = || {
            let into = self.log_probabilities[to..].iter().step_by(self.n_contexts);
            into.zip(log_probabilities).map(|(step, log)| step + log)
        };
        let largest = terms().fold(f64::NEG_INFINITY, f64::max);
        if largest == f64::NEG_INFINITY {
            return largest;
        }
        largest + terms().map(|term| (term - largest).exp()).sum::<f64>().ln()
    }
}

/// The forward filter: what is believed of the context at the latest sample.
///
/// ```text
/// P_1(γ) ∝ P(c_γ) p_1(γ)
/// P_s(δ) ∝ p_s(δ) Σ_γ P_{s−1}(γ) T_γδ          s > 1
/// ```
/// p_s(γ) is the density of the sample s under context γ, of whatever origin; the filter takes
/// the samples as independent given their contexts, or p_s as conditioned on earlier ones.
/// If T = I, then P_s is [`crate::context::ContextPosterior`] for the product of the densities: with the
/// densities of single samples, that of a model in which the samples are independent given the
/// context; with p_s conditioned on all earlier samples, eq. (21).
///
/// A step takes O(m²) and allocates nothing.
/// # Source
/// Eq. (21) with the Markov prior of section 5; Rabiner 1989, sec. III.A (forward procedure).
#[derive(Debug, Clone)]
pub struct ContextFilter {
    transition: ContextTransition,
    log_probabilities: Vec<f64>,
    next: Vec<f64>,
    n_samples: usize,
}

impl ContextFilter {
    /// A filter before its first sample.
    ///
    /// # Errors
    /// [`MtgpError::CountMismatch`] unless prior and chain have the same contexts.
    pub fn new(prior: &ContextPrior, transition: ContextTransition) -> Result<Self, MtgpError> {
        let log_probabilities = prior.log_probabilities().to_vec();
        let n_contexts = transition.n_contexts;
        require_count("contexts of the prior", log_probabilities.len(), n_contexts)?;
        Ok(Self {
            transition,
            next: log_probabilities.clone(),
            log_probabilities,
            n_samples: 0,
        })
    }

    /// Takes a sample in, and returns log P_s.
    ///
    /// # Shapes
    /// `log_densities` (m,), log p_s; the result (m,).
    /// # Errors
    /// [`MtgpError::CountMismatch`]; [`MtgpError::NoUsableDensity`] if a density is NaN or +∞, or
    /// no context that can be reached has one above zero. The filter is then as before the call.
    pub fn step(&mut self, log_densities: &[f64]) -> Result<&[f64], MtgpError> {
        let n_contexts = self.transition.n_contexts;
        require_count("densities of contexts", log_densities.len(), n_contexts)?;
        for (context, density) in log_densities.iter().enumerate() {
            let predicted = if self.n_samples == 0 {
                self.log_probabilities[context]
            } else {
                self.transition.log_moved(&self.log_probabilities, context)
            };
            self.next[context] = predicted + density;
        }
        normalise(&mut self.next)?;
        std::mem::swap(&mut self.next, &mut self.log_probabilities);
        self.n_samples += 1;
        Ok(&self.log_probabilities)
    }

    /// log P_s, (m,), natural logarithm.
    pub fn log_probabilities(&self) -> &[f64] {
        &self.log_probabilities
    }

    /// The context of the largest probability, the first of several.
    pub fn most_probable(&self) -> usize {
        most_probable(&self.log_probabilities)
    }

    /// Number of samples taken in.
    pub fn n_samples(&self) -> usize {
        self.n_samples
    }
}
