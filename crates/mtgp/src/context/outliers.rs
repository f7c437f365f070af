//! Samples that the model does not describe: a heavy tail of the density of a torque.

use std::f64::consts::TAU;

use crate::error::MtgpError;

/// How often and how far a torque may be off, beyond what the model says.
///
/// ```text
/// p(z) = (1 − ε) N(z; 0, 1) + ε N(z; 0, κ²)      z: the residual over its standard deviation
/// ```
/// A model that extrapolates can be far surer of itself than it should be, under every context alike.
/// A sample that is implausible under all of them then says next to nothing of which one it is,
/// while one that a single context explains still says so: log(κ/ε) nats and more.
/// # Source
/// Tukey 1960, "A survey of sampling from contaminated distributions"; Box & Tiao 1968.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outliers {
    probability: f64,
    spread: f64,
}

impl Outliers {
    /// No sample is off: the density of the model itself.
    pub const NONE: Self = Self {
        probability: 0.0,
        spread: 1.0,
    };

    /// A part ε of the torques is off, with κ times the standard deviation.
    ///
    /// # Errors
    /// [`MtgpError::NotProbabilities`] unless 0 ≤ ε < 1, or κ is not finite and at least 1.
    pub fn new(probability: f64, spread: f64) -> Result<Self, MtgpError> {
        let refuse = |what, sum| Err(MtgpError::NotProbabilities { what, row: 0, sum });
        if !(0.0..1.0).contains(&probability) {
            return refuse("probability of an outlier", probability);
        }
        if !(spread >= 1.0 && spread.is_finite()) {
            return refuse("spread of outliers", spread);
        }
        Ok(Self {
            probability,
            spread,
        })
    }

    /// log p(z).
    pub(crate) fn log_density(self, z: f64) -> f64 {
        let usual = -0.5 * (z * z + TAU.ln());
        if self.probability <= 0.0 {
            return usual;
        }
        let far = z / self.spread;
        let tail = -0.5 * (far * far + TAU.ln()) + (self.probability / self.spread).ln();
        let core = usual + (-self.probability).ln_1p();
        let largest = core.max(tail);
        largest + ((core - largest).exp() + (tail - largest).exp()).ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn densities_by_hand() {
        let outliers = Outliers::new(0.1, 10.0).unwrap();
        // z = 0: 0.9 N(0) + 0.1 N(0)/10 = 0.91 N(0).
        let at_zero = (0.91_f64).ln() - 0.5 * TAU.ln();
        assert!((outliers.log_density(0.0) - at_zero).abs() < 4.0 * f64::EPSILON);
        // z = 100: the core is e⁻⁵⁰⁰⁰ of the tail.
        let far = -50.0 - 0.5 * TAU.ln() + 0.01_f64.ln();
        assert!((outliers.log_density(100.0) - far).abs() < 1e-13);
        assert!((Outliers::NONE.log_density(3.0) + 4.5 + 0.5 * TAU.ln()).abs() < 1e-15);
    }

    #[test]
    fn what_is_no_distribution_is_refused() {
        for (probability, spread) in [
            (-0.1, 2.0),
            (1.0, 2.0),
            (f64::NAN, 2.0),
            (0.1, 0.5),
            (0.1, f64::INFINITY),
        ] {
            assert!(Outliers::new(probability, spread).is_err());
        }
    }
}
