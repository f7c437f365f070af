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

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatRef, Par};
use kernels::Covariance;

use crate::pivot_choice::choose_pivots;

/// Pivots that are added together at most.
const BLOCK: usize = 24;

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
    /// (r, r), lower; zero above.
    l_p: Mat<f64>,
    /// Diagonal of E, (n,); rounding may take an entry slightly below zero.
    residual: Vec<f64>,
    trace: f64,
    largest: f64,
}

impl PivotedCholesky {
    /// The factor without pivots: E = K.
    pub fn empty<C: Covariance>(covariance: &C, x: MatRef<'_, f64>) -> Self {
        let residual = covariance.diag(x);
        Self {
            pivots: Vec::new(),
            phi: Mat::zeros(x.nrows(), 0),
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
        self.append(covariance, x, seeds, seeds.len(), 0.0);
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
            let with_column = trace + column.iter().map(|v| v * v).sum::<f64>();
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
            self.phi = self.phi.subcols(0, rank).to_owned();
            self.l_p = self.l_p.submatrix(0, 0, rank, rank).to_owned();
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
        subtract_product(&mut schur, phi_c.as_ref(), phi_c.as_ref());
        let floor = PIVOT_NOISE * self.largest;
        let choice = choose_pivots(schur, max_count, floor, worth_taking);
        let added = choice.order.len();
        if added == 0 {
            return 0;
        }

        // Φ_new = (K_nc − Φ Φ_cᵀ) L_c⁻ᵀ
        let chosen: Vec<usize> = choice.order.iter().map(|&idx| candidates[idx]).collect();
        let phi_c = rows(self.phi(), &chosen); // (k, r)
        let mut phi_new = covariance.cross(x, rows(x, &chosen).as_ref()); // (n, k)
        subtract_product(&mut phi_new, self.phi(), phi_c.as_ref());
        solve_lower_triangular_in_place(
            choice.l.as_ref(),
            phi_new.as_mut().transpose_mut(),
            Par::Seq,
        );
        for col in 0..added {
            for (residual, value) in self.residual.iter_mut().zip(phi_new.col_as_slice(col)) {
                *residual -= value * value;
            }
        }
        self.grow(chosen, phi_new, &phi_c, &choice.l);
        added
    }

    /// Φ ← [Φ Φ_new],  L_P ← [L_P 0; Φ_c L_c].
    fn grow(&mut self, chosen: Vec<usize>, phi_new: Mat<f64>, phi_c: &Mat<f64>, l_c: &Mat<f64>) {
        let (n, old, added) = (phi_new.nrows(), self.rank(), chosen.len());
        let rank = old + added;
        let mut l_p = Mat::zeros(rank, rank);
        l_p.as_mut()
            .submatrix_mut(0, 0, old, old)
            .copy_from(&self.l_p);
        l_p.as_mut()
            .submatrix_mut(old, 0, added, old)
            .copy_from(phi_c);
        l_p.as_mut()
            .submatrix_mut(old, old, added, added)
            .copy_from(l_c);
        self.l_p = l_p;
        self.phi = if old == 0 {
            phi_new
        } else {
            let mut phi = Mat::zeros(n, rank);
            phi.as_mut().subcols_mut(0, old).copy_from(&self.phi);
            phi.as_mut().subcols_mut(old, added).copy_from(&phi_new);
            phi
        };
        self.pivots.extend(chosen);
    }
}

/// Some rows of a matrix.
pub(crate) fn rows(matrix: MatRef<'_, f64>, indices: &[usize]) -> Mat<f64> {
    Mat::from_fn(indices.len(), matrix.ncols(), |row, col| {
        matrix[(indices[row], col)]
    })
}

/// out −= a bᵀ
fn subtract_product(out: &mut Mat<f64>, a: MatRef<'_, f64>, b: MatRef<'_, f64>) {
    if a.ncols() > 0 {
        matmul(out.as_mut(), Accum::Add, a, b.transpose(), -1.0, Par::Seq);
    }
}
