//! What stands in the payload of a model file of one context, and the checks that turn it back into a model.
//!
//! Records are plain: lists, numbers, strings.

use serde::{Deserialize, Serialize};

use crate::fit::{BayesLinear, LinearForm};
use crate::model::file::ModelFileError;
use crate::model::joint_model::{JointModel, ProcessModel};
use crate::model::matrix_record::{TriangleRecord, malformed, require, require_values};
use crate::model::origin_record::{ProvenanceRecord, RangesRecord};
use crate::model::process_record::{ParamsRecord, PosteriorRecord, SummaryRecord};
use crate::model::torque_model::TorqueModel;

#[derive(Serialize, Deserialize)]
pub(crate) struct ModelRecord {
    joint_names: Vec<String>,
    ranges: RangesRecord,
    provenance: ProvenanceRecord,
    learned: Vec<(usize, JointRecord)>,
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
    posterior: PosteriorRecord,
    summary: SummaryRecord,
}

impl ModelRecord {
    pub fn of(model: &TorqueModel) -> Self {
        let learned = model.learned().iter();
        Self {
            joint_names: model.joint_names().to_vec(),
            ranges: RangesRecord::of(model.ranges()),
            provenance: ProvenanceRecord::of(model.provenance()),
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
        let ranges = self.ranges.into_ranges()?;
        let provenance = self.provenance.into_provenance();
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
        Self {
            params: ParamsRecord::of(process.posterior.covariance()),
            posterior: PosteriorRecord::of(&process.posterior),
            summary: SummaryRecord::of(&process.summary),
        }
    }

    fn into_process(self) -> Result<ProcessModel, ModelFileError> {
        let covariance = self.params.into_covariance()?;
        let n_columns = 3 * covariance.n_joints();
        Ok(ProcessModel {
            posterior: self.posterior.into_posterior(covariance, n_columns)?,
            summary: self.summary.into_summary()?,
        })
    }
}
