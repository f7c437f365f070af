//! The Cholesky factor K = LLᵀ: the only place where a covariance matrix is factorised.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::{
    LltError, LltParams, LltRegularization, cholesky_in_place, cholesky_in_place_scratch,
};
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_inverse::invert_lower_triangular;
use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{Accum, Auto, ColMut, Mat, MatMut, MatRef, Par, Spec};

use linalg::Threads;

use crate::error::GpError;
use crate::tiled;

/// Orders from which a matrix is worked on in tiles.
const TILED: usize = 640;

/// Lower Cholesky factor of a positive definite matrix.
///
/// ```text
/// K = L Lᵀ
/// ```
/// Nothing is ever added to the diagonal of K: a matrix that is not positive
/// definite in double precision is an error.
/// Large matrices are worked on in tiles, by all threads at hand; the tiles depend on
/// the order of the matrix only, so results do not depend on the number of threads.
/// # Source
/// Golub & Van Loan 2013, sec. 4.2.
#[derive(Debug, Clone)]
pub struct Factor {
    /// L on and below the diagonal; what is above is left over and never read.
    l: Mat<f64>,
}

impl Factor {
    /// Factorises K in place, reading its lower triangle only.
    ///
    /// # Errors
    /// [`GpError::NotPositiveDefinite`] at the first pivot that is not a positive number,
    /// which includes NaN anywhere in the triangle.
    /// # Panics
    /// If the matrix is not square.
    pub fn new(mut k: Mat<f64>) -> Result<Self, GpError> {
        let order = k.nrows();
        assert_eq!(order, k.ncols(), "a covariance matrix is square");
        let threads = Threads::at_hand(order);
        let outcome = if order < TILED {
            factorise_in_place(k.as_mut())
        } else {
            threads.run(|| tiled::factorise(k.as_mut(), threads))
        };
        outcome.map_err(|pivot| GpError::NotPositiveDefinite { pivot, order })?;
        Ok(Self { l: k })
    }

    /// The factor whose L stands in the lower triangle of a square matrix.
    ///
    /// # Panics
    /// If the matrix is not square.
    pub(crate) fn from_lower(l: Mat<f64>) -> Self {
        assert_eq!(l.nrows(), l.ncols(), "a Cholesky factor is square");
        Self { l }
    }

    /// Order n of the matrix.
    pub fn order(&self) -> usize {
        self.l.nrows()
    }

    /// The factor L; only its lower triangle has a meaning.
    pub fn l(&self) -> MatRef<'_, f64> {
        self.l.as_ref()
    }

    /// Natural logarithm of the determinant.
    ///
    /// ```text
    /// log|K| = 2 Σ_i log L_ii
    /// ```
    pub fn log_det(&self) -> f64 {
        let half: f64 = (0..self.order()).map(|idx| self.l[(idx, idx)].ln()).sum();
        2.0 * half
    }

    /// A lower bound on the condition number of K in the 2-norm: (max L_ii / min L_ii)².
    pub fn condition_lower_bound(&self) -> f64 {
        let (low, high) = (0..self.order())
            .map(|idx| self.l[(idx, idx)])
            .fold((f64::INFINITY, 0.0_f64), |(low, high), pivot| {
                (low.min(pivot), high.max(pivot))
            });
        (high / low).powi(2)
    }

    /// Replaces every column b of the right-hand side by L⁻¹b.
    ///
    /// # Panics
    /// If the right-hand side does not have n rows.
    pub fn half_solve_in_place(&self, rhs: MatMut<'_, f64>) {
        solve_lower_triangular_in_place(self.l(), rhs, Par::Seq);
    }

    /// Replaces every column b of the right-hand side by K⁻¹b.
    ///
    /// # Panics
    /// If the right-hand side does not have n rows.
    pub fn solve_in_place(&self, mut rhs: MatMut<'_, f64>) {
        self.half_solve_in_place(rhs.as_mut());
        solve_upper_triangular_in_place(self.l().transpose(), rhs, Par::Seq);
    }

    /// Quadratic form and solution of one right-hand side.
    ///
    /// ```text
    /// (bᵀK⁻¹b, K⁻¹b),   bᵀK⁻¹b = |L⁻¹b|²
    /// ```
    /// # Panics
    /// If `rhs` does not have n entries.
    pub fn quadratic_form_and_solve(&self, rhs: &[f64]) -> (f64, Vec<f64>) {
        assert_eq!(rhs.len(), self.order());
        let mut solution = rhs.to_vec();
        self.half_solve_in_place(ColMut::from_slice_mut(&mut solution).as_mat_mut());
        let quadratic = solution.iter().map(|value| value * value).sum();
        solve_upper_triangular_in_place(
            self.l().transpose(),
            ColMut::from_slice_mut(&mut solution).as_mat_mut(),
            Par::Seq,
        );
        (quadratic, solution)
    }

    /// K v = L (Lᵀ v).
    ///
    /// # Panics
    /// If `vector` does not have one entry per row.
    pub fn product(&self, vector: &[f64]) -> Vec<f64> {
        let n = self.order();
        assert_eq!(vector.len(), n);
        let l = self.l();
        let mut product = vec![0.0; n];
        for col in 0..n {
            let below = l.col(col).subrows(col, n - col);
            let entries = || below.iter().zip(col..n);
            let inner: f64 = entries().map(|(l, row)| l * vector[row]).sum();
            entries().for_each(|(l, row)| product[row] += l * inner);
        }
        product
    }

    /// K⁻¹b for one right-hand side.
    ///
    /// # Panics
    /// If `rhs` does not have n entries.
    pub fn solve(&self, rhs: &[f64]) -> Vec<f64> {
        self.quadratic_form_and_solve(rhs).1
    }

    /// The lower triangle of K⁻¹, in the memory of the factor.
    ///
    /// `scratch` (n, n) is overwritten with L⁻¹; together they take 2n² doubles.
    /// ```text
    /// K⁻¹ = L⁻ᵀ L⁻¹
    /// ```
    /// Entries above the diagonal are left unspecified.
    /// # Panics
    /// If `scratch` is not (n, n).
    pub fn into_inverse(self, scratch: &mut Mat<f64>) -> Mat<f64> {
        let mut inverse = self.l;
        let order = inverse.nrows();
        assert_eq!((scratch.nrows(), scratch.ncols()), (order, order));
        if order < TILED {
            invert_in_place(inverse.as_mut(), scratch.as_mut());
        } else {
            let threads = Threads::at_hand(order);
            threads.run(|| tiled::invert(inverse.as_mut(), scratch.as_mut(), threads));
        }
        inverse
    }

    /// Gives the memory back.
    pub fn into_buffer(self) -> Mat<f64> {
        self.l
    }
}

/// Replaces the lower triangle of K by that of L, by one thread.
///
/// # Errors
/// The index of the first pivot that is not a positive number.
pub(crate) fn factorise_in_place(k: MatMut<'_, f64>) -> Result<(), usize> {
    let params: Spec<LltParams, f64> = <LltParams as Auto<f64>>::auto().into();
    let scratch = cholesky_in_place_scratch::<f64>(k.nrows(), Par::Seq, params);
    cholesky_in_place(
        k,
        LltRegularization::default(),
        Par::Seq,
        MemStack::new(&mut MemBuffer::new(scratch)),
        params,
    )
    .map_err(|LltError::NonPositivePivot { index }| index)?;
    Ok(())
}

/// The lower triangle of L⁻ᵀL⁻¹ in place of that of L, with L⁻¹ in `scratch`, by one thread.
fn invert_in_place(mut l: MatMut<'_, f64>, mut scratch: MatMut<'_, f64>) {
    invert_lower_triangular(scratch.as_mut(), l.as_ref(), Par::Seq);
    triangular::matmul(
        l.as_mut(),
        BlockStructure::TriangularLower,
        Accum::Replace,
        scratch.as_ref().transpose(),
        BlockStructure::TriangularUpper,
        scratch.as_ref(),
        BlockStructure::TriangularLower,
        1.0,
        Par::Seq,
    );
}
