//! Where the feed-forward torques come from.

use std::path::Path;

use faer::MatRef;
use puma_dyn::dynamics::Hysteresis;
use puma_dyn::motion::{FeedForward, GravityFeedForward, JointState, ModelFeedForward};
use puma_dyn::{Context, DynError};
use torque_model::{Predictor, Scratch, TorqueError};

use crate::commands::control::reference::Reference;
use crate::error::CliError;
use crate::messages;
use crate::model_file::{ModelFile, are_numbered};
use crate::range_watch::warn_outside;
use crate::robot::Robot;
use crate::row_contexts::number_of;

/// A source of torques for a desired state.
pub enum Source<'a> {
    /// Nothing.
    Nothing,
    /// Gravity of the robot with a load.
    Gravity(GravityFeedForward<'a>),
    /// The robot with a load.
    Exact(ModelFeedForward<'a>),
    /// A model file.
    Learned(Box<Learned>),
}

/// Which load a model file is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Asked<'a> {
    /// Name of a context.
    pub context: Option<&'a str>,
    /// A payload file.
    pub payload: Option<&'a Path>,
}

/// A learned model as the loop asks it.
pub struct Learned {
    model: ModelFile,
    predictor: Predictor,
    scratch: Scratch,
    /// Number of the context.
    context: usize,
    /// Friction's memory of the desired motion.
    memory: Hysteresis,
    last_q: Option<Vec<f64>>,
    x: Vec<f64>,
    mean: Vec<f64>,
    var: Vec<f64>,
    /// The first state that the model has no torque for.
    failure: Option<TorqueError>,
}

impl<'a> Source<'a> {
    /// The source of a name or a model file.
    ///
    /// # Errors
    /// A file that is no model or one of other joints, a context that it does not have or that is not asked for,
    /// a context or payload for what is no model.
    pub fn open(
        name: &Path,
        asked: Asked<'_>,
        robot: &'a Robot,
        payload: &Context,
        reference: &Reference,
    ) -> Result<Self, CliError> {
        let (model, payload) = (&robot.model, payload.clone());
        let source = match name.to_str() {
            Some("none") => Self::Nothing,
            Some("gravity") => Self::Gravity(GravityFeedForward::new(model, payload)),
            Some("exact") => Self::Exact(ModelFeedForward::new(model, robot.effects, payload)),
            _ => {
                let learned = Learned::load(name, asked, robot, reference)?;
                return Ok(Self::Learned(Box::new(learned)));
            }
        };
        let option = match (asked.context, asked.payload) {
            (None, None) => return Ok(source),
            (Some(context), _) => format!("--context {context}"),
            (None, Some(payload)) => format!("--model-payload {}", payload.display()),
        };
        Err(CliError::Usage(format!(
            "{option} is for model files; --feed-forward {} is none",
            name.display()
        )))
    }

    /// What stopped a run, with the cause if it is this.
    pub fn why(self, stop: DynError) -> CliError {
        let Self::Learned(learned) = self else {
            return stop.into();
        };
        let Learned { model, failure, .. } = *learned;
        let Some(cause) = failure else {
            return stop.into();
        };
        CliError::FeedForward {
            what: match &cause {
                TorqueError::NotFinite { joint_idx, .. } => format!(
                    "the desired state is so large that the torque of `{}` is not a finite number",
                    model.joint_names()[*joint_idx]
                ),
                other => other.to_string(),
            },
            file: model.file,
            stop: Box::new(stop),
            cause: Box::new(cause),
        }
    }
}

impl FeedForward for Source<'_> {
    fn torques(&mut self, desired: &JointState, tau: &mut [f64]) {
        match self {
            Self::Nothing => tau.fill(0.0),
            Self::Gravity(gravity) => gravity.torques(desired, tau),
            Self::Exact(exact) => exact.torques(desired, tau),
            Self::Learned(learned) => learned.torques(desired, tau),
        }
    }
}

impl Learned {
    fn load(
        path: &Path,
        asked: Asked<'_>,
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
        let (model, loaded) = ModelFile::load(path)?.with_payload(asked.payload)?;
        let whose = &model.file;
        require_joints(whose, model.joint_names(), robot.model.joint_names())?;
        warn(&model, robot, reference);
        let context = match loaded {
            Some(number) => number,
            None => number_asked_for(&model, asked.context)?,
        };
        let predictor = model.predictor();
        let n_learned = predictor.n_learned();
        Ok(Self {
            scratch: predictor.scratch(),
            context,
            memory: model.hysteresis(),
            last_q: None,
            x: vec![0.0; model.n_covariates()],
            mean: vec![0.0; n_learned],
            var: vec![0.0; n_learned],
            failure: None,
            predictor,
            model,
        })
    }

    /// Means of the learned joints; zero for the others.
    ///
    /// Where the model has none they are NaN, which stops the run, and the cause is kept.
    fn torques(&mut self, desired: &JointState, tau: &mut [f64]) {
        match &mut self.last_q {
            Some(last) => {
                self.memory.travel(last, &desired.q);
                last.copy_from_slice(&desired.q);
            }
            None => self.last_q = Some(desired.q.clone()),
        }
        let state = desired.q.iter().chain(&desired.qd).chain(&desired.qdd);
        let numbers = state.chain(self.memory.states());
        let x = self.x.iter_mut().zip(numbers);
        x.for_each(|(x, number)| *x = *number);
        let (scratch, mean, var) = (&mut self.scratch, &mut self.mean, &mut self.var);
        let predictor = &self.predictor;
        if let Err(cause) = predictor.predict_into(self.context, scratch, &self.x, mean, var) {
            self.failure.get_or_insert(cause);
        }
        tau.fill(0.0);
        for (joint_idx, mean) in predictor.joint_indices().iter().zip(mean.iter()) {
            tau[*joint_idx] = *mean;
        }
    }
}

/// # Errors
/// A context that the model does not have, or none for a model of several.
fn number_asked_for(model: &ModelFile, context: Option<&str>) -> Result<usize, CliError> {
    let whose = &model.file;
    match (model.contexts(), context) {
        ([] | [_], None) => Ok(0),
        ([], Some(asked)) => Err(CliError::Usage(format!(
            "--context {asked}: {whose} is a model of one context; leave --context out"
        ))),
        (contexts, Some(asked)) => number_of(asked, contexts, whose),
        (contexts, None) => Err(CliError::Usage(format!(
            "{whose} is a model of several contexts; choose one with --context NAME: {}",
            contexts.join(", ")
        ))),
    }
}

/// # Errors
/// A model of other joints than the robot's, in name or in order; numbered joints fit any names.
fn require_joints(whose: &str, learned: &[String], robot: &[String]) -> Result<(), CliError> {
    let by_number = learned.len() == robot.len() && are_numbered(learned);
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
fn warn(model: &ModelFile, robot: &Robot, reference: &Reference) {
    let names = robot.model.joint_names();
    let learned = model.learned_joints();
    let missing: Vec<&str> = (0..names.len())
        .filter(|idx| !learned.contains(idx))
        .map(|idx| names[idx].as_str())
        .collect();
    if !missing.is_empty() {
        let missing = missing.join(", ");
        messages::warning(format!(
            "{} has no model of {missing}: no feed-forward there",
            model.file
        ));
    }
    let (n_columns, states) = (3 * names.len(), &reference.states);
    let x = MatRef::from_row_major_slice(states, states.len() / n_columns, n_columns);
    warn_outside(model.ranges(), x, &reference.file, &reference.columns);
}
