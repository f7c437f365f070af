//! The informative prior of section 3.2 beside GPc, and beside mGP where there are many loads.
//!
//! # Source
//! Section 3.2: "a Gaussian prior on the inertial parameters … highly informative".

mod findings;
mod line;
mod many_loads;
mod one_load;

use rayon::prelude::*;
use serde::Deserialize;

use self::line::Line;
use super::bench::Bench;
use super::spec::Section5Experiment;
use super::training_set::TrainingSet;
use crate::data_figures::section::Section;
use crate::error::BenchError;
use crate::rigid_body::rows::Regressors;

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

/// Makes the table.
///
/// # Errors
/// `Experiment`, and those of the fits.
pub fn make(experiment: &Section5Experiment, bench: &Bench) -> Result<Section, BenchError> {
    let settings: Settings = experiment.settings(bench.profile)?;
    let mut cells = Vec::new();
    for &joint in &settings.joints {
        for &n in &settings.sizes {
            cells.push((joint, n));
        }
    }
    let regressors = Regressors::new(&bench.data);
    let one: Vec<Vec<Line>> = cells
        .into_par_iter()
        .map(|(joint, n)| one_load::lines(bench, &regressors, &settings.loads, joint, n))
        .collect::<Result<_, _>>()?;
    let set = TrainingSet::of_table_2(settings.n_total);
    // Before the loop: its threads would wait for each other at the shelf.
    let trained = bench.trained(&set)?;
    let many: Vec<Vec<Line>> = (settings.many_joints.into_par_iter())
        .map(|joint| many_loads::lines(bench, &regressors, &set, &trained, joint))
        .collect::<Result<_, _>>()?;
    let lines: Vec<Line> = one.into_iter().chain(many).flatten().collect();
    let mut section = line::section(&lines);
    findings::add(&mut section, &lines);
    Ok(section)
}
