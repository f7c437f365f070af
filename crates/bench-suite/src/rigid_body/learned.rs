//! rbd and rbd+gp of one joint: under one load, or under many that share the arm.

use faer::Mat;
use gp_core::fit::{ParameterPrior, RegressorSamples};
use gp_core::{Fit, FitOptions, Starts};
use kernels::Covariance;
use puma_dyn::Scenario;
use puma_dyn::dynamics::N_PARAMETERS;
use torque_model::learn::{InformedJoint, RigidBodyForm};

use super::parameters::{self, Knowledge};
use super::rows::{self, States};
use crate::error::BenchError;
use crate::fit_summary::{FitSummary, StartSummary};

/// Rows that are predicted at a time.
const BLOCK: usize = 4000;

/// What is known of one joint of the arm before any torque is measured.
#[derive(Debug, Clone)]
pub enum JointModel {
    /// The arm with one load, which the last link's parameters are of: as `torque-gp fit` learns it.
    OfOneLoad {
        /// From 1.
        joint: usize,
        /// What the model of the arm gets right.
        knowledge: Knowledge,
    },
    /// The arm with any of several loads, of which the samples say which, with parameters of their own.
    OfLoads {
        /// In the columns of [`rows::columns`], then ten for each load.
        prior: ParameterPrior,
        /// How many.
        n_loads: usize,
    },
}

impl JointModel {
    /// The arm with one load; joint from 1.
    pub fn of_one_load(joint: usize, knowledge: Knowledge) -> Self {
        Self::OfOneLoad { joint, knowledge }
    }

    /// The arm with any of several loads; joint from 1.
    pub fn of_loads(joint: usize, knowledge: Knowledge, n_loads: usize) -> Self {
        let model = Scenario::reference();
        Self::OfLoads {
            prior: parameters::of_arm_and_loads(model.model(), joint, knowledge, n_loads),
            n_loads,
        }
    }

    /// Learns it from samples, each under the load of its number, from 0; none where there is one load.
    ///
    /// The process is searched for from the start of eq. (22) alone.
    /// # Shapes
    /// `states` n of them; `targets` (n,), N·m; `loads` (n,) or empty.
    /// # Errors
    /// `Fit`.
    /// # Panics
    /// If the loads are not one a sample where there are several, or the states are another joint's.
    pub fn fit(
        self,
        form: RigidBodyForm,
        states: &States,
        targets: &[f64],
        loads: &[usize],
    ) -> Result<RigidBodyFit, BenchError> {
        let options = FitOptions {
            starts: Starts::Chapter,
            ..FitOptions::several()
        };
        let x = states.x.as_ref();
        let of = |regressor| RegressorSamples {
            x,
            regressor,
            targets,
        };
        let (fit, parameters) = match self {
            Self::OfOneLoad { joint, knowledge } => {
                let learner = parameters::learner(knowledge, form, options);
                let regressor = rows::of_all_parameters(joint, &states.arm);
                let fit = learner.fit(joint - 1, of(regressor.as_ref()))?;
                let all = fit.parameter_mean()?;
                let columns = rows::columns(Scenario::reference().model(), joint);
                (fit, columns.iter().map(|&column| all[column]).collect())
            }
            Self::OfLoads { prior, n_loads } => {
                let regressor = rows::with_loads(&states.arm, loads, n_loads);
                let samples = of(regressor.as_ref());
                let fit = InformedJoint::learn(form, &prior, samples, &options)?;
                let parameters = fit.parameter_mean()?;
                (fit, parameters)
            }
        };
        let (of_arm, of_loads) = parameters.split_at(states.arm.ncols());
        Ok(RigidBodyFit {
            of_arm: of_arm.to_vec(),
            of_loads: of_loads.to_vec(),
            n_samples: targets.len(),
            fit,
        })
    }
}

/// A joint's torque, learned.
pub struct RigidBodyFit {
    /// Posterior means of the arm's parameters, in the columns of [`rows::columns`].
    of_arm: Vec<f64>,
    /// Of what each load adds to the last link's, ten a load; empty where there is one load.
    of_loads: Vec<f64>,
    n_samples: usize,
    fit: InformedJoint,
}

impl RigidBodyFit {
    /// Torques at states, of the one load, or without any of several, N·m.
    ///
    /// ```text
    /// Y(x) E[π] + E[f(x)]
    /// ```
    /// # Errors
    /// `Fit` if the states are not finite.
    pub fn predict_mean(&self, states: &States) -> Result<Vec<f64>, BenchError> {
        let n = states.x.nrows();
        let mut means = product(&states.arm, 0, &self.of_arm);
        if let InformedJoint::WithProcess(fit) = &self.fit {
            for first in (0..n).step_by(BLOCK) {
                let count = BLOCK.min(n - first);
                let process = fit.process_mean(states.x.as_ref().subrows(first, count))?;
                add(&mut means[first..first + count], &process);
            }
        }
        Ok(means)
    }

    /// Torques at states under each of several loads, (n, m), N·m.
    ///
    /// # Errors
    /// `Fit` if the states are not finite.
    pub fn predict_mean_of_loads(&self, states: &States) -> Result<Mat<f64>, BenchError> {
        let without_load = self.predict_mean(states)?;
        let last = rows::last_link(&states.arm);
        let mut means = Mat::zeros(states.x.nrows(), self.of_loads.len() / N_PARAMETERS);
        for (load, parameters) in self.of_loads.chunks_exact(N_PARAMETERS).enumerate() {
            let of_load = means.col_as_slice_mut(load);
            of_load.copy_from_slice(&without_load);
            add(of_load, &product(&states.arm, last, parameters));
        }
        Ok(means)
    }

    /// σ, N·m.
    pub fn noise_std(&self) -> f64 {
        match &self.fit {
            InformedJoint::Alone(fit) => fit.fit.posterior.noise_std(),
            InformedJoint::WithProcess(fit) => fit.fit.posterior.noise_std(),
        }
    }

    /// What the optimiser reported.
    pub fn summary(&self) -> FitSummary {
        match &self.fit {
            InformedJoint::Alone(fit) => summary_of(&fit.fit, "prior", self.n_samples),
            InformedJoint::WithProcess(fit) => summary_of(&fit.fit, "eq22", self.n_samples),
        }
    }
}

/// Columns of the arm's regressor, from `first` on, times parameters.
fn product(arm: &Mat<f64>, first: usize, parameters: &[f64]) -> Vec<f64> {
    let mut torques = vec![0.0; arm.nrows()];
    for (idx, parameter) in parameters.iter().enumerate() {
        for (torque, y) in torques.iter_mut().zip(arm.col_as_slice(first + idx)) {
            *torque += y * parameter;
        }
    }
    torques
}

fn add(values: &mut [f64], others: &[f64]) {
    for (value, other) in values.iter_mut().zip(others) {
        *value += other;
    }
}

/// Summary of a fit that set out from a start of the name given.
fn summary_of<C: Covariance>(fit: &Fit<C>, name: &str, n_samples: usize) -> FitSummary {
    let search = fit.report.winning_start();
    let hyperparameters = fit.covariance().params();
    FitSummary {
        log_marginal_likelihood: search.log_marginal,
        start: name.to_string(),
        recoveries: search.recoveries,
        starts: vec![StartSummary {
            name: name.to_string(),
            ..StartSummary::of(search, n_samples)
        }],
        ..FitSummary::of(&fit.report, fit.noise_std(), hyperparameters)
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use torque_model::{JointTorques, Provenance, RobotModel, Samples};

    use super::*;
    use crate::dataset::{DataSet, N_JOINTS};

    #[test]
    fn one_load_is_learned_as_a_user_has_it() {
        let (load, joint) = (7, 3);
        let data = DataSet::simulate(&BTreeSet::from([load])).unwrap();
        let rows: Vec<usize> = (0..24).map(|i| 2_600 * i).collect();
        let (x, values) = (data.x(&rows), data.torques(load, joint, &rows));
        let states = States::of(joint, x.as_ref());
        for form in RigidBodyForm::ALL {
            let model = JointModel::of_one_load(joint, Knowledge::Nominal);
            let fit = model.fit(form, &states, &values, &[]).unwrap();

            let options = FitOptions {
                starts: Starts::Chapter,
                ..FitOptions::several()
            };
            let learner = parameters::learner(Knowledge::Nominal, form, options);
            let names = (1..=N_JOINTS).map(|i| format!("joint{i}")).collect();
            let torques = vec![JointTorques {
                joint_idx: joint - 1,
                values: values.clone(),
            }];
            let samples = Samples::of_one_context(names, x.clone(), torques).unwrap();
            let provenance = Provenance::new("test", b"");
            let model = RobotModel::learn(&samples, &learner, provenance).unwrap();

            let (_, joint_model) = &model.learned()[0];
            let (found, expected) = (joint_model.summary().unwrap(), fit.summary());
            assert_eq!(
                found.log_marginal.to_bits(),
                expected.log_marginal_likelihood.to_bits()
            );
            let of_model = model.predict_joint(0, 0, x.as_ref()).unwrap().mean;
            let of_fit = fit.predict_mean(&states).unwrap();
            // Torques of up to 100 N·m, of which the experiment adds rigid body and process by themselves.
            for (found, expected) in of_model.iter().zip(of_fit) {
                assert!((found - expected).abs() < 1e-7, "{found} {expected}");
            }
        }
    }
}
