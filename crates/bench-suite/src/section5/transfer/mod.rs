//! How much the samples of other loads are worth: nMSE against their number, and against the target's own samples.
//!
//! # Source
//! Section 4.6, whose figures have 14 loads with equally many samples each.

mod curve;
mod measure;
mod picture;
mod settings;
mod table;

pub use self::curve::{Axis, Curve, CurveRecord, Learner, Score};
pub use self::measure::measure;
use self::settings::Settings;
use super::campaign::Campaign;
use crate::data_figures::section::{Made, Section};
use crate::section_experiment::SectionExperiment;

/// Makes the table, the picture and the findings; `None` as long as a curve is missing.
///
/// # Errors
/// `Experiment`, and those of the models and the picture.
pub fn make(experiment: &SectionExperiment, campaign: &Campaign) -> Made {
    let settings: Settings = experiment.settings(campaign.profile)?;
    let records = campaign.complete(&experiment.name, settings.curves(), Ok, |bench, curve| {
        measure(curve, &bench.data)
    })?;
    let Some(records) = records else {
        return Ok(None);
    };
    let mut section = Section::default();
    table::report(&records, &settings, &mut section);
    let picture = picture::draw(&records, &settings);
    let caption = "nMSE of the target load on extrap, geometric mean over the targets";
    section.show("transfer", caption, &picture)?;
    Ok(Some(section))
}
