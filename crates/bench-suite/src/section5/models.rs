//! The shared models themselves: how they were fitted and how they predict.

use super::trained::process_of;
use serde::{Deserialize, Serialize};
use torque_model::{TaskProcess, TorqueFunction};

use super::bench::Bench;
use super::campaign::Campaign;
use super::part::Task;
use super::training_set::{SPLIT_SEED, TrainingSet};
use crate::data_figures::section::{Made, Section, csv};
use crate::dataset::N_JOINTS;
use crate::error::BenchError;
use crate::multi::bench::context_scores;
use crate::multi::unit::ContextScore;
use crate::report::text_table::{TextTable, score};
use crate::section_experiment::SectionExperiment;
use crate::split::{N_ROWS, Split};

/// Settings of a profile.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Settings {
    n_total: usize,
}

/// One joint of one model.
#[derive(Serialize, Deserialize)]
struct Line {
    model: String,
    joint: usize,
    log_marginal: f64,
    noise_std: f64,
    /// Order of the factor that a prediction works with.
    basis: usize,
    interp: f64,
    extrap: f64,
}

/// Makes the table; `None` as long as a line of it is missing.
///
/// # Errors
/// `Experiment`, and those of [`Bench::trained`].
pub fn make(experiment: &SectionExperiment, campaign: &Campaign) -> Made {
    let settings: Settings = experiment.settings(campaign.profile)?;
    let set = TrainingSet::of_table_2(settings.n_total);
    let mut tasks = Vec::new();
    for (model, name) in ["mGP", "iGP", "pGP"].into_iter().enumerate() {
        tasks.extend((0..N_JOINTS).map(|joint_idx| {
            let label = format!("{name}, joint {}", joint_idx + 1);
            Task::new(label, (model, joint_idx))
        }));
    }
    let prepare = |bench| Ok((bench, Bench::trained(bench, &set)?, splits(&set)));
    let lines = campaign.parts(
        experiment,
        &tasks,
        prepare,
        |(bench, trained, splits), &(model, joint_idx)| {
            let models = [&trained.mgp, &trained.igp, &trained.pgp];
            let process = process_of(models[model], joint_idx);
            line(bench, splits, joint_idx + 1, process)
        },
    )?;
    Ok(lines.map(|lines| section(&lines)))
}

fn splits(set: &TrainingSet) -> Vec<Split> {
    (1..=set.n_contexts)
        .map(|load| Split::draw(SPLIT_SEED, load))
        .collect()
}

fn line(
    bench: &Bench,
    splits: &[Split],
    joint: usize,
    process: &TaskProcess,
) -> Result<Line, BenchError> {
    let all_rows: Vec<usize> = (0..N_ROWS).collect();
    let means = process.predict_mean_of_all_contexts(bench.data.x(&all_rows).as_ref())?;
    let scores = context_scores(&bench.data, joint, splits, &means)?;
    let mean = |of: fn(&ContextScore) -> f64| {
        let sum: f64 = scores.iter().map(of).sum();
        sum / scores.len() as f64
    };
    Ok(Line {
        model: process.name(),
        joint,
        log_marginal: process.summary.log_marginal,
        noise_std: process.noise_var().sqrt(),
        basis: process.summary.rank,
        interp: mean(|score| score.interp),
        extrap: mean(|score| score.extrap),
    })
}

fn section(lines: &[Line]) -> Section {
    let header = [
        "model",
        "joint",
        "log likelihood",
        "σ (N·m)",
        "rank",
        "interp",
        "extrap",
    ];
    let row = |line: &Line| {
        vec![
            line.model.clone(),
            line.joint.to_string(),
            format!("{:.1}", line.log_marginal),
            format!("{:.3}", line.noise_std),
            line.basis.to_string(),
            score(Some(line.interp)),
            score(Some(line.extrap)),
        ]
    };
    let mut section = Section::of_table(TextTable::new(1, header, lines.iter().map(row)));
    let numbers = lines.iter().map(|line| {
        let labels = vec![line.model.clone(), line.joint.to_string()];
        let numbers = [line.log_marginal, line.noise_std, line.interp, line.extrap];
        (labels, numbers.to_vec())
    });
    let header = "model,joint,log_marginal_likelihood,noise_std,nmse_interp,nmse_extrap";
    section.file("section5_models.csv", csv(header, numbers));
    section
}
