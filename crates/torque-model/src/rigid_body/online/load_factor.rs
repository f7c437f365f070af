//! Cholesky factors of order ten, without a call to the heap.

use puma_dyn::dynamics::N_PARAMETERS;

/// Ten numbers of a load.
pub(super) type Ten = [f64; N_PARAMETERS];
/// A matrix of such, row after row.
pub(super) type Square = [Ten; N_PARAMETERS];

/// The unit matrix.
pub(super) fn unit() -> Square {
    std::array::from_fn(|row| std::array::from_fn(|col| f64::from(u8::from(row == col))))
}

/// Σ a b
#[inline(always)]
#[allow(clippy::inline_always, reason = "compiled once per instruction set")]
pub(super) fn inner(a: &Ten, b: &Ten) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// L of A = LLᵀ.
#[derive(Debug, Clone)]
pub(super) struct LoadFactor {
    l: Square,
    inverse_diagonal: Ten,
}

impl LoadFactor {
    /// Of the lower triangle of A; `None` where A is not positive definite.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    pub fn new(a: &Square) -> Option<Self> {
        let mut l = [[0.0; N_PARAMETERS]; N_PARAMETERS];
        let mut inverse_diagonal = [0.0; N_PARAMETERS];
        for row in 0..N_PARAMETERS {
            for col in 0..row {
                let sum: f64 = (0..col).map(|k| l[row][k] * l[col][k]).sum();
                l[row][col] = (a[row][col] - sum) * inverse_diagonal[col];
            }
            let sum: f64 = l[row][..row].iter().map(|value| value * value).sum();
            let pivot = a[row][row] - sum;
            if !(pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            l[row][row] = pivot.sqrt();
            inverse_diagonal[row] = 1.0 / l[row][row];
        }
        Some(Self {
            l,
            inverse_diagonal,
        })
    }

    /// log|L|
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    pub fn log_det_root(&self) -> f64 {
        let product: f64 = self.inverse_diagonal.iter().map(|value| value.ln()).sum();
        -product
    }

    /// L⁻¹b
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    pub fn half_solve(&self, b: &Ten) -> Ten {
        let mut solved = *b;
        for row in 0..N_PARAMETERS {
            let sum: f64 = (0..row).map(|k| self.l[row][k] * solved[k]).sum();
            solved[row] = (solved[row] - sum) * self.inverse_diagonal[row];
        }
        solved
    }

    /// L⁻ᵀb
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    pub fn second_half_solve(&self, b: &Ten) -> Ten {
        let mut solved = *b;
        for row in (0..N_PARAMETERS).rev() {
            let sum: f64 = (row + 1..N_PARAMETERS)
                .map(|k| self.l[k][row] * solved[k])
                .sum();
            solved[row] = (solved[row] - sum) * self.inverse_diagonal[row];
        }
        solved
    }

    /// L⁻¹B
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    pub fn half_solve_matrix(&self, b: &Square) -> Square {
        let mut solved = *b;
        for row in 0..N_PARAMETERS {
            let (above, rest) = solved.split_at_mut(row);
            for (k, of_k) in above.iter().enumerate() {
                let l = self.l[row][k];
                rest[0]
                    .iter_mut()
                    .zip(of_k)
                    .for_each(|(to, b)| *to -= l * b);
            }
            let inverse = self.inverse_diagonal[row];
            rest[0].iter_mut().for_each(|value| *value *= inverse);
        }
        solved
    }

    /// Diagonal of A⁻¹.
    pub fn inverse_diagonal(&self) -> Ten {
        let inverse = self.half_solve_matrix(&unit()); // L⁻¹
        std::array::from_fn(|col| inverse.iter().map(|row| row[col] * row[col]).sum())
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "powers of two are exact")]
mod tests {
    use super::*;

    /// A_ij = min(i, j): its L is all ones, its inverse has 2 on the diagonal and 1 in the last place.
    fn least() -> Square {
        std::array::from_fn(|row| std::array::from_fn(|col| (row.min(col) + 1) as f64))
    }

    #[test]
    fn a_matrix_with_known_factor_and_inverse() {
        let factor = LoadFactor::new(&least()).unwrap();
        assert!(factor.log_det_root().abs() < 1e-15);
        let ones = [1.0; N_PARAMETERS];
        assert_eq!(factor.half_solve(&ones), unit()[0]);
        assert_eq!(factor.second_half_solve(&ones), unit()[N_PARAMETERS - 1]);
        let mut expected = [2.0; N_PARAMETERS];
        expected[N_PARAMETERS - 1] = 1.0;
        assert_eq!(factor.inverse_diagonal(), expected);
        assert!(LoadFactor::new(&[[1.0; N_PARAMETERS]; N_PARAMETERS]).is_none());
    }
}
