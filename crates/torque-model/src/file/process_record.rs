//! A process of any covariance as a plain record: hyperparameters of eq. (7), posterior, summary of the fit.

use gp_core::{Basis, Posterior, data};
use kernels::{ContinuousJoints, Covariance, TorqueCovariance, TorqueParams};
use linalg::Factor;
use serde::{Deserialize, Serialize};

use crate::file::format::ModelFileError;
use crate::file::matrix_record::{
    MatrixRecord, TriangleRecord, malformed, require, require_values,
};
use crate::fit_summary::FitSummary;

/// The hyperparameters of a joint's covariance, eq. (7).
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct ParamsRecord {
    bias_std: f64,
    linear_std: Vec<f64>,
    signal_std: f64,
    length_scales: Vec<f64>,
    coulomb_std: Option<Vec<f64>>,
}

/// What a process keeps of its data, by either path, and its noise.
#[derive(Debug, Serialize, Deserialize)]
pub(crate) struct PosteriorRecord {
    noise_std: f64,
    basis: BasisRecord,
}

#[derive(Debug, Serialize, Deserialize)]
enum BasisRecord {
    Dense {
        x: MatrixRecord,
        alpha: Vec<f64>,
        l: TriangleRecord,
    },
    LowRank {
        pivots: MatrixRecord,
        weights: Vec<f64>,
        pivot_factor: TriangleRecord,
        /// Rᵀ, so that it is a lower triangle.
        noise_factor_transposed: TriangleRecord,
    },
}

impl ParamsRecord {
    /// The hyperparameters of a covariance.
    pub fn of(covariance: &TorqueCovariance) -> Self {
        let params = covariance.named_params();
        Self {
            bias_std: params.bias_std,
            linear_std: params.linear_std,
            signal_std: params.signal_std,
            length_scales: params.length_scales,
            coulomb_std: params.coulomb_std,
        }
    }

    /// The covariance with these hyperparameters.
    ///
    /// # Errors
    /// [`ModelFileError::Malformed`] for numbers that are none of a covariance, and for joints that it does not have.
    pub fn into_covariance(
        self,
        continuous: &ContinuousJoints,
    ) -> Result<TorqueCovariance, ModelFileError> {
        let of_joints = TorqueCovariance::new(TorqueParams {
            bias_std: self.bias_std,
            linear_std: self.linear_std,
            signal_std: self.signal_std,
            length_scales: self.length_scales,
            coulomb_std: self.coulomb_std,
        })
        .map_err(malformed)?;
        of_joints
            .with_continuous(continuous.clone())
            .map_err(malformed)
    }
}

impl PosteriorRecord {
    /// What a posterior consists of beside its covariance.
    pub fn of<C: Covariance>(posterior: &Posterior<C>) -> Self {
        Self {
            noise_std: posterior.noise_std(),
            basis: BasisRecord::of(posterior.basis()),
        }
    }

    /// The posterior of a covariance whose inputs have `n_columns` columns.
    ///
    /// # Errors
    /// [`ModelFileError::Malformed`] with what does not fit or is not a finite number.
    pub fn into_posterior<C: Covariance>(
        self,
        covariance: C,
        n_columns: usize,
    ) -> Result<Posterior<C>, ModelFileError> {
        data::require_noise(self.noise_std).map_err(malformed)?;
        let basis = self.basis.into_basis(n_columns)?;
        Posterior::from_parts(covariance, self.noise_std, basis).map_err(malformed)
    }
}

impl BasisRecord {
    fn of(basis: &Basis) -> Self {
        let points = MatrixRecord::of(basis.points.as_ref());
        let (weights, l) = (basis.weights.clone(), TriangleRecord::of(basis.factor.l()));
        match &basis.noise_factor {
            None => Self::Dense {
                x: points,
                alpha: weights,
                l,
            },
            Some(r) => Self::LowRank {
                pivots: points,
                weights,
                pivot_factor: l,
                noise_factor_transposed: TriangleRecord::of(r.transpose()),
            },
        }
    }

    fn into_basis(self, n_columns: usize) -> Result<Basis, ModelFileError> {
        let (points, weights, l, r_transposed) = match self {
            Self::Dense { x, alpha, l } => {
                let x = x.into_mat("training inputs", n_columns)?;
                require(x.nrows() > 0, || {
                    "a process without training inputs".to_owned()
                })?;
                let l = l.into_packed("a Cholesky factor", x.nrows())?;
                (x, alpha, l, None)
            }
            Self::LowRank {
                pivots,
                weights,
                pivot_factor,
                noise_factor_transposed,
            } => {
                let pivots = pivots.into_mat("pivots", n_columns)?;
                let l = pivot_factor.into_packed("the pivots' factor", pivots.nrows())?;
                let r = noise_factor_transposed.into_packed("R", pivots.nrows())?;
                (pivots, weights, l, Some(r))
            }
        };
        require_values("weights of a process", &weights, points.nrows())?;
        Ok(Basis {
            points,
            weights,
            factor: Factor::from_lower(l.to_mat()),
            noise_factor: r_transposed.map(|r| r.to_mat().transpose().to_owned()),
        })
    }
}

/// Fails for a summary whose likelihood is not finite.
pub(crate) fn require_summary(summary: FitSummary) -> Result<FitSummary, ModelFileError> {
    require_values("log marginal likelihood", &[summary.log_marginal], 1)?;
    Ok(summary)
}
