//! Trials: new torques under one load, and what each known load's density says of them.

use mtgp::MtgpError;
use mtgp::latent::LatentFunctions;
use mtgp::novel::RowPopulation;
use serde::{Deserialize, Serialize};
use torque_model::{RobotModel, TaskProcess};

use super::settings::Settings;
use crate::dataset::{DataSet, N_JOINTS};
use crate::error::BenchError;
use crate::section5::normal::normals;
use crate::seed::{sample_indices, stream};
use crate::split::{N_SAMPLES, TrajectoryId, UNIQUE};

/// Seed of places and noise.
pub const SEED: &str = "context-estimation";

/// How the samples of a trial lie on the trajectory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Layout {
    /// One after another in time.
    Consecutive,
    /// Anywhere on one round.
    Scattered,
}

impl Layout {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Consecutive, Self::Scattered];

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Consecutive => "consecutive",
            Self::Scattered => "scattered",
        }
    }
}

/// The states of trials, which all loads and noises share.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Place {
    pub layout: Layout,
    pub trajectory: TrajectoryId,
    /// Which place on this trajectory, from 0.
    pub number: usize,
    /// Rows of the data set, as many as the longest trial has samples.
    pub(super) rows: Vec<usize>,
}

/// The torques of one load at a place with one noise.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trial {
    pub layout: Layout,
    pub trajectory: TrajectoryId,
    pub place: usize,
    /// From 1.
    pub load: usize,
    /// Which of the noises.
    pub noise_idx: usize,
    /// What its first samples say, for each of the counts.
    pub by_count: Vec<Evidence>,
}

/// Natural logarithms of densities of some torques of all joints.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// Under each known load, (m,).
    pub known: Vec<f64>,
    /// Under a load drawn like the known ones.
    pub novel: f64,
}

impl Evidence {
    /// The known load of the highest density, from 0.
    pub fn best(&self) -> usize {
        let mut best = 0;
        for (load, value) in self.known.iter().enumerate() {
            if *value > self.known[best] {
                best = load;
            }
        }
        best
    }

    /// How much better a load like the known ones explains the torques than the best known one.
    pub fn surprise(&self) -> f64 {
        self.novel - self.known[self.best()]
    }
}

impl Place {
    /// All places of a layout.
    pub fn all(layout: Layout, tested: &[TrajectoryId], settings: &Settings) -> Vec<Self> {
        let most = settings.most();
        let of_one = |&trajectory: &TrajectoryId| {
            let first_row = trajectory.rows().start;
            let place = move |number: usize| {
                let label = format!("{}/{first_row}/{number}", layout.name());
                let mut rng = stream(SEED, &label);
                let offsets = match layout {
                    Layout::Consecutive => {
                        let start = sample_indices(&mut rng, N_SAMPLES - most, 1)[0];
                        (start..start + most).collect()
                    }
                    Layout::Scattered => sample_indices(&mut rng, N_SAMPLES, most),
                };
                let rows = offsets.into_iter().map(|offset| first_row + offset);
                Self {
                    layout,
                    trajectory,
                    number,
                    rows: rows.collect(),
                }
            };
            (0..settings.places).map(place)
        };
        tested.iter().flat_map(of_one).collect()
    }

    /// What tells it from other places.
    pub fn label(&self) -> String {
        let (layout, number) = (self.layout.name(), self.number);
        format!("{layout} samples on {}, place {number}", self.trajectory)
    }

    /// The trials of all 15 loads and all noises.
    ///
    /// # Errors
    /// `MultiTask` if a density overflows.
    pub fn trials(
        &self,
        model: &RobotModel,
        data: &DataSet,
        settings: &Settings,
    ) -> Result<Vec<Trial>, BenchError> {
        let m = model.contexts().len();
        let mut trials = self.empty(m, settings);
        for (joint_idx, process) in model.tasks() {
            let densities = Densities::at(self, process, data, settings)?;
            for trial in &mut trials {
                let mut torques = data.torques(trial.load, joint_idx + 1, &self.rows);
                self.add_noise(trial, joint_idx, settings, &mut torques);
                densities.add_to(trial, &torques, settings)?;
            }
        }
        Ok(trials)
    }

    /// The trials of all 15 loads and all noises, without what the torques say.
    pub(super) fn empty(&self, n_known: usize, settings: &Settings) -> Vec<Trial> {
        let nothing = Evidence {
            known: vec![0.0; n_known],
            novel: 0.0,
        };
        let noises = 0..settings.torque_noise.len();
        let of_noise = |noise_idx| {
            let nothing = nothing.clone();
            (1..=UNIQUE.len()).map(move |load| Trial {
                layout: self.layout,
                trajectory: self.trajectory,
                place: self.number,
                load,
                noise_idx,
                by_count: vec![nothing.clone(); settings.counts.len()],
            })
        };
        noises.flat_map(of_noise).collect()
    }

    /// Adds the trial's noise; each trial and joint has a stream of its own.
    pub(super) fn add_noise(
        &self,
        trial: &Trial,
        joint_idx: usize,
        settings: &Settings,
        torques: &mut [f64],
    ) {
        let noise_std = settings.torque_noise[trial.noise_idx];
        let label = format!(
            "noise{}/{}/{}/{}/c{}/joint{}",
            trial.noise_idx,
            self.layout.name(),
            self.trajectory.rows().start,
            self.number,
            trial.load,
            joint_idx % N_JOINTS + 1
        );
        let mut rng = stream(SEED, &label);
        for (torque, z) in torques.iter_mut().zip(normals(&mut rng)) {
            *torque += noise_std * z;
        }
    }
}

/// One joint's densities at a place, for every noise: those of the known loads, then that of a novel one.
struct Densities(Vec<Vec<mtgp::latent::PredictiveDensity>>);

impl Densities {
    fn at(
        place: &Place,
        process: &TaskProcess,
        data: &DataSet,
        settings: &Settings,
    ) -> Result<Self, MtgpError> {
        let x = data.x(&place.rows);
        let latent = LatentFunctions::new(&process.posterior, x.as_ref())?;
        let rows = process.covariance().task().rows();
        let population = RowPopulation::of(&rows)?;
        let of_noise = |&noise_std: &f64| {
            let known = rows
                .iter()
                .map(|row| latent.density_with_noise(row, noise_std));
            let novel = std::iter::once_with(|| population.density(&latent, noise_std));
            known.chain(novel).collect()
        };
        let all: Result<_, MtgpError> = settings.torque_noise.iter().map(of_noise).collect();
        all.map(Self)
    }

    fn add_to(
        &self,
        trial: &mut Trial,
        torques: &[f64],
        settings: &Settings,
    ) -> Result<(), MtgpError> {
        let densities = &self.0[trial.noise_idx];
        for (hypothesis, density) in densities.iter().enumerate() {
            let running = density.running_log_densities(torques)?;
            for (evidence, count) in trial.by_count.iter_mut().zip(&settings.counts) {
                let value = running[count - 1].0;
                match evidence.known.get_mut(hypothesis) {
                    Some(known) => *known += value,
                    None => evidence.novel += value,
                }
            }
        }
        Ok(())
    }
}
