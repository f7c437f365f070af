//! Trials with rbd of all joints: which load it is, and whether it is any of them, by the evidence of `torque-gp context`.

use torque_model::rigid_body::ParameterPosterior;

use super::confusion::percent;
use super::counts::Confusion;
use super::settings::Settings;
use super::trials::{Evidence, Layout, Place, Trial};
use crate::data_figures::section::{Section, csv};
use crate::dataset::DataSet;
use crate::error::BenchError;
use crate::rigid_body::{Terms, shared};
use crate::section_experiment::SectionExperiment;
use crate::section5::campaign::Campaign;
use crate::section5::part::Task;
use crate::section5::training_set::TrainingSet;
use crate::spec::Profile;

/// Consecutive samples at the first places on each trajectory: evidence of all joints takes a tenth of a second.
///
/// # Errors
/// `Experiment`, `Model`.
pub fn trials(
    experiment: &SectionExperiment,
    campaign: &Campaign,
    set: &TrainingSet,
    settings: &Settings,
) -> Result<Option<Vec<Trial>>, BenchError> {
    let n_places = match campaign.profile {
        Profile::Smoke => 1,
        Profile::Full => 4,
    };
    let places = Place::all(Layout::Consecutive, &settings.tested, settings).into_iter();
    let places: Vec<Task<Place>> = places
        .filter(|place| place.number < n_places)
        .map(|place| {
            Task::new(
                format!("{}, {}", Terms::Chosen.name(), place.label()),
                place,
            )
        })
        .collect();
    let trials: Option<Vec<Vec<Trial>>> = campaign.parts(
        experiment,
        &places,
        |bench| Ok((bench, bench.shared(Terms::Chosen, set)?)),
        |(bench, model), place| {
            let posterior = shared::joint_of(model, 1).posterior();
            place.trials_of_shared(posterior, &bench.data, settings)
        },
    )?;
    Ok(trials.map(|trials| trials.concat()))
}

impl Place {
    /// The trials of all 15 loads and all noises; the model is not told of the noise.
    fn trials_of_shared(
        &self,
        posterior: &ParameterPosterior,
        data: &DataSet,
        settings: &Settings,
    ) -> Result<Vec<Trial>, BenchError> {
        let mut trials = self.empty(posterior.n_contexts(), settings);
        for trial in &mut trials {
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

/// CSV file, and a finding for each noise.
pub fn report(trials: &[Trial], settings: &Settings, section: &mut Section) {
    let mut numbers = Vec::new();
    for (noise_idx, noise) in settings.torque_noise.iter().enumerate() {
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
                "{}: the right load, a known load taken for an unknown one, and c15 for one, by consecutive samples, noise {noise} N·m that the model is not told of",
                Terms::Chosen.name()
            ),
            format!(
                "right {}; false alarms {}; c15 {}",
                listed(|shares| shares.right),
                listed(|shares| shares.false_alarms),
                listed(|shares| shares.detected)
            ),
        );
        numbers.extend(shares.iter().map(|(count, shares)| {
            let labels = vec![noise.to_string(), count.to_string()];
            (
                labels,
                vec![shares.right, shares.false_alarms, shares.detected],
            )
        }));
    }
    let header = "torque_noise,count,right,false_alarms,detected";
    section.file("context_shared.csv", csv(header, numbers));
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
        let trials = place.trials_of_shared(posterior, &data, &settings).unwrap();
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
