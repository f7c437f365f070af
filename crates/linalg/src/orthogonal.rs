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
//! Q itself is never formed, only the last triangle T of
//!
//! ```text
//! Q = [ B; C ] T⁻¹        one round: B = Φ, C = σI, T = R
//!                         two rounds: B = ΦL₁⁻ᵀ, C = σL₁⁻ᵀ, T = L₂ᵀ, R = (L₁L₂)ᵀ
//! ```
//! which saves the work and the memory of a matrix of the size of Φ.
//!
//! Source: Yamamoto, Nakatsukasa, Yanagisawa & Fukaya 2015, ETNA 44, pp. 306–326,
//! algorithm 2 and theorem 3.1; Demmel 1989, LAPACK working note 14 (scaling);
//! Björck 1987, Linear Algebra Appl. 88/89, pp. 31–48 (Q by its triangle alone).

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Accum, ColMut, ColRef, Mat, MatRef, Par};

use crate::cholesky::Factor;
use crate::error::LinalgError;
use crate::products::mirror;

/// How far from I the product QᵀQ may be: the error it leaves in log|RᵀR|.
const LOSS_OF_ORTHOGONALITY: f64 = 1e-10;

/// R, and Q by its parts.
#[derive(Debug, Clone)]
pub struct Orthogonal {
    noise_std: f64,
    r: Mat<f64>,    // (r, r), upper
    gram: Mat<f64>, // ΦᵀΦ, (r, r), symmetric
    second: Option<SecondRound>,
}

/// What takes the place of Φ, σI and R where one round is not enough.
#[derive(Debug, Clone)]
struct SecondRound {
    top: Mat<f64>,      // B = ΦL₁⁻ᵀ, (n, r)
    bottom: Mat<f64>,   // C = σL₁⁻ᵀ, (r, r), upper
    triangle: Mat<f64>, // T = L₂ᵀ, (r, r), upper
}

impl Orthogonal {
    /// Factorises [Φ; σI].
    ///
    /// # Errors
    /// [`LinalgError::NotPositiveDefinite`] if ΦᵀΦ + σ²I has no Cholesky factor.
    pub fn new(phi: MatRef<'_, f64>, noise_std: f64) -> Result<Self, LinalgError> {
        let r = phi.ncols();
        let mut gram = gram_lower(phi);
        let mut shifted = gram.clone();
        mirror(&mut gram);
        for idx in 0..r {
            shifted[(idx, idx)] += noise_std * noise_std;
        }
        let diagonal: Vec<f64> = (0..r).map(|idx| shifted[(idx, idx)]).collect();
        let first = Factor::new(shifted)?;

        let loss = r as f64 * f64::EPSILON * scaled_condition(&diagonal, &first);
        if loss <= LOSS_OF_ORTHOGONALITY {
            return Ok(Self {
                noise_std,
                r: upper_of(first.l()),
                gram,
                second: None,
            });
        }
        let (second, r) = second_round(phi, noise_std, &first)?;
        Ok(Self {
            noise_std,
            r,
            gram,
            second: Some(second),
        })
    }

    /// B, (n, r); `phi` is the matrix that was factorised.
    #[inline]
    pub fn top<'a>(&'a self, phi: MatRef<'a, f64>) -> MatRef<'a, f64> {
        self.second
            .as_ref()
            .map_or(phi, |second| second.top.as_ref())
    }

    /// T, (r, r), upper triangular.
    #[inline]
    pub fn triangle(&self) -> MatRef<'_, f64> {
        self.second
            .as_ref()
            .map_or(self.r(), |second| second.triangle.as_ref())
    }

    /// R, (r, r), upper triangular.
    #[inline]
    pub fn r(&self) -> MatRef<'_, f64> {
        self.r.as_ref()
    }

    /// ΦᵀΦ, (r, r).
    #[inline]
    pub fn gram(&self) -> MatRef<'_, f64> {
        self.gram.as_ref()
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
    /// Projected until it is orthogonal to rounding of itself, not of t, although Q is
    /// orthogonal to 10⁻¹⁰ only: a projection leaves that part of what it took away.
    /// # Source
    /// Giraud, Langou, Rozložník & van den Eshof 2005, Numer. Math. 101, pp. 87–100.
    pub fn project_out(&self, phi: MatRef<'_, f64>, targets: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let mut top = targets.to_vec();
        let mut bottom = vec![0.0; self.r.nrows()];
        for _ in 0..3 {
            let removed = self.project_once(phi, &mut top, &mut bottom);
            let left = (squared_norm(&top) + squared_norm(&bottom)).sqrt();
            if LOSS_OF_ORTHOGONALITY * removed <= f64::EPSILON * left {
                break;
            }
        }
        (top, bottom)
    }

    /// (top, bottom) −= Q Qᵀ(top, bottom); returns the norm of what is taken away.
    fn project_once(&self, phi: MatRef<'_, f64>, top: &mut [f64], bottom: &mut [f64]) -> f64 {
        let basis = self.top(phi);
        let mut along = vec![0.0; bottom.len()]; // (r,)
        add_product(&mut along, basis.transpose(), top, 1.0);
        self.add_bottom_transposed(&mut along, bottom);
        let triangle = self.triangle();
        let column = ColMut::from_slice_mut(&mut along).as_mat_mut();
        solve_lower_triangular_in_place(triangle.transpose(), column, Par::Seq);
        let removed = squared_norm(&along).sqrt();

        let column = ColMut::from_slice_mut(&mut along).as_mat_mut();
        solve_upper_triangular_in_place(triangle, column, Par::Seq);
        add_product(top, basis, &along, -1.0);
        self.subtract_bottom(bottom, &along);
        removed
    }

    /// out += Cᵀv
    fn add_bottom_transposed(&self, out: &mut [f64], vector: &[f64]) {
        match &self.second {
            Some(second) => add_product(out, second.bottom.transpose(), vector, 1.0),
            None => add_scaled(out, vector, self.noise_std),
        }
    }

    /// out −= Cv
    fn subtract_bottom(&self, out: &mut [f64], vector: &[f64]) {
        match &self.second {
            Some(second) => add_product(out, second.bottom.as_ref(), vector, -1.0),
            None => add_scaled(out, vector, -self.noise_std),
        }
    }
}

/// The lower triangle of ΦᵀΦ.
fn gram_lower(phi: MatRef<'_, f64>) -> Mat<f64> {
    let r = phi.ncols();
    let mut gram = Mat::zeros(r, r);
    add_gram_lower(&mut gram, phi);
    gram
}

/// Adds the lower triangle of MᵀM.
fn add_gram_lower(gram: &mut Mat<f64>, matrix: MatRef<'_, f64>) {
    triangular::matmul(
        gram.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Add,
        matrix.transpose(),
        BlockStructure::Rectangular,
        matrix,
        BlockStructure::Rectangular,
        1.0,
        Par::Seq,
    );
}

/// Makes Q, orthogonal roughly, orthogonal to rounding; returns it with R.
fn second_round(
    phi: MatRef<'_, f64>,
    noise_std: f64,
    first: &Factor,
) -> Result<(SecondRound, Mat<f64>), LinalgError> {
    let r = phi.ncols();
    let mut top = phi.to_owned();
    let mut bottom = Mat::from_fn(r, r, |row, col| if row == col { noise_std } else { 0.0 });
    first.half_solve_in_place(top.as_mut().transpose_mut());
    first.half_solve_in_place(bottom.as_mut().transpose_mut());

    let mut gram = gram_lower(top.as_ref()); // QᵀQ
    add_gram_lower(&mut gram, bottom.as_ref());
    let second = Factor::new(gram)?;
    let product = product_of_factors(first, &second);
    let round = SecondRound {
        top,
        bottom,
        triangle: upper_of(second.l()),
    };
    Ok((round, upper_of(product.as_ref())))
}

/// Lᵀ with zeros below the diagonal, from the lower triangle of a square matrix.
pub fn upper_of(lower: MatRef<'_, f64>) -> Mat<f64> {
    let r = lower.nrows();
    Mat::from_fn(
        r,
        r,
        |row, col| {
            if row <= col { lower[(col, row)] } else { 0.0 }
        },
    )
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

/// out += factor · v
fn add_scaled(out: &mut [f64], vector: &[f64], factor: f64) {
    for (out, value) in out.iter_mut().zip(vector) {
        *out += factor * value;
    }
}

fn squared_norm(values: &[f64]) -> f64 {
    ColRef::from_slice(values).squared_norm_l2()
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

        let (top, bottom) = factor.project_out(phi.as_ref(), &[1.0; 54]);
        // (1, …, 1) is the first column but for σ: what is left of it is about σ.
        let left: f64 = top.iter().chain(&bottom).map(|v| v * v).sum();
        assert!(left.sqrt() <= 1.5 * noise_std, "{:e}", left.sqrt());
        // Q = [B; C] T⁻¹ by its two columns.
        let second = factor
            .second
            .as_ref()
            .expect("columns that are nearly equal");
        let triangle = &second.triangle;
        let q = |part: &Mat<f64>| {
            let first = part.col(0) * (1.0 / triangle[(0, 0)]);
            let rest = part.col(1) - &first * triangle[(0, 1)];
            first.transpose() * rest * (1.0 / triangle[(1, 1)])
        };
        let product = q(&second.top) + q(&second.bottom);
        assert!(product.abs() <= tolerance, "{product:e}");
    }
}
