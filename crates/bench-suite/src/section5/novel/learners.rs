//! What can be done with a few samples of a new load.

use std::time::Instant;

use gp_core::optimize::MinimizeOptions;
use mtgp::context::{ContextPrior, JointTorques, WithTorqueNoise, context_evidence};
use mtgp::latent::LatentFunctions;
use mtgp::novel::{Border, NewTorques, fit_row_from_population, predict_mean_of_new_context};
use serde::{Deserialize, Serialize};
use torque_model::{Adapt, RobotModel, TaskProcess, TorqueFunction, adapt_joint};

use super::case::{Case, Samples, Test};
use super::physics::LoadRegression;
use crate::cell::ModelKind;
use crate::error::BenchError;
use crate::metrics::nmse;
use crate::models::Fitted;
use crate::rigid_body::Terms;
use crate::section5::trained::{Trained, process_of};

/// Known rows that a search for the new one sets out from, beside least squares.
const N_NEAREST: usize = 1;

/// A way to learn the new load.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Learner {
    /// The row with the known rows as a prior, and the new torques conditioned on.
    Mgp,
    /// The same row; the posterior of the old data alone.
    RowOnly,
    /// As the first, with a function that no mixture of the known loads' has.
    OwnFunction,
    /// As the first, with the row of maximum likelihood.
    NoPrior,
    /// GPc of the new samples alone.
    Alone,
    /// pGP with the new samples among its own.
    Pooled,
    /// The known load that eq. (21) says.
    Nearest,
    /// rbd of the known loads, whose arm and friction are learned, given the new torques.
    Shared,
    /// The same with signs for friction, as the arm is simulated.
    SharedSigns,
    /// Ten inertial parameters, all else known.
    Physics,
}

impl Learner {
    /// All, in the order of the tables.
    pub const ALL: [Self; 10] = [
        Self::Mgp,
        Self::RowOnly,
        Self::OwnFunction,
        Self::NoPrior,
        Self::Alone,
        Self::Pooled,
        Self::Nearest,
        Self::Shared,
        Self::SharedSigns,
        Self::Physics,
    ];

    /// Name in tables and pictures.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mgp => "mGP",
            Self::RowOnly => "mGP, row only",
            Self::OwnFunction => "mGP, own function",
            Self::NoPrior => "mGP, no prior",
            Self::Alone => "GPc",
            Self::Pooled => "pGP",
            Self::Nearest => "nearest",
            Self::Shared => Terms::Chosen.name(),
            Self::SharedSigns => Terms::Signs.name(),
            Self::Physics => "physics",
        }
    }
}

/// nMSE of one joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Score {
    pub learner: Learner,
    pub draw: usize,
    pub noise_idx: usize,
    pub count: usize,
    /// From 1.
    pub joint: usize,
    pub nmse: f64,
    /// Wall-clock seconds of learning this joint, mGP and rbd alone; not reproducible.
    pub seconds: f64,
}

/// The known models and the test.
pub struct Learners<'a> {
    pub trained: &'a Trained,
    pub physics: &'a LoadRegression,
    pub test: &'a Test,
}

impl Learners<'_> {
    /// Scores of all joints and of all learners but those of [`super::shared`]; a learner that cannot learn from so few has none.
    ///
    /// # Errors
    /// `MultiTask` or `Fit` if an adaptation fails, `Decomposition`, those of [`nmse`].
    pub fn scores(&self, samples: &Samples, case: Case) -> Result<Vec<Score>, BenchError> {
        let mut scores = Vec::new();
        let nearest = nearest(&self.trained.mgp, samples)?;
        let parameters = LoadRegression::new(samples.x.as_ref())
            .parameters(&samples.torques, samples.noise_std)?;
        for joint_idx in 0..samples.torques.len() {
            let mut add = |learner, mean: Vec<f64>, seconds| {
                let nmse = nmse(&mean, &self.test.torques[joint_idx])?;
                scores.push(Score {
                    learner,
                    draw: case.draw,
                    noise_idx: case.noise_idx,
                    count: case.count,
                    joint: joint_idx + 1,
                    // An exact prediction still has a place on a logarithmic axis.
                    nmse: nmse.max(f64::MIN_POSITIVE),
                    seconds,
                });
                Ok::<(), BenchError>(())
            };
            for (learner, mean, seconds) in self.adapted(samples, joint_idx)? {
                add(learner, mean, seconds)?;
            }
            if let Some(mean) = self.alone(samples, joint_idx) {
                add(Learner::Alone, mean, 0.0)?;
            }
            add(Learner::Pooled, self.pooled(samples, joint_idx)?, 0.0)?;
            add(Learner::Nearest, self.known(joint_idx, nearest)?, 0.0)?;
            let physics = self.physics.predict(joint_idx, &parameters);
            add(Learner::Physics, physics, 0.0)?;
        }
        Ok(scores)
    }

    /// The four ways of the mGP.
    fn adapted(
        &self,
        samples: &Samples,
        joint_idx: usize,
    ) -> Result<[(Learner, Vec<f64>, f64); 4], BenchError> {
        let process = process_of(&self.trained.mgp, joint_idx);
        let (x, torques) = (samples.x.as_ref(), &samples.torques[joint_idx]);
        let new = process.covariance().n_tasks();
        let mean = |how| {
            let grown = adapt_joint(process, x, torques, how)?;
            Ok::<_, BenchError>(grown.predict_mean(new, self.test.x.as_ref())?)
        };
        let start = Instant::now();
        let grown = adapt_joint(process, x, torques, Adapt::default())?;
        let seconds = start.elapsed().as_secs_f64();
        let row_only = Adapt {
            is_row_only: true,
            ..Adapt::default()
        };
        let no_prior = Adapt {
            has_prior: false,
            ..Adapt::default()
        };
        let of_test = grown.predict_mean(new, self.test.x.as_ref())?;
        Ok([
            (Learner::Mgp, of_test, seconds),
            (Learner::RowOnly, mean(row_only)?, 0.0),
            (
                Learner::OwnFunction,
                self.own_function(process, samples, torques)?,
                0.0,
            ),
            (Learner::NoPrior, mean(no_prior)?, 0.0),
        ])
    }

    /// A mixture like the known ones and a function of its own, which no grown Λ can hold.
    fn own_function(
        &self,
        process: &TaskProcess,
        samples: &Samples,
        torques: &[f64],
    ) -> Result<Vec<f64>, BenchError> {
        let latent = LatentFunctions::new(&process.posterior, samples.x.as_ref())?;
        let new = NewTorques {
            latent: &latent,
            torques,
        };
        let known = process.covariance().task().rows();
        let border = Border::WithOwnVariance;
        let fit = fit_row_from_population(&[new], &known, border, N_NEAREST, &row_search())?;
        let (x, test) = (samples.x.as_ref(), self.test.x.as_ref());
        let means = predict_mean_of_new_context(&process.posterior, &fit.row, x, new, test)?;
        Ok(means)
    }

    fn alone(&self, samples: &Samples, joint_idx: usize) -> Option<Vec<f64>> {
        let torques = &samples.torques[joint_idx];
        let fitted = Fitted::fit(ModelKind::GpCoulomb, samples.x.as_ref(), torques).ok()?;
        fitted.predict_mean(self.test.x.as_ref()).ok()
    }

    /// pGP takes all loads for one, so its samples may be anyone's.
    fn pooled(&self, samples: &Samples, joint_idx: usize) -> Result<Vec<f64>, BenchError> {
        let process = process_of(&self.trained.pgp, joint_idx);
        let torques = &samples.torques[joint_idx];
        let grown = process.with_samples(0, samples.x.as_ref(), torques)?;
        Ok(grown.predict_mean(0, self.test.x.as_ref())?)
    }

    fn known(&self, joint_idx: usize, context: usize) -> Result<Vec<f64>, BenchError> {
        let process = process_of(&self.trained.mgp, joint_idx);
        Ok(process.predict_mean(context, self.test.x.as_ref())?)
    }
}

/// How long to search for a row with a function of its own.
fn row_search() -> MinimizeOptions {
    MinimizeOptions {
        gradient_tolerance: 1e-3,
        value_tolerance: 1e-6,
        max_evaluations: 100,
        max_recoveries: 5,
    }
}

/// The known load of the highest density, from 0.
fn nearest(model: &RobotModel, samples: &Samples) -> Result<usize, BenchError> {
    let models: Vec<WithTorqueNoise<'_>> = model
        .tasks()
        .map(|(_, process)| WithTorqueNoise {
            posterior: &process.posterior,
            noise_std: samples.noise_std,
        })
        .collect();
    let joints: Vec<JointTorques<'_>> = (models.iter().zip(&samples.torques))
        .map(|(model, torques)| JointTorques { model, torques })
        .collect();
    let evidence = context_evidence(&joints, samples.x.as_ref())?;
    let prior = ContextPrior::uniform(model.contexts().len())?;
    Ok(evidence.posterior(&prior)?.most_probable())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use torque_model::{JointTorques as Torques, Provenance, adapt};

    use super::*;
    use crate::dataset::{DataSet, N_JOINTS};
    use crate::run::Reuse;
    use crate::section5::trained::Shelf;
    use crate::section5::training_set::TrainingSet;
    use crate::shard::Shard;

    #[test]
    fn a_load_is_adapted_to_as_a_user_does() {
        let (load, joint_idx) = (15, 2);
        let data = DataSet::simulate(&BTreeSet::from([1, 2, 3, 4, load])).unwrap();
        let set = TrainingSet {
            n_contexts: 4,
            n_total: 24,
            held_out: Vec::new(),
        };
        let dir = tempfile::tempdir().unwrap();
        let shelf = Shelf::new(dir.path().into(), Reuse::Scratch, Shard::WHOLE);
        let trained = shelf.trained(&set, &data).unwrap();
        let of = |rows: Vec<usize>| {
            let torques = (1..=N_JOINTS).map(|joint| data.torques(load, joint, &rows));
            (data.x(&rows), torques.collect::<Vec<_>>())
        };
        let (x, torques) = of((0..12).map(|i| 5_000 * i).collect());
        let (test_x, test_torques) = of((0..8).map(|i| 7_777 * i).collect());
        let samples = Samples {
            x: x.clone(),
            torques: torques.clone(),
            noise_std: 0.0,
        };
        let test = Test {
            x: test_x,
            torques: test_torques,
        };
        let learners = Learners {
            trained: &trained,
            physics: &LoadRegression::new(test.x.as_ref()),
            test: &test,
        };
        let [(_, mean, _), (_, of_row, _), ..] = learners.adapted(&samples, joint_idx).unwrap();

        let of_joint = |(joint_idx, values)| Torques { joint_idx, values };
        let of_user = torque_model::Samples::of_one_context(
            trained.mgp.joint_names().to_vec(),
            x,
            torques.into_iter().enumerate().map(of_joint).collect(),
        )
        .unwrap();
        for (is_row_only, expected) in [(false, mean), (true, of_row)] {
            let how = Adapt {
                is_row_only,
                ..Adapt::default()
            };
            let provenance = Provenance::new("test", b"");
            let grown = adapt(&trained.mgp, "c15", &of_user, how, provenance).unwrap();
            let found = grown.predict_joint(joint_idx, 4, test.x.as_ref()).unwrap();
            assert_eq!(found.mean, expected);
        }
    }
}
