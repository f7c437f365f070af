//! How long after a change of load in mid-motion the tracker knows the new one.

use std::time::Instant;

use faer::Mat;
use mtgp::context::{ContextPrior, ContextTracker, ContextTransition};
use puma_dyn::Scenario;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use torque_model::RobotModel;

use super::confusion::percent;
use super::settings::Settings;
use super::trials::SEED;
use crate::data_figures::section::{Section, csv};
use crate::dataset::N_JOINTS;
use crate::error::BenchError;
use crate::section_experiment::SectionExperiment;
use crate::section5::bench::Bench;
use crate::section5::campaign::Campaign;
use crate::section5::normal::normals;
use crate::section5::part::Task;
use crate::section5::training_set::TrainingSet;
use crate::seed::{sample_indices, stream};
use crate::split::{N_SAMPLES, TrajectoryId};

/// Samples before the change.
const BEFORE: usize = 20;
/// Motion after the change that is looked at, s.
const HORIZON: f64 = 0.1;
/// Motion within which the new load is to be found, s.
const ASKED: f64 = 0.05;

/// One change of load.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Change {
    trajectory: TrajectoryId,
    place: usize,
    /// Loads from 0.
    from: usize,
    to: usize,
}

/// What came of it.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub struct Outcome {
    change: Change,
    /// Time after which the new load is the most probable one up to the horizon; `None` if it is not at the end.
    delay: Option<f64>,
    /// Time of the tracker's median step, s.
    step: f64,
}

/// What came of all changes with a window.
pub type OfWindow = (usize, Vec<Outcome>);

/// What came of all changes, for every window; `None` as long as one of them is missing.
///
/// A part is a window on a trajectory.
///
/// # Errors
/// `MultiTask`, `Dynamics`.
pub fn outcomes(
    experiment: &SectionExperiment,
    campaign: &Campaign,
    set: &TrainingSet,
    settings: &Settings,
) -> Result<Option<Vec<OfWindow>>, BenchError> {
    let mut tasks = Vec::new();
    for &window in &settings.windows {
        tasks.extend(settings.tested.iter().map(|&trajectory| {
            let label = format!("changes on {trajectory}, window {window}");
            Task::new(label, (window, trajectory))
        }));
    }
    let outcomes: Option<Vec<Vec<Outcome>>> = campaign.parts(
        experiment,
        &tasks,
        |bench| Ok((bench, bench.trained(set)?.mgp.for_tracking()?)),
        |(bench, model), &(window, trajectory)| {
            let tracker = tracker(trajectory, window, model, settings)?;
            let changes = changes(trajectory, model.contexts().len(), settings.switch_places);
            (changes.into_par_iter())
                .map(|change| follow(change, tracker.clone(), bench, settings))
                .collect()
        },
    )?;
    let of_window =
        |(idx, outcomes): (usize, &[Vec<Outcome>])| (settings.windows[idx], outcomes.concat());
    let by_window = |outcomes: Vec<Vec<Outcome>>| {
        let windows = outcomes.chunks(settings.tested.len()).enumerate();
        windows.map(of_window).collect()
    };
    Ok(outcomes.map(by_window))
}

/// CSV file and findings, for every window.
pub fn report(outcomes: &[OfWindow], settings: &Settings, section: &mut Section) {
    let mut rows = Vec::new();
    for (window, outcomes) in outcomes {
        found(*window, outcomes, settings, section);
        rows.extend(outcomes.iter().map(|outcome| line(*window, outcome)));
    }
    let header = "window,trajectory,from,to,delay_s";
    section.file("context_delays.csv", csv(header, rows));
}

/// Every load once at every place, each changed for the one five further on.
fn changes(trajectory: TrajectoryId, m: usize, n_places: usize) -> Vec<Change> {
    let of_place = |place| {
        (0..m).map(move |from| Change {
            trajectory,
            place,
            from,
            to: (from + 5 + place) % m,
        })
    };
    (0..n_places).flat_map(of_place).collect()
}

/// Time between two samples, s.
fn interval(trajectory: TrajectoryId) -> f64 {
    Scenario::reference().duration(trajectory.speed_idx) / N_SAMPLES as f64
}

/// A tracker before its first sample; copies of it share what is costly.
fn tracker(
    trajectory: TrajectoryId,
    window: usize,
    model: &RobotModel,
    settings: &Settings,
) -> Result<ContextTracker, BenchError> {
    let m = model.contexts().len();
    let posteriors = model.tasks().map(|(_, process)| &process.posterior);
    let prior = ContextPrior::uniform(m)?;
    let chain = ContextTransition::switching(m, settings.switching_rate, interval(trajectory))?;
    let noise = vec![settings.switch_noise; model.learned().len()];
    let tracker = ContextTracker::new(posteriors, window, &prior, chain)?;
    Ok(tracker.with_torque_noise(&noise)?)
}

fn follow(
    change: Change,
    mut tracker: ContextTracker,
    bench: &Bench,
    settings: &Settings,
) -> Result<Outcome, BenchError> {
    let interval = interval(change.trajectory);
    let is_looked_at = |n: &usize| *n as f64 * interval <= HORIZON + 1e-9;
    let after = (1..=N_SAMPLES).take_while(is_looked_at).count();
    let (x, torques) = motion(change, after, bench, settings.switch_noise);

    let mut steps = Vec::with_capacity(x.nrows());
    let mut delay = None;
    for (sample, torques) in torques.iter().enumerate() {
        let state: Vec<f64> = x.row(sample).iter().copied().collect();
        let start = Instant::now();
        tracker.step(&state, torques)?;
        steps.push(start.elapsed().as_secs_f64());
        if sample >= BEFORE {
            let is_right = tracker.filter().most_probable() == change.to;
            let elapsed = (sample - BEFORE + 1) as f64 * interval;
            delay = is_right.then(|| delay.unwrap_or(elapsed));
        }
    }
    steps.sort_by(f64::total_cmp);
    Ok(Outcome {
        change,
        delay,
        step: steps[steps.len() / 2],
    })
}

/// States, and torques of all joints with noise, under the one load and then the other.
fn motion(
    change: Change,
    after: usize,
    bench: &Bench,
    noise_std: f64,
) -> (Mat<f64>, Vec<[Option<f64>; N_JOINTS]>) {
    let first_row = change.trajectory.rows().start;
    let n = BEFORE + after;
    let label = format!("switch/{first_row}/{}", change.place);
    let start = sample_indices(&mut stream(SEED, &label), N_SAMPLES - n, 1)[0];
    let rows: Vec<usize> = (first_row + start..first_row + start + n).collect();
    let mut rng = stream(SEED, &format!("{label}/c{}/noise", change.from + 1));
    let mut noise = normals(&mut rng);
    let mut torques = vec![[None; N_JOINTS]; n];
    for joint in 1..=N_JOINTS {
        let of_load = |load: usize| bench.data.torques(load + 1, joint, &rows);
        let (before, after) = (of_load(change.from), of_load(change.to));
        let torque = before[..BEFORE].iter().chain(&after[BEFORE..]);
        for ((of_sample, torque), z) in torques.iter_mut().zip(torque).zip(noise.by_ref()) {
            of_sample[joint - 1] = Some(torque + noise_std * z);
        }
    }
    (bench.data.x(&rows), torques)
}

fn line(window: usize, outcome: &Outcome) -> (Vec<String>, Vec<f64>) {
    let Change {
        trajectory,
        from,
        to,
        ..
    } = outcome.change;
    let labels = [
        window.to_string(),
        trajectory.to_string(),
        format!("c{}", from + 1),
        format!("c{}", to + 1),
    ];
    (
        labels.to_vec(),
        vec![outcome.delay.unwrap_or(f64::INFINITY)],
    )
}

fn found(window: usize, outcomes: &[Outcome], settings: &Settings, section: &mut Section) {
    // A sampling instant can miss 50 ms by rounding alone.
    let is_in_time = |outcome: &&Outcome| outcome.delay.is_some_and(|delay| delay <= ASKED + 1e-9);
    let n_in_time = outcomes.iter().filter(is_in_time).count();
    let mut steps: Vec<f64> = outcomes.iter().map(|outcome| outcome.step).collect();
    steps.sort_by(f64::total_cmp);
    section.found(
        format!(
            "a change of load found within 50 ms in 95 % or more, torque noise {} N·m; the tracker at 1 kHz",
            settings.switch_noise
        ),
        format!(
            "window of {window}: {} of {} changes; {:.0} µs a sample (median)",
            percent(n_in_time as f64 / outcomes.len() as f64),
            outcomes.len(),
            1e6 * steps[steps.len() / 2]
        ),
    );
}
