//! What stands in the payload of a model file, and the checks that turn it back into a model.
//!
//! Records are plain: lists, numbers, strings.
//! A matrix is its numbers of rows and columns and its columns one after another;
//! a triangle is its order and its columns from the diagonal down.

use faer::{Mat, MatRef};
use kernels::{TorqueCovariance, TorqueParams};
use serde::{Deserialize, Serialize};

use crate::bayes_linear::{BayesLinear, LinearForm};
use crate::cholesky::Factor;
use crate::data::require_noise;
use crate::fit_posterior::FitPosterior;
use crate::low_rank_posterior::{LowRankParts, LowRankPosterior};
use crate::model::file::ModelFileError;
use crate::model::joint_model::{FitSummary, JointModel, ProcessModel};
use crate::model::packed_lower::PackedLower;
use crate::model::provenance::Provenance;
use crate::model::torque_model::TorqueModel;
use crate::model::training_ranges::TrainingRanges;
use crate::posterior::Posterior;

#[derive(Serialize, Deserialize)]
pub(crate) struct ModelRecord {
    joint_names: Vec<String>,
    ranges: RangesRecord,
    provenance: ProvenanceRecord,
    learned: Vec<(usize, JointRecord)>,
}

#[derive(Serialize, Deserialize)]
struct RangesRecord {
    min: Vec<f64>,
    max: Vec<f64>,
    n_samples: usize,
}

#[derive(Serialize, Deserialize)]
struct ProvenanceRecord {
    data_sha256: [u8; 32],
    robot_sha256: Option<[u8; 32]>,
    program: String,
    context: String,
}

#[derive(Serialize, Deserialize)]
enum JointRecord {
    Linear(LinearRecord),
    Process(Box<ProcessRecord>),
}

#[derive(Serialize, Deserialize)]
struct LinearRecord {
    n_joints: usize,
    has_signs: bool,
    weights: Vec<f64>,
    /// Rᵀ, so that it is a lower triangle.
    r_transposed: TriangleRecord,
}

#[derive(Serialize, Deserialize)]
struct ProcessRecord {
    params: ParamsRecord,
    noise_std: f64,
    posterior: PosteriorRecord,
    summary: SummaryRecord,
}

#[derive(Serialize, Deserialize)]
struct ParamsRecord {
    bias_std: f64,
    linear_std: Vec<f64>,
    signal_std: f64,
    length_scales: Vec<f64>,
    coulomb_std: Option<Vec<f64>>,
}

#[derive(Serialize, Deserialize)]
enum PosteriorRecord {
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

#[derive(Serialize, Deserialize)]
struct SummaryRecord {
    log_marginal: f64,
    start: String,
    n_starts: usize,
    evaluations: usize,
    bounds_hit: Vec<String>,
    condition_lower_bound: f64,
    method: String,
    rank: usize,
    error_bound: Option<f64>,
}

#[derive(Serialize, Deserialize)]
struct MatrixRecord {
    n_rows: usize,
    n_cols: usize,
    columns: Vec<f64>,
}

#[derive(Serialize, Deserialize)]
struct TriangleRecord {
    order: usize,
    columns: Vec<f64>,
}

impl ModelRecord {
    pub fn of(model: &TorqueModel) -> Self {
        let (ranges, provenance) = (model.ranges(), model.provenance());
        let learned = model.learned().iter();
        Self {
            joint_names: model.joint_names().to_vec(),
            ranges: RangesRecord {
                min: ranges.min().to_vec(),
                max: ranges.max().to_vec(),
                n_samples: ranges.n_samples(),
            },
            provenance: ProvenanceRecord {
                data_sha256: provenance.data_sha256,
                robot_sha256: provenance.robot_sha256,
                program: provenance.program.clone(),
                context: provenance.context.clone(),
            },
            learned: learned.map(|(idx, m)| (*idx, JointRecord::of(m))).collect(),
        }
    }

    /// The model, if every part is one and they fit together.
    ///
    /// # Errors
    /// [`ModelFileError::Malformed`] with what is wrong.
    pub fn into_model(self) -> Result<TorqueModel, ModelFileError> {
        let learned = self.learned.into_iter();
        let learned: Result<_, ModelFileError> = learned
            .map(|(idx, record)| Ok((idx, record.into_model()?)))
            .collect();
        let ranges = TrainingRanges::new(self.ranges.min, self.ranges.max, self.ranges.n_samples);
        let provenance = Provenance {
            data_sha256: self.provenance.data_sha256,
            robot_sha256: self.provenance.robot_sha256,
            program: self.provenance.program,
            context: self.provenance.context,
        };
        let ranges = ranges.map_err(malformed)?;
        TorqueModel::new(self.joint_names, learned?, ranges, provenance).map_err(malformed)
    }
}

impl JointRecord {
    fn of(model: &JointModel) -> Self {
        match model {
            JointModel::Linear(linear) => Self::Linear(LinearRecord::of(linear)),
            JointModel::Process(process) => Self::Process(Box::new(ProcessRecord::of(process))),
        }
    }

    fn into_model(self) -> Result<JointModel, ModelFileError> {
        Ok(match self {
            Self::Linear(record) => record.into_linear()?.into(),
            Self::Process(record) => JointModel::Process(Box::new(record.into_process()?)),
        })
    }
}

impl LinearRecord {
    fn of(linear: &BayesLinear) -> Self {
        Self {
            n_joints: linear.n_joints(),
            has_signs: linear.form() == LinearForm::Coulomb,
            weights: linear.weights().to_vec(),
            r_transposed: TriangleRecord::of(linear.r().transpose()),
        }
    }

    fn into_linear(self) -> Result<BayesLinear, ModelFileError> {
        let form = if self.has_signs {
            LinearForm::Coulomb
        } else {
            LinearForm::Smooth
        };
        // Bounded before it is multiplied, as it comes from the file.
        require(self.n_joints <= self.weights.len(), || {
            format!("{} joints", self.n_joints)
        })?;
        let n_features = form.n_features(self.n_joints);
        require_values("weights of a linear model", &self.weights, n_features)?;
        let r = self.r_transposed.into_packed("R", n_features)?;
        Ok(BayesLinear::from_parts(
            form,
            self.n_joints,
            self.weights,
            r.to_mat().transpose().to_owned(),
        ))
    }
}

impl ProcessRecord {
    fn of(process: &ProcessModel) -> Self {
        let posterior = &process.posterior;
        let params = posterior.covariance().named_params();
        Self {
            params: ParamsRecord {
                bias_std: params.bias_std,
                linear_std: params.linear_std,
                signal_std: params.signal_std,
                length_scales: params.length_scales,
                coulomb_std: params.coulomb_std,
            },
            noise_std: posterior.noise_std(),
            posterior: PosteriorRecord::of(posterior),
            summary: SummaryRecord::of(&process.summary),
        }
    }

    fn into_process(self) -> Result<ProcessModel, ModelFileError> {
        let covariance = TorqueCovariance::new(TorqueParams {
            bias_std: self.params.bias_std,
            linear_std: self.params.linear_std,
            signal_std: self.params.signal_std,
            length_scales: self.params.length_scales,
            coulomb_std: self.params.coulomb_std,
        })
        .map_err(malformed)?;
        require_noise(self.noise_std).map_err(malformed)?;
        Ok(ProcessModel {
            posterior: self.posterior.into_posterior(covariance, self.noise_std)?,
            summary: self.summary.into_summary()?,
        })
    }
}

impl PosteriorRecord {
    fn of(posterior: &FitPosterior) -> Self {
        match posterior {
            FitPosterior::Dense(posterior) => Self::Dense {
                x: MatrixRecord::of(posterior.x()),
                alpha: posterior.alpha().to_vec(),
                l: TriangleRecord::of(posterior.factor().l()),
            },
            FitPosterior::LowRank(posterior) => {
                let parts = posterior.parts();
                Self::LowRank {
                    pivots: MatrixRecord::of(parts.pivots.as_ref()),
                    weights: parts.weights.clone(),
                    pivot_factor: TriangleRecord::of(parts.pivot_factor.as_ref()),
                    noise_factor_transposed: TriangleRecord::of(parts.noise_factor.transpose()),
                }
            }
        }
    }

    fn into_posterior(
        self,
        covariance: TorqueCovariance,
        noise_std: f64,
    ) -> Result<FitPosterior, ModelFileError> {
        let n_covariates = 3 * covariance.n_joints();
        match self {
            Self::Dense { x, alpha, l } => {
                let x = x.into_mat("training inputs", n_covariates)?;
                let n = x.nrows();
                require(n > 0, || "a process without training inputs".to_owned())?;
                require_values("weights of a process", &alpha, n)?;
                let factor = Factor::from_lower(l.into_packed("a Cholesky factor", n)?.to_mat());
                let posterior = Posterior::from_parts(covariance, noise_std, x, alpha, factor);
                Ok(FitPosterior::Dense(posterior))
            }
            Self::LowRank {
                pivots,
                weights,
                pivot_factor,
                noise_factor_transposed,
            } => {
                let pivots = pivots.into_mat("pivots", n_covariates)?;
                let rank = pivots.nrows();
                let pivot_factor = pivot_factor.into_packed("the pivots' factor", rank)?;
                let noise_factor = noise_factor_transposed.into_packed("R", rank)?;
                let parts = LowRankParts {
                    noise_std,
                    pivots,
                    pivot_factor: pivot_factor.to_mat(),
                    noise_factor: noise_factor.to_mat().transpose().to_owned(),
                    weights,
                };
                let posterior = LowRankPosterior::from_parts(covariance, parts);
                posterior.map(FitPosterior::LowRank).map_err(malformed)
            }
        }
    }
}

impl SummaryRecord {
    fn of(summary: &FitSummary) -> Self {
        Self {
            log_marginal: summary.log_marginal,
            start: summary.start.clone(),
            n_starts: summary.n_starts,
            evaluations: summary.evaluations,
            bounds_hit: summary.bounds_hit.clone(),
            condition_lower_bound: summary.condition_lower_bound,
            method: summary.method.clone(),
            rank: summary.rank,
            error_bound: summary.error_bound,
        }
    }

    fn into_summary(self) -> Result<FitSummary, ModelFileError> {
        require_values("log marginal likelihood", &[self.log_marginal], 1)?;
        Ok(FitSummary {
            log_marginal: self.log_marginal,
            start: self.start,
            n_starts: self.n_starts,
            evaluations: self.evaluations,
            bounds_hit: self.bounds_hit,
            condition_lower_bound: self.condition_lower_bound,
            method: self.method,
            rank: self.rank,
            error_bound: self.error_bound,
        })
    }
}

impl MatrixRecord {
    fn of(matrix: MatRef<'_, f64>) -> Self {
        let columns = matrix.col_iter();
        Self {
            n_rows: matrix.nrows(),
            n_cols: matrix.ncols(),
            columns: columns.flat_map(|column| column.iter().copied()).collect(),
        }
    }

    fn into_mat(self, what: &str, n_cols: usize) -> Result<Mat<f64>, ModelFileError> {
        let n_values = self.n_rows.checked_mul(self.n_cols);
        require(self.n_cols == n_cols, || {
            format!("{what} are {} × {}", self.n_rows, self.n_cols)
        })?;
        require_values(what, &self.columns, n_values.unwrap_or(usize::MAX))?;
        Ok(Mat::from_fn(self.n_rows, n_cols, |row, col| {
            self.columns[col * self.n_rows + row]
        }))
    }
}

impl TriangleRecord {
    fn of(matrix: MatRef<'_, f64>) -> Self {
        let packed = PackedLower::of(matrix);
        Self {
            order: packed.order(),
            columns: packed.columns().to_vec(),
        }
    }

    fn into_packed(self, what: &str, order: usize) -> Result<PackedLower, ModelFileError> {
        require(self.order == order, || {
            format!("{what} has order {}, not {order}", self.order)
        })?;
        let n_values = order
            .checked_mul(order + 1)
            .map_or(usize::MAX, |twice| twice / 2);
        require_values(what, &self.columns, n_values)?;
        let packed = PackedLower::from_columns(order, self.columns);
        require(packed.is_invertible(), || {
            format!("{what} has a zero on its diagonal")
        })?;
        Ok(packed)
    }
}

fn require(is_met: bool, what: impl FnOnce() -> String) -> Result<(), ModelFileError> {
    if is_met {
        return Ok(());
    }
    Err(ModelFileError::malformed(what()))
}

/// Fails unless there are `count` values, all finite.
fn require_values(what: &str, values: &[f64], count: usize) -> Result<(), ModelFileError> {
    require(values.len() == count, || {
        format!("{what}: {} values, not {count}", values.len())
    })?;
    require(values.iter().all(|value| value.is_finite()), || {
        format!("{what}: a value that is not finite")
    })
}

fn malformed(error: impl std::fmt::Display) -> ModelFileError {
    ModelFileError::malformed(error.to_string())
}
