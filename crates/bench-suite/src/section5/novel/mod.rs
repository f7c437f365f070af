//! A load that no model has seen: how few samples of it are enough.
//!
//! # Source
//! Section 5, novel contexts.

mod case;
mod learners;
mod physics;
mod picture;
mod shared;
mod table;

use std::collections::BTreeMap;

use torque_model::RobotModel;

use self::case::{Case, Samples, Settings, Test};
use self::learners::{Learner, Learners, Score};
use self::physics::LoadRegression;
use super::bench::Bench;
use super::campaign::Campaign;
use super::normal::normals;
use super::part::Task;
use super::training_set::{SPLIT_SEED, TrainingSet};
use crate::data_figures::section::{Made, Section};
use crate::dataset::N_JOINTS;
use crate::error::BenchError;
use crate::multi::draw::nested;
use crate::rigid_body::Terms;
use crate::section_experiment::SectionExperiment;
use crate::seed::stream;
use crate::split::Split;

/// Seed of samples and noise.
const SEED: &str = "novel-load";

/// Makes the tables, the picture and the findings; `None` as long as a score is missing.
///
/// # Errors
/// `Experiment`, and those of the models and the picture.
pub fn make(experiment: &SectionExperiment, campaign: &Campaign) -> Made {
    let settings: Settings = experiment.settings(campaign.profile)?;
    let split = Split::draw(SPLIT_SEED, settings.load);
    let scores: Option<Vec<Vec<Score>>> = campaign.parts(
        experiment,
        &cases(&settings),
        |bench| {
            let trained = bench.trained(&TrainingSet::of_table_2(settings.n_total))?;
            let test = test(bench, &settings, &split);
            let physics = LoadRegression::new(test.x.as_ref());
            Ok((bench, trained, test, physics))
        },
        |(bench, trained, test, physics), case| {
            let learners = Learners {
                trained,
                physics,
                test,
            };
            learners.scores(&samples(*case, &settings, &split, bench), *case)
        },
    )?;
    let of_robot: Option<Vec<Vec<Score>>> = campaign.parts(
        experiment,
        &cases_of_robot(&settings),
        |bench| {
            let set = TrainingSet::of_table_2(settings.n_total);
            let learned = |terms| Ok((terms, bench.shared(terms, &set)?));
            let known: Result<BTreeMap<Terms, RobotModel>, BenchError> =
                Terms::ALL.into_iter().map(learned).collect();
            let known = known?;
            Ok((bench, known, test(bench, &settings, &split)))
        },
        |(bench, known, test), (terms, case)| {
            let samples = samples(*case, &settings, &split, bench);
            shared::scores((*terms, &known[terms]), &samples, test, *case)
        },
    )?;
    let Some((scores, of_robot)) = scores.zip(of_robot) else {
        return Ok(None);
    };
    let scores = [scores, of_robot].concat().concat();

    let mut section = Section::default();
    table::report(&scores, &settings, &mut section);
    let picture = picture::draw(&scores, &settings);
    let caption = "nMSE of the new load against its samples, geometric mean over joints 2 to 6";
    section.show("novel", caption, &picture)?;
    Ok(Some(section))
}

/// What is predicted: some rows of the load's extrap set.
fn test(bench: &Bench, settings: &Settings, split: &Split) -> Test {
    let extrap = split.extrap.iter().copied();
    let rows: Vec<usize> = extrap.step_by(settings.test_stride).collect();
    Test {
        x: bench.data.x(&rows),
        torques: torques(bench, settings.load, &rows),
    }
}

fn cases(settings: &Settings) -> Vec<Task<Case>> {
    let mut cases = Vec::new();
    for draw in 0..settings.draws {
        for (noise_idx, noise) in settings.torque_noise.iter().enumerate() {
            cases.extend(settings.counts.iter().map(|&count| {
                let label = format!("draw {draw}, noise {noise} N·m, {count} samples");
                let case = Case {
                    draw,
                    noise_idx,
                    count,
                };
                Task::new(label, case).costing(count)
            }));
        }
    }
    cases
}

/// Those of rbd, which are parts of their own: it learns all joints at once.
fn cases_of_robot(settings: &Settings) -> Vec<Task<(Terms, Case)>> {
    let of_terms = |terms: Terms| {
        let cases = cases(settings).into_iter();
        cases.map(move |of| {
            let label = format!("{}, {}", terms.name(), of.label);
            Task::new(label, (terms, of.task)).costing(of.cost)
        })
    };
    Terms::ALL.into_iter().flat_map(of_terms).collect()
}

/// The first samples of a draw; those of a smaller number are among those of a larger one.
fn samples(case: Case, settings: &Settings, split: &Split, bench: &Bench) -> Samples {
    let rows = nested(split, SEED, settings.load, case.draw, case.count);
    let noise_std = settings.torque_noise[case.noise_idx];
    let mut torques = torques(bench, settings.load, &rows);
    for (joint_idx, torques) in torques.iter_mut().enumerate() {
        let label = format!(
            "noise{}/{}/joint{}",
            case.noise_idx,
            case.draw,
            joint_idx + 1
        );
        for (torque, z) in torques.iter_mut().zip(normals(&mut stream(SEED, &label))) {
            *torque += noise_std * z;
        }
    }
    Samples {
        x: bench.data.x(&rows),
        torques,
        noise_std,
    }
}

fn torques(bench: &Bench, load: usize, rows: &[usize]) -> Vec<Vec<f64>> {
    let of_joint = |joint| bench.data.torques(load, joint, rows);
    (1..=N_JOINTS).map(of_joint).collect()
}

/// Scores of a learner at a number of samples and a noise, of one joint.
fn of(
    scores: &[Score],
    (learner, noise_idx, count, joint): (Learner, usize, usize, usize),
) -> impl Iterator<Item = &Score> {
    scores.iter().filter(move |score| {
        let place = (score.learner, score.noise_idx, score.count, score.joint);
        place == (learner, noise_idx, count, joint)
    })
}

impl Settings {
    /// Geometric mean of the nMSE over draws and joints; `None` if one of them is missing.
    fn mean(
        &self,
        scores: &[Score],
        place: (Learner, usize, usize),
        joints: impl IntoIterator<Item = usize>,
    ) -> Option<f64> {
        let (learner, noise_idx, count) = place;
        let (mut sum, mut n) = (0.0, 0);
        for joint in joints {
            let of_joint = of(scores, (learner, noise_idx, count, joint));
            let logs: Vec<f64> = of_joint.map(|score| score.nmse.ln()).collect();
            if logs.len() < self.draws {
                return None;
            }
            sum += logs.iter().sum::<f64>();
            n += logs.len();
        }
        (n > 0).then(|| (sum / n as f64).exp())
    }
}
