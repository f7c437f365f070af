//! The orthogonal factor of a tall matrix on top of a multiple of the identity.
//!
//! ```text
//! [ Φ  ]   [ Q₁ ]
//! [ σI ] = [ Q₂ ] R,   Q₁ᵀQ₁ + Q₂ᵀQ₂ = I,   RᵀR = ΦᵀΦ + σ²I
//! ```
//! Cholesky QR does in matrix products what Householder's reflections do in products
//! of matrix and vector.
//! One round leaves QᵀQ − I at about r ε κ, with κ the condition number of RᵀR after
//! its diagonal is scaled to ones; columns of a pivoted factor are nearly orthogonal
//! to each other, so κ is small although that of RᵀR itself is not.
//! Where it is not small, a second round makes Q orthogonal to rounding.
//!
//! Source: Yamamoto, Nakatsukasa, Yanagisawa & Fukaya 2015, ETNA 44, pp. 306–326,
//! algorithm 2 and theorem 3.1; Demmel 1989, LAPACK working note 14 (scaling).

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::{Accum, ColMut, ColRef, Mat, MatRef, Par};

use crate::cholesky::Factor;
use crate::error::GpError;

/// How far from I the product QᵀQ may be: the error it leaves in log|RᵀR|.
const LOSS_OF_ORTHOGONALITY: f64 = 1e-10;

/// Q₁, Q₂ and R, with ΦᵀΦ.
#[derive(Debug, Clone)]
pub(crate) struct Orthogonal {
    q1: Mat<f64>,   // (n, r)
    q2: Mat<f64>,   // (r, r), upper
    r: Mat<f64>,    // (r, r), upper
    gram: Mat<f64>, // ΦᵀΦ, (r, r), symmetric
}

impl Orthogonal {
    /// Factorises [Φ; σI].
    ///
    /// # Errors
    /// [`GpError::NotPositiveDefinite`] if ΦᵀΦ + σ²I has no Cholesky factor.
    pub fn new(phi: MatRef<'_, f64>, noise_std: f64) -> Result<Self, GpError> {
        let r = phi.ncols();
        let mut gram = gram_lower(phi);
        let mut shifted = gram.clone();
        for idx in 0..r {
            shifted[(idx, idx)] += noise_std * noise_std;
        }
        mirror(&mut gram);

        // First round: Q = [Φ; σI] L₁⁻ᵀ.
        let diagonal: Vec<f64> = (0..r).map(|idx| shifted[(idx, idx)]).collect();
        let first = Factor::new(shifted)?;
        let mut q1 = phi.to_owned();
        let mut q2 = Mat::from_fn(r, r, |row, col| if row == col { noise_std } else { 0.0 });
        first.half_solve_in_place(q1.as_mut().transpose_mut());
        first.half_solve_in_place(q2.as_mut().transpose_mut());

        let loss = r as f64 * f64::EPSILON * scaled_condition(&diagonal, &first);
        let factor = if loss <= LOSS_OF_ORTHOGONALITY {
            first.l().to_owned()
        } else {
            let second = second_round(&mut q1, &mut q2)?;
            product_of_factors(&first, &second)
        };
        let r = Mat::from_fn(
            r,
            r,
            |row, col| {
                if row <= col { factor[(col, row)] } else { 0.0 }
            },
        );
        Ok(Self { q1, q2, r, gram })
    }

    /// Q₁, (n, r).
    pub fn q1(&self) -> MatRef<'_, f64> {
        self.q1.as_ref()
    }

    /// R, (r, r), upper triangular.
    pub fn r(&self) -> MatRef<'_, f64> {
        self.r.as_ref()
    }

    /// ΦᵀΦ, (r, r).
    pub fn gram(&self) -> &Mat<f64> {
        &self.gram
    }

    /// log|RᵀR|.
    pub fn log_det(&self) -> f64 {
        let half: f64 = (0..self.r.nrows()).map(|idx| self.r[(idx, idx)].ln()).sum();
        2.0 * half
    }

    /// R⁻¹, (r, r), upper triangular.
    pub fn r_inv(&self) -> Mat<f64> {
        let mut inverse = Mat::zeros(self.r.nrows(), self.r.nrows());
        invert_lower_triangular(
            inverse.as_mut().transpose_mut(),
            self.r.transpose(),
            Par::Seq,
        );
        inverse
    }

    /// The part of (t, 0) that is orthogonal to Q, top (n,) and bottom (r,).
    ///
    /// Projected three times, so that it is orthogonal to rounding of itself, not of t,
    /// although Q is orthogonal to 10⁻¹⁰ only.
    /// # Source
    /// Giraud, Langou, Rozložník & van den Eshof 2005, Numer. Math. 101, pp. 87–100.
    pub fn project_out(&self, targets: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut top = targets.to_vec();
        let mut bottom = vec![0.0; self.q2.nrows()];
        for _ in 0..3 {
            let mut along = vec![0.0; bottom.len()]; // (r,)
            add_product(&mut along, self.q1.transpose(), &top, 1.0);
            add_product(&mut along, self.q2.transpose(), &bottom, 1.0);
            add_product(&mut top, self.q1.as_ref(), &along, -1.0);
            add_product(&mut bottom, self.q2.as_ref(), &along, -1.0);
        }
        (top, bottom)
    }
}

/// The lower triangle of ΦᵀΦ.
fn gram_lower(phi: MatRef<'_, f64>) -> Mat<f64> {
    let r = phi.ncols();
    let mut gram = Mat::zeros(r, r);
    triangular::matmul(
        gram.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Replace,
        phi.transpose(),
        BlockStructure::Rectangular,
        phi,
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
    gram
}

/// Copies the lower triangle to the upper.
fn mirror(matrix: &mut Mat<f64>) {
    for col in 1..matrix.ncols() {
        for row in 0..col {
            matrix[(row, col)] = matrix[(col, row)];
        }
    }
}

/// Makes the columns of [Q₁; Q₂], orthogonal roughly, orthogonal to rounding.
fn second_round(q1: &mut Mat<f64>, q2: &mut Mat<f64>) -> Result<Factor, GpError> {
    let mut gram = gram_lower(q1.as_ref()); // QᵀQ
    triangular::matmul(
        gram.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Add,
        q2.transpose(),
        BlockStructure::Rectangular,
        q2.as_ref(),
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
    let factor = Factor::new(gram)?;
    factor.half_solve_in_place(q1.as_mut().transpose_mut());
    factor.half_solve_in_place(q2.as_mut().transpose_mut());
    Ok(factor)
}

/// Roughly the condition number of LLᵀ with its diagonal scaled to ones.
///
/// ```text
/// max_i (LLᵀ)_ii / L_ii²     1/(1 − the squared correlation of column i with those before)
/// ```
fn scaled_condition(diagonal: &[f64], factor: &Factor) -> f64 {
    (diagonal.iter().enumerate())
        .map(|(idx, entry)| entry / factor.l()[(idx, idx)].powi(2))
        .fold(1.0, f64::max)
}

/// L₁L₂.
fn product_of_factors(first: &Factor, second: &Factor) -> Mat<f64> {
    let r = first.order();
    let mut product = Mat::zeros(r, r);
    triangular::matmul(
        product.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Replace,
        first.l(),
        BlockStructure::TriangularLower,
        second.l(),
        BlockStructure::TriangularLower,
        1.0,
        Par::Seq,
    );
    product
}

/// out += factor · M v
fn add_product(out: &mut [f64], matrix: MatRef<'_, f64>, vector: &[f64], factor: f64) {
    matmul(
        ColMut::from_slice_mut(out),
        Accum::Add,
        matrix,
        ColRef::from_slice(vector),
        factor,
        Par::Seq,
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearly_equal_columns_are_made_orthogonal_in_a_second_round() {
        // Columns a and a + eb with aᵀb = 0 and powers of two, so that
        // |ΦᵀΦ + σ²I| = (n + σ²)(n(1 + e²) + σ²) − n² is known without cancellation.
        let (n, e, noise_std) = (54.0, 2.0_f64.powi(-17), 2.0_f64.powi(-20));
        let phi = Mat::from_fn(54, 2, |row, col| {
            let sign = if row % 2 == 0 { 1.0 } else { -1.0 };
            1.0 + if col == 1 { e * sign } else { 0.0 }
        });
        let factor = Orthogonal::new(phi.as_ref(), noise_std).unwrap();
        let s = noise_std * noise_std;
        let determinant = n * n * e * e + 2.0 * n * s + n * e * e * s + s * s;
        // Φ is taken to ε, which the difference of its columns magnifies by 1/e.
        let tolerance = n * f64::EPSILON / e;
        let error = (factor.log_det() - determinant.ln()).abs();
        assert!(error <= tolerance, "{error:e} {tolerance:e}");

        let (top, bottom) = factor.project_out(&[1.0; 54]);
        // (1, …, 1) is the first column but for σ: what is left of it is about σ.
        let left: f64 = top.iter().chain(&bottom).map(|v| v * v).sum();
        assert!(left.sqrt() <= 1.5 * noise_std, "{:e}", left.sqrt());
        let product = factor.q1.col(0).transpose() * factor.q1.col(1)
            + factor.q2.col(0).transpose() * factor.q2.col(1);
        assert!(product.abs() <= tolerance, "{product:e}");
    }
}
