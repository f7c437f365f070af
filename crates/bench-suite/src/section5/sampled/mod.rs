//! Predictions averaged over hyperparameters, beside those of their point estimate.
//!
//! # Source
//! Section 5, priors over the hyperparameters and Markov chain Monte Carlo.

mod chains;
mod scores;

use std::time::Instant;

use faer::Mat;
use gp_core::FitPosterior;
use mtgp::MultiTaskCovariance;
use rayon::prelude::*;
use serde::Deserialize;

use self::chains::{Agreement, Drawn, draw};
use self::scores::{Held, Scores};
use super::bench::Bench;
use super::spec::Section5Experiment;
use super::trained::Trained;
use super::training_set::TrainingSet;
use crate::data_figures::section::{Section, csv};
use crate::error::BenchError;
use crate::report::text_table::TextTable;

/// Settings of a profile.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    n_total: usize,
    joints: Vec<usize>,
    n_chains: u64,
    n_warmup: usize,
    n_draws: usize,
    max_depth: u32,
    target_acceptance: f64,
    n_mixture: usize,
    n_test: usize,
}

/// One joint under one way of predicting.
struct Line {
    joint: usize,
    estimate: &'static str,
    interp: Scores,
    extrap: Scores,
    seconds: f64,
}

/// Makes the table.
///
/// # Errors
/// `Experiment`, and those of the fits and chains.
pub fn make(experiment: &Section5Experiment, bench: &Bench) -> Result<Section, BenchError> {
    let settings: Settings = experiment.settings(bench.profile)?;
    let set = TrainingSet::of_table_2(settings.n_total);
    // Before the loop: its threads would wait for each other at the shelf.
    let trained = bench.trained(&set)?;
    let task = Task {
        bench,
        settings: &settings,
        set: &set,
        trained: &trained,
    };
    let results: Vec<([Line; 2], Drawn)> = (settings.joints.par_iter())
        .map(|&joint| of_joint(&task, joint))
        .collect::<Result<_, _>>()?;
    Ok(section(&results))
}

/// What the joints share.
struct Task<'a> {
    bench: &'a Bench,
    settings: &'a Settings,
    set: &'a TrainingSet,
    trained: &'a Trained,
}

fn of_joint(task: &Task<'_>, joint: usize) -> Result<([Line; 2], Drawn), BenchError> {
    let Task {
        bench,
        settings,
        set,
        trained,
    } = task;
    let of_joint = trained
        .mgp
        .learned()
        .iter()
        .find(|(idx, _)| idx + 1 == joint);
    let (_, point) = of_joint.expect("every joint is learned");
    let samples = set.samples(&bench.data)?;
    let targets = samples.targets(&bench.data, joint);
    let held = Held::draw(bench, set, joint, settings.n_test);

    let start = Instant::now();
    let [interp, extrap] = held.scores(&[&point.posterior])?;
    let of_point = Line {
        joint,
        estimate: "likeliest",
        interp,
        extrap,
        seconds: start.elapsed().as_secs_f64(),
    };

    let start = Instant::now();
    let drawn = draw(&samples.stacked, &targets, point, settings, joint)?;
    let posteriors: Vec<FitPosterior<MultiTaskCovariance>> =
        drawn.posteriors(&samples.stacked, &targets, settings.n_mixture)?;
    let [interp, extrap] = held.scores(&posteriors.iter().collect::<Vec<_>>())?;
    let of_draws = Line {
        joint,
        estimate: "averaged",
        interp,
        extrap,
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok(([of_point, of_draws], drawn))
}

fn section(results: &[([Line; 2], Drawn)]) -> Section {
    let header = [
        "joint",
        "hyperparameters",
        "interp: inside 95 %",
        "log density",
        "extrap: inside 95 %",
        "log density",
        "R̂",
        "of correlations",
        "of coordinates",
        "size",
        "divergences",
        "likelihoods",
        "s",
    ];
    let mut rows = Vec::new();
    let mut numbers = Vec::new();
    for (lines, drawn) in results {
        for (idx, line) in lines.iter().enumerate() {
            let mut row = vec![line.joint.to_string(), line.estimate.to_string()];
            for scores in [&line.interp, &line.extrap] {
                row.push(format!("{:.1} %", 100.0 * scores.coverage));
                row.push(format!("{:.2}", scores.log_density));
            }
            row.extend(match idx {
                0 => std::array::from_fn(|_| "–".to_string()),
                _ => [
                    format!("{:.3}", drawn.known.r_hat),
                    format!("{:.3}", drawn.correlations.r_hat),
                    format!("{:.3}", drawn.coordinates.r_hat),
                    format!("{:.0}", drawn.known.size),
                    drawn.n_divergences.to_string(),
                    drawn.n_evaluations.to_string(),
                ],
            });
            row.push(format!("{:.1}", line.seconds));
            rows.push(row);
            let labels = vec![line.joint.to_string(), line.estimate.to_string()];
            let scores = [&line.interp, &line.extrap];
            let values = scores.iter().flat_map(|s| [s.coverage, s.log_density]);
            numbers.push((labels, values.collect()));
        }
    }
    let mut section = Section {
        table: Some(TextTable {
            header: header.map(String::from).to_vec(),
            rows,
            n_left: 2,
        }),
        ..Section::default()
    };
    let header = "joint,hyperparameters,coverage_interp,log_density_interp,coverage_extrap,log_density_extrap";
    section.file("section5_sampled.csv", csv(header, numbers));
    add_findings(&mut section, results);
    section
}

fn add_findings(section: &mut Section, results: &[([Line; 2], Drawn)]) {
    let mean = |of: &dyn Fn(&[Line; 2]) -> f64| {
        results.iter().map(|(lines, _)| of(lines)).sum::<f64>() / results.len().max(1) as f64
    };
    let coverage = |idx: usize| 100.0 * mean(&|lines| lines[idx].extrap.coverage);
    section.found(
        "does averaging over the hyperparameters bring the coverage of the nominal 95 % nearer to it?",
        format!(
            "on extrap {:.1} % of the torques are inside with the likeliest and {:.1} % with averaged hyperparameters",
            coverage(0),
            coverage(1)
        ),
    );
    let gain = |lines: &[Line; 2]| lines[1].extrap.log_density - lines[0].extrap.log_density;
    section.found(
        "does it predict better?",
        format!(
            "the log density on extrap changes by {:+.2} nats per torque, averaged over {} joints",
            mean(&gain),
            results.len()
        ),
    );
    let agreed = |of: fn(&Drawn) -> &Agreement| {
        let worst = results
            .iter()
            .max_by(|a, b| of(&a.1).r_hat.total_cmp(&of(&b.1).r_hat));
        worst.map_or(String::new(), |(lines, drawn)| {
            let Agreement { r_hat, worst, .. } = of(drawn);
            format!("{r_hat:.3} ({worst}, joint {})", lines[0].joint)
        })
    };
    let divergences: usize = results.iter().map(|(_, drawn)| drawn.n_divergences).sum();
    section.found(
        "do the chains agree (R̂ below 1.01)?",
        format!(
            "the largest R̂ is {} of what the likelihood knows, {} of the correlations between loads, {} of the coordinates one by one; {divergences} divergences",
            agreed(|drawn| &drawn.known),
            agreed(|drawn| &drawn.correlations),
            agreed(|drawn| &drawn.coordinates)
        ),
    );
    let evaluations: usize = results.iter().map(|(_, drawn)| drawn.n_evaluations).sum();
    section.found(
        "what does it cost?",
        format!(
            "{} likelihoods with gradient per joint",
            evaluations / results.len().max(1)
        ),
    );
}

/// Rows of a matrix as vectors.
fn row_of(matrix: &Mat<f64>, row: usize) -> Vec<f64> {
    matrix.row(row).iter().copied().collect()
}
