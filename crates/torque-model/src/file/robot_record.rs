//! What stands in the payloads of model files of each kind, and the checks that turn it back into a model's parts.
//!
//! Records are plain: lists, numbers, strings.

use std::sync::Arc;

use gp_core::fit::{BayesLinear, LINEAR_NOISE_VAR, LinearForm, ParameterPrior};
use kernels::{ContinuousJoints, OnColumns, Sum, TorqueCovariance};
use mtgp::MultiTaskCovariance;
use mtgp::prior::{DescribedParams, DescribedTasks, TaskCovariance, TaskFactor};
use puma_dyn::Model;
use serde::{Deserialize, Serialize};

use crate::file::format::{ModelFileError, ModelFileKind, decode_model, encode_model};
use crate::file::matrix_record::{
    MatrixRecord, TriangleRecord, malformed, require, require_values,
};
use crate::file::process_record::{ParamsRecord, PosteriorRecord, require_summary};
use crate::file::ranges_record::RangesRecord;
use crate::file::shared_record::SharedRecord;
use crate::fit_summary::FitSummary;
use crate::joint_model::JointModel;
use crate::parts::{ModelParts, RankSelection, kind_of};
use crate::process::{Process, TaskProcess};
use crate::provenance::Provenance;
use crate::robot_source::RobotSource;
use crate::rows::{RegressorRows, Rows, States, n_parameters};

/// Kind 0: linear models and processes of one load.
#[derive(Serialize, Deserialize)]
struct OneContextRecord {
    joint_names: Vec<String>,
    ranges: RangesRecord,
    provenance: Provenance,
    learned: Vec<(usize, JointRecord)>,
}

/// Kind 1: processes of several loads.
#[derive(Serialize, Deserialize)]
struct ManyContextsRecord {
    joint_names: Vec<String>,
    contexts: Vec<String>,
    ranges: RangesRecord,
    context_ranges: Vec<RangesRecord>,
    provenance: Provenance,
    selection: Option<RankSelection>,
    learned: Vec<(usize, TasksRecord)>,
}

/// Kind 2: models of one load that know a robot's parameters.
#[derive(Serialize, Deserialize)]
struct RigidBodyRecord {
    robot: RobotSource,
    learned: Vec<(usize, InformedRecord)>,
    ranges: RangesRecord,
    provenance: Provenance,
}

#[derive(Serialize, Deserialize)]
enum JointRecord {
    Linear(LinearRecord),
    Process(Box<ProcessRecord>),
    /// With a noise that was learned.
    LearnedLinear(LearnedLinearRecord),
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
struct LearnedLinearRecord {
    noise_var: f64,
    linear: LinearRecord,
}

#[derive(Serialize, Deserialize)]
struct ProcessRecord {
    params: ParamsRecord,
    posterior: PosteriorRecord,
    summary: FitSummary,
}

#[derive(Serialize, Deserialize)]
struct TasksRecord {
    params: ParamsRecord,
    task: TaskRecord,
    posterior: PosteriorRecord,
    summary: FitSummary,
}

#[derive(Serialize, Deserialize)]
struct InformedRecord {
    prior_mean: Vec<f64>,
    prior_std: Vec<f64>,
    spread: f64,
    remainder: Option<ParamsRecord>,
    posterior: PosteriorRecord,
    summary: FitSummary,
}

/// K^ρ; the number of tasks is that of the contexts.
#[derive(Serialize, Deserialize)]
enum TaskRecord {
    Identity,
    Ones,
    /// The free entries of Λ, row by row.
    Factor {
        rank: usize,
        entries: Vec<f64>,
    },
    Described(Box<DescribedRecord>),
}

/// K^ρ by descriptors of the contexts.
#[derive(Serialize, Deserialize)]
struct DescribedRecord {
    descriptors: MatrixRecord,
    bias_std: f64,
    linear_std: Vec<f64>,
    signal_std: f64,
    length_scales: Vec<f64>,
}

/// The bytes of a model file.
///
/// # Panics
/// If the joints' models are of several kinds, which [`crate::RobotModel::new`] excludes.
pub(crate) fn write_model(parts: &ModelParts) -> Vec<u8> {
    let (kind, continuous) = (kind_of(parts), parts.continuous());
    match kind {
        ModelFileKind::OneContext => encode_model(kind, &continuous, &OneContextRecord::of(parts)),
        ModelFileKind::ManyContexts => {
            encode_model(kind, &continuous, &ManyContextsRecord::of(parts))
        }
        ModelFileKind::RigidBody => encode_model(kind, &continuous, &RigidBodyRecord::of(parts)),
        ModelFileKind::SharedParameters => {
            encode_model(kind, &continuous, &SharedRecord::of(parts))
        }
    }
}

/// What the bytes of a model file hold, of whatever kind.
///
/// # Errors
/// Anything but a whole, unaltered file of a version known here.
pub(crate) fn read_model(bytes: &[u8]) -> Result<ModelParts, ModelFileError> {
    let kind = ModelFileKind::of(bytes)?;
    let (continuous, parts) = match kind {
        ModelFileKind::OneContext => {
            let (continuous, record) = decode_model::<OneContextRecord>(kind, bytes)?;
            let parts = record.into_parts(&continuous)?;
            (continuous, parts)
        }
        ModelFileKind::ManyContexts => {
            let (continuous, record) = decode_model::<ManyContextsRecord>(kind, bytes)?;
            let parts = record.into_parts(&continuous)?;
            (continuous, parts)
        }
        ModelFileKind::RigidBody => {
            let (continuous, record) = decode_model::<RigidBodyRecord>(kind, bytes)?;
            let parts = record.into_parts(&continuous)?;
            (continuous, parts)
        }
        ModelFileKind::SharedParameters => {
            let (continuous, record) = decode_model::<SharedRecord>(kind, bytes)?;
            (continuous, record.into_parts()?)
        }
    };
    require(parts.continuous() == continuous, || {
        format!(
            "continuous joints {:?} without a process",
            continuous.indices()
        )
    })?;
    Ok(parts)
}

/// The records of all joints' models.
fn records<T>(parts: &ModelParts, record: impl Fn(&JointModel) -> Option<T>) -> Vec<(usize, T)> {
    let of_kind = |model| record(model).expect("all models are of one kind");
    let learned = parts.learned.iter();
    learned.map(|(idx, model)| (*idx, of_kind(model))).collect()
}

/// The models of all joints' records.
fn models<T>(
    records: Vec<(usize, T)>,
    model: impl Fn(T) -> Result<JointModel, ModelFileError>,
) -> Result<Vec<(usize, JointModel)>, ModelFileError> {
    let records = records.into_iter();
    records
        .map(|(idx, record)| Ok((idx, model(record)?)))
        .collect()
}

impl OneContextRecord {
    fn of(parts: &ModelParts) -> Self {
        Self {
            joint_names: parts.joint_names.clone(),
            ranges: RangesRecord::of(&parts.ranges),
            provenance: parts.provenance.clone(),
            learned: records(parts, |model| match model {
                JointModel::Linear(linear) => Some(JointRecord::of_linear(linear)),
                JointModel::Process(process) => {
                    Some(JointRecord::Process(Box::new(ProcessRecord::of(process))))
                }
                _ => None,
            }),
        }
    }

    fn into_parts(self, continuous: &ContinuousJoints) -> Result<ModelParts, ModelFileError> {
        Ok(ModelParts {
            joint_names: self.joint_names,
            contexts: Vec::new(),
            learned: models(self.learned, |record| match record {
                JointRecord::Linear(record) => Ok(record.into_linear()?.into()),
                JointRecord::Process(record) => Ok(JointModel::Process(Box::new(
                    record.into_process(continuous)?,
                ))),
                JointRecord::LearnedLinear(record) => Ok(record.into_linear()?.into()),
            })?,
            ranges: self.ranges.into_ranges()?,
            context_ranges: Vec::new(),
            selection: None,
            robot: None,
            provenance: self.provenance,
        })
    }
}

impl ManyContextsRecord {
    fn of(parts: &ModelParts) -> Self {
        Self {
            joint_names: parts.joint_names.clone(),
            contexts: parts.contexts.clone(),
            ranges: RangesRecord::of(&parts.ranges),
            context_ranges: parts.context_ranges.iter().map(RangesRecord::of).collect(),
            provenance: parts.provenance.clone(),
            selection: parts.selection.clone(),
            learned: records(parts, |model| model.tasks().map(TasksRecord::of)),
        }
    }

    fn into_parts(self, continuous: &ContinuousJoints) -> Result<ModelParts, ModelFileError> {
        let (n_joints, n_tasks) = (self.joint_names.len(), self.contexts.len());
        let context_ranges = self.context_ranges.into_iter();
        Ok(ModelParts {
            learned: models(self.learned, |record| {
                Ok(record.into_process((n_joints, continuous), n_tasks)?.into())
            })?,
            joint_names: self.joint_names,
            contexts: self.contexts,
            ranges: self.ranges.into_ranges()?,
            context_ranges: context_ranges
                .map(RangesRecord::into_ranges)
                .collect::<Result<_, _>>()?,
            selection: self.selection,
            robot: None,
            provenance: self.provenance,
        })
    }
}

impl RigidBodyRecord {
    fn of(parts: &ModelParts) -> Self {
        Self {
            robot: parts.robot.clone().expect("such models know their robot"),
            learned: records(parts, InformedRecord::of),
            ranges: RangesRecord::of(&parts.ranges),
            provenance: parts.provenance.clone(),
        }
    }

    fn into_parts(self, continuous: &ContinuousJoints) -> Result<ModelParts, ModelFileError> {
        let robot = self.robot.model("the model's robot").map_err(malformed)?;
        let n_joints = robot.n_joints();
        let indices: Vec<usize> = self.learned.iter().map(|(idx, _)| *idx).collect();
        let are_joints =
            indices.is_sorted_by(|a, b| a < b) && indices.iter().all(|idx| *idx < n_joints);
        require(!indices.is_empty() && are_joints, || {
            format!("joints {indices:?} of {n_joints}")
        })?;
        let robot = Arc::new(robot);
        let learned = (self.learned.into_iter())
            .map(|(idx, record)| Ok((idx, record.into_model(&robot, idx, continuous)?)))
            .collect::<Result<_, ModelFileError>>()?;
        Ok(ModelParts {
            joint_names: robot.joint_names().to_vec(),
            contexts: Vec::new(),
            learned,
            ranges: self.ranges.into_ranges()?,
            context_ranges: Vec::new(),
            selection: None,
            robot: Some(self.robot),
            provenance: self.provenance,
        })
    }
}

impl JointRecord {
    fn of_linear(linear: &BayesLinear) -> Self {
        let (noise_var, record) = (linear.noise_var(), LinearRecord::of(linear));
        if noise_var.total_cmp(&LINEAR_NOISE_VAR).is_eq() {
            return Self::Linear(record);
        }
        Self::LearnedLinear(LearnedLinearRecord {
            noise_var,
            linear: record,
        })
    }
}

impl LearnedLinearRecord {
    fn into_linear(self) -> Result<BayesLinear, ModelFileError> {
        let noise_var = self.noise_var;
        require(noise_var.is_finite() && noise_var > 0.0, || {
            format!("a noise variance of {noise_var}")
        })?;
        Ok(self.linear.into_linear()?.with_noise_var(noise_var))
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
    fn of(process: &Process<TorqueCovariance, States>) -> Self {
        Self {
            params: ParamsRecord::of(process.posterior.covariance()),
            posterior: PosteriorRecord::of(&process.posterior),
            summary: process.summary.clone(),
        }
    }

    fn into_process(
        self,
        continuous: &ContinuousJoints,
    ) -> Result<Process<TorqueCovariance, States>, ModelFileError> {
        let covariance = self.params.into_covariance(continuous)?;
        let rows = States {
            n_joints: covariance.n_joints(),
        };
        Ok(Process {
            posterior: (self.posterior).into_posterior(covariance, rows.n_columns())?,
            rows,
            summary: require_summary(self.summary)?,
        })
    }
}

impl TasksRecord {
    fn of(process: &TaskProcess) -> Self {
        Self {
            params: ParamsRecord::of(process.covariance().input()),
            task: TaskRecord::of(process.covariance().task()),
            posterior: PosteriorRecord::of(&process.posterior),
            summary: process.summary.clone(),
        }
    }

    fn into_process(
        self,
        (n_joints, continuous): (usize, &ContinuousJoints),
        n_tasks: usize,
    ) -> Result<TaskProcess, ModelFileError> {
        let input = self.params.into_covariance(continuous)?;
        require(input.n_joints() == n_joints, || {
            format!("a process of {} joints", input.n_joints())
        })?;
        let prior = MultiTaskCovariance::new(input, self.task.into_task(n_tasks)?);
        let posterior = self.posterior.into_posterior(prior, 3 * n_joints + 1)?;
        let process = TaskProcess::of_tasks(posterior, require_summary(self.summary)?);
        let points = process.posterior.basis().points.as_ref();
        require(process.rows.admit(points), || {
            format!("rows of other than {n_tasks} tasks")
        })?;
        Ok(process)
    }
}

impl TaskRecord {
    fn of(task: &TaskCovariance) -> Self {
        match task {
            TaskCovariance::Identity { .. } => Self::Identity,
            TaskCovariance::Ones { .. } => Self::Ones,
            TaskCovariance::Factor(factor) => Self::Factor {
                rank: factor.rank(),
                entries: factor.entries(),
            },
            TaskCovariance::Described(tasks) => {
                Self::Described(Box::new(DescribedRecord::of(tasks)))
            }
        }
    }

    fn into_task(self, n_tasks: usize) -> Result<TaskCovariance, ModelFileError> {
        Ok(match self {
            Self::Identity => TaskCovariance::Identity { n_tasks },
            Self::Ones => TaskCovariance::Ones { n_tasks },
            Self::Factor { rank, entries } => TaskCovariance::Factor(
                TaskFactor::from_entries(n_tasks, rank, &entries).map_err(malformed)?,
            ),
            Self::Described(record) => TaskCovariance::Described(record.into_tasks(n_tasks)?),
        })
    }
}

impl DescribedRecord {
    fn of(tasks: &DescribedTasks) -> Self {
        let params = tasks.named_params();
        Self {
            descriptors: MatrixRecord::of(tasks.descriptors()),
            bias_std: params.bias_std,
            linear_std: params.linear_std,
            signal_std: params.signal_std,
            length_scales: params.length_scales,
        }
    }

    fn into_tasks(self, n_tasks: usize) -> Result<DescribedTasks, ModelFileError> {
        let descriptors = (self.descriptors).into_mat("descriptors", self.linear_std.len())?;
        let found = descriptors.nrows();
        require(found == n_tasks, || {
            format!("descriptors of {found} contexts, not {n_tasks}")
        })?;
        let params = DescribedParams {
            bias_std: self.bias_std,
            linear_std: self.linear_std,
            signal_std: self.signal_std,
            length_scales: self.length_scales,
        };
        DescribedTasks::new(descriptors, params).map_err(malformed)
    }
}

impl InformedRecord {
    fn of(model: &JointModel) -> Option<Self> {
        let (rows, posterior) = match model {
            JointModel::RigidBody(p) => (&p.rows, PosteriorRecord::of(&p.posterior)),
            JointModel::RigidBodyAndProcess(p) => (&p.rows, PosteriorRecord::of(&p.posterior)),
            _ => return None,
        };
        Some(Self {
            prior_mean: rows.prior.mean.clone(),
            prior_std: rows.prior.std.clone(),
            spread: model.spread()?,
            remainder: model.input_covariance().map(ParamsRecord::of),
            posterior,
            summary: model.summary()?.clone(),
        })
    }

    fn into_model(
        self,
        robot: &Arc<Model>,
        joint_idx: usize,
        continuous: &ContinuousJoints,
    ) -> Result<JointModel, ModelFileError> {
        let (n_joints, n_parameters) = (robot.n_joints(), n_parameters(robot));
        require_values("means of parameters", &self.prior_mean, n_parameters)?;
        require_values("standard deviations", &self.prior_std, n_parameters)?;
        require_values("spread", &[self.spread], 1)?;
        let rows = RegressorRows {
            robot: Arc::clone(robot),
            joint_idx,
            prior: ParameterPrior {
                mean: self.prior_mean,
                std: self.prior_std,
            },
        };
        let (n_inputs, n_columns) = (3 * n_joints, rows.n_columns());
        let parameters = (rows.prior.covariance_at(n_inputs, self.spread)).map_err(malformed)?;
        let summary = require_summary(self.summary)?;
        let Some(params) = self.remainder else {
            let posterior = self.posterior.into_posterior(parameters, n_columns)?;
            return Ok(JointModel::RigidBody(Box::new(Process {
                posterior,
                rows,
                summary,
            })));
        };
        let remainder = params.into_covariance(continuous)?;
        let found = remainder.n_joints();
        require(found == n_joints, || {
            format!("a covariance of {found} joints")
        })?;
        let covariance = Sum::new(OnColumns::new(remainder, 0..n_inputs), parameters);
        let posterior = self.posterior.into_posterior(covariance, n_columns)?;
        Ok(JointModel::RigidBodyAndProcess(Box::new(Process {
            posterior,
            rows,
            summary,
        })))
    }
}
