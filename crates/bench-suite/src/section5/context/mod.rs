//! Context estimation on trajectories that were not trained on: right loads, delays, unknown loads.
//!
//! # Source
//! Section 5, eq. (21).

mod confusion;
mod counts;
mod picture;
mod settings;
mod shared;
mod switching;
mod trials;
mod unknown;

use self::settings::Settings;
use self::trials::{Layout, Place, Trial};
use super::campaign::Campaign;
use super::part::Task;
use crate::data_figures::section::{Made, Section};
use crate::section_experiment::SectionExperiment;

/// Makes the tables, the picture and the findings; `None` as long as a trial is missing.
///
/// # Errors
/// `Experiment`; those of the models, of eq. (21) and of the picture.
pub fn make(experiment: &SectionExperiment, campaign: &Campaign) -> Made {
    let settings: Settings = experiment.settings(campaign.profile)?;
    let set = settings.training_set();
    let tested = &settings.tested;

    let places: Vec<Task<Place>> = Layout::ALL
        .into_iter()
        .flat_map(|layout| Place::all(layout, tested, &settings))
        .map(|place| Task::new(place.label(), place))
        .collect();
    let trials: Option<Vec<Vec<Trial>>> = campaign.parts(
        experiment,
        &places,
        |bench| Ok((bench, bench.trained(&set)?)),
        |(bench, trained), place| place.trials(&trained.mgp, &bench.data, &settings),
    )?;
    let changes = switching::outcomes(experiment, campaign, &set, &settings)?;
    let of_shared = shared::trials(experiment, campaign, &set, &settings)?;
    let Some(((trials, changes), of_shared)) = trials.zip(changes).zip(of_shared) else {
        return Ok(None);
    };

    let trials: Vec<Trial> = trials.into_iter().flatten().collect();
    let mut section = Section::default();
    confusion::report(&trials, &settings, &mut section)?;
    unknown::report(&trials, &settings, &mut section)?;
    switching::report(&changes, &settings, &mut section);
    shared::report(&of_shared, &settings, &mut section);
    Ok(Some(section))
}
