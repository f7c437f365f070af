//! What learned torques are worth to a controller: error, gains, corrective torque and contact force.
//!
//! The arm is simulated with friction that holds and slips ([`puma_dyn::motion::ArmSimulator`]), and follows
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

use torque_model::RobotModel;

use self::findings::Results;
use self::plant::Plant;
use self::settings::Settings;
use self::source::{Desired, NEW_LOAD, Source, Sources, of_all_loads};
use self::sweep::{Row, Sweep, integration_error};
use self::switch::Switching;
use super::bench::Bench;
use super::campaign::Campaign;
use super::part::Task;
use super::training_set::TrainingSet;
use crate::data_figures::section::Made;
use crate::error::BenchError;
use crate::section_experiment::SectionExperiment;
use crate::split::{REFERENCE, TrajectoryId, UNIQUE};

/// Makes the table, the picture, the CSV files and the findings; `None` as long as a run is missing.
///
/// # Errors
/// `Experiment`; `Fit`, `MultiTask` or `Dynamics` if a model or a run fails; `Picture`.
pub fn make(experiment: &SectionExperiment, campaign: &Campaign) -> Made {
    let settings: Settings = experiment.settings(campaign.profile)?;
    let set = settings.training_set();
    let followed = &settings.followed;
    let plant = Plant::new()?;
    let prepare = |bench| sources(bench, &plant, &set, &settings);

    let loads: Vec<usize> = settings.loads.iter().copied().chain([NEW_LOAD]).collect();
    let sweeps: Vec<Task<usize>> = (loads.iter())
        .map(|&load| Task::new(format!("c{load} on all trajectories"), load))
        .collect();
    let rows: Option<Vec<Vec<Vec<Row>>>> =
        campaign.parts(experiment, &sweeps, prepare, |sources, &load| {
            sweep(sources, &settings, load)
        })?;
    let of_shared = runs_of_shared(experiment, campaign, (&plant, &set, &settings))?;
    let once = |label: &str| [Task::new(label, ())];
    let contact = campaign.parts(experiment, &once("the wall"), prepare, |sources, ()| {
        contact(sources, &settings)
    })?;
    let switched = campaign.parts(
        experiment,
        &once("changes of load"),
        prepare,
        |sources, ()| changes(sources, &settings),
    )?;
    let finer = campaign.parts(experiment, &once("finer steps"), prepare, |sources, ()| {
        check_integration(sources, &settings, loads[0])
    })?;
    let found = rows.zip(contact).zip(of_shared).zip(switched).zip(finer);
    let Some(((((mut rows, mut contact), of_shared), switched), finer)) = found else {
        return Ok(None);
    };
    rows.extend(of_shared.free);
    contact.push(of_shared.walled);

    let results = Results {
        integration_error: finer.into_iter().sum(),
        contact: contact.concat(),
        changes: switched.concat(),
        trajectories: followed
            .iter()
            .map(|id| (id.to_string(), is_trained_on(*id, &set)))
            .collect(),
        settings: &settings,
        rows: (0..followed.len())
            .flat_map(|id_idx| rows.iter().flat_map(move |of_load| of_load[id_idx].clone()))
            .collect(),
    };
    results.section(&plant).map(Some)
}
/// Runs with rbd of all loads.
struct OfShared {
    /// Of each load on each trajectory.
    free: Vec<Vec<Vec<Row>>>,
    /// Into the wall.
    walled: Vec<Row>,
}

/// The runs of rbd, which learns all loads at once; `None` as long as one is missing.
fn runs_of_shared(
    experiment: &SectionExperiment,
    campaign: &Campaign,
    (plant, set, settings): (&Plant, &TrainingSet, &Settings),
) -> Result<Option<OfShared>, BenchError> {
    let prepare = |bench| of_all_loads(bench, set, settings.new_samples);
    let loads = settings.loads.iter().copied().chain([NEW_LOAD]);
    let tasks: Vec<Task<usize>> = loads
        .map(|load| {
            Task::new(
                format!("rbd of all loads, c{load} on all trajectories"),
                load,
            )
        })
        .collect();
    let free = campaign.parts(experiment, &tasks, prepare, |model, &load| {
        sweep_of_shared(plant, settings, model, load)
    })?;
    let wall = [Task::new("rbd of all loads, the wall", ())];
    let walled: Option<Vec<Vec<Row>>> =
        campaign.parts(experiment, &wall, prepare, |model, ()| {
            contact_of_shared(plant, settings, model)
        })?;
    let both = free.zip(walled);
    Ok(both.map(|(free, walled)| OfShared {
        free,
        walled: walled.concat(),
    }))
}

/// What all runs need.
fn sources<'a>(
    bench: &'a Bench,
    plant: &'a Plant,
    set: &'a TrainingSet,
    settings: &Settings,
) -> Result<Sources<'a>, BenchError> {
    Ok(Sources {
        plant,
        bench,
        set,
        trained: bench.trained(set)?,
        new_samples: settings.new_samples,
    })
}

/// Whether samples of a trajectory are among those that the models were trained on.
fn is_trained_on(id: TrajectoryId, set: &TrainingSet) -> bool {
    let is_drawn = id == REFERENCE || UNIQUE[..set.n_contexts].contains(&id);
    is_drawn && !set.held_out.contains(&id)
}

/// Runs of one load, on each trajectory.
fn sweep(
    sources: &Sources<'_>,
    settings: &Settings,
    load: usize,
) -> Result<Vec<Vec<Row>>, BenchError> {
    let learned = sources.learn(load)?;
    let sweep = Sweep {
        plant: sources.plant,
        settings,
        wall: None,
    };
    let rows = settings
        .followed
        .iter()
        .map(|id| sweep.rows(sources, *id, &[&learned]));
    rows.collect()
}

/// Runs of rbd of all loads under one of them, on each trajectory.
fn sweep_of_shared(
    plant: &Plant,
    settings: &Settings,
    model: &RobotModel,
    load: usize,
) -> Result<Vec<Vec<Row>>, BenchError> {
    let sweep = Sweep {
        plant,
        settings,
        wall: None,
    };
    let rows = settings.followed.iter();
    rows.map(|id| sweep.rows_of_shared(model, *id, load))
        .collect()
}

/// Its runs into the wall; none if its load is not among those that are carried.
fn contact_of_shared(
    plant: &Plant,
    settings: &Settings,
    model: &RobotModel,
) -> Result<Vec<Row>, BenchError> {
    let (load, id) = (settings.wall.load, settings.wall.trajectory);
    if !settings.loads.contains(&load) {
        return Ok(Vec::new());
    }
    let wall = plant.wall(id.path_idx, &settings.wall);
    let sweep = Sweep {
        plant,
        settings,
        wall: Some(&wall),
    };
    sweep.rows_of_shared(model, id, load)
}

/// The change of the errors that a finer integration makes, on the last trajectory.
fn check_integration(
    sources: &Sources<'_>,
    settings: &Settings,
    load: usize,
) -> Result<f64, BenchError> {
    let Some(id) = settings.followed.last() else {
        return Ok(0.0);
    };
    let learned = sources.learn(load)?;
    let reference = sources.plant.reference(*id)?;
    let desired = Desired::of(sources.plant.desired(&reference)?.as_ref());
    let mut largest: f64 = 0.0;
    for source in [Source::Nothing, Source::Lr, Source::Exact] {
        if let Some(table) = sources.table(source, &learned, &desired)? {
            let load = (&table, learned.load());
            let error = integration_error(sources.plant, settings, &reference, load)?;
            largest = largest.max(error);
        }
    }
    Ok(largest)
}

/// Runs into the wall; none if its load is not among those that are carried.
fn contact(sources: &Sources<'_>, settings: &Settings) -> Result<Vec<Row>, BenchError> {
    let id = settings.wall.trajectory;
    let wall = sources.plant.wall(id.path_idx, &settings.wall);
    let sweep = Sweep {
        plant: sources.plant,
        settings,
        wall: Some(&wall),
    };
    if !settings.loads.contains(&settings.wall.load) {
        return Ok(Vec::new());
    }
    sweep.rows(sources, id, &[&sources.learn(settings.wall.load)?])
}

/// Changes of load in mid-motion.
fn changes(sources: &Sources<'_>, settings: &Settings) -> Result<Vec<switch::Change>, BenchError> {
    let id = settings.switch.trajectory;
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
