//! Predictions averaged over hyperparameters, beside those of their point estimate.
//!
//! # Source
//! Section 5, priors over the hyperparameters and Markov chain Monte Carlo.

mod chains;
mod scores;
mod settings;

use std::sync::Arc;
use std::time::Instant;

use gp_core::Posterior;
use serde::{Deserialize, Serialize};

use self::chains::{Agreement, Diagnostics, Regressions, draw};
use self::scores::{Held, Scores};
use self::settings::Settings;
use super::bench::Bench;
use super::campaign::Campaign;
use super::part::Task;
use super::trained::{Trained, process_of};
use super::training_set::TrainingSet;
use crate::data_figures::section::{Made, Section, csv};
use crate::error::BenchError;
use crate::report::text_table::TextTable;
use crate::section_experiment::SectionExperiment;

/// One joint under one way of predicting.
#[derive(Serialize, Deserialize)]
struct Line {
    joint: usize,
    estimate: String,
    interp: Scores,
    extrap: Scores,
    seconds: f64,
}

/// One joint: likeliest and averaged hyperparameters, and what the chains of the latter say of themselves.
#[derive(Serialize, Deserialize)]
struct OfJoint {
    lines: [Line; 2],
    chains: Diagnostics,
}

/// Makes the table; `None` as long as a joint is missing.
///
/// # Errors
/// `Experiment`, and those of the fits and chains.
pub fn make(experiment: &SectionExperiment, campaign: &Campaign) -> Made {
    let settings: Settings = experiment.settings(campaign.profile)?;
    let set = TrainingSet::of_table_2(settings.n_total);
    let joints = settings.joints.iter();
    let joints: Vec<Task<usize>> = joints
        .map(|&joint| Task::new(format!("joint {joint}"), joint))
        .collect();
    let results = campaign.parts(
        experiment,
        &joints,
        |bench| {
            Ok(Shared {
                bench,
                settings: &settings,
                set: &set,
                trained: bench.trained(&set)?,
            })
        },
        |shared, &joint| of_joint(shared, joint),
    )?;
    Ok(results.map(|results| section(&results)))
}

/// What the joints share.
struct Shared<'a> {
    bench: &'a Bench,
    settings: &'a Settings,
    set: &'a TrainingSet,
    trained: Arc<Trained>,
}

fn of_joint(shared: &Shared<'_>, joint: usize) -> Result<OfJoint, BenchError> {
    let Shared {
        bench,
        settings,
        set,
        trained,
    } = shared;
    let point = process_of(&trained.mgp, joint - 1);
    let samples = set.samples(&bench.data)?;
    let targets = samples.targets(&bench.data, joint);
    let held = Held::draw(bench, set, joint, settings.n_test);

    let start = Instant::now();
    let [interp, extrap] = held.scores(&[&point.posterior])?;
    let of_point = Line {
        joint,
        estimate: "likeliest".to_string(),
        interp,
        extrap,
        seconds: start.elapsed().as_secs_f64(),
    };

    let start = Instant::now();
    let drawn = draw(&samples.stacked, &targets, point, settings, joint)?;
    let posteriors: Vec<Posterior<Regressions>> =
        drawn.posteriors(&samples.stacked, &targets, settings.n_mixture)?;
    let [interp, extrap] = held.scores(&posteriors.iter().collect::<Vec<_>>())?;
    let of_draws = Line {
        joint,
        estimate: "averaged".to_string(),
        interp,
        extrap,
        seconds: start.elapsed().as_secs_f64(),
    };
    Ok(OfJoint {
        lines: [of_point, of_draws],
        chains: drawn.diagnostics,
    })
}

fn section(results: &[OfJoint]) -> Section {
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
    for OfJoint { lines, chains } in results {
        for (idx, line) in lines.iter().enumerate() {
            let mut row = vec![line.joint.to_string(), line.estimate.clone()];
            for scores in [&line.interp, &line.extrap] {
                row.push(format!("{:.1} %", 100.0 * scores.coverage));
                row.push(format!("{:.2}", scores.log_density));
            }
            row.extend(match idx {
                0 => std::array::from_fn(|_| "–".to_string()),
                _ => [
                    format!("{:.3}", chains.known.r_hat),
                    format!("{:.3}", chains.correlations.r_hat),
                    format!("{:.3}", chains.coordinates.r_hat),
                    format!("{:.0}", chains.known.size),
                    chains.n_divergences.to_string(),
                    chains.n_evaluations.to_string(),
                ],
            });
            row.push(format!("{:.1}", line.seconds));
            rows.push(row);
            let labels = vec![line.joint.to_string(), line.estimate.clone()];
            let scores = [&line.interp, &line.extrap];
            let values = scores.iter().flat_map(|s| [s.coverage, s.log_density]);
            numbers.push((labels, values.collect()));
        }
    }
    let mut section = Section::of_table(TextTable::new(2, header, rows));
    let header = "joint,hyperparameters,coverage_interp,log_density_interp,coverage_extrap,log_density_extrap";
    section.file("section5_sampled.csv", csv(header, numbers));
    add_findings(&mut section, results);
    section
}

fn add_findings(section: &mut Section, results: &[OfJoint]) {
    let mean = |of: &dyn Fn(&[Line; 2]) -> f64| {
        results.iter().map(|one| of(&one.lines)).sum::<f64>() / results.len().max(1) as f64
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
    let agreed = |of: fn(&Diagnostics) -> &Agreement| {
        let worst = results
            .iter()
            .max_by(|a, b| of(&a.chains).r_hat.total_cmp(&of(&b.chains).r_hat));
        worst.map_or(String::new(), |OfJoint { lines, chains }| {
            let Agreement { r_hat, worst, .. } = of(chains);
            format!("{r_hat:.3} ({worst}, joint {})", lines[0].joint)
        })
    };
    let divergences: usize = results.iter().map(|one| one.chains.n_divergences).sum();
    section.found(
        "do the chains agree (R̂ below 1.01)?",
        format!(
            "the largest R̂ is {} of what the likelihood knows, {} of the correlations between loads, {} of the coordinates one by one; {divergences} divergences",
            agreed(|chains| &chains.known),
            agreed(|chains| &chains.correlations),
            agreed(|chains| &chains.coordinates)
        ),
    );
    let evaluations: usize = results.iter().map(|one| one.chains.n_evaluations).sum();
    section.found(
        "what does it cost?",
        format!(
            "{} likelihoods with gradient per joint",
            evaluations / results.len().max(1)
        ),
    );
}
