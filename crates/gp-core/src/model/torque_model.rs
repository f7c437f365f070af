//! The torque models of a robot's joints, with what they were learned from.

use faer::MatRef;

use crate::error::GpError;
use crate::model::file::{ModelFileError, ModelFileKind, decode_model, encode_model};
use crate::model::joint_model::JointModel;
use crate::model::predictor::Predictor;
use crate::model::provenance::Provenance;
use crate::model::record::ModelRecord;
use crate::model::training_ranges::TrainingRanges;
use crate::posterior::Prediction;

/// What is learned for a robot: a torque model for some or all of its joints.
///
/// Every joint's model sees the whole state x = (q, q̇, q̈) of all ℓ joints.
/// ```
/// use faer::Mat;
/// use gp_core::{BayesLinear, LinearForm, Provenance, TorqueModel, TrainingRanges};
///
/// // One joint: columns q, qd, qdd.
/// let x = Mat::from_fn(20, 3, |i, j| ((i + 1) * (j + 1)) as f64 % 7.0 - 3.0);
/// let torques: Vec<f64> = (0..20).map(|i| 2.0 * x[(i, 0)] + 0.5 * x[(i, 2)]).collect();
/// let elbow = BayesLinear::fit(x.as_ref(), &torques, LinearForm::Smooth)?;
///
/// let model = TorqueModel::new(
///     vec!["elbow".to_owned()],
///     vec![(0, elbow.into())],
///     TrainingRanges::of(x.as_ref())?,
///     Provenance {
///         data_sha256: [0; 32],
///         robot_sha256: None,
///         program: "example 1.0".to_owned(),
///         context: "no load".to_owned(),
///     },
/// )?;
/// let loaded = TorqueModel::from_bytes(&model.to_bytes())?;
/// assert_eq!(loaded.predict(x.as_ref())?, model.predict(x.as_ref())?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct TorqueModel {
    joint_names: Vec<String>,
    learned: Vec<(usize, JointModel)>,
    ranges: TrainingRanges,
    provenance: Provenance,
}

/// Means and variances of one joint's torque at a set of states.
#[derive(Debug, Clone, PartialEq)]
pub struct JointPrediction {
    /// Index of the joint among all joints of the robot.
    pub joint_idx: usize,
    /// Posterior means, N·m.
    pub mean: Vec<f64>,
    /// Variances of the latent (noise-free) torque, N²·m².
    pub var: Vec<f64>,
    /// Variance of the noise: add it to `var` for that of an observation, N²·m².
    pub noise_var: f64,
    /// How many variances came out below zero by rounding and were set to zero.
    pub n_clamped: usize,
}

impl JointPrediction {
    /// A prediction of a joint's torque, and the variance of the noise on it, N²·m².
    pub fn new(joint_idx: usize, prediction: Prediction, noise_var: f64) -> Self {
        Self {
            joint_idx,
            mean: prediction.mean,
            var: prediction.var,
            noise_var,
            n_clamped: prediction.n_clamped,
        }
    }
}

impl TorqueModel {
    /// The models of some joints of a robot.
    ///
    /// `joint_names` are all joints of the robot in order; `learned` are the
    /// models with the index of their joint, in ascending order.
    /// # Errors
    /// [`GpError::InconsistentModel`] if there is no joint, no model, two joints
    /// of one name, indices that do not ascend or point past the last joint, or a
    /// model or range with other covariates than three per joint.
    pub fn new(
        joint_names: Vec<String>,
        learned: Vec<(usize, JointModel)>,
        ranges: TrainingRanges,
        provenance: Provenance,
    ) -> Result<Self, GpError> {
        if let Some(what) = inconsistency(&joint_names, &learned, &ranges) {
            return Err(GpError::InconsistentModel { what });
        }
        Ok(Self {
            joint_names,
            learned,
            ranges,
            provenance,
        })
    }

    /// Names of all joints of the robot, in the order of the covariates.
    pub fn joint_names(&self) -> &[String] {
        &self.joint_names
    }

    /// Number of joints ℓ of the robot.
    pub fn n_joints(&self) -> usize {
        self.joint_names.len()
    }

    /// The models, each with the index of its joint, in ascending order.
    pub fn learned(&self) -> &[(usize, JointModel)] {
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
        let of_joint = |(joint_idx, model): &(usize, JointModel)| {
            let prediction = model.predict(x)?;
            Ok(JointPrediction::new(
                *joint_idx,
                prediction,
                model.noise_var(),
            ))
        };
        self.learned.iter().map(of_joint).collect()
    }

    /// Indices of the covariates of a state that lie outside the training data's range.
    ///
    /// # Panics
    /// If `x` does not have 3ℓ entries.
    pub fn outside_training_range(&self, x: &[f64]) -> Vec<usize> {
        self.ranges.outside(x).collect()
    }

    /// The model in the form that a control loop asks, one state at a time.
    pub fn predictor(&self) -> Predictor {
        Predictor::new(self)
    }

    /// The bytes of a model file.
    pub fn to_bytes(&self) -> Vec<u8> {
        encode_model(ModelFileKind::OneContext, &ModelRecord::of(self))
    }

    /// The model in the bytes of a model file.
    ///
    /// It predicts bit for bit what the model predicts whose bytes they are.
    /// # Errors
    /// [`ModelFileError`]: anything but a whole, unaltered file of a version known here.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ModelFileError> {
        decode_model::<ModelRecord>(ModelFileKind::OneContext, bytes)?.into_model()
    }
}

/// What does not fit together, if anything.
fn inconsistency(
    joint_names: &[String],
    learned: &[(usize, JointModel)],
    ranges: &TrainingRanges,
) -> Option<String> {
    let n_joints = joint_names.len();
    if n_joints == 0 || learned.is_empty() {
        return Some(format!("{n_joints} joints, {} models", learned.len()));
    }
    let is_repeated = |(idx, name): &(usize, &String)| joint_names[..*idx].contains(name);
    if let Some((_, name)) = joint_names.iter().enumerate().find(is_repeated) {
        return Some(format!("two joints are named {name}"));
    }
    if learned.windows(2).any(|pair| pair[0].0 >= pair[1].0) {
        return Some("joint indices do not ascend".to_owned());
    }
    if let Some((idx, _)) = learned.iter().find(|(idx, _)| *idx >= n_joints) {
        return Some(format!("a model for joint {idx} of {n_joints}"));
    }
    if let Some((idx, model)) = learned.iter().find(|(_, m)| m.n_joints() != n_joints) {
        let found = model.n_joints();
        return Some(format!(
            "joint {idx}'s model is for {found} joints, not {n_joints}"
        ));
    }
    let n_ranges = ranges.n_covariates();
    (n_ranges != 3 * n_joints).then(|| format!("{n_ranges} ranges for {n_joints} joints"))
}
