//! Torques with a rigid-body prior: a model for each joint, and the robot whose parameters they are of.

use faer::MatRef;
use gp_core::{
    GpError, InformedModel, InformedRecord, JointPrediction, ModelFileError, ModelFileKind,
    Provenance, ProvenanceRecord, RangesRecord, TrainingRanges, decode_model, encode_model,
};
use puma_dyn::Model;
use serde::{Deserialize, Serialize};

use crate::robot_source::{RobotSource, n_parameters, regressors};

/// rbd or rbd+gp of some joints of a robot.
#[derive(Debug, Clone)]
pub struct RigidBodyModel {
    source: RobotSource,
    robot: Model,
    /// With the indices of their joints, ascending.
    learned: Vec<(usize, InformedModel)>,
    ranges: TrainingRanges,
    provenance: Provenance,
}

#[derive(Serialize, Deserialize)]
struct Record {
    robot: RobotSource,
    learned: Vec<(usize, InformedRecord)>,
    ranges: RangesRecord,
    provenance: ProvenanceRecord,
}

impl RigidBodyModel {
    /// The models of some joints of the robot that `source` describes.
    pub fn new(
        source: RobotSource,
        robot: Model,
        learned: Vec<(usize, InformedModel)>,
        ranges: TrainingRanges,
        provenance: Provenance,
    ) -> Self {
        Self {
            source,
            robot,
            learned,
            ranges,
            provenance,
        }
    }

    /// Names of all joints of the robot.
    pub fn joint_names(&self) -> &[String] {
        self.robot.joint_names()
    }

    /// The models, each with the index of its joint, ascending.
    pub fn learned(&self) -> &[(usize, InformedModel)] {
        &self.learned
    }

    /// The range of every covariate in the training data.
    pub fn ranges(&self) -> &TrainingRanges {
        &self.ranges
    }

    /// Where the model comes from.
    pub fn provenance(&self) -> &Provenance {
        &self.provenance
    }

    /// Means and latent variances of every learned joint at the rows of `x`, (n, 3ℓ).
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn predict(&self, x: MatRef<'_, f64>) -> Result<Vec<JointPrediction>, GpError> {
        let (found, expected) = (x.ncols(), 3 * self.robot.n_joints());
        if found != expected {
            return Err(GpError::WrongCovariates { found, expected });
        }
        let joints: Vec<usize> = self.learned.iter().map(|(idx, _)| *idx).collect();
        let of_joints = regressors(&self.robot, &joints, x);
        let predict = |((joint_idx, model), regressor): (&(usize, InformedModel), _)| {
            let regressor: &faer::Mat<f64> = regressor;
            let prediction = model.predict(x, regressor.as_ref())?;
            let noise_var = model.noise_std().powi(2);
            Ok(JointPrediction::new(*joint_idx, prediction, noise_var))
        };
        self.learned.iter().zip(&of_joints).map(predict).collect()
    }

    /// The bytes of a model file.
    pub fn to_bytes(&self) -> Vec<u8> {
        let learned = self.learned.iter();
        let record = Record {
            robot: self.source.clone(),
            learned: learned
                .map(|(idx, model)| (*idx, InformedRecord::of(model)))
                .collect(),
            ranges: RangesRecord::of(&self.ranges),
            provenance: ProvenanceRecord::of(&self.provenance),
        };
        encode_model(ModelFileKind::RigidBody, &record)
    }

    /// The model in the bytes of a file.
    ///
    /// # Errors
    /// [`ModelFileError`]: anything but a whole, unaltered file of this kind.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ModelFileError> {
        let record: Record = decode_model(ModelFileKind::RigidBody, bytes)?;
        let robot = record.robot.model("the model's robot");
        let robot = robot.map_err(|error| malformed(error.to_string()))?;
        let n_joints = robot.n_joints();
        let indices: Vec<usize> = record.learned.iter().map(|(idx, _)| *idx).collect();
        let are_joints =
            indices.is_sorted_by(|a, b| a < b) && indices.iter().all(|i| *i < n_joints);
        if indices.is_empty() || !are_joints {
            return Err(malformed(format!("joints {indices:?} of {n_joints}")));
        }
        let ranges = record.ranges.into_ranges()?;
        let n_columns = ranges.min().len();
        if n_columns != 3 * n_joints {
            return Err(malformed(format!("ranges of {n_columns} covariates")));
        }
        let learned = record
            .learned
            .into_iter()
            .map(|(idx, informed)| Ok((idx, informed.into_model(n_joints, n_parameters(&robot))?)));
        let learned = learned.collect::<Result<_, ModelFileError>>()?;
        let provenance = record.provenance.into_provenance();
        Ok(Self::new(record.robot, robot, learned, ranges, provenance))
    }
}

fn malformed(what: String) -> ModelFileError {
    ModelFileError::Malformed { what }
}
