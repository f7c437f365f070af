//! Where feed-forward torques come from, and the torques themselves at every tick of a reference.

use std::sync::Arc;

use faer::{Mat, MatRef};
use puma_dyn::motion::{
    FeedForward, GravityFeedForward, JointState, ModelFeedForward, NoFeedForward, Tick,
};
use serde::{Deserialize, Serialize};
use torque_model::rigid_body::SharedJoint;
use torque_model::{Adapt, RobotModel, TaskProcess, TorqueFunction, adapt, adapt_joint};

use super::plant::Plant;
use crate::cell::ModelKind;
use crate::dataset::N_JOINTS;
use crate::error::BenchError;
use crate::models::Fitted;
use crate::multi::draw::nested;
use crate::rigid_body::parameters::Knowledge;
use crate::rigid_body::rows::States;
use crate::rigid_body::{JointModel, RigidBodyFit, RigidBodyForm, Terms, shared};
use crate::section5::bench::Bench;
use crate::section5::trained::{Trained, process_of};
use crate::section5::training_set::{SPLIT_SEED, TrainingSet};
use crate::split::Split;

/// Seed of the samples of c15.
const SEED: &str = "closed-loop";
/// The load that no model of many loads has seen.
pub const NEW_LOAD: usize = 15;

/// A source of feed-forward torques; a new one needs a line here, in `name`, in `table` and in the picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Source {
    /// Nothing: a PD controller.
    Nothing,
    /// Gravity of the arm and its load, both known.
    Gravity,
    /// LRc of the load's own samples.
    Lr,
    /// GPc of the load's own samples.
    Gp,
    /// iGP: the load's own samples, hyperparameters of all loads.
    Igp,
    /// mGP of rank 4; for c15, adapted to its samples.
    Mgp,
    /// rbd+gp of the load's own samples: a rigid-body model with uncertain parameters, and a process.
    RigidBody,
    /// The same with a rigid-body model that knows no friction.
    NoFriction,
    /// rbd of all loads, as the command learns it; for c15, adapted to its samples.
    Shared,
    /// The simulated arm itself.
    Exact,
}

impl Source {
    /// All, in the order of the tables.
    pub const ALL: [Self; 10] = [
        Self::Nothing,
        Self::Gravity,
        Self::Lr,
        Self::Gp,
        Self::Igp,
        Self::Mgp,
        Self::NoFriction,
        Self::RigidBody,
        Self::Shared,
        Self::Exact,
    ];

    /// Those that are learned or known for each load by itself; the runs of rbd, which learns all loads at once, are
    /// parts of their own.
    pub fn of_each_load() -> impl Iterator<Item = Self> {
        Self::ALL
            .into_iter()
            .filter(|source| *source != Self::Shared)
    }

    /// Name in tables, pictures and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Nothing => "nothing",
            Self::Gravity => "gravity",
            Self::Lr => "LRc",
            Self::Gp => "GPc",
            Self::Igp => "iGP",
            Self::Mgp => "mGP",
            Self::RigidBody => "rbd+gp",
            Self::NoFriction => "rbd¬f+gp",
            Self::Shared => Terms::Chosen.name(),
            Self::Exact => "exact",
        }
    }
}

/// Desired states at every tick, with what a rigid-body model makes of them for each joint.
pub struct Desired(Vec<States>);

impl Desired {
    /// Of states (n, 18).
    pub fn of(x: MatRef<'_, f64>) -> Self {
        Self((1..=N_JOINTS).map(|joint| States::of(joint, x)).collect())
    }

    /// (n, 18).
    pub fn x(&self) -> MatRef<'_, f64> {
        self.0[0].x.as_ref()
    }
}

/// Feed-forward torques of one load at every tick, (n_ticks, 6).
pub struct TorqueTable(pub Mat<f64>);

/// Reads a table row by row.
pub struct FromTable<'a> {
    table: &'a TorqueTable,
    tick: usize,
}

impl TorqueTable {
    /// The table as feed-forward, from its first row.
    pub fn feed_forward(&self) -> FromTable<'_> {
        FromTable {
            table: self,
            tick: 0,
        }
    }

    /// Torques at a tick.
    pub fn row(&self, tick: usize, tau: &mut [f64]) {
        for (joint, tau) in tau.iter_mut().enumerate() {
            *tau = self.0[(tick, joint)];
        }
    }
}

impl FeedForward for FromTable<'_> {
    fn torques(&mut self, _desired: &JointState, tau: &mut [f64]) {
        self.table.row(self.tick, tau);
    }

    fn observe(&mut self, _tick: &Tick<'_>) {
        self.tick += 1;
    }
}

/// What all sources need.
pub struct Sources<'a> {
    pub plant: &'a Plant,
    pub bench: &'a Bench,
    pub set: &'a TrainingSet,
    pub trained: Arc<Trained>,
    pub new_samples: usize,
}

/// The models of one load, fitted to its own samples.
pub struct Learned {
    load: usize,
    linear: Vec<Fitted>,
    process: Vec<Fitted>,
    rigid_body: Vec<RigidBodyFit>,
    no_friction: Vec<RigidBodyFit>,
    /// For c15, which the mGP does not have.
    adapted: Vec<TaskProcess>,
}

impl Learned {
    /// The load, from 1.
    pub fn load(&self) -> usize {
        self.load
    }
}

/// Rows that a load, from 1, is learned from.
fn samples_of(load: usize, set: &TrainingSet, new_samples: usize) -> Vec<usize> {
    if load == NEW_LOAD {
        let split = Split::draw(SPLIT_SEED, load);
        return nested(&split, SEED, load, 0, new_samples);
    }
    set.rows(load)
}

/// rbd of all known loads and of c15, which it adapts to.
///
/// # Errors
/// `Model` if it cannot be learned.
pub fn of_all_loads(
    bench: &Bench,
    set: &TrainingSet,
    new_samples: usize,
) -> Result<RobotModel, BenchError> {
    let known = bench.shared(Terms::Chosen, set)?;
    let new = [(NEW_LOAD, samples_of(NEW_LOAD, set, new_samples))];
    let samples = shared::samples(&bench.data, &new);
    let provenance = known.provenance().clone();
    Ok(adapt(
        &known,
        "c15",
        &samples,
        Adapt::default(),
        provenance,
    )?)
}

/// Torques of [`of_all_loads`] under a load, from 1, at the desired states.
///
/// # Errors
/// States that are not finite.
pub fn shared_table(
    model: &RobotModel,
    load: usize,
    x: MatRef<'_, f64>,
) -> Result<TorqueTable, BenchError> {
    let joints: Vec<&SharedJoint> = (1..=N_JOINTS)
        .map(|joint| shared::joint_of(model, joint))
        .collect();
    let torques = columns(&joints, |joint| Ok(joint.predict_mean(load - 1, x)?))?;
    Ok(TorqueTable(torques))
}

impl Sources<'_> {
    /// Learns a load, from 1, from its samples: those of the training set, or for c15 its own few.
    ///
    /// # Errors
    /// `Fit`, `MultiTask`.
    pub fn learn(&self, load: usize) -> Result<Learned, BenchError> {
        let rows = samples_of(load, self.set, self.new_samples);
        let x = self.bench.data.x(&rows);
        let mut learned = Learned {
            load,
            linear: Vec::new(),
            process: Vec::new(),
            rigid_body: Vec::new(),
            no_friction: Vec::new(),
            adapted: Vec::new(),
        };
        for joint in 1..=N_JOINTS {
            let torques = self.bench.data.torques(load, joint, &rows);
            let fit = |kind| Fitted::fit(kind, x.as_ref(), &torques);
            learned.linear.push(fit(ModelKind::LrCoulomb)?);
            learned.process.push(fit(ModelKind::GpCoulomb)?);
            let states = States::of(joint, x.as_ref());
            let informed = |knowledge| {
                let model = JointModel::of_one_load(joint, knowledge);
                model.fit(RigidBodyForm::WithProcess, &states, &torques, &[])
            };
            learned.rigid_body.push(informed(Knowledge::Nominal)?);
            learned.no_friction.push(informed(Knowledge::NoFriction)?);
            if load == NEW_LOAD {
                let process = process_of(&self.trained.mgp, joint - 1);
                let adapted = adapt_joint(process, x.as_ref(), &torques, Adapt::default())?;
                learned.adapted.push(adapted);
            }
        }
        Ok(learned)
    }

    /// Torques of a source at the desired states; none if it does not know the load, and of [`Source::Shared`], whose are
    /// [`shared_table`]'s.
    ///
    /// # Errors
    /// `Fit`, `MultiTask`, `Dynamics`.
    pub fn table(
        &self,
        source: Source,
        learned: &Learned,
        desired: &Desired,
    ) -> Result<Option<TorqueTable>, BenchError> {
        let (load, x) = (learned.load, desired.x());
        let scenario = self.plant.scenario();
        let (model, effects) = (scenario.model(), scenario.effects());
        let context = self.plant.context(load)?;
        let of_fits = |fits: &[Fitted]| columns(fits, |fit| fit.predict_mean(x));
        let informed = |fits: &[RigidBodyFit]| {
            let joints: Vec<(&RigidBodyFit, &States)> = fits.iter().zip(&desired.0).collect();
            columns(&joints, |(fit, states)| fit.predict_mean(states))
        };
        let table = match source {
            Source::Nothing => asked(NoFeedForward, x),
            Source::Gravity => asked(GravityFeedForward::new(model, context), x),
            Source::Exact => asked(ModelFeedForward::new(model, effects, context), x),
            Source::Lr => of_fits(&learned.linear)?,
            Source::Gp => of_fits(&learned.process)?,
            Source::RigidBody => informed(&learned.rigid_body)?,
            Source::NoFriction => informed(&learned.no_friction)?,
            Source::Mgp if load == NEW_LOAD => columns(&learned.adapted, |adapted| {
                Ok(adapted.predict_mean(self.set.n_contexts, x)?)
            })?,
            Source::Shared => return Ok(None),
            Source::Igp if load == NEW_LOAD => return Ok(None),
            Source::Igp => means(&self.trained.igp, load - 1, x)?,
            Source::Mgp => means(&self.trained.mgp, load - 1, x)?,
        };
        Ok(Some(TorqueTable(table)))
    }

    /// Torques of the mGP in every known load at the desired states.
    ///
    /// # Errors
    /// `MultiTask`.
    pub fn all_loads(&self, x: MatRef<'_, f64>) -> Result<Vec<TorqueTable>, BenchError> {
        (0..self.set.n_contexts)
            .map(|task| Ok(TorqueTable(means(&self.trained.mgp, task, x)?)))
            .collect()
    }
}

/// Asks a feed-forward at every state.
fn asked(mut feed_forward: impl FeedForward, x: MatRef<'_, f64>) -> Mat<f64> {
    let mut torques = Mat::zeros(x.nrows(), N_JOINTS);
    let (mut state, mut tau) = (JointState::zero(N_JOINTS), [0.0; N_JOINTS]);
    for row in 0..x.nrows() {
        for joint in 0..N_JOINTS {
            state.q[joint] = x[(row, joint)];
            state.qd[joint] = x[(row, N_JOINTS + joint)];
            state.qdd[joint] = x[(row, 2 * N_JOINTS + joint)];
        }
        feed_forward.torques(&state, &mut tau);
        for (joint, tau) in tau.iter().enumerate() {
            torques[(row, joint)] = *tau;
        }
    }
    torques
}

/// One column of predictions a joint.
fn columns<T>(
    joints: &[T],
    predict: impl Fn(&T) -> Result<Vec<f64>, BenchError>,
) -> Result<Mat<f64>, BenchError> {
    let columns: Vec<Vec<f64>> = joints.iter().map(predict).collect::<Result<_, _>>()?;
    Ok(Mat::from_fn(columns[0].len(), columns.len(), |row, col| {
        columns[col][row]
    }))
}

fn means(model: &RobotModel, task: usize, x: MatRef<'_, f64>) -> Result<Mat<f64>, BenchError> {
    let joints: Vec<&TaskProcess> = model.tasks().map(|(_, process)| process).collect();
    columns(&joints, |process| Ok(process.predict_mean(task, x)?))
}

#[cfg(test)]
mod tests {
    use super::super::plant::{Control, Run};
    use super::super::settings::Obstacle;
    use super::*;
    use crate::split::TrajectoryId;

    #[test]
    fn a_table_is_its_feed_forward_and_the_better_one_follows_and_touches_more_softly() {
        let plant = Plant::new().unwrap();
        let scenario = plant.scenario();
        let id = TrajectoryId {
            path_idx: 1,
            speed_idx: 3,
        };
        let reference = plant.reference(id).unwrap();
        let x = plant.desired(&reference).unwrap();
        let (model, effects) = (scenario.model(), scenario.effects());
        let context = plant.context(3).unwrap();
        let exact = || ModelFeedForward::new(model, effects, context.clone());
        let control = |bandwidth| Control {
            bandwidth,
            damping_ratio: 1.0,
            n_steps: 1,
        };
        let free = Run {
            reference: &reference,
            context: context.clone(),
            wall: None,
        };
        let table = TorqueTable(asked(exact(), x.as_ref()));
        let mut from_table = table.feed_forward();
        let by_table = plant.follow(&free, &mut from_table, control(4.0)).unwrap();
        let by_model = plant.follow(&free, &mut exact(), control(4.0)).unwrap();
        assert_eq!(by_table, by_model);

        let stiff = plant
            .follow(&free, &mut NoFeedForward, control(32.0))
            .unwrap();
        assert!(
            by_model.error() < 0.1 * stiff.error(),
            "{by_model:?} {stiff:?}"
        );
        assert!((stiff.corrective_share - 1.0).abs() < 1e-12, "{stiff:?}");

        let walled = Run {
            wall: Some(plant.wall(1, &Obstacle::sample())),
            ..free
        };
        let soft = plant.follow(&walled, &mut exact(), control(4.0)).unwrap();
        let hard = plant
            .follow(&walled, &mut NoFeedForward, control(32.0))
            .unwrap();
        assert!(
            soft.peak_force > 1.0 && hard.peak_force > 2.0 * soft.peak_force,
            "{soft:?} {hard:?}"
        );
    }
}
