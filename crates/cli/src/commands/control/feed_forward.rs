//! Where the feed-forward torques come from.

use std::path::Path;

use faer::MatRef;
use gp_core::TorqueModel;
use mtgp::MultiTaskModel;
use puma_dyn::Context;
use puma_dyn::motion::{
    FeedForward, GravityFeedForward, JointState, ModelFeedForward, NoFeedForward,
};

use super::reference::Reference;
use crate::error::CliError;
use crate::messages;
use crate::model_file::LearnedModel;
use crate::range_watch::RangeWatch;
use crate::rigid_body_model::RigidBodyModel;
use crate::robot::Robot;
use crate::row_contexts::number_of;

/// A source, ready for a run.
pub enum Source {
    /// Nothing.
    Nothing,
    /// Gravity of the robot with a load.
    Gravity(Context),
    /// The robot with a load.
    Exact(Context),
    /// A model file.
    Learned(Box<Learned>),
}

/// What the loop asks: torques for a desired state.
pub type Asked<'a> = Box<dyn FnMut(&JointState, &mut [f64]) + 'a>;

/// A learned model as the loop asks it.
pub struct Learned {
    means: Means,
    joint_indices: Vec<usize>,
    x: Vec<f64>,
    mean: Vec<f64>,
}

/// Means of the learned joints at a state x; NaN where it is not finite, which stops the run with the joint's name.
type Means = Box<dyn FnMut(&[f64], &mut [f64])>;

fn of_one_context(model: &TorqueModel) -> Means {
    let predictor = model.predictor();
    let mut scratch = predictor.scratch();
    let mut var = vec![0.0; predictor.n_learned()];
    Box::new(move |x, mean| _ = predictor.predict_into(&mut scratch, x, mean, &mut var))
}

fn of_many_contexts(model: &MultiTaskModel, number: usize) -> Means {
    let predictor = model.predictor();
    let mut scratch = predictor.scratch();
    let mut var = vec![0.0; model.learned().len()];
    Box::new(move |x, mean| _ = predictor.predict_into(number, &mut scratch, x, mean, &mut var))
}

fn of_rigid_body(model: RigidBodyModel) -> Means {
    Box::new(move |x, mean| {
        let row = MatRef::from_row_major_slice(x, 1, x.len());
        match model.predict(row) {
            Ok(joints) => {
                let means = joints.iter().map(|joint| joint.mean[0]);
                mean.iter_mut().zip(means).for_each(|(to, from)| *to = from);
            }
            Err(_) => mean.fill(f64::NAN),
        }
    })
}

impl Source {
    /// The source of a name or a model file.
    ///
    /// # Errors
    /// A file that is no model or one of other joints, a context that it does not have or that is not asked for,
    /// a context for what is no model.
    pub fn open(
        name: &Path,
        context: Option<&str>,
        robot: &Robot,
        payload: &Context,
        reference: &Reference,
    ) -> Result<Self, CliError> {
        let source = match name.to_str() {
            Some("none") => Self::Nothing,
            Some("gravity") => Self::Gravity(payload.clone()),
            Some("exact") => Self::Exact(payload.clone()),
            _ => {
                let learned = Learned::load(name, context, robot, reference)?;
                return Ok(Self::Learned(Box::new(learned)));
            }
        };
        match context {
            None => Ok(source),
            Some(asked) => Err(CliError::Usage(format!(
                "--context {asked} is for model files; --feed-forward {} is none",
                name.display()
            ))),
        }
    }

    /// The source as the loop asks it.
    pub fn feed_forward(self, robot: &Robot) -> Asked<'_> {
        let (model, effects) = (&robot.model, robot.effects);
        match self {
            Self::Nothing => Box::new(|desired, tau| NoFeedForward.torques(desired, tau)),
            Self::Gravity(payload) => {
                let mut gravity = GravityFeedForward::new(model, payload);
                Box::new(move |desired, tau| gravity.torques(desired, tau))
            }
            Self::Exact(payload) => {
                let mut exact = ModelFeedForward::new(model, effects, payload);
                Box::new(move |desired, tau| exact.torques(desired, tau))
            }
            Self::Learned(mut learned) => {
                Box::new(move |desired, tau| learned.torques(desired, tau))
            }
        }
    }
}

impl Learned {
    fn load(
        path: &Path,
        context: Option<&str>,
        robot: &Robot,
        reference: &Reference,
    ) -> Result<Self, CliError> {
        if !path.exists() {
            let name = path.display();
            let reason = format!(
                "--feed-forward {name}: there is no such model file; beside files there are none, gravity and exact"
            );
            return Err(CliError::Usage(reason));
        }
        let model = LearnedModel::load(path)?;
        let whose = path.display().to_string();
        require_joints(&whose, model.joint_names(), robot.model.joint_names())?;
        warn(&whose, &model, robot, reference);
        let joint_indices = model.learned();
        let means = match (model, context) {
            (LearnedModel::OneContext(model), None) => of_one_context(&model),
            (LearnedModel::RigidBody(model), None) => of_rigid_body(model),
            (LearnedModel::OneContext(_) | LearnedModel::RigidBody(_), Some(asked)) => {
                return Err(CliError::Usage(format!(
                    "--context {asked}: {whose} is a model of one context; leave --context out"
                )));
            }
            (LearnedModel::ManyContexts(model), Some(asked)) => {
                let number = number_of(asked, model.contexts(), &whose)?;
                of_many_contexts(&model, number)
            }
            (LearnedModel::ManyContexts(model), None) => {
                return Err(CliError::Usage(format!(
                    "{whose} is a model of several contexts; choose one with --context NAME: {}",
                    model.contexts().join(", ")
                )));
            }
        };
        Ok(Self {
            means,
            x: vec![0.0; 3 * robot.model.n_joints()],
            mean: vec![0.0; joint_indices.len()],
            joint_indices,
        })
    }

    /// Means of the learned joints; zero for the others.
    fn torques(&mut self, desired: &JointState, tau: &mut [f64]) {
        let numbers = desired.q.iter().chain(&desired.qd).chain(&desired.qdd);
        self.x
            .iter_mut()
            .zip(numbers)
            .for_each(|(x, number)| *x = *number);
        (self.means)(&self.x, &mut self.mean);
        tau.fill(0.0);
        for (joint_idx, mean) in self.joint_indices.iter().zip(&self.mean) {
            tau[*joint_idx] = *mean;
        }
    }
}

/// # Errors
/// A model of other joints than the robot's, in name or in order; numbered joints fit any names.
fn require_joints(whose: &str, learned: &[String], robot: &[String]) -> Result<(), CliError> {
    let is_numbered = |(idx, name): (usize, &String)| *name == format!("joint{}", idx + 1);
    let by_number = learned.len() == robot.len() && learned.iter().enumerate().all(is_numbered);
    if learned == robot || by_number {
        return Ok(());
    }
    Err(CliError::Usage(format!(
        "{whose} is a model of the joints {}; the robot has {}",
        learned.join(", "),
        robot.join(", ")
    )))
}

/// Says which joints have no model, and how much of the motion lies outside its data.
fn warn(whose: &str, model: &LearnedModel, robot: &Robot, reference: &Reference) {
    let names = robot.model.joint_names();
    let learned = model.learned();
    let missing: Vec<&str> = (0..names.len())
        .filter(|idx| !learned.contains(idx))
        .map(|idx| names[idx].as_str())
        .collect();
    if !missing.is_empty() {
        let missing = missing.join(", ");
        messages::warning(format!(
            "{whose} has no model of {missing}: no feed-forward there"
        ));
    }
    let mut ranges = RangeWatch::new(model.ranges());
    for x in reference.states.chunks_exact(3 * names.len()) {
        ranges.see(x);
    }
    let doubt = ranges.doubt(&reference.file, &reference.columns);
    doubt.into_iter().for_each(messages::warning);
}
