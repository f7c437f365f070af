//! Trials with rbd of all joints: which load it is, and whether it is any of them, by the evidence of `torque-gp context`.

use std::sync::Arc;

use torque_model::Samples;
use torque_model::rigid_body::ParameterPosterior;

use super::confusion::percent;
use super::counts::Confusion;
use super::settings::Settings;
use super::trials::{Evidence, Layout, Place, SEED, Trial};
use crate::data_figures::section::{Section, csv};
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::rigid_body::{Terms, shared};
use crate::section_experiment::SectionExperiment;
use crate::section5::bench::Bench;
use crate::section5::campaign::Campaign;
use crate::section5::normal::normals;
use crate::section5::part::Task;
use crate::section5::training_set::TrainingSet;
use crate::seed::stream;
use crate::spec::Profile;

/// What the model was learned from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Lesson {
    /// Torques without noise.
    Quiet,
    /// Torques with the noise of the trial.
    Noisy,
}

impl Lesson {
    /// Both, in the order of the findings.
    pub const ALL: [Self; 2] = [Self::Quiet, Self::Noisy];

    /// In words.
    fn name(self) -> &'static str {
        match self {
            Self::Quiet => "learned without noise",
            Self::Noisy => "learned with that noise",
        }
    }

    /// Whether trials with a noise are made: without any, both are the same.
    fn has(self, noise_std: f64) -> bool {
        self == Self::Quiet || noise_std > 0.0
    }
}

/// Trials with models learned from either.
pub type OfLesson = (Lesson, Vec<Trial>);

/// Consecutive samples at the first places on each trajectory: evidence of all joints takes a tenth of a second.
///
/// # Errors
/// `Experiment`, `Model`.
pub fn trials(
    experiment: &SectionExperiment,
    campaign: &Campaign,
    set: &TrainingSet,
    settings: &Settings,
) -> Result<Option<Vec<OfLesson>>, BenchError> {
    let n_places = match campaign.profile {
        Profile::Smoke => 1,
        Profile::Full => 4,
    };
    let places = Place::all(Layout::Consecutive, &settings.tested, settings).into_iter();
    let places: Vec<Place> = places.filter(|place| place.number < n_places).collect();
    let mut all = Vec::new();
    for lesson in Lesson::ALL {
        let task = |place: &Place| {
            let (name, what) = (Terms::Chosen.name(), lesson.name());
            Task::new(format!("{name} {what}, {}", place.label()), place.clone())
        };
        let tasks: Vec<Task<Place>> = places.iter().map(task).collect();
        let trials: Option<Vec<Vec<Trial>>> = campaign.parts(
            experiment,
            &tasks,
            |bench| Ok((bench, models(lesson, bench, set, settings)?)),
            |(bench, models), place| place.trials_of_shared(models, &bench.data, settings),
        )?;
        all.push(trials.map(|trials| (lesson, trials.concat())));
    }
    Ok(all.into_iter().collect())
}

/// A model for each noise that trials are made with.
fn models(
    lesson: Lesson,
    bench: &Bench,
    set: &TrainingSet,
    settings: &Settings,
) -> Result<Vec<Option<Arc<ParameterPosterior>>>, BenchError> {
    let quiet = bench.samples_of_joints(set);
    let learn = |samples: &Samples| {
        let model = Terms::Chosen.learn(samples)?;
        Ok::<_, BenchError>(Arc::clone(shared::joint_of(&model, 1).posterior()))
    };
    let noises = settings.torque_noise.iter().enumerate();
    if lesson == Lesson::Quiet {
        let model = learn(&quiet)?;
        return Ok(noises.map(|_| Some(Arc::clone(&model))).collect());
    }
    let of_noise = |(idx, noise_std): (usize, &f64)| {
        let mut noisy = quiet.clone();
        for joint in &mut noisy.torques {
            let label = format!("training/noise{idx}/joint{}", joint.joint_idx + 1);
            let mut rng = stream(SEED, &label);
            for (torque, z) in joint.values.iter_mut().zip(normals(&mut rng)) {
                *torque += noise_std * z;
            }
        }
        let has = lesson.has(*noise_std);
        has.then(|| learn(&noisy)).transpose()
    };
    noises.map(of_noise).collect()
}

impl Place {
    /// The trials of all 15 loads, with every noise that there is a model for; no model is told of the noise.
    fn trials_of_shared(
        &self,
        models: &[Option<Arc<ParameterPosterior>>],
        data: &DataSet,
        settings: &Settings,
    ) -> Result<Vec<Trial>, BenchError> {
        let mut trials = self.empty(0, settings);
        trials.retain(|trial| models[trial.noise_idx].is_some());
        for trial in &mut trials {
            let Some(posterior) = &models[trial.noise_idx] else {
                continue;
            };
            let mut samples = shared::samples(data, &[(trial.load, self.rows.as_slice())]);
            for joint in &mut samples.torques {
                self.add_noise(trial, joint.joint_idx, settings, &mut joint.values);
            }
            for (evidence, count) in trial.by_count.iter_mut().zip(&settings.counts) {
                let first: Vec<usize> = (0..*count).collect();
                let found = posterior.load_evidence(&samples.rows(&first))?;
                *evidence = Evidence {
                    known: found.of_contexts,
                    novel: found.of_unknown,
                };
            }
        }
        Ok(trials)
    }
}

/// Shares of trials with some noise and number of samples.
struct Shares {
    /// Known loads that are the best known one.
    right: f64,
    /// Known loads that an unknown one explains better than all known ones.
    false_alarms: f64,
    /// The same of the load that is not known.
    detected: f64,
}

impl Shares {
    fn of(trials: &[Trial], noise_idx: usize, count_idx: usize) -> Self {
        let is_in = |trial: &Trial| trial.noise_idx == noise_idx;
        let alarms = |is_known: bool| {
            let of_kind = trials.iter().filter(|trial| {
                is_in(trial) && (trial.load <= trial.by_count[count_idx].known.len()) == is_known
            });
            let surprises: Vec<bool> = of_kind
                .map(|trial| trial.by_count[count_idx].surprise() > 0.0)
                .collect();
            let n_alarms = surprises.iter().filter(|is_alarm| **is_alarm).count();
            n_alarms as f64 / surprises.len() as f64
        };
        Self {
            right: Confusion::of(trials, count_idx, is_in).accuracy(),
            false_alarms: alarms(true),
            detected: alarms(false),
        }
    }
}

/// CSV file, and a finding for each noise and lesson.
pub fn report(all: &[OfLesson], settings: &Settings, section: &mut Section) {
    let mut numbers = Vec::new();
    for (lesson, trials) in all {
        numbers.extend(found(*lesson, trials, settings, section));
    }
    let header = "model,torque_noise,count,right,false_alarms,detected";
    section.file("context_shared.csv", csv(header, numbers));
}

/// The findings of a lesson, and its lines of the file.
fn found(
    lesson: Lesson,
    trials: &[Trial],
    settings: &Settings,
    section: &mut Section,
) -> Vec<(Vec<String>, Vec<f64>)> {
    let mut numbers = Vec::new();
    let noises = settings.torque_noise.iter().enumerate();
    for (noise_idx, noise) in noises.filter(|(_, noise)| lesson.has(**noise)) {
        let counts = settings.counts.iter().enumerate();
        let shares: Vec<(usize, Shares)> = counts
            .map(|(idx, count)| (*count, Shares::of(trials, noise_idx, idx)))
            .collect();
        let listed = |of: fn(&Shares) -> f64| {
            let shares = shares.iter();
            let all: Vec<String> = shares
                .map(|(count, shares)| format!("{count}: {}", percent(of(shares))))
                .collect();
            all.join(", ")
        };
        section.found(
            format!(
                "{} {}: the right load, a known load taken for an unknown one, and c15 for one, by consecutive samples, noise {noise} N·m",
                Terms::Chosen.name(),
                lesson.name()
            ),
            format!(
                "right {}; false alarms {}; c15 {}",
                listed(|shares| shares.right),
                listed(|shares| shares.false_alarms),
                listed(|shares| shares.detected)
            ),
        );
        numbers.extend(shares.iter().map(|(count, shares)| {
            let labels = vec![
                lesson.name().to_string(),
                noise.to_string(),
                count.to_string(),
            ];
            (
                labels,
                vec![shares.right, shares.false_alarms, shares.detected],
            )
        }));
    }
    numbers
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::split::UNIQUE;

    #[test]
    fn ten_samples_tell_four_loads_apart_and_from_another_as_a_user_is_told() {
        let data = DataSet::simulate(&(1..=15).collect::<BTreeSet<usize>>()).unwrap();
        let rows: Vec<usize> = (0..60).map(|i| 1_051 * i).collect();
        let loads: Vec<(usize, &[usize])> = (1..=4).map(|load| (load, &rows[..])).collect();
        let model = Terms::Signs.learn(&shared::samples(&data, &loads)).unwrap();
        let posterior = model.rigid_body().unwrap();
        let models = [Some(Arc::clone(posterior))];
        let settings = Settings {
            n_total: 0,
            held_out: Vec::new(),
            tested: vec![UNIQUE[8]],
            places: 1,
            counts: vec![1, 10],
            torque_noise: vec![0.0],
            level: 0.05,
            windows: Vec::new(),
            switching_rate: 0.5,
            switch_noise: 0.0,
            switch_places: 0,
        };
        let place = &Place::all(Layout::Consecutive, &settings.tested, &settings)[0];
        let trials = place.trials_of_shared(&models, &data, &settings).unwrap();
        assert_eq!(trials.len(), 15);
        for trial in &trials {
            let evidence = &trial.by_count[1];
            let is_known = trial.load <= 4;
            assert_eq!(evidence.surprise() < 0.0, is_known, "{trial:?}");
            assert!(!is_known || evidence.best() == trial.load - 1, "{trial:?}");
            let of_user = shared::samples(&data, &[(trial.load, &place.rows[..10])]);
            let of_user = posterior.load_evidence(&of_user).unwrap();
            assert_eq!(
                (&evidence.known, evidence.novel.to_bits()),
                (&of_user.of_contexts, of_user.of_unknown.to_bits())
            );
        }
    }
}
