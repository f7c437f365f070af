//! Kind 3: the posterior of a robot's parameters, shared by joints and loads.

use std::sync::Arc;

use faer::Mat;
use puma_dyn::robot::FrictionTerm;
use serde::{Deserialize, Serialize};

use crate::file::format::ModelFileError;
use crate::file::matrix_record::{malformed, require, require_values};
use crate::file::ranges_record::RangesRecord;
use crate::joint_model::JointModel;
use crate::parts::ModelParts;
use crate::provenance::Provenance;
use crate::rigid_body::{
    JointNoise, LearnedJoint, N_BINS, ParameterPosterior, PosteriorParts, SharedJoint, TermSet,
    Unknowns,
};
use crate::robot_source::RobotSource;

#[derive(Serialize, Deserialize)]
pub(crate) struct SharedRecord {
    robot: RobotSource,
    contexts: Vec<String>,
    loads: Vec<Option<usize>>,
    terms: Vec<TermRecord>,
    described: Vec<f64>,
    prior_std: Vec<f64>,
    /// Lower triangle of H, row after row.
    h: Vec<f64>,
    b: Vec<f64>,
    joints: Vec<Option<LearnedRecord>>,
    step: Option<f64>,
    ranges: RangesRecord,
    context_ranges: Vec<RangesRecord>,
    provenance: Provenance,
}

#[derive(Serialize, Deserialize)]
enum TermRecord {
    Acceleration,
    Speed,
    Offset,
    Tanh(f64),
    StepUp,
    StepDown,
    Hysteresis(f64),
    LoadHysteresis(f64),
    LoadSpeed,
}

#[derive(Serialize, Deserialize)]
struct LearnedRecord {
    /// Name of the set of terms.
    terms: String,
    std: f64,
    profile: Vec<f64>,
    correlation: f64,
    is_seen: bool,
}

impl TermRecord {
    fn of(term: FrictionTerm) -> Self {
        match term {
            FrictionTerm::Acceleration => Self::Acceleration,
            FrictionTerm::Speed => Self::Speed,
            FrictionTerm::Offset => Self::Offset,
            FrictionTerm::Tanh { width } => Self::Tanh(width),
            FrictionTerm::StepUp => Self::StepUp,
            FrictionTerm::StepDown => Self::StepDown,
            FrictionTerm::Hysteresis { length } => Self::Hysteresis(length),
            FrictionTerm::LoadHysteresis { length } => Self::LoadHysteresis(length),
            FrictionTerm::LoadSpeed => Self::LoadSpeed,
        }
    }

    fn into_term(self) -> Result<FrictionTerm, ModelFileError> {
        let positive = |value: f64| {
            let is_positive = value.is_finite() && value > 0.0;
            require(is_positive, || {
                format!("friction of width or length {value}")
            })?;
            Ok(value)
        };
        Ok(match self {
            Self::Acceleration => FrictionTerm::Acceleration,
            Self::Speed => FrictionTerm::Speed,
            Self::Offset => FrictionTerm::Offset,
            Self::Tanh(width) => FrictionTerm::Tanh {
                width: positive(width)?,
            },
            Self::StepUp => FrictionTerm::StepUp,
            Self::StepDown => FrictionTerm::StepDown,
            Self::Hysteresis(length) => FrictionTerm::Hysteresis {
                length: positive(length)?,
            },
            Self::LoadHysteresis(length) => FrictionTerm::LoadHysteresis {
                length: positive(length)?,
            },
            Self::LoadSpeed => FrictionTerm::LoadSpeed,
        })
    }
}

impl LearnedRecord {
    fn of(joint: &LearnedJoint) -> Self {
        Self {
            terms: joint.terms.name().to_owned(),
            std: joint.noise.std,
            profile: joint.noise.profile.to_vec(),
            correlation: joint.noise.correlation,
            is_seen: joint.is_seen,
        }
    }

    fn into_learned(self) -> Result<LearnedJoint, ModelFileError> {
        let known = TermSet::ALL
            .into_iter()
            .find(|set| set.name() == self.terms);
        let terms = known.ok_or_else(|| malformed(format!("friction terms `{}`", self.terms)))?;
        let numbers = [[self.std, self.correlation].as_slice(), &self.profile].concat();
        require_values("noise of a joint", &numbers, N_BINS + 2)?;
        let is_noise = numbers.iter().all(|value| *value > 0.0) && self.correlation >= 1.0;
        require(is_noise, || format!("noise of a joint: {numbers:?}"))?;
        let mut profile = [0.0; N_BINS];
        profile.copy_from_slice(&self.profile);
        Ok(LearnedJoint {
            terms,
            noise: JointNoise {
                std: self.std,
                profile,
                correlation: self.correlation,
            },
            is_seen: self.is_seen,
        })
    }
}

impl SharedRecord {
    /// # Panics
    /// If the joints share no posterior or no robot is described, which [`crate::RobotModel::new`] excludes.
    pub fn of(parts: &ModelParts) -> Self {
        let posterior = parts
            .posterior()
            .expect("joints that share a posterior")
            .parts();
        let lower = (0..posterior.b.len()).flat_map(|row| (0..=row).map(move |col| (row, col)));
        Self {
            robot: parts.robot.clone().expect("a robot described"),
            contexts: posterior.contexts.clone(),
            loads: posterior.loads.clone(),
            terms: (posterior.unknowns.terms().iter())
                .map(|term| TermRecord::of(*term))
                .collect(),
            described: posterior.described.clone(),
            prior_std: posterior.prior_std.clone(),
            h: lower.map(|at| posterior.h[at]).collect(),
            b: posterior.b.clone(),
            joints: (posterior.joints.iter())
                .map(|joint| joint.as_ref().map(LearnedRecord::of))
                .collect(),
            step: posterior.step,
            ranges: RangesRecord::of(&parts.ranges),
            context_ranges: parts.context_ranges.iter().map(RangesRecord::of).collect(),
            provenance: parts.provenance.clone(),
        }
    }

    pub fn into_parts(self) -> Result<ModelParts, ModelFileError> {
        let robot = self.robot.model("the model's robot").map_err(malformed)?;
        let n_joints = robot.n_joints();
        require(self.joints.len() == n_joints, || {
            format!("{} joints for a robot of {n_joints}", self.joints.len())
        })?;
        let terms: Vec<FrictionTerm> = (self.terms.into_iter())
            .map(TermRecord::into_term)
            .collect::<Result<_, _>>()?;
        let n_loads = n_loads(&self.loads, &self.contexts)?;
        let unknowns = Unknowns::new(&robot, terms).with_loads(n_loads);
        let p = unknowns.len();
        require_values(
            "described parameters",
            &self.described,
            unknowns.bodies().len(),
        )?;
        require_values("standard deviations of the prior", &self.prior_std, p)?;
        require_values("b", &self.b, p)?;
        require_values("H", &self.h, p * (p + 1) / 2)?;
        let is_std = self.prior_std.iter().all(|std| *std >= 0.0);
        require(is_std, || "a negative standard deviation".to_owned())?;
        if let Some(step) = self.step {
            require_values("step", &[step], 1)?;
        }
        let posterior = ParameterPosterior::new(PosteriorParts {
            robot: Arc::new(robot),
            h: symmetric(&self.h, p),
            unknowns,
            described: self.described,
            contexts: self.contexts.clone(),
            loads: self.loads,
            prior_std: self.prior_std,
            b: self.b,
            joints: (self.joints.into_iter())
                .map(|joint| joint.map(LearnedRecord::into_learned).transpose())
                .collect::<Result<_, _>>()?,
            step: self.step,
        });
        let posterior = Arc::new(posterior.map_err(malformed)?);
        Ok(ModelParts {
            joint_names: posterior.parts().robot.joint_names().to_vec(),
            contexts: self.contexts,
            learned: (0..n_joints)
                .filter_map(|joint| Some((joint, shared(&posterior, joint)?)))
                .collect(),
            ranges: self.ranges.into_ranges()?,
            context_ranges: (self.context_ranges.into_iter())
                .map(RangesRecord::into_ranges)
                .collect::<Result<_, _>>()?,
            selection: None,
            robot: Some(self.robot),
            provenance: self.provenance,
        })
    }
}

/// Number of loads; each is carried in a context, which bounds it.
fn n_loads(loads: &[Option<usize>], contexts: &[String]) -> Result<usize, ModelFileError> {
    let largest = loads
        .iter()
        .flatten()
        .map(|load| load.saturating_add(1))
        .max();
    let n_loads = largest.unwrap_or(0);
    let fits = n_loads <= loads.len() && loads.len() == contexts.len().max(1);
    require(fits, || {
        format!("{n_loads} loads of {} contexts", contexts.len())
    })?;
    Ok(n_loads)
}

/// The symmetric matrix of a lower triangle, row after row.
fn symmetric(lower: &[f64], order: usize) -> Mat<f64> {
    Mat::from_fn(order, order, |row, col| {
        let (low, high) = (row.min(col), row.max(col));
        lower[high * (high + 1) / 2 + low]
    })
}

fn shared(posterior: &Arc<ParameterPosterior>, joint: usize) -> Option<JointModel> {
    SharedJoint::new(posterior, joint).map(|joint| JointModel::Shared(Box::new(joint)))
}
