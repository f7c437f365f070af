//! Densities of torques where the size of the errors is uncertain too.

/// Log density of torques under Student's t, from that of the normal density that it widens.
///
/// ```text
/// p(t) = ∫ N(t; mean, aΣ) InvGamma(a; ν/2, ν/2) da
/// log p(t) = log N(t; mean, Σ) + s/2 − (ν + k)/2 log(1 + s/ν)
///            + log Γ((ν + k)/2) − log Γ(ν/2) − (k/2) log(ν/2)
/// s = (t − mean)ᵀ Σ⁻¹ (t − mean)
/// ```
/// A model errs more on a motion unlike those it was learned from, by about as much under every
/// context: a ratio of normal densities takes all of that for evidence, in proportion to s; a ratio of these
/// only to log s, as one a is right for all torques.
/// For ν → ∞ it is the normal density. NaN for NaN.
/// # Shapes
/// `log_density` log N(t; mean, Σ) and `squares` s of k torques, summed over joints that share a, as
/// [`crate::PredictiveDensity::running_log_densities`] has them; `degrees_of_freedom` ν > 0, the number of
/// torques that the model's own error bars count as.
/// # Source
/// Gelman et al. 2013, *Bayesian Data Analysis*, secs. 3.6 and 17.2; Lange, Little & Taylor 1989.
pub fn student_log_density(
    log_density: f64,
    squares: f64,
    n_torques: usize,
    degrees_of_freedom: f64,
) -> f64 {
    let (nu, k) = (degrees_of_freedom, n_torques as f64);
    let both = 0.5 * (nu + k);
    let gammas = libm::lgamma(both) - libm::lgamma(0.5 * nu) - 0.5 * k * (0.5 * nu).ln();
    log_density + 0.5 * squares - both * (squares / nu).ln_1p() + gammas
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    #[test]
    fn of_one_torque_it_is_the_textbook_s_density() {
        // ν = 4: 3/8 (1 + t²/4)^(−5/2).
        for t in [0.0_f64, 0.7, -3.0, 40.0] {
            let normal = -0.5 * (t * t + TAU.ln());
            let expected = (0.375 * (1.0 + 0.25 * t * t).powf(-2.5)).ln();
            let found = student_log_density(normal, t * t, 1, 4.0);
            // |log N| is up to 800.
            assert!((found - expected).abs() <= 1e-12, "{found} {expected}");
        }
    }

    #[test]
    fn it_is_the_integral_over_the_scale() {
        // Three torques with |Σ| = 0.2, ν = 5; a = e^u by the trapezoidal rule, which is exact but for rounding.
        let (squares, k, nu, log_det) = (17.0_f64, 3, 5.0, 0.2_f64.ln());
        let normal = |a: f64| -0.5 * (squares / a + log_det + 3.0 * (a.ln() + TAU.ln()));
        let prior = |a: f64| {
            let half: f64 = 0.5 * nu;
            half * half.ln() - libm::lgamma(half) - (half + 1.0) * a.ln() - half / a
        };
        let step = 1.0 / 64.0;
        let integral: f64 = (-512..1024)
            .map(|i| f64::from(i) * step)
            .map(|u| (normal(u.exp()) + prior(u.exp()) + u).exp() * step)
            .sum();
        let found = student_log_density(normal(1.0), squares, k, nu);
        assert!((found - integral.ln()).abs() <= 1e-12, "{found}");
    }
}
