//! Context estimation on trajectories that were not trained on: right loads, delays, unknown loads.
//!
//! # Source
//! Section 5, eq. (21).

mod confusion;
mod picture;
mod settings;
mod switching;
mod trials;
mod unknown;

use rayon::prelude::*;

use self::settings::Settings;
use self::trials::{Layout, Place, Trial};
use super::bench::Bench;
use super::spec::Section5Experiment;
use crate::data_figures::section::Section;
use crate::error::BenchError;

/// Makes the tables, the picture and the findings.
///
/// # Errors
/// `Experiment`; those of the models, of eq. (21) and of the picture.
pub fn make(experiment: &Section5Experiment, bench: &Bench) -> Result<Section, BenchError> {
    let settings: Settings = experiment.settings(bench.profile)?;
    let set = settings.training_set(&experiment.name)?;
    let trained = bench.trained(&set)?;
    let tested = settings.tested(&experiment.name)?;

    let places: Vec<Place> = Layout::ALL
        .into_iter()
        .flat_map(|layout| Place::all(layout, &tested, &settings))
        .collect();
    let trials: Vec<Vec<Trial>> = places
        .par_iter()
        .map(|place| place.trials(&trained.mgp, &bench.data, &settings))
        .collect::<Result<_, BenchError>>()?;
    let trials: Vec<Trial> = trials.into_iter().flatten().collect();

    let mut section = Section::default();
    confusion::report(&trials, &settings, &mut section)?;
    unknown::report(&trials, &tested, &settings, &mut section)?;
    switching::report(&trained.mgp, bench, &tested, &settings, &mut section)?;
    Ok(section)
}
