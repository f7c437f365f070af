//! Reading a model file of either kind; what is in it is the libraries'.

use std::path::Path;

use faer::{Mat, MatRef};
use gp_core::{JointPrediction, ModelFileError, ModelFileKind, Provenance, TorqueModel, TrainingRanges};
use mtgp::{MtgpError, MultiTaskModel};

use crate::columns::{Naming, StateColumns};
use crate::error::CliError;
use crate::joints::Joints;
use crate::messages;
use crate::rigid_body_model::RigidBodyModel;

/// What a model file holds.
pub enum LearnedModel {
    /// A torque model for each joint, of one load.
    OneContext(TorqueModel),
    /// One for each joint that covers several loads.
    ManyContexts(MultiTaskModel),
    /// One for each joint, of one load, with the robot whose parameters they know.
    RigidBody(RigidBodyModel),
}

impl LearnedModel {
    /// Reads a model.
    ///
    /// # Errors
    /// A file that cannot be read, or is not a whole, unaltered model of a version known here.
    pub fn load(path: &Path) -> Result<Self, CliError> {
        let file = path.display().to_string();
        let bytes = std::fs::read(path).map_err(CliError::io("read", file.clone()))?;
        Self::from_bytes(&bytes).map_err(|cause| CliError::ModelFile { file, cause })
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, ModelFileError> {
        Ok(match ModelFileKind::of(bytes)? {
            ModelFileKind::OneContext => Self::OneContext(TorqueModel::from_bytes(bytes)?),
            ModelFileKind::ManyContexts => Self::ManyContexts(MultiTaskModel::from_bytes(bytes)?),
            ModelFileKind::RigidBody => Self::RigidBody(RigidBodyModel::from_bytes(bytes)?),
        })
    }

    /// The model of several contexts that a command needs; `whose` names it in messages.
    ///
    /// # Errors
    /// A model of one context.
    pub fn several(&self, whose: &str) -> Result<&MultiTaskModel, CliError> {
        match self {
            Self::ManyContexts(model) => Ok(model),
            Self::OneContext(_) | Self::RigidBody(_) => Err(CliError::Usage(format!(
                "{whose} is a model of one context; one of several is needed: `torque-gp fit --model mgp`"
            ))),
        }
    }

    /// Names of all joints, in the order of the covariates.
    pub fn joint_names(&self) -> &[String] {
        match self {
            Self::OneContext(model) => model.joint_names(),
            Self::ManyContexts(model) => model.joint_names(),
            Self::RigidBody(model) => model.joint_names(),
        }
    }

    /// Indices of the joints that have a model, ascending.
    pub fn learned(&self) -> Vec<usize> {
        match self {
            Self::OneContext(model) => model.learned().iter().map(|(idx, _)| *idx).collect(),
            Self::ManyContexts(model) => model.learned().iter().map(|(idx, _)| *idx).collect(),
            Self::RigidBody(model) => model.learned().iter().map(|(idx, _)| *idx).collect(),
        }
    }

    /// Ranges of the training data, of all contexts together.
    pub fn ranges(&self) -> &TrainingRanges {
        match self {
            Self::OneContext(model) => model.ranges(),
            Self::ManyContexts(model) => model.ranges(),
            Self::RigidBody(model) => model.ranges(),
        }
    }

    /// Where the model comes from.
    pub fn provenance(&self) -> &Provenance {
        match self {
            Self::OneContext(model) => model.provenance(),
            Self::ManyContexts(model) => model.provenance(),
            Self::RigidBody(model) => model.provenance(),
        }
    }

    /// Predictions at the rows of `x`, each in the context of its number, which a model of one context ignores.
    ///
    /// # Errors
    /// States that are not finite or do not fit.
    /// # Panics
    /// If there is not one number per row, each that of a context.
    pub fn predict(
        &self,
        x: MatRef<'_, f64>,
        contexts: &[usize],
    ) -> Result<Vec<JointPrediction>, MtgpError> {
        assert_eq!(contexts.len(), x.nrows());
        match self {
            Self::OneContext(model) => Ok(model.predict(x)?),
            Self::ManyContexts(model) => predict_by_context(model, x, contexts),
            Self::RigidBody(model) => Ok(model.predict(x)?),
        }
    }

    /// Names of the contexts; none for a model of one.
    pub fn contexts(&self) -> &[String] {
        match self {
            Self::ManyContexts(model) => model.contexts(),
            Self::OneContext(_) | Self::RigidBody(_) => &[],
        }
    }

    /// The joints, for reading a table of their states.
    pub fn joints(&self) -> Joints {
        Joints::by_name("model", self.joint_names().to_vec())
    }

    /// Says in which order numbered columns were taken, where the model knows its joints by other names.
    pub fn note_order(&self, file: &str, columns: &StateColumns) {
        let names = self.joint_names();
        let is_numbered = |(idx, name): (usize, &String)| *name == format!("joint{}", idx + 1);
        if columns.naming == Naming::Numbered && !names.iter().enumerate().all(is_numbered) {
            messages::note(format!(
                "{file}: joints 1 to {} are taken to be the model's {}",
                names.len(),
                names.join(", ")
            ));
        }
    }
}

/// Predicts the rows of each context together, and puts the results in the order of the rows.
fn predict_by_context(
    model: &MultiTaskModel,
    x: MatRef<'_, f64>,
    contexts: &[usize],
) -> Result<Vec<JointPrediction>, MtgpError> {
    let empty = |(joint_idx, process): &(usize, mtgp::TaskProcess)| JointPrediction {
        joint_idx: *joint_idx,
        mean: vec![0.0; x.nrows()],
        var: vec![0.0; x.nrows()],
        noise_var: process.noise_var(),
        n_clamped: 0,
    };
    let mut predictions: Vec<JointPrediction> = model.learned().iter().map(empty).collect();
    for (number, name) in model.contexts().iter().enumerate() {
        let rows: Vec<usize> = (0..x.nrows())
            .filter(|row| contexts[*row] == number)
            .collect();
        if rows.is_empty() {
            continue;
        }
        let of_context = Mat::from_fn(rows.len(), x.ncols(), |row, col| x[(rows[row], col)]);
        let of_joints = model.predict(name, of_context.as_ref())?;
        for (all, of_joint) in predictions.iter_mut().zip(of_joints) {
            for (idx, row) in rows.iter().enumerate() {
                all.mean[*row] = of_joint.mean[idx];
                all.var[*row] = of_joint.var[idx];
            }
            all.n_clamped += of_joint.n_clamped;
        }
    }
    Ok(predictions)
}
