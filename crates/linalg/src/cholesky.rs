//! The Cholesky factor K = LLᵀ of a positive definite matrix.

use faer::linalg::triangular_solve::{
    solve_lower_triangular_in_place, solve_upper_triangular_in_place,
};
use faer::{ColMut, Mat, MatMut, MatRef, Par};

use crate::error::LinalgError;
use crate::in_place::{factorise_in_place, invert_in_place};
use crate::threads::Threads;
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
    /// [`LinalgError::NotPositiveDefinite`] at the first pivot that is not a positive number,
    /// which includes NaN anywhere in the triangle.
    /// # Panics
    /// If the matrix is not square.
    pub fn new(mut k: Mat<f64>) -> Result<Self, LinalgError> {
        let order = k.nrows();
        assert_eq!(
            order,
            k.ncols(),
            "a matrix with a Cholesky factor is square"
        );
        let threads = Threads::at_hand(order);
        let outcome = if order < TILED {
            factorise_in_place(k.as_mut())
        } else {
            threads.run(|| tiled::factorise(k.as_mut(), threads))
        };
        outcome.map_err(|pivot| LinalgError::NotPositiveDefinite { pivot, order })?;
        Ok(Self { l: k })
    }

    /// The factor whose L stands in the lower triangle of a square matrix.
    ///
    /// # Panics
    /// If the matrix is not square.
    pub fn from_lower(l: Mat<f64>) -> Self {
        assert_eq!(l.nrows(), l.ncols(), "a Cholesky factor is square");
        Self { l }
    }

    /// Order n of the matrix.
    #[inline]
    pub fn order(&self) -> usize {
        self.l.nrows()
    }

    /// The factor L; only its lower triangle has a meaning.
    #[inline]
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
