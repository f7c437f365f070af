//! Learning in a unit of the torques' own size, so that it does not matter in which unit they are given.

use gp_core::search::FitReport;
use gp_core::{LikelihoodOptions, Posterior};
use kernels::{KernelError, TorqueCovariance};
use mtgp::MultiTaskCovariance;

use crate::error::TorqueError;
use crate::joint_model::JointModel;
use crate::learn::candidate::{Candidate, TaskCandidate};
use crate::learn::learner::Learn;
use crate::parts::RankSelection;
use crate::process::Process;
use crate::samples::{JointTorques, Samples};

/// Standard deviation of the torques in their own unit.
///
/// The bounds of sec. 3 are then σ ≥ 2·10⁻⁴ of it, and u ≤ 2 of it for a unit of the covariate.
const SPREAD: f64 = 50.0;

/// A spread below this part of the largest torque is rounding.
const CONSTANT: f64 = 1e-12;

/// Smallest and largest unit, N·m, so that squares of hyperparameters are in the range of double precision.
const UNITS: [f64; 2] = [1e-120, 1e120];

// DEVIATION(sec. 3): the chapter's bounds, σ² ≥ 10⁻⁴ N²·m² and u ≤ 100, are for torques of an arm's size.
/// A learner of processes that sees torques in a unit of their own size.
///
/// ```text
/// s = std t / 50;   t/s is learned;   b, u, v, w, σ times s;   log p less n log s
/// ```
/// A Gaussian process is equivariant under the scale of its targets; bounds and starts are not.
/// With torques times a power of two the hyperparameters are, to the bit, those times it.
#[derive(Debug, Clone, PartialEq)]
pub struct InOwnUnit<L> {
    /// Who learns.
    pub learner: L,
    /// How the process of one context is conditioned on the torques as they are.
    pub likelihood: LikelihoodOptions,
}

impl<L: Learn> Learn for InOwnUnit<L> {
    fn name(&self) -> String {
        self.learner.name()
    }

    fn is_of_many_contexts(&self) -> bool {
        self.learner.is_of_many_contexts()
    }

    fn candidates(
        &self,
        samples: &Samples,
        joint: &JointTorques,
        tell: &mut dyn FnMut(&str),
    ) -> Result<Vec<Candidate>, TorqueError> {
        let unit = own_unit(&joint.values);
        let in_unit = JointTorques {
            joint_idx: joint.joint_idx,
            values: joint.values.iter().map(|torque| torque / unit).collect(),
        };
        let candidates = self.learner.candidates(samples, &in_unit, tell)?;
        let back = |candidate| self.in_newton_metres(candidate, unit, samples, joint);
        candidates.into_iter().map(back).collect()
    }

    fn choose(
        &self,
        samples: &Samples,
        of_joints: &[(&JointTorques, Vec<Candidate>)],
    ) -> Result<(usize, Option<RankSelection>), TorqueError> {
        self.learner.choose(samples, of_joints)
    }

    fn finish(
        &self,
        samples: &Samples,
        joint: &JointTorques,
        candidate: Candidate,
    ) -> Result<JointModel, TorqueError> {
        self.learner.finish(samples, joint, candidate)
    }
}

impl<L> InOwnUnit<L> {
    fn in_newton_metres(
        &self,
        candidate: Candidate,
        unit: f64,
        samples: &Samples,
        joint: &JointTorques,
    ) -> Result<Candidate, TorqueError> {
        match candidate {
            Candidate::Tasks(task) => Ok(Candidate::Tasks(Box::new(task.in_unit(unit)?))),
            Candidate::Model(model) => match *model {
                JointModel::Process(process) => {
                    let Process {
                        posterior,
                        rows,
                        mut summary,
                    } = *process;
                    summary.log_marginal -= joint.values.len() as f64 * unit.ln();
                    let covariance = in_unit(posterior.covariance(), unit)?;
                    let noise_std = unit * posterior.noise_std();
                    drop(posterior);
                    let (x, torques) = (samples.x.as_ref(), &joint.values);
                    let posterior =
                        Posterior::new(covariance, noise_std, x, torques, self.likelihood)?;
                    let process = Process {
                        posterior,
                        rows,
                        summary,
                    };
                    Ok(JointModel::Process(Box::new(process)).into())
                }
                other => Err(TorqueError::OtherKind {
                    what: format!("{} has no unit of its own", other.name()),
                }),
            },
        }
    }
}

impl TaskCandidate {
    fn in_unit(self, unit: f64) -> Result<Self, KernelError> {
        let input = in_unit(self.covariance.input(), unit)?;
        Ok(Self {
            covariance: MultiTaskCovariance::new(input, self.covariance.task().clone()),
            noise_std: unit * self.noise_std,
            report: report_in_unit(self.report, unit),
        })
    }
}

/// The unit of some torques, N·m: a fiftieth of their standard deviation, or of their size if they are all equal; 1 for
/// none but zeros.
pub fn own_unit(torques: &[f64]) -> f64 {
    let largest = torques.iter().fold(0.0, |most: f64, t| most.max(t.abs()));
    if !largest.is_finite() || largest < f64::MIN_POSITIVE {
        return 1.0;
    }
    let n = torques.len() as f64;
    let mean = torques.iter().map(|t| t / largest).sum::<f64>() / n;
    let squares = torques.iter().map(|t| (t / largest - mean).powi(2));
    let spread = (squares.sum::<f64>() / n).sqrt();
    let part = if spread > CONSTANT { spread } else { 1.0 };
    (largest * part / SPREAD).clamp(UNITS[0], UNITS[1])
}

/// The covariance of torques `unit` times as large.
fn in_unit(covariance: &TorqueCovariance, unit: f64) -> Result<TorqueCovariance, KernelError> {
    let mut params = covariance.named_params();
    params.bias_std *= unit;
    params.signal_std *= unit;
    let weights = (params.linear_std.iter_mut()).chain(params.coulomb_std.iter_mut().flatten());
    weights.for_each(|weight| *weight *= unit);
    covariance.with_params(params)
}

/// The report with the likelihoods of densities per N·m.
fn report_in_unit(mut report: FitReport, unit: f64) -> FitReport {
    for stage in &mut report.stages {
        let change = stage.n_samples as f64 * unit.ln();
        for start in &mut stage.starts {
            start.log_marginal -= change;
            start.initial_log_marginal = start.initial_log_marginal.map(|log| log - change);
        }
    }
    let n_samples = report.stages.last().map_or(0, |stage| stage.n_samples);
    report.log_marginal -= n_samples as f64 * unit.ln();
    report
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "powers of two are exact")]
mod tests {
    use super::own_unit;

    #[test]
    fn the_unit_is_a_part_of_the_spread_and_follows_it_to_the_bit() {
        let torques = [1000.0, 1040.0, 1080.0];
        // Population standard deviation of three numbers 40 apart: 40 √(2/3).
        let expected = 40.0 * (2.0_f64 / 3.0).sqrt() / 50.0;
        let unit = own_unit(&torques);
        assert!((unit / expected - 1.0).abs() <= 1e-12, "{unit} {expected}");
        for factor in [2.0_f64.powi(-200), 0.125, 4.0, 2.0_f64.powi(300)] {
            assert_eq!(own_unit(&torques.map(|t| factor * t)), factor * unit);
        }
    }

    #[test]
    fn torques_without_a_spread_have_a_unit_too() {
        assert_eq!(own_unit(&[0.0; 3]), 1.0);
        assert_eq!(own_unit(&[-100.0; 3]), 2.0);
    }
}
