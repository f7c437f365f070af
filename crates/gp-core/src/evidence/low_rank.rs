//! The likelihood of eq. (8) from a low-rank factor, with a certificate of its error.
//!
//! Samples along smooth curves carry little information: K = c(X, X) is a matrix
//! K̂ = ΦΦᵀ of rank r ≪ n plus a remainder E ⪰ 0 whose trace ε is known.
//! With A = K̂ + σ²I and α̂ = A⁻¹t,
//!
//! ```text
//! log p̂ = −½ tᵀA⁻¹t − ½ log|A| − ½ n log 2π
//! |log p − log p̂| ≤ ½ max(ε/σ², ε|α̂|²)
//! ```
//!
//! Proof. Let B = A + E.
//! log|B| − log|A| = log|I + A^{−½} E A^{−½}| lies between 0 and tr(A⁻¹E) ≤ ε/σ²,
//! as log(1 + λ) ≤ λ and A ⪰ σ²I.
//! tᵀA⁻¹t − tᵀB⁻¹t lies between 0, as B ⪰ A, and α̂ᵀEα̂ ≤ ε|α̂|², as
//! A⁻¹ − B⁻¹ = A⁻¹EA⁻¹ − A⁻¹EB⁻¹EA⁻¹ with a last term that is positive semi-definite.
//! The two differences enter log p − log p̂ with opposite signs, so the larger one
//! bounds it. ∎
//!
//! tᵀt/σ² can be 10¹⁰ where the likelihood is 10⁴, so the quadratic form is not a
//! difference of such numbers: with the orthogonal factor of
//!
//! ```text
//! [ Φ  ]   [ Q₁ ]          [ σ²α̂ ]                [ t ]
//! [ σI ] = [ Q₂ ] R,       [ −σ g ] = (I − Q Qᵀ)  [ 0 ]
//! tᵀA⁻¹t = σ²|α̂|² + |g|²,    g = Φᵀα̂ = R⁻¹Q₁ᵀt
//! log|A| = (n − r) log σ² + 2 Σ log R_ii
//! ```
//!
//! Source: Rasmussen & Williams 2006, sec. 8.1 (the Nyström form) and eq. (A.9);
//! Harbrecht, Peters & Schneider 2012 (the trace of the remainder).

use std::f64::consts::PI;

use faer::linalg::matmul::matmul;
use faer::linalg::matmul::triangular::{self, BlockStructure};
use faer::linalg::triangular_solve::solve_upper_triangular_in_place;
use faer::{Accum, ColMut, ColRef, Mat, MatRef, Par, RowRef};
use kernels::Covariance;
use linalg::Orthogonal;

use super::pivoted::{PivotedCholesky, row_blocks, rows};
use crate::error::GpError;

/// A zero-mean process with covariance ΦΦᵀ + σ²I, conditioned on targets.
#[derive(Debug, Clone)]
pub(crate) struct LowRank {
    pivoted: PivotedCholesky,
    noise_std: f64,
    noise_var: f64,
    orthogonal: Orthogonal,
    /// α̂ = A⁻¹t, (n,).
    alpha: Vec<f64>,
    /// g = Φᵀα̂, (r,).
    weights: Vec<f64>,
}

impl LowRank {
    /// Conditions on `targets`.
    ///
    /// # Errors
    /// [`GpError::NotPositiveDefinite`] if ΦᵀΦ + σ²I has no factor in double precision.
    pub fn new(pivoted: PivotedCholesky, noise_std: f64, targets: &[f64]) -> Result<Self, GpError> {
        let orthogonal = Orthogonal::new(pivoted.phi(), noise_std)?;
        let (mut alpha, mut weights) = orthogonal.project_out(pivoted.phi(), targets);
        let noise_var = noise_std * noise_std;
        for value in &mut alpha {
            *value /= noise_var;
        }
        for value in &mut weights {
            *value /= -noise_std;
        }
        Ok(Self {
            pivoted,
            noise_std,
            noise_var,
            orthogonal,
            alpha,
            weights,
        })
    }

    /// The factor of K̂.
    pub fn pivoted(&self) -> &PivotedCholesky {
        &self.pivoted
    }

    /// Gives the factor of K̂ back, to be extended.
    pub fn into_pivoted(self) -> PivotedCholesky {
        self.pivoted
    }

    /// Noise standard deviation σ.
    pub fn noise_std(&self) -> f64 {
        self.noise_std
    }

    /// α̂ = A⁻¹t, (n,).
    pub fn alpha(&self) -> &[f64] {
        &self.alpha
    }

    /// |α̂|².
    pub fn alpha_sq_norm(&self) -> f64 {
        squared_norm(&self.alpha)
    }

    /// log p̂, natural log.
    pub fn log_marginal(&self) -> f64 {
        let (n, r) = (self.alpha.len() as f64, self.pivoted.rank() as f64);
        let quadratic = self.noise_var * self.alpha_sq_norm() + squared_norm(&self.weights);
        let log_det = (n - r) * self.noise_var.ln() + self.orthogonal.log_det();
        -0.5 * (quadratic + log_det + n * (2.0 * PI).ln())
    }

    /// Half the larger of ε/σ² and ε|α̂|², for ε = tr E as computed.
    pub fn truncation_bound(&self) -> f64 {
        0.5 * self.pivoted.residual_trace() * self.sensitivity()
    }

    /// What rounding may add to the truncation bound and to the value.
    ///
    /// The first part is the trace that rounding may hide; the second is what any
    /// method that starts from the rounded entries of K has.
    pub fn rounding_bound(&self) -> f64 {
        let entries = rounding_of_entries(
            self.alpha.len(),
            self.pivoted.largest_variance(),
            self.noise_var,
            self.alpha_sq_norm(),
        );
        0.5 * self.pivoted.trace_rounding() * self.sensitivity() + entries
    }

    /// The certificate with its allowance for rounding, in nats.
    pub fn error_bound(&self) -> f64 {
        self.truncation_bound() + self.rounding_bound()
    }

    /// max(1/σ², |α̂|²): nats by which tr E can be multiplied, twice over.
    pub fn sensitivity(&self) -> f64 {
        self.noise_var.recip().max(self.alpha_sq_norm())
    }

    /// Gradient of log p̂ with the pivots held fixed, with respect to (θ, σ).
    ///
    /// ```text
    /// Q = ½(α̂α̂ᵀ − A⁻¹),  W = K_nP K_PP⁻¹ = Φ L_P⁻¹
    /// ∂ log p̂ = Σ (2QW) ∘ ∂K_nP − Σ (WᵀQW) ∘ ∂K_PP,   ∂/∂σ log p̂ = 2σ tr Q
    /// 2QW  = α̂βᵀ − Q₁Sᵀ = α̂βᵀ − B (T⁻¹Sᵀ),   β = L_P⁻ᵀg,  S = L_P⁻ᵀR⁻¹
    /// WᵀQW = ½(ββᵀ − (L_P⁻ᵀ ΦᵀΦ R⁻¹) Sᵀ)
    /// ```
    /// # Panics
    /// If `gradient` does not have one entry per hyperparameter and one for σ.
    pub fn gradient<C: Covariance>(
        &self,
        covariance: &C,
        x: MatRef<'_, f64>,
        gradient: &mut [f64],
    ) {
        let n_params = covariance.n_params();
        assert_eq!(gradient.len(), n_params + 1);
        gradient.fill(0.0);
        let (n, r) = (x.nrows(), self.pivoted.rank());
        let r_inv = self.orthogonal.r_inv(); // (r, r), upper
        if r > 0 {
            let x_p = rows(x, self.pivoted.pivots());
            let beta = self.beta();
            let mut s = r_inv.clone(); // (r, r), upper
            self.solve_l_p_transposed(&mut s);
            let of_theta = &mut gradient[..n_params];
            self.add_adjoint_of_columns(covariance, x, x_p.as_ref(), &s, &beta, of_theta);
            let of_block = self.adjoint_of_block(&s, &r_inv, &beta);
            covariance.gram_adjoint(x_p.as_ref(), of_block.as_ref(), of_theta);
        }

        // tr A⁻¹ = (n − r)/σ² + |R⁻¹|²
        let inverse_trace = (n - r) as f64 / self.noise_var + r_inv.squared_norm_l2();
        gradient[n_params] = self.noise_std * (self.alpha_sq_norm() - inverse_trace);
    }

    /// Weights of the pivots in the posterior mean: β = L_P⁻ᵀ g, (r,).
    pub fn beta(&self) -> Vec<f64> {
        let mut beta = self.weights.clone();
        solve_upper_triangular_in_place(
            self.pivoted.l_p().transpose(),
            ColMut::from_slice_mut(&mut beta).as_mat_mut(),
            Par::Seq,
        );
        beta
    }

    /// R, (r, r), upper triangular, with RᵀR = ΦᵀΦ + σ²I.
    pub fn r(&self) -> MatRef<'_, f64> {
        self.orthogonal.r()
    }

    /// Adds Σ (2QW) ∘ ∂K_nP to the gradient, some rows of 2QW at a time.
    fn add_adjoint_of_columns<C: Covariance>(
        &self,
        covariance: &C,
        x: MatRef<'_, f64>,
        x_p: MatRef<'_, f64>,
        s: &Mat<f64>,
        beta: &[f64],
        gradient: &mut [f64],
    ) {
        let mut weights = s.transpose().to_owned(); // T⁻¹Sᵀ, (r, r)
        solve_upper_triangular_in_place(self.orthogonal.triangle(), weights.as_mut(), Par::Seq);
        let basis = self.orthogonal.top(self.pivoted.phi());
        let longest = row_blocks(x.nrows()).next().map_or(0, |block| block.len());
        let mut buffer = Mat::zeros(longest, beta.len()); // (rows, r)
        for block in row_blocks(x.nrows()) {
            let (first, count) = (block.start, block.len());
            let mut adjoint = buffer.as_mut().subrows_mut(0, count);
            let alpha = ColRef::from_slice(&self.alpha[block]).as_mat();
            let beta = RowRef::from_slice(beta).as_mat();
            matmul(adjoint.as_mut(), Accum::Replace, alpha, beta, 1.0, Par::Seq);
            let basis = basis.subrows(first, count);
            matmul(
                adjoint.as_mut(),
                Accum::Add,
                basis,
                &weights,
                -1.0,
                Par::Seq,
            );
            covariance.cross_adjoint(x.subrows(first, count), x_p, adjoint.as_ref(), gradient);
        }
    }

    /// −WᵀQW, (r, r), symmetric.
    ///
    /// Not by ΦᵀA⁻¹Φ = I − σ²(RᵀR)⁻¹, which cancels where a column of Φ is below σ.
    fn adjoint_of_block(&self, s: &Mat<f64>, r_inv: &Mat<f64>, beta: &[f64]) -> Mat<f64> {
        let (rectangular, upper, lower) = (
            BlockStructure::Rectangular,
            BlockStructure::TriangularUpper,
            BlockStructure::TriangularLower,
        );
        let gram = self.orthogonal.gram();
        let mut half = product((gram, rectangular), (r_inv.as_ref(), upper)); // ΦᵀΦR⁻¹
        self.solve_l_p_transposed(&mut half);
        let product = product((half.as_ref(), rectangular), (s.transpose(), lower)); // WᵀA⁻¹W
        Mat::from_fn(beta.len(), beta.len(), |row, col| {
            let mean = 0.5 * (product[(row, col)] + product[(col, row)]);
            0.5 * (mean - beta[row] * beta[col])
        })
    }

    /// Replaces every column b by L_P⁻ᵀb.
    fn solve_l_p_transposed(&self, rhs: &mut Mat<f64>) {
        let l_p = self.pivoted.l_p();
        solve_upper_triangular_in_place(l_p.transpose(), rhs.as_mut(), Par::Seq);
    }
}

/// Roughly the error that the rounding of K leaves in its log marginal likelihood, in nats.
///
/// ```text
/// ε max K_aa · max(n/σ², |α|²)
/// ```
/// The first as |tr(K⁻¹δK)| ≤ ε max K · n/σ² for rounding errors of the diagonal
/// alone, the second as the spread of αᵀδKα for independent errors of all entries.
pub(crate) fn rounding_of_entries(n: usize, largest: f64, noise_var: f64, alpha_sq: f64) -> f64 {
    f64::EPSILON * largest * (n as f64 / noise_var).max(alpha_sq)
}

/// a b of square matrices, of which only the named parts are read.
fn product(
    (a, of_a): (MatRef<'_, f64>, BlockStructure),
    (b, of_b): (MatRef<'_, f64>, BlockStructure),
) -> Mat<f64> {
    let mut out = Mat::zeros(a.nrows(), b.ncols());
    triangular::matmul(
        out.as_mut(),
        BlockStructure::Rectangular,
        Accum::Replace,
        a,
        of_a,
        b,
        of_b,
        1.0,
        Par::Seq,
    );
    out
}

fn squared_norm(values: &[f64]) -> f64 {
    ColRef::from_slice(values).squared_norm_l2()
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernels::{TorqueCovariance, TorqueForm};

    /// log p̂ and gradient with given pivots.
    fn with_pivots(theta: &[f64], pivots: &[usize]) -> (f64, Vec<f64>) {
        let x = Mat::from_fn(40, 3, |row, col| {
            (0.16 * row as f64 + 1.1 * col as f64).sin() * (1.0 + 0.02 * row as f64)
        });
        let targets: Vec<f64> = (0..40)
            .map(|row| 2.0 * (0.3 * f64::from(row)).sin())
            .collect();
        let (noise_std, of_covariance) = theta.split_last().unwrap();
        let mut covariance = TorqueCovariance::unit(1, TorqueForm::Coulomb);
        covariance.set_params(of_covariance);
        let mut pivoted = PivotedCholesky::empty(&covariance, x.as_ref(), Mat::new());
        pivoted.seed(&covariance, x.as_ref(), pivots);
        assert_eq!(pivoted.rank(), pivots.len());
        let low_rank = LowRank::new(pivoted, *noise_std, &targets).unwrap();
        let mut gradient = vec![0.0; theta.len()];
        low_rank.gradient(&covariance, x.as_ref(), &mut gradient);
        (low_rank.log_marginal(), gradient)
    }

    #[test]
    fn gradient_with_fixed_pivots_is_that_of_central_differences() {
        // Few pivots, so that what is left out is far from negligible.
        for pivots in [vec![], vec![7], vec![3, 30, 12, 21, 37, 0]] {
            let theta = [0.7, 0.5, 0.8, 0.4, 1.3, 0.9, 1.2, 1.5, 0.6, 0.3];
            let (_, gradient) = with_pivots(&theta, &pivots);
            for (idx, value) in theta.iter().enumerate() {
                let step = 1e-5 * value;
                let at = |shift: f64| {
                    let mut moved = theta;
                    moved[idx] += shift;
                    with_pivots(&moved, &pivots).0
                };
                let difference = (at(step) - at(-step)) / (2.0 * step);
                // Values near 100 rounded to 1e-13; third derivatives near 1e4/θ³.
                let tolerance = 1e-12 / step + 1e4 * step * step / value.powi(3);
                let error = (gradient[idx] - difference).abs();
                assert!(error <= tolerance, "{idx}: {} {difference}", gradient[idx]);
            }
        }
    }
}
