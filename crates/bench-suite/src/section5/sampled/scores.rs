//! How well predictive distributions do on held-out torques.

use faer::Mat;
use gp_core::Posterior;
use gp_core::sampling::GaussianMixture;
use mtgp::MultiTaskCovariance;
use mtgp::prior::TaskMatrix;
use serde::{Deserialize, Serialize};

use crate::error::BenchError;
use crate::section5::bench::Bench;
use crate::section5::training_set::{SPLIT_SEED, TrainingSet};
use crate::seed::{sample_indices, stream};
use crate::split::Split;

/// Averages over the torques of a set.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Part of the torques within the central 95 %.
    pub coverage: f64,
    /// Nats per torque.
    pub log_density: f64,
}

/// Held-out torques of one joint: of interp and of extrap, of every load.
pub struct Held {
    /// Inputs and torques by set and load.
    sets: [Vec<(Mat<f64>, Vec<f64>)>; 2],
}

impl Held {
    /// `n_test` torques of every load and set.
    pub fn draw(bench: &Bench, set: &TrainingSet, joint: usize, n_test: usize) -> Self {
        let pick = |load: usize, name: &str, rows: &[usize]| {
            let mut rng = stream(SPLIT_SEED, &format!("sampled/{name}/c{load}"));
            let picked = sample_indices(&mut rng, rows.len(), n_test.min(rows.len()));
            let rows: Vec<usize> = picked.into_iter().map(|i| rows[i]).collect();
            (bench.data.x(&rows), bench.data.torques(load, joint, &rows))
        };
        let mut sets = [const { Vec::new() }; 2];
        for load in 1..=set.n_contexts {
            let split = Split::draw(SPLIT_SEED, load);
            sets[0].push(pick(load, "interp", &split.interp));
            sets[1].push(pick(load, "extrap", &split.extrap));
        }
        Self { sets }
    }

    /// Scores of the mixture of processes on interp and extrap.
    ///
    /// # Errors
    /// `Fit` or `MultiTask`.
    pub fn scores<T: TaskMatrix>(
        &self,
        processes: &[&Posterior<MultiTaskCovariance<T>>],
    ) -> Result<[Scores; 2], BenchError> {
        let [interp, extrap] = &self.sets;
        Ok([of_set(interp, processes)?, of_set(extrap, processes)?])
    }
}

fn of_set<T: TaskMatrix>(
    loads: &[(Mat<f64>, Vec<f64>)],
    processes: &[&Posterior<MultiTaskCovariance<T>>],
) -> Result<Scores, BenchError> {
    let (mut inside, mut log_density, mut count) = (0_u32, 0.0, 0_u32);
    for (task, (x, torques)) in loads.iter().enumerate() {
        let mut means = vec![Vec::new(); torques.len()];
        let mut variances = vec![Vec::new(); torques.len()];
        for process in processes {
            let rows = process.covariance().rows_of(x.as_ref(), task)?;
            let prediction = process.predict(rows.as_ref())?;
            let noise_var = process.noise_std() * process.noise_std();
            for idx in 0..torques.len() {
                means[idx].push(prediction.mean[idx]);
                variances[idx].push(prediction.var[idx] + noise_var);
            }
        }
        let mixtures = means.into_iter().zip(&variances);
        for ((means, variances), torque) in mixtures.zip(torques) {
            let mixture = GaussianMixture::new(means, variances);
            let below = mixture.cdf(*torque);
            inside += u32::from((0.025..=0.975).contains(&below));
            log_density += mixture.log_density(*torque);
            count += 1;
        }
    }
    Ok(Scores {
        coverage: f64::from(inside) / f64::from(count),
        log_density: log_density / f64::from(count),
    })
}
