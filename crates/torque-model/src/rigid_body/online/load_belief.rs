//! What rows tell of a load, and how well each hypothesis about it explains them.
//!
//! ```text
//! log p(D | u) = −½ (n log 2π + log|S| + q) + bᵀu − ½ uᵀHu,   u = ψ/s
//! u = μ + C z + e,  e ~ N(0, V):   log p(D | c) = log ∫ p(D | u) N(Bu; m, W) du,   z | u, D ~ N(ẑ − Zu, P)
//! B = 1 + CZ,   m = μ + Cẑ,   W = V + C P Cᵀ
//! ```
//! s are the widths of a load's prior, so that one that is not known has u ~ N(0, 1): B = 1, m = 0, W = 1.

use puma_dyn::dynamics::N_PARAMETERS;

use crate::rigid_body::online::load_factor::{LoadFactor, Square, Ten, inner};

/// Entries of a row of residual and load columns, with zeros behind them.
pub(super) const WIDTH: usize = 16;
/// Those that are not zero.
pub(super) const N_COLUMNS: usize = 1 + N_PARAMETERS;

/// What rows that are independent of each other say of a load.
#[derive(Debug, Clone, Copy)]
pub(super) struct LoadInformation {
    /// Inner products of residuals and load columns: q, b and H.
    pub gram: [[f64; WIDTH]; N_COLUMNS],
    /// n log 2π + log|S|
    pub log_vars: f64,
}

impl LoadInformation {
    /// Of no row.
    pub const NONE: Self = Self {
        gram: [[0.0; WIDTH]; N_COLUMNS],
        log_vars: 0.0,
    };

    /// Every row counts `part` of what it did.
    pub fn forget(&mut self, part: f64) {
        let entries = self.gram.as_flattened_mut().iter_mut();
        entries.for_each(|value| *value *= part);
        self.log_vars *= part;
    }

    /// log p(D | u = 0)
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn log_without(&self) -> f64 {
        -0.5 * (self.log_vars + self.gram[0][0])
    }

    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn b(&self) -> Ten {
        std::array::from_fn(|k| self.gram[0][1 + k])
    }

    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn h(&self) -> Square {
        std::array::from_fn(|row| std::array::from_fn(|col| self.gram[1 + row][1 + col]))
    }
}

/// A load given the arm, as the rows have left it: N(Bu; m, W).
#[derive(Debug, Clone, Copy)]
pub(super) struct LoadPrior {
    /// B.
    pub map: Square,
    /// m.
    pub mean: Ten,
    /// W.
    pub covariance: Square,
}

/// How well a hypothesis explains the rows, and the load under it.
#[derive(Debug, Clone)]
pub(super) struct LoadBelief {
    /// log p(D | c).
    pub log_evidence: f64,
    /// Mean of u.
    pub mean: Ten,
    /// Factor of the precision of u; none where u is known.
    pub precision: Option<LoadFactor>,
}

impl LoadBelief {
    /// Nothing is carried.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    pub fn of_none(information: &LoadInformation) -> Self {
        Self {
            log_evidence: information.log_without(),
            mean: [0.0; N_PARAMETERS],
            precision: None,
        }
    }

    /// Of a load that is not known.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    pub fn of_unknown(information: &LoadInformation) -> Self {
        let mut precision = information.h();
        for (k, row) in precision.iter_mut().enumerate() {
            row[k] += 1.0;
        }
        Self::solved(information, &precision, &information.b(), 0.0)
    }

    /// Of a load with a prior.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    pub fn of_known(information: &LoadInformation, prior: &LoadPrior) -> Self {
        let Some(factor) = LoadFactor::new(&prior.covariance) else {
            return Self::impossible();
        };
        let map = factor.half_solve_matrix(&prior.map); // L⁻¹B
        let mean = factor.half_solve(&prior.mean); // L⁻¹m
        let (mut precision, mut moment) = (information.h(), information.b());
        for (of_row, mean) in map.iter().zip(&mean) {
            for (row, left) in of_row.iter().enumerate() {
                moment[row] += left * mean;
                for (to, right) in precision[row].iter_mut().zip(&of_row[..=row]) {
                    *to += left * right;
                }
            }
        }
        let known = -0.5 * inner(&mean, &mean) - factor.log_det_root();
        Self::solved(information, &precision, &moment, known)
    }

    /// The Gaussian integral of exp(vᵀu − ½ uᵀMu), (2π)^5 left out.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn solved(information: &LoadInformation, m: &Square, v: &Ten, known: f64) -> Self {
        let Some(factor) = LoadFactor::new(m) else {
            return Self::impossible();
        };
        let half = factor.half_solve(v);
        Self {
            log_evidence: information.log_without() + known + 0.5 * inner(&half, &half)
                - factor.log_det_root(),
            mean: factor.second_half_solve(&half),
            precision: Some(factor),
        }
    }

    /// Numbers that overflow explain nothing.
    fn impossible() -> Self {
        Self {
            log_evidence: f64::NEG_INFINITY,
            mean: [0.0; N_PARAMETERS],
            precision: None,
        }
    }

    /// Standard deviations of u.
    pub fn std(&self) -> Ten {
        let variances = self.precision.as_ref().map(LoadFactor::inverse_diagonal);
        variances.map_or([0.0; N_PARAMETERS], |variances| variances.map(f64::sqrt))
    }
}

/// log of the mean of exponentials, of as many as there are.
#[inline(always)]
#[allow(clippy::inline_always, reason = "compiled once per instruction set")]
pub(super) fn log_mean_exp(values: impl Iterator<Item = f64>) -> f64 {
    let (mut largest, mut sum, mut n) = (f64::NEG_INFINITY, 0.0, 0.0);
    for value in values {
        n += 1.0;
        if value <= largest {
            sum += (value - largest).exp();
        } else {
            sum = sum * (largest - value).exp() + 1.0;
            largest = value;
        }
    }
    largest + f64::ln(sum / n)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::rigid_body::online::load_factor::unit;

    #[test]
    fn one_number_by_hand() {
        // y = 2u + ε, u ~ N(0, 1), y = 3: N(3; 0, 5), u ~ N(6/5, 1/5).
        let mut information = LoadInformation::NONE;
        let row = {
            let mut row = [0.0; N_COLUMNS];
            (row[0], row[4]) = (3.0, 2.0);
            row
        };
        for (to, a) in information.gram.iter_mut().zip(row) {
            to.iter_mut().zip(row).for_each(|(to, b)| *to = a * b);
        }
        information.log_vars = TAU.ln();
        let expected = -0.5 * (9.0 / 5.0 + 5.0_f64.ln() + TAU.ln());
        let unknown = LoadBelief::of_unknown(&information);
        let standard = LoadPrior {
            map: unit(),
            mean: [0.0; N_PARAMETERS],
            covariance: unit(),
        };
        let known = LoadBelief::of_known(&information, &standard);
        for belief in [unknown, known] {
            assert!((belief.log_evidence - expected).abs() < 1e-14);
            assert!((belief.mean[3] - 1.2).abs() < 1e-15);
            assert!((belief.std()[3] - 0.2_f64.sqrt()).abs() < 1e-15);
            assert!((belief.std()[0] - 1.0).abs() < 1e-15);
        }
        // Without a load: N(3; 0, 1).
        let none = LoadBelief::of_none(&information);
        assert!((none.log_evidence + 0.5 * (9.0 + TAU.ln())).abs() < 1e-14);
    }

    #[test]
    fn a_mean_of_exponentials_does_not_overflow() {
        let value = log_mean_exp([-1000.0, 2000.0, 2000.0].into_iter());
        assert!(
            (value - 2000.0 - (2.0_f64 / 3.0).ln()).abs() < 1e-12,
            "{value}"
        );
        assert!(log_mean_exp([0.0, 0.0].into_iter()).abs() < 1e-15);
    }
}
