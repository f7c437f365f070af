//! The parameters of a rigid body at one state: what a joint's torque is linear in.

use faer::linalg::matmul::matmul;
use faer::linalg::triangular_solve::solve_lower_triangular_in_place;
use faer::{Accum, Mat, MatRef, Par, Side};
use gp_core::Posterior;
use gp_core::fit::{ParameterPrior, RigidBodyCovariance};
use kernels::Covariance;
use linalg::sums::{dot_compensated, dot_pairwise};
use puma_dyn::dynamics::parameters_of_joint;

use crate::rows::RegressorRows;

/// Columns of Y that a joint's torque depends on, with the posterior mean of the parameters there.
///
/// ```text
/// mean(x) = y E[π],   y = Y(x),   E[π] = π₀ + S Y_Bᵀ β,   S = s² diag(Σ)
/// ```
/// # Shapes
/// p columns.
#[derive(Debug, Clone)]
pub(crate) struct Parameters {
    columns: Vec<usize>,
    mean: Vec<f64>,
}

/// S of a joint's columns, (p,), and S Y_Bᵀ, (b, p): the covariance of y with each basis point.
#[derive(Debug, Clone)]
pub(crate) struct ParameterTerms {
    pub prior_var: Vec<f64>,
    pub cross: Mat<f64>,
}

impl Parameters {
    /// Of the basis points of a posterior of deviations from what is known, with the prior at spread s.
    pub fn new<C: Covariance>(
        posterior: &Posterior<C>,
        rows: &RegressorRows,
        spread: f64,
    ) -> (Self, ParameterTerms) {
        let first = 3 * rows.robot.n_joints();
        let columns = parameters_of_joint(&rows.robot, rows.joint_idx);
        let ParameterPrior { mean, std } = &rows.prior;
        let prior_var: Vec<f64> = columns.iter().map(|&k| (spread * std[k]).powi(2)).collect();
        let basis = posterior.basis();
        let cross = Mat::from_fn(basis.rank(), columns.len(), |point, k| {
            prior_var[k] * basis.points[(point, first + columns[k])]
        });
        let learned = |k: usize| {
            let terms = cross.col(k).iter().zip(&basis.weights);
            dot_compensated(terms.map(|(cross, weight)| (*cross, *weight)))
        };
        let mean = (columns.iter().enumerate())
            .map(|(k, column)| mean[*column] + learned(k))
            .collect();
        (Self { columns, mean }, ParameterTerms { prior_var, cross })
    }

    /// Number p of columns.
    pub fn n_columns(&self) -> usize {
        self.columns.len()
    }

    /// Gathers a joint's columns of its row of Y, and gives y E[π].
    pub fn gather(&self, of_joint: &[f64], y: &mut [f64]) -> f64 {
        for (entry, column) in y.iter_mut().zip(&self.columns) {
            *entry = of_joint[*column];
        }
        dot_pairwise(y, &self.mean)
    }
}

/// rbd ready to be asked at one state.
///
/// ```text
/// mean = y E[π],   var = |T y|²,   TᵀT = cov(π | data)
/// ```
/// # Shapes
/// T (p, p), upper triangular, column after column from the top down to the diagonal.
#[derive(Debug, Clone)]
pub(crate) struct RegressorPredictor {
    parameters: Parameters,
    root: UpperTriangle,
}

/// An upper triangular matrix, column after column from the top down to the diagonal.
#[derive(Debug, Clone)]
pub(crate) struct UpperTriangle {
    columns: Vec<f64>,
}

impl UpperTriangle {
    /// The upper triangle of a square matrix.
    pub fn of(matrix: MatRef<'_, f64>) -> Self {
        let upper = (0..matrix.ncols()).flat_map(|col| (0..=col).map(move |row| (row, col)));
        Self {
            columns: upper.map(|at| matrix[at]).collect(),
        }
    }

    /// |T y|², with scratch for T y.
    pub fn squared_norm(&self, y: &[f64], product: &mut [f64]) -> f64 {
        product.fill(0.0);
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                let mut rest = self.columns.as_slice();
                for (col, y) in y.iter().enumerate() {
                    let (column, after) = rest.split_at(col + 1);
                    for (sum, t) in product.iter_mut().zip(column) {
                        *sum += t * y;
                    }
                    rest = after;
                }
                dot_pairwise(product, product)
            },
        )
    }
}

impl RegressorPredictor {
    pub fn new(posterior: &Posterior<RigidBodyCovariance>, rows: &RegressorRows) -> Self {
        let spread = posterior.covariance().inner().spread();
        let (parameters, terms) = Parameters::new(posterior, rows, spread);
        let root = root_of_covariance(posterior, &terms);
        Self {
            parameters,
            root: UpperTriangle::of(root.as_ref()),
        }
    }

    /// Scratch entries needed: y and T y.
    pub fn n_scratch(&self) -> usize {
        2 * self.parameters.n_columns()
    }

    /// Mean and latent variance, from the joint's row of Y.
    pub fn predict(&self, of_joint: &[f64], scratch: &mut [f64]) -> (f64, f64) {
        let (y, product) = scratch.split_at_mut(self.parameters.n_columns());
        let mean = self.parameters.gather(of_joint, y);
        (mean, self.root.squared_norm(y, product))
    }
}

/// T, (p, p), upper triangular, with TᵀT the posterior covariance of the parameters.
///
/// ```text
/// samples as B:  cov = D (I + D Y_BᵀY_B D/σ²)⁻¹ D = D A⁻¹ D,   D = S^½,  A = L_A L_Aᵀ:  L_A⁻¹ D
/// pivots as B:   cov = (S − WᵀW)₊ + σ² (R⁻ᵀW)ᵀ(R⁻ᵀW),   W = L⁻¹ Y_B S
/// ```
/// Sums of squares either way, so that nothing cancels against the prior where data are precise.
/// # Source
/// Rasmussen & Williams 2006, eqs. (2.8) and (2.11), for a linear model.
fn root_of_covariance(
    posterior: &Posterior<RigidBodyCovariance>,
    terms: &ParameterTerms,
) -> Mat<f64> {
    let basis = posterior.basis();
    let (p, noise_std) = (terms.prior_var.len(), posterior.noise_std());
    let std: Vec<f64> = terms.prior_var.iter().map(|var| var.sqrt()).collect();
    let Some(r) = &basis.noise_factor else {
        // Rows of Y_B D/σ under those of I: RᵀR = A by an orthogonal factor, which squares nothing.
        let b = basis.rank();
        let stacked = Mat::from_fn(b + p, p, |row, col| {
            if row < b {
                let d = std[col];
                if d > 0.0 {
                    terms.cross[(row, col)] / d / noise_std
                } else {
                    0.0
                }
            } else {
                f64::from(u8::from(row - b == col))
            }
        });
        let upper = upper_factor(stacked.as_ref()); // A = RᵀR
        let mut root = Mat::from_fn(p, p, |row, col| if row == col { std[row] } else { 0.0 });
        solve_lower_triangular_in_place(upper.transpose(), root.as_mut(), Par::Seq); // R⁻ᵀ D
        return upper_factor(root.as_ref());
    };
    let mut w = terms.cross.clone(); // Y_B S
    basis.factor.half_solve_in_place(w.as_mut());
    let mut remainder = Mat::from_fn(p, p, |row, col| {
        if row == col {
            terms.prior_var[row]
        } else {
            0.0
        }
    });
    matmul(
        remainder.as_mut(),
        Accum::Add,
        w.transpose(),
        w.as_ref(),
        -1.0,
        Par::Seq,
    );
    let unexplained = positive_root(remainder.as_ref());
    solve_lower_triangular_in_place(r.transpose(), w.as_mut(), Par::Seq); // R⁻ᵀ W
    let stacked = Mat::from_fn(p + w.nrows(), p, |row, col| {
        if row < p {
            unexplained[(row, col)]
        } else {
            noise_std * w[(row - p, col)]
        }
    });
    upper_factor(stacked.as_ref())
}

/// R of the orthogonal factorisation A = QR, (p, p), of a matrix with at least p rows.
pub(crate) fn upper_factor(matrix: MatRef<'_, f64>) -> Mat<f64> {
    let r = matrix.qr().thin_R().to_owned();
    Mat::from_fn(r.nrows(), r.ncols(), |row, col| {
        if row <= col { r[(row, col)] } else { 0.0 }
    })
}

/// G with GᵀG = A₊, the part of a symmetric matrix that is not negative; scaled by its diagonal before.
fn positive_root(a: MatRef<'_, f64>) -> Mat<f64> {
    let p = a.nrows();
    let size: Vec<f64> = (0..p).map(|k| a[(k, k)].max(0.0).sqrt()).collect();
    let inverse: Vec<f64> = (size.iter())
        .map(|size| if *size > 0.0 { 1.0 / size } else { 0.0 })
        .collect();
    let scaled = Mat::from_fn(p, p, |row, col| inverse[row] * a[(row, col)] * inverse[col]);
    let Ok(eigen) = scaled.self_adjoint_eigen(Side::Lower) else {
        // Only numbers that are not finite have no eigenvalues; they must not become certainty.
        return Mat::from_fn(p, p, |_, _| f64::NAN);
    };
    let values = eigen.S().column_vector();
    let vectors = eigen.U();
    Mat::from_fn(p, p, |row, col| {
        values[row].max(0.0).sqrt() * vectors[(col, row)] * size[col]
    })
}
