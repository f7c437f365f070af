//! The informative prior of section 3.2 beside GPc, and beside mGP where there are many loads.
//!
//! # Source
//! Section 3.2: "a Gaussian prior on the inertial parameters … highly informative".

mod findings;
mod line;
mod many_loads;
mod one_load;

use serde::Deserialize;

use self::line::Line;
use super::bench::Bench;
use super::campaign::Campaign;
use super::part::Task;
use super::training_set::TrainingSet;
use crate::data_figures::section::Made;
use crate::rigid_body::rows::Regressors;
use crate::section_experiment::SectionExperiment;

/// Settings of a profile.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    /// Loads, from 1, over which the scores of one load are averaged.
    loads: Vec<usize>,
    joints: Vec<usize>,
    /// Training samples of one load.
    sizes: Vec<usize>,
    /// Training samples of all 14 loads together.
    n_total: usize,
    many_joints: Vec<usize>,
}

/// Makes the table; `None` as long as a line of it is missing.
///
/// # Errors
/// `Experiment`, and those of the fits.
pub fn make(experiment: &SectionExperiment, campaign: &Campaign) -> Made {
    let settings: Settings = experiment.settings(campaign.profile)?;
    let mut cells = Vec::new();
    for &joint in &settings.joints {
        cells.extend(settings.sizes.iter().map(|&n| {
            let label = format!("one load, joint {joint}, n {n}");
            Task::new(label, (joint, n)).costing(n)
        }));
    }
    let one: Option<Vec<Vec<Line>>> = campaign.parts(
        experiment,
        &cells,
        |bench| Ok(with_regressors(bench)),
        |(bench, y), &(joint, n)| one_load::lines(bench, y, &settings.loads, joint, n),
    )?;
    let set = TrainingSet::of_table_2(settings.n_total);
    let joints = settings.many_joints.iter();
    let joints: Vec<Task<usize>> = joints
        .map(|&joint| Task::new(format!("many loads, joint {joint}"), joint))
        .collect();
    let many: Option<Vec<Vec<Line>>> = campaign.parts(
        experiment,
        &joints,
        |bench| Ok((with_regressors(bench), bench.trained(&set)?)),
        |((bench, y), trained), &joint| many_loads::lines(bench, y, &set, trained, joint),
    )?;
    let Some((one, many)) = one.zip(many) else {
        return Ok(None);
    };
    let lines = [one, many].concat().concat();
    let mut section = line::section(&lines);
    findings::add(&mut section, &lines);
    Ok(Some(section))
}

/// The data with the regressor's rows at all states.
fn with_regressors(bench: &Bench) -> (&Bench, Regressors<'_>) {
    (bench, Regressors::new(&bench.data))
}
