//! Whether the load is one of the known: a calibrated test, and c15, which no model has seen.

use std::collections::BTreeMap;

use mtgp::MtgpError;
use mtgp::context::{Calibration, largest_p_value};

use super::confusion::percent;
use super::settings::Settings;
use super::trials::{Layout, Trial};
use crate::data_figures::section::{Section, csv};
use crate::error::BenchError;
use crate::split::TrajectoryId;

/// The load that no model has seen.
const UNKNOWN: usize = 15;

/// Which trials of known loads a trial's surprise is compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Against {
    /// The trials at places of even number, on all trajectories; those at odd ones are judged.
    SameTrajectories,
    /// All trials on the other trajectories, on each of which it has to be unusual.
    OtherTrajectories,
}

impl Against {
    const ALL: [Self; 2] = [Self::SameTrajectories, Self::OtherTrajectories];

    fn name(self) -> &'static str {
        match self {
            Self::SameTrajectories => "same trajectories",
            Self::OtherTrajectories => "other trajectories",
        }
    }

    fn calibrates(self, trial: &Trial, tested: TrajectoryId) -> bool {
        match self {
            Self::SameTrajectories => trial.place.is_multiple_of(2),
            Self::OtherTrajectories => trial.trajectory != tested,
        }
    }

    fn judges(self, trial: &Trial, tested: TrajectoryId) -> bool {
        let is_there = trial.trajectory == tested;
        match self {
            Self::SameTrajectories => is_there && !trial.place.is_multiple_of(2),
            Self::OtherTrajectories => is_there,
        }
    }
}

/// How many trials were called unknown.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
struct Alarms {
    n_trials: usize,
    n_alarms: usize,
}

impl Alarms {
    fn count(&mut self, is_alarm: bool) {
        self.n_trials += 1;
        self.n_alarms += usize::from(is_alarm);
    }

    fn rate(self) -> f64 {
        self.n_alarms as f64 / self.n_trials as f64
    }
}

/// Alarms under known loads and under the unknown one.
fn alarms(
    trials: &[&Trial],
    count_idx: usize,
    against: Against,
    settings: &Settings,
) -> Result<[Alarms; 2], BenchError> {
    let surprise = |trial: &Trial| trial.by_count[count_idx].surprise();
    let mut alarms = [Alarms::default(); 2];
    for &trajectory in &settings.tested {
        let known = trials.iter().filter(|trial| trial.load != UNKNOWN);
        let known = known.filter(|trial| against.calibrates(trial, trajectory));
        let calibrations = calibrations(known.copied(), against, surprise)?;
        for trial in trials
            .iter()
            .filter(|trial| against.judges(trial, trajectory))
        {
            let is_alarm = largest_p_value(&calibrations, surprise(trial)) <= settings.level;
            alarms[usize::from(trial.load == UNKNOWN)].count(is_alarm);
        }
    }
    Ok(alarms)
}

/// Trials at other places of the same trajectories in one calibration, else one for each trajectory.
///
/// The loads at one place err alike: a place is a group.
fn calibrations<'a>(
    trials: impl Iterator<Item = &'a Trial>,
    against: Against,
    surprise: impl Fn(&Trial) -> f64,
) -> Result<Vec<Calibration>, MtgpError> {
    type Place = (usize, usize);
    let mut all: BTreeMap<usize, BTreeMap<Place, Vec<f64>>> = BTreeMap::new();
    for trial in trials {
        let first_row = trial.trajectory.rows().start;
        let calibration = match against {
            Against::SameTrajectories => 0,
            Against::OtherTrajectories => first_row,
        };
        let places = all.entry(calibration).or_default();
        let place = places.entry((first_row, trial.place)).or_default();
        place.push(surprise(trial));
    }
    let groups = all
        .into_values()
        .map(|places| places.into_values().collect());
    groups.map(Calibration::of_groups).collect()
}

/// CSV file and findings.
///
/// # Errors
/// `MultiTask` without trials to calibrate on.
pub fn report(
    trials: &[Trial],
    settings: &Settings,
    section: &mut Section,
) -> Result<(), BenchError> {
    let mut numbers = Vec::new();
    for layout in Layout::ALL {
        for (noise_idx, noise) in settings.torque_noise.iter().enumerate() {
            let is_in = |trial: &&Trial| trial.layout == layout && trial.noise_idx == noise_idx;
            let of_noise: Vec<&Trial> = trials.iter().filter(is_in).collect();
            for (count_idx, count) in settings.counts.iter().enumerate() {
                for against in Against::ALL {
                    let [known, unknown] = alarms(&of_noise, count_idx, against, settings)?;
                    let labels = [layout.name(), against.name()].map(String::from);
                    let place = [*noise, *count as f64];
                    let rates = [known.rate(), unknown.rate()];
                    numbers.push((labels.to_vec(), [place, rates].concat()));
                    if *count == settings.most() && *noise <= 0.0 {
                        found(layout, against, *count, [known, unknown], section);
                    }
                }
            }
        }
    }
    let header = "samples,calibrated_on,torque_noise,count,false_alarms,detected";
    section.file("context_unknown.csv", csv(header, numbers));
    Ok(())
}

fn found(
    layout: Layout,
    against: Against,
    count: usize,
    [known, unknown]: [Alarms; 2],
    section: &mut Section,
) {
    section.found(
        format!(
            "c15 found to be none of c1 to c14 in 95 % or more at 5 % of false alarms or fewer, {count} {} samples without noise, calibrated on the {}",
            layout.name(),
            against.name()
        ),
        format!(
            "{} of {} trials detected, {} false alarms of {}",
            percent(unknown.rate()),
            unknown.n_trials,
            percent(known.rate()),
            known.n_trials
        ),
    );
}
