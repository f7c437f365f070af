//! What is learned for a robot: a model of some or all of its joints, for one load or for many.

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use faer::{Mat, MatRef};
use gp_core::Prediction;
use kernels::ContinuousJoints;
use mtgp::MtgpError;
use puma_dyn::Model;
use puma_dyn::dynamics::Hysteresis;
use puma_dyn::robot::JointKind;

use crate::error::{TorqueError, consistent};
use crate::file::{ModelFileError, ModelFileKind, read_model, write_model};
use crate::joint_model::JointModel;
use crate::parts::{ModelParts, context_number, inconsistency, kind_of, other_robot};
use crate::prediction::JointPrediction;
use crate::predictor::Predictor;
use crate::process::TaskProcess;
use crate::provenance::Provenance;
use crate::ranges::TrainingRanges;
use crate::rigid_body::{OnlineLoad, OnlineSettings, ParameterPosterior, states_with_memory};
use crate::rows::require_finite;
use crate::samples::Samples;

/// Samples up to which a step of a tracker is fast enough without pivots.
const FEW: usize = 512;

/// Nats of the log marginal likelihood that a tracker does not see.
const TRACKING_CERTIFICATE: f64 = 0.1;

/// What is learned for a robot: a torque model for some or all of its joints.
///
/// Every joint's model sees the whole state x = (q, q̇, q̈) of all ℓ joints.
/// A model of several loads knows each by the name of its *context*.
/// ```
/// use faer::Mat;
/// use torque_model::learn::Linear;
/// use torque_model::{JointTorques, Provenance, RobotModel, Samples};
///
/// // One joint: columns q, qd, qdd.
/// let x = Mat::from_fn(20, 3, |i, j| ((i + 1) * (j + 1)) as f64 % 7.0 - 3.0);
/// let values = (0..20).map(|i| 2.0 * x[(i, 0)] + 0.5 * x[(i, 2)]).collect();
/// let torques = vec![JointTorques { joint_idx: 0, values }];
/// let samples = Samples::of_one_context(vec!["elbow".to_owned()], x, torques)?;
///
/// let provenance = Provenance::new("example 1.0", b"where the samples came from");
/// let model = RobotModel::learn(&samples, &Linear::smooth(), provenance)?;
/// let loaded = RobotModel::from_bytes(&model.to_bytes())?;
/// let x = samples.x.as_ref();
/// assert_eq!(loaded.predict(0, x)?, model.predict(0, x)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct RobotModel {
    parts: ModelParts,
    /// What `parts.robot` describes.
    robot: Option<Arc<Model>>,
    predictor: OnceLock<Predictor>,
}

impl RobotModel {
    /// The model of these parts.
    ///
    /// # Errors
    /// [`TorqueError::InconsistentModel`] if there is no joint or model, two joints
    /// or contexts of one name, indices that do not ascend or point past the last joint,
    /// models of different kinds, or models or ranges for other joints or contexts;
    /// [`TorqueError::Robot`] for a description that is none.
    pub fn new(mut parts: ModelParts) -> Result<Self, TorqueError> {
        consistent(inconsistency(&parts))?;
        let robot = match &parts.robot {
            None => None,
            Some(source) => {
                let robot = source.model("the model's robot")?;
                consistent(other_robot(&parts, &robot))?;
                Some(Arc::new(robot))
            }
        };
        let continuous = turning(&parts, robot.as_deref());
        for ranges in parts.context_ranges.iter_mut().chain([&mut parts.ranges]) {
            ranges.set_continuous(continuous.clone());
        }
        Ok(Self {
            parts,
            robot,
            predictor: OnceLock::new(),
        })
    }

    /// The joints to whose torques a turn more of their positions makes no difference: of processes those that were
    /// learned so, of a robot's parameters those of type `continuous`.
    pub fn continuous(&self) -> &ContinuousJoints {
        self.parts.ranges.continuous()
    }

    /// All that it consists of.
    pub fn parts(&self) -> &ModelParts {
        &self.parts
    }

    /// All that it consists of, to be put together anew.
    pub fn into_parts(self) -> ModelParts {
        self.parts
    }

    /// Which kind of file it makes.
    pub fn kind(&self) -> ModelFileKind {
        kind_of(&self.parts)
    }

    /// Names of all joints of the robot, in the order of the covariates.
    pub fn joint_names(&self) -> &[String] {
        &self.parts.joint_names
    }

    /// Number of joints ℓ of the robot.
    pub fn n_joints(&self) -> usize {
        self.parts.joint_names.len()
    }

    /// The posterior of a robot's parameters, of a model that learned them for all joints together.
    pub fn rigid_body(&self) -> Option<&Arc<ParameterPosterior>> {
        self.parts.posterior()
    }

    /// Entries of a state: (q, q̇, q̈), and the hysteresis states z of a model with memory.
    pub fn n_covariates(&self) -> usize {
        self.parts.n_covariates()
    }

    /// Lengths δ of the hysteresis states that a state has, rad; none of a model without memory.
    pub fn hysteresis_lengths(&self) -> &[f64] {
        self.rigid_body().map_or(&[], |of| of.unknowns().lengths())
    }

    /// The hysteresis states z at the beginning of a motion, in their order behind (q, q̇, q̈); none of a model without
    /// memory.
    pub fn hysteresis(&self) -> Hysteresis {
        Hysteresis::of_every_joint(self.n_joints(), self.hysteresis_lengths())
    }

    /// The states of samples as the model wants them, (n, n_covariates): with the hysteresis of their motion, if it
    /// has memory.
    ///
    /// # Errors
    /// [`TorqueError::Log`] for samples without what says it, or with times that do not rise.
    pub fn states_of<'a>(&self, samples: &'a Samples) -> Result<Cow<'a, Mat<f64>>, TorqueError> {
        match self.rigid_body() {
            Some(posterior) => states_with_memory(samples, posterior.unknowns()),
            None => Ok(Cow::Borrowed(&samples.x)),
        }
    }

    /// Follows which load the arm carries, and weighs it, in a control loop.
    ///
    /// # Errors
    /// [`TorqueError::OtherKind`] for a model that did not learn a robot's parameters for all joints together; what
    /// [`OnlineLoad::new`] refuses.
    pub fn online_load(&self, settings: OnlineSettings) -> Result<OnlineLoad, TorqueError> {
        let Some(posterior) = self.rigid_body() else {
            return Err(TorqueError::OtherKind {
                what: "a load is weighed by a model of a robot's parameters (rbd)".to_owned(),
            });
        };
        OnlineLoad::new(posterior, self.ranges(), settings)
    }

    /// Names of the contexts; none for a model of one.
    pub fn contexts(&self) -> &[String] {
        &self.parts.contexts
    }

    /// The number of a context, which predictions ask for.
    ///
    /// # Errors
    /// [`MtgpError::UnknownContext`] with those that the model has.
    pub fn number_of(&self, context: &str) -> Result<usize, MtgpError> {
        context_number(&self.parts.contexts, context)
    }

    /// The models, each with the index of its joint, in ascending order.
    pub fn learned(&self) -> &[(usize, JointModel)] {
        &self.parts.learned
    }

    /// The processes of several contexts, each with the index of its joint; none for a model of one.
    pub fn tasks(&self) -> impl Iterator<Item = (usize, &TaskProcess)> {
        let learned = self.parts.learned.iter();
        learned.filter_map(|(idx, model)| Some((*idx, model.tasks()?)))
    }

    /// The range of every covariate in the training data of all contexts.
    pub fn ranges(&self) -> &TrainingRanges {
        &self.parts.ranges
    }

    /// The same of each context.
    pub fn context_ranges(&self) -> &[TrainingRanges] {
        &self.parts.context_ranges
    }

    /// Where the model comes from.
    pub fn provenance(&self) -> &Provenance {
        &self.parts.provenance
    }

    /// Means and latent variances of every learned joint at states in a context, by its number.
    ///
    /// The numbers of [`RobotModel::predictor`], state by state.
    /// # Shapes
    /// `x` (n, 3ℓ).
    /// # Errors
    /// States that are not finite or of another robot, a context that there is not.
    pub fn predict(
        &self,
        context: usize,
        x: MatRef<'_, f64>,
    ) -> Result<Vec<JointPrediction>, TorqueError> {
        self.predict_rows(&vec![context; x.nrows()], x)
    }

    /// As [`RobotModel::predict`], each row in a context of its own.
    ///
    /// # Errors
    /// As there.
    /// # Panics
    /// If there is not one number per row.
    pub fn predict_rows(
        &self,
        contexts: &[usize],
        x: MatRef<'_, f64>,
    ) -> Result<Vec<JointPrediction>, TorqueError> {
        assert_eq!(contexts.len(), x.nrows(), "one context per row");
        require_finite(x, self.n_covariates())?;
        self.in_the_loop().predict_rows(contexts, x)
    }

    /// Means and latent variances of one learned joint, by its place among them, in a context.
    ///
    /// For many states at a time, by products of matrices; they differ from those of the
    /// loop by rounding.
    /// # Errors
    /// As for [`RobotModel::predict`].
    /// # Panics
    /// If there is no such joint.
    pub fn predict_joint(
        &self,
        place: usize,
        context: usize,
        x: MatRef<'_, f64>,
    ) -> Result<Prediction, TorqueError> {
        self.parts.learned[place].1.predict(context, x)
    }

    /// The model in the form that a control loop asks, one state at a time.
    pub fn predictor(&self) -> Predictor {
        self.in_the_loop().clone()
    }

    fn in_the_loop(&self) -> &Predictor {
        (self.predictor).get_or_init(|| Predictor::new(&self.parts, self.robot.clone()))
    }

    /// The model for a loop of 1 kHz: what is dense on many samples goes on a few pivots.
    ///
    /// A joint of several contexts with more than 512 samples is conditioned again by
    /// [`gp_core::Posterior::on_pivots`], with an error of at most 0.1 nats in its log marginal
    /// likelihood; the others stay, to the bit.
    /// # Errors
    /// As for [`gp_core::Posterior::new`].
    pub fn for_tracking(&self) -> Result<Self, TorqueError> {
        let mut parts = self.parts.clone();
        for (_, model) in &mut parts.learned {
            if let JointModel::Tasks(process) = model
                && process.posterior.rank() > FEW
            {
                process.posterior = process.posterior.on_pivots(TRACKING_CERTIFICATE)?;
            }
        }
        Self::new(parts)
    }

    /// The bytes of a model file.
    pub fn to_bytes(&self) -> Vec<u8> {
        write_model(&self.parts)
    }

    /// The model in the bytes of a model file, of whatever kind.
    ///
    /// It predicts bit for bit what the model predicts whose bytes they are.
    /// # Errors
    /// [`ModelFileError`]: anything but a whole, unaltered file of a version known here.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ModelFileError> {
        Self::new(read_model(bytes)?).map_err(ModelFileError::of)
    }
}

/// See [`RobotModel::continuous`].
fn turning(parts: &ModelParts, robot: Option<&Model>) -> ContinuousJoints {
    let is_process = |(_, model): &(usize, JointModel)| model.input_covariance().is_some();
    match robot {
        Some(robot) if !parts.learned.iter().any(is_process) => {
            let turns = |joint: &usize| robot.joint_kind(*joint) == JointKind::Continuous;
            ContinuousJoints::of((0..robot.n_joints()).filter(turns))
        }
        _ => parts.continuous(),
    }
}
