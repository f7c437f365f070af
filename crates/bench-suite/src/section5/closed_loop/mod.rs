//! What learned torques are worth to a controller: error, gains, corrective torque and contact force.
//!
//! The arm is simulated with friction that holds and slips ([`puma_dyn::ArmSimulator`]), and follows
//! trajectories of the data set under the composite controller of sec. 1 at 1 kHz, with feed-forward
//! from each of `source::Source`.
//! Gains are those of one bandwidth ω for all joints: K_p = I ω², K_d = 2 ζ I ω, with the mean
//! diagonal of the inertia matrix for I.
//!
//! # Source
//! Sec. 1 of the chapter names the composite controller and does not run one.

mod findings;
mod picture;
mod plant;
mod settings;
mod source;
mod sweep;
mod switch;

use rayon::prelude::*;

use self::findings::Results;
use self::plant::Plant;
use self::settings::{Settings, trajectory_name};
use self::source::{Desired, Learned, NEW_LOAD, Source, Sources};
use self::sweep::{Row, Sweep, integration_error};
use self::switch::Switching;
use super::bench::Bench;
use super::spec::Section5Experiment;
use super::training_set::TrainingSet;
use crate::data_figures::section::Section;
use crate::error::BenchError;
use crate::split::{REFERENCE, TrajectoryId, UNIQUE};

/// Makes the table, the picture, the CSV files and the findings.
///
/// # Errors
/// `Experiment`; `Fit`, `MultiTask` or `Dynamics` if a model or a run fails; `Picture`.
pub fn make(experiment: &Section5Experiment, bench: &Bench) -> Result<Section, BenchError> {
    let settings: Settings = experiment.settings(bench.profile)?;
    let set = settings.training_set(&experiment.name)?;
    let trained = bench.trained(&set)?;
    let plant = Plant::new()?;
    let sources = Sources {
        plant: &plant,
        bench,
        set: &set,
        trained: &trained,
        new_samples: settings.new_samples,
    };
    let loads: Vec<usize> = settings.loads.iter().copied().chain([NEW_LOAD]).collect();
    let learned: Vec<Learned> = loads
        .par_iter()
        .map(|load| sources.learn(*load))
        .collect::<Result<_, _>>()?;

    let sweep = Sweep {
        sources: &sources,
        settings: &settings,
        wall: None,
    };
    let followed = settings.followed(&experiment.name)?;
    let all: Vec<&Learned> = learned.iter().collect();
    let mut rows: Vec<Row> = Vec::new();
    for id in &followed {
        rows.extend(sweep.rows(*id, &all)?);
    }
    let results = Results {
        integration_error: check_integration(&sources, &settings, &learned[0], &followed)?,
        contact: contact(&sources, &settings, &learned, &experiment.name)?,
        changes: changes(&sources, &settings, &experiment.name)?,
        trajectories: followed
            .iter()
            .map(|id| (trajectory_name(*id), is_trained_on(*id, &set)))
            .collect(),
        settings: &settings,
        rows,
    };
    results.section(&plant)
}

/// Whether samples of a trajectory are among those that the models were trained on.
fn is_trained_on(id: TrajectoryId, set: &TrainingSet) -> bool {
    let is_drawn = id == REFERENCE || UNIQUE[..set.n_contexts].contains(&id);
    is_drawn && !set.held_out.contains(&id)
}

/// The change of the errors that a finer integration makes, on the last trajectory.
fn check_integration(
    sources: &Sources<'_>,
    settings: &Settings,
    learned: &Learned,
    followed: &[TrajectoryId],
) -> Result<f64, BenchError> {
    let Some(id) = followed.last() else {
        return Ok(0.0);
    };
    let reference = sources.plant.reference(*id)?;
    let desired = Desired::of(sources.plant.desired(&reference)?.as_ref());
    let mut largest: f64 = 0.0;
    for source in [Source::Nothing, Source::Lr, Source::Exact] {
        if let Some(table) = sources.table(source, learned, &desired)? {
            let load = (&table, learned.load());
            let error = integration_error(sources.plant, settings, &reference, load)?;
            largest = largest.max(error);
        }
    }
    Ok(largest)
}

/// Runs into the wall.
fn contact(
    sources: &Sources<'_>,
    settings: &Settings,
    learned: &[Learned],
    name: &str,
) -> Result<Vec<Row>, BenchError> {
    let id = settings.wall.trajectory(name)?;
    let wall = sources.plant.wall(id.path_idx, &settings.wall);
    let sweep = Sweep {
        sources,
        settings,
        wall: Some(&wall),
    };
    let is_carried = |learned: &&Learned| learned.load() == settings.wall.load;
    let carried: Vec<&Learned> = learned.iter().filter(is_carried).collect();
    sweep.rows(id, &carried)
}

/// Changes of load in mid-motion.
fn changes(
    sources: &Sources<'_>,
    settings: &Settings,
    name: &str,
) -> Result<Vec<switch::Change>, BenchError> {
    let id = settings.switch.trajectory(name)?;
    let reference = sources.plant.reference(id)?;
    let x = sources.plant.desired(&reference)?;
    let tables = sources.all_loads(x.as_ref())?;
    let model = sources.trained.mgp.for_tracking()?;
    let switching = Switching {
        plant: sources.plant,
        model: &model,
        settings,
        reference: &reference,
        tables: &tables,
    };
    switching.changes()
}
