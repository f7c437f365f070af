//! The pivoted Cholesky factor of a covariance matrix, with the trace of what it leaves out.
//!
//! ```text
//! K ≈ K̂ = Φ Φᵀ,   Φ = K_nP L_P⁻ᵀ,   K_PP = L_P L_Pᵀ,   E = K − K̂ ⪰ 0
//! ```
//! P are the pivots: samples whose values determine those of all others.
//! Only the diagonal of K and its columns P are ever computed, in blocks, so that
//! the work is in matrix products: O(n r²) for r pivots.
//!
//! Source: Harbrecht, Peters & Schneider 2012, Applied Numerical Mathematics 62,
//! pp. 428–440, algorithm 1; here with several pivots chosen at a time.

use std::ops::Range;

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatMut, MatRef, Par};
use kernels::Covariance;

use super::pivot_choice::{Choice, choose_pivots};

/// Pivots that are added together at most.
const BLOCK: usize = 24;

/// Earlier pivots that are taken together.
const SEED_BLOCK: usize = 96;

/// Rows of Φ that are worked on together: 64 columns of them are 256 kB.
const ROWS: usize = 512;

/// Columns for which memory is asked at first; what is not written is not used.
const FIRST_COLUMNS: usize = 96;

/// Samples among which the pivots of a block are chosen: the worst of each stretch of data.
const CANDIDATES: usize = 96;

/// A pivot of a block is not taken when it is below this part of the block's first.
const WORTH_TAKING: f64 = 0.02;

/// Below this part of the largest variance, a pivot is rounding error.
///
/// A residual E_ii is the difference of K_ii and a sum of up to r squares.
const PIVOT_NOISE: f64 = 64.0 * f64::EPSILON;

/// Why the search for pivots ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Extent {
    /// The trace is within its target.
    Reached,
    /// What is left is rounding error; more pivots would not reduce it.
    AtRounding,
    /// The largest rank allowed is used up.
    RankLimit,
}

/// K ≈ ΦΦᵀ, with everything that a certificate needs.
#[derive(Debug, Clone)]
pub(crate) struct PivotedCholesky {
    pivots: Vec<usize>,
    /// (n, r)
    phi: Mat<f64>,
    /// Columns for which there is room in Φ, at least.
    columns: usize,
    /// (r, r), lower; zero above.
    l_p: Mat<f64>,
    /// Diagonal of E, (n,); rounding may take an entry slightly below zero.
    residual: Vec<f64>,
    trace: f64,
    largest: f64,
}

impl PivotedCholesky {
    /// The factor without pivots: E = K.
    ///
    /// `buffer` is memory for Φ, of any shape; what it holds is lost.
    pub fn empty<C: Covariance>(covariance: &C, x: MatRef<'_, f64>, mut buffer: Mat<f64>) -> Self {
        let residual = covariance.diag(x);
        buffer.truncate(0, 0);
        buffer.resize_with(x.nrows(), 0, |_, _| 0.0);
        Self {
            pivots: Vec::new(),
            phi: buffer,
            columns: 0,
            l_p: Mat::new(),
            trace: residual.iter().sum(),
            largest: residual.iter().copied().fold(0.0, f64::max),
            residual,
        }
    }

    /// Rows of the data that are pivots, in order of choice.
    pub fn pivots(&self) -> &[usize] {
        &self.pivots
    }

    /// Φ, (n, r).
    pub fn phi(&self) -> MatRef<'_, f64> {
        self.phi.as_ref()
    }

    /// L_P, (r, r), lower triangular.
    pub fn l_p(&self) -> MatRef<'_, f64> {
        self.l_p.as_ref()
    }

    /// Number of pivots r.
    pub fn rank(&self) -> usize {
        self.pivots.len()
    }

    /// Largest variance max K_aa.
    pub fn largest_variance(&self) -> f64 {
        self.largest
    }

    /// tr E as computed.
    pub fn residual_trace(&self) -> f64 {
        self.residual.iter().map(|value| value.max(0.0)).sum()
    }

    /// What rounding may hide of tr E.
    ///
    /// ```text
    /// 2 √(r + 1) ε tr K
    /// ```
    /// A sum of r products is rounded by √r ε/2 of its size times a small constant,
    /// except with a probability that falls exponentially in that constant; the
    /// constant here is 4.
    /// # Source
    /// Higham & Mary 2019, SIAM J. Sci. Comput. 41, A2815–A2835, theorem 2.4.
    pub fn trace_rounding(&self) -> f64 {
        2.0 * ((self.rank() + 1) as f64).sqrt() * f64::EPSILON * self.trace
    }

    /// Takes the pivots of an earlier factor, as far as they still add something.
    pub fn seed<C: Covariance>(&mut self, covariance: &C, x: MatRef<'_, f64>, seeds: &[usize]) {
        for block in seeds.chunks(SEED_BLOCK) {
            self.append(covariance, x, block, block.len(), 0.0);
        }
    }

    /// Gives the memory of Φ back.
    pub fn into_buffer(self) -> Mat<f64> {
        self.phi
    }

    /// Adds pivots until tr E is within `target`.
    pub fn extend<C: Covariance>(
        &mut self,
        covariance: &C,
        x: MatRef<'_, f64>,
        target: f64,
        max_rank: usize,
    ) -> Extent {
        loop {
            let trace = self.residual_trace();
            if trace <= target {
                return Extent::Reached;
            }
            let room = max_rank.saturating_sub(self.rank());
            if room == 0 {
                return Extent::RankLimit;
            }
            let candidates = self.worst_of_each_stretch();
            let added = self.append(covariance, x, &candidates, BLOCK.min(room), WORTH_TAKING);
            if added == 0 {
                return Extent::AtRounding;
            }
        }
    }

    /// Drops the last pivots that the target does not need.
    pub fn trim(&mut self, target: f64) {
        let mut trace = self.residual_trace();
        let mut rank = self.rank();
        while rank > 0 {
            let column = self.phi.col_as_slice(rank - 1);
            let with_column = trace + self.phi.col(rank - 1).squared_norm_l2();
            if !matches!(
                with_column.partial_cmp(&target),
                Some(std::cmp::Ordering::Less)
            ) {
                break;
            }
            for (residual, value) in self.residual.iter_mut().zip(column) {
                *residual += value * value;
            }
            trace = with_column;
            rank -= 1;
        }
        if rank < self.rank() {
            self.pivots.truncate(rank);
            self.phi.truncate(self.residual.len(), rank);
            self.l_p.truncate(rank, rank);
        }
    }

    /// In each of some stretches of consecutive samples, the one with the largest residual.
    fn worst_of_each_stretch(&self) -> Vec<usize> {
        let n = self.residual.len();
        let stretch = n.div_ceil(CANDIDATES);
        (0..n)
            .step_by(stretch)
            .map(|first| {
                let end = n.min(first + stretch);
                (first..end).fold(first, |worst, idx| {
                    if self.residual[idx] > self.residual[worst] {
                        idx
                    } else {
                        worst
                    }
                })
            })
            .collect()
    }

    /// Adds up to `max_count` of the candidates; returns how many.
    fn append<C: Covariance>(
        &mut self,
        covariance: &C,
        x: MatRef<'_, f64>,
        candidates: &[usize],
        max_count: usize,
        worth_taking: f64,
    ) -> usize {
        // The Schur complement K_cc − Φ_c Φ_cᵀ of the candidates.
        let phi_c = rows(self.phi(), candidates); // (m, r)
        let mut schur = covariance.gram(rows(x, candidates).as_ref()); // (m, m)
        subtract_product(schur.as_mut(), phi_c.as_ref(), phi_c.as_ref());
        let floor = PIVOT_NOISE * self.largest;
        let choice = choose_pivots(schur.as_ref(), max_count, floor, worth_taking);
        let added = choice.order.len();
        if added > 0 {
            let chosen = choice.order.iter().map(|&idx| candidates[idx]).collect();
            self.grow(covariance, x, chosen, choice.l.as_ref());
        }
        added
    }

    /// Φ ← [Φ Φ_new] with Φ_new = (K_nc − Φ Φ_cᵀ) L_c⁻ᵀ,  L_P ← [L_P 0; Φ_c L_c].
    fn grow<C: Covariance>(
        &mut self,
        covariance: &C,
        x: MatRef<'_, f64>,
        chosen: Vec<usize>,
        l_c: MatRef<'_, f64>,
    ) {
        let (n, old, added) = (x.nrows(), self.rank(), chosen.len());
        let rank = old + added;
        let x_c = rows(x, &chosen); // (k, d)
        let phi_c = rows(self.phi(), &chosen); // (k, r)
        self.reserve(n, rank);
        self.phi.resize_with(n, rank, |_, _| 0.0);
        for block in row_blocks(n) {
            let (first, count) = (block.start, block.len());
            let of_block = self.phi.as_mut().subrows_mut(first, count);
            let (phi, mut phi_new) = of_block.split_at_col_mut(old);
            covariance.add_cross(x.subrows(first, count), x_c.as_ref(), phi_new.as_mut());
            subtract_product(phi_new.as_mut(), phi.as_ref(), phi_c.as_ref());
            solve_lower_triangular_in_place(l_c, phi_new.as_mut().transpose_mut(), Par::Seq);
            subtract_squares(&mut self.residual[block], phi_new.as_ref());
        }

        self.l_p.resize_with(rank, rank, |_, _| 0.0);
        let mut new_rows = self.l_p.as_mut().subrows_mut(old, added);
        new_rows.as_mut().subcols_mut(0, old).copy_from(&phi_c);
        new_rows.subcols_mut(old, added).copy_from(l_c);
        self.pivots.extend(chosen);
    }

    /// Makes room for `rank` columns at least, twice as many as before where it must move them.
    fn reserve(&mut self, n: usize, rank: usize) {
        if rank > self.columns {
            self.columns = rank.max(2 * self.columns).max(FIRST_COLUMNS);
            self.phi.reserve(n, self.columns);
        }
    }
}

/// Consecutive rows that are worked on together, so that what is made of them stays in cache.
pub(crate) fn row_blocks(n: usize) -> impl Iterator<Item = Range<usize>> {
    (0..n)
        .step_by(ROWS)
        .map(move |first| first..n.min(first + ROWS))
}

/// Some rows of a matrix.
pub(crate) fn rows(matrix: MatRef<'_, f64>, indices: &[usize]) -> Mat<f64> {
    Mat::from_fn(indices.len(), matrix.ncols(), |row, col| {
        matrix[(indices[row], col)]
    })
}

/// out −= a bᵀ
fn subtract_product(out: MatMut<'_, f64>, a: MatRef<'_, f64>, b: MatRef<'_, f64>) {
    if a.ncols() > 0 {
        matmul(out, Accum::Add, a, b.transpose(), -1.0, Par::Seq);
    }
}

/// Subtracts the squared norm of every row.
fn subtract_squares(residual: &mut [f64], phi: MatRef<'_, f64>) {
    pulp::Arch::new().dispatch(
        #[inline(always)]
        || {
            for col in phi.col_iter() {
                let column = col.try_as_col_major().expect("Φ is column-major");
                for (residual, value) in residual.iter_mut().zip(column.as_slice()) {
                    *residual -= value * value;
                }
            }
        },
    );
}

/// Rows of a small covariance matrix that determine the others but for rounding, and their factor.
///
/// `largest` is the largest variance that the matrix is a remainder of.
pub(crate) fn independent_rows(matrix: MatRef<'_, f64>, largest: f64) -> Choice {
    choose_pivots(matrix, matrix.nrows(), PIVOT_NOISE * largest, 0.0)
}
