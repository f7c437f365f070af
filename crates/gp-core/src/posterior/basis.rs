//! The points that a posterior is expressed in, with what it has learned there.

use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Mat, MatRef, Par};
use linalg::Factor;

use crate::data::{require_finite_inputs, require_noise};
use crate::error::GpError;

/// Points B, weights β and triangular factors of a posterior.
///
/// ```text
/// mean(f) = c(f, B) β
/// cov(f, g) = c(f, g) − c(f, B) P c(B, g)
/// samples as B:  P = K⁻¹ = L⁻ᵀL⁻¹                      LLᵀ = c(B, B) + σ²I
/// pivots as B:   P = L⁻ᵀ (I − σ²R⁻¹R⁻ᵀ) L⁻¹            LLᵀ = c(B, B),  RᵀR = ΦᵀΦ + σ²I
/// ```
/// for any values f, g of the process.
/// # Shapes
/// b points of d covariates.
/// # Source
/// Eqs. (3)–(4); for pivots Rasmussen & Williams 2006, eqs. (8.14) and (8.15).
#[derive(Debug, Clone)]
pub struct Basis {
    /// Inputs of the points, (b, d).
    pub points: Mat<f64>,
    /// β: K⁻¹t of samples, (b,).
    pub weights: Vec<f64>,
    /// L, (b, b).
    pub factor: Factor,
    /// R of pivots, (b, b), upper triangular; `None` where the points are the samples.
    pub noise_factor: Option<Mat<f64>>,
}

impl Basis {
    /// Number b of points: the rank of what has been learned.
    pub fn rank(&self) -> usize {
        self.weights.len()
    }

    /// Whether the points are a few pivots that carry what all samples say.
    pub fn is_on_pivots(&self) -> bool {
        self.noise_factor.is_some()
    }

    /// # Errors
    /// [`GpError::CountMismatch`] unless everything is of b points; [`GpError::BadNoise`],
    /// [`GpError::NonFiniteInput`] or [`GpError::NonFiniteTarget`] for numbers that are not usable.
    pub(crate) fn require_usable(&self, noise_std: f64) -> Result<(), GpError> {
        let rank = self.rank();
        let mut sides = vec![self.points.nrows(), self.factor.order()];
        if let Some(r) = &self.noise_factor {
            sides.extend([r.nrows(), r.ncols()]);
        }
        if let Some(&side) = sides.iter().find(|side| **side != rank) {
            return Err(GpError::CountMismatch {
                n_inputs: side,
                n_targets: rank,
            });
        }
        require_noise(noise_std)?;
        let matrices = [Some(&self.points), self.noise_factor.as_ref()];
        for matrix in matrices.into_iter().flatten() {
            require_finite_inputs(matrix.as_ref())?;
        }
        require_finite_lower(self.factor.l())?;
        match self.weights.iter().position(|value| !value.is_finite()) {
            None => Ok(()),
            Some(row) => Err(GpError::NonFiniteTarget {
                row,
                value: self.weights[row],
            }),
        }
    }

    /// P c(B, F) in place of `cross` = c(B, F), (b, p).
    ///
    /// # Panics
    /// If `cross` does not have b rows.
    pub fn solve_in_place(&self, noise_std: f64, cross: &mut Mat<f64>) {
        self.factor.half_solve_in_place(cross.as_mut());
        if let Some(r) = &self.noise_factor {
            let mut part = cross.clone();
            solve_lower_triangular_in_place(r.transpose(), part.as_mut(), Par::Seq);
            solve_upper_triangular_in_place(r.as_ref(), part.as_mut(), Par::Seq);
            *cross -= faer::Scale(noise_std * noise_std) * part;
        }
        let l = self.factor.l();
        solve_upper_triangular_in_place(l.transpose(), cross.as_mut(), Par::Seq);
    }
}

fn require_finite_lower(l: MatRef<'_, f64>) -> Result<(), GpError> {
    for column in 0..l.ncols() {
        let below = (column..l.nrows()).find(|&row| !l[(row, column)].is_finite());
        if let Some(row) = below {
            let value = l[(row, column)];
            return Err(GpError::NonFiniteInput { row, column, value });
        }
    }
    Ok(())
}
