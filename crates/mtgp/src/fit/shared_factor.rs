//! One K^ρ for all joints: hyperparameters learned over the joints together, inference joint by joint.
//!
//! ```text
//! L(θ_1, σ_1, …, θ_ℓ, σ_ℓ, Λ) = Σ_i log p(t_i | X, θ_i^x, ΛΛᵀ, σ_i)
//! ```
//! It is the case of equal A_i in eq. (13). Λ has as many entries as for one joint, so that
//! eq. (19) counts ½ r (2m + 1 − r) of them once: [`crate::RankCounts::n_params_shared`].
//!
//! Source: sec. 5, first extension.

use faer::{Mat, MatRef};
use gp_core::evidence::{add_prior_information, information};
use gp_core::optimize::{MinimizeOptions, Objective, Rounds, StopReason, minimize_in_metric};
use gp_core::search::Start;
use gp_core::{GpError, LogMarginal, Posterior};
use kernels::{Covariance, Jitter, ParamLayout, TorqueCovariance, TorqueParams};

use super::options::MultiTaskOptions;
use crate::error::{MtgpError, require_count};
use crate::latent::predict_mean_of_all_tasks;
use crate::prior::MultiTaskCovariance;
use crate::prior::Stacked;
use crate::prior::TaskMatrix;
use crate::prior::rank_part;
use crate::prior::{TaskCovariance, TaskFactor};

/// Evaluations of the sum after which the metric of the search is renewed, and the nats that a round must gain.
const ROUNDS: Rounds = Rounds {
    evaluations: 150,
    worth: 0.01,
};

/// All joints of a robot, learned with one K^ρ.
#[derive(Debug, Clone)]
pub struct SharedFit {
    /// The process of every joint, conditioned on its torques; all have the same Λ.
    pub joints: Vec<Posterior<MultiTaskCovariance>>,
    /// log L_i of every joint, natural log.
    pub log_marginals: Vec<f64>,
    /// Σ_i log L_i at the start.
    pub initial_log_marginal: f64,
    /// Evaluations of the sum over the joints with its gradient.
    pub evaluations: usize,
    /// Why the search ended.
    pub stop: StopReason,
}

impl SharedFit {
    /// Posterior means of every task for one joint, from 0, at the rows of `x`, (k, m): see
    /// [`predict_mean_of_all_tasks`].
    ///
    /// # Errors
    /// As there.
    /// # Panics
    /// If there is no such joint.
    pub fn predict_mean_of_all_tasks(
        &self,
        joint_idx: usize,
        x: MatRef<'_, f64>,
    ) -> Result<Mat<f64>, MtgpError> {
        predict_mean_of_all_tasks(&self.joints[joint_idx], x)
    }

    /// Σ_i log L_i, natural log.
    pub fn log_marginal(&self) -> f64 {
        self.log_marginals.iter().sum()
    }

    /// Λ, (m, r).
    pub fn lambda(&self) -> MatRef<'_, f64> {
        match self.joints[0].covariance().task() {
            TaskCovariance::Factor(factor) => factor.lambda(),
            _ => unreachable!("the joints share a factor"),
        }
    }

    /// K^ρ, (m, m).
    pub fn k_task(&self) -> Mat<f64> {
        self.joints[0].covariance().task().k_task()
    }
}

/// Learns one Λ with θ_i^x and σ_i of every joint, from fits of the joints on their own.
///
/// The start is the rank-r part of the average of their K^ρ, each divided by its mean diagonal,
/// which goes into θ_i^x: (a² K^ρ, c^x/a²) is one model.
/// From there the search takes its steps in the metric of the Fisher information, as
/// [`gp_core::search::refine`] does; the information of the joints adds up, as they are independent
/// given the hyperparameters.
/// Sequential and deterministic.
/// # Shapes
/// `targets` of every joint (n,), in the order of the rows of `data`; `starts` one per joint, such as
/// [`super::TaskFit::start`] of a fit of its own.
/// # Errors
/// [`MtgpError::NoJoints`]; [`MtgpError::CountMismatch`] unless there is one start per joint, and as
/// many targets as rows; [`MtgpError::BadRank`]; [`MtgpError::Gp`] if the start has no likelihood.
/// # Source
/// Sec. 5, first extension.
pub fn fit_shared(
    data: &Stacked,
    targets: &[Vec<f64>],
    rank: usize,
    starts: &[Start<MultiTaskCovariance>],
    options: &MultiTaskOptions,
) -> Result<SharedFit, MtgpError> {
    require_joints(data, targets, starts)?;
    let factor = mean_factor(starts, rank, options)?;
    let task = TaskCovariance::Factor(factor);
    let covariances = (starts.iter())
        .map(|start| Ok(MultiTaskCovariance::new(rescaled(start)?, task.clone())))
        .collect::<Result<Vec<_>, MtgpError>>()?;
    let noise_stds: Vec<f64> = starts.iter().map(|start| start.noise_std).collect();

    let metric = |z: &[f64]| shared_information(data, &covariances, z);
    let mut objective = Together::new(data, targets, covariances.clone(), options)?;
    let start = objective.unconstrained(&noise_stds);
    let mut unused = vec![0.0; start.len()];
    let initial_log_marginal = -objective.value_and_gradient(&start, &mut unused);
    if !initial_log_marginal.is_finite() {
        return Err(GpError::NoUsableStart {
            n_starts: 1,
            reason: None,
        }
        .into());
    }
    let minimum = minimize_in_metric(
        &mut objective,
        &start,
        metric,
        &MinimizeOptions {
            gradient_tolerance: options.gradient_tolerance,
            value_tolerance: options.value_tolerance,
            max_evaluations: options.max_evaluations,
            max_recoveries: 10,
        },
        ROUNDS,
    );
    let noise_stds = objective.set(&minimum.z);
    let covariances = objective.covariances;
    let mut joints = Vec::new();
    let mut log_marginals = Vec::new();
    for ((covariance, noise_std), targets) in covariances.into_iter().zip(noise_stds).zip(targets) {
        let x = data.inputs();
        let mut evidence = LogMarginal::new(x, targets, options.likelihood);
        let mut gradient = vec![0.0; covariance.n_params() + 1];
        let evaluation = evidence.evaluate(&covariance, noise_std, &mut gradient)?;
        log_marginals.push(evaluation.log_marginal_likelihood);
        let likelihood = options.likelihood;
        joints.push(Posterior::new(
            covariance, noise_std, x, targets, likelihood,
        )?);
    }
    Ok(SharedFit {
        joints,
        log_marginals,
        initial_log_marginal,
        evaluations: minimum.evaluations + 1,
        stop: minimum.stop,
    })
}

fn require_joints(
    data: &Stacked,
    targets: &[Vec<f64>],
    starts: &[Start<MultiTaskCovariance>],
) -> Result<(), MtgpError> {
    if targets.is_empty() {
        return Err(MtgpError::NoJoints);
    }
    require_count("fits to start from", starts.len(), targets.len())?;
    for (targets, start) in targets.iter().zip(starts) {
        require_count("targets", targets.len(), data.tasks().len())?;
        let n_tasks = start.covariance.n_tasks();
        require_count("tasks of a fit to start from", n_tasks, data.n_tasks())?;
    }
    Ok(())
}

/// a² = tr K^ρ/m of a joint.
fn mean_diagonal(start: &Start<MultiTaskCovariance>) -> f64 {
    let k_task = start.covariance.task().k_task();
    let m = k_task.nrows();
    (0..m).map(|task| k_task[(task, task)]).sum::<f64>() / m as f64
}

/// Λ of the rank-r part of the average of K^ρ/a².
fn mean_factor(
    starts: &[Start<MultiTaskCovariance>],
    rank: usize,
    options: &MultiTaskOptions,
) -> Result<TaskFactor, MtgpError> {
    let m = starts[0].covariance.n_tasks();
    let mut sum = Mat::<f64>::zeros(m, m);
    for start in starts {
        let weight = 1.0 / (mean_diagonal(start) * starts.len() as f64);
        let k_task = start.covariance.task().k_task();
        for col in 0..m {
            for row in 0..m {
                sum[(row, col)] += weight * k_task[(row, col)];
            }
        }
    }
    rank_part(sum.as_ref(), rank, options.rank_part)
}

/// a² c^x of a joint.
fn rescaled(start: &Start<MultiTaskCovariance>) -> Result<TorqueCovariance, MtgpError> {
    let a = mean_diagonal(start).sqrt();
    let times_a = |values: Vec<f64>| values.into_iter().map(|value| a * value).collect();
    let input = start.covariance.input();
    let params = input.named_params();
    Ok(input.with_params(TorqueParams {
        bias_std: a * params.bias_std,
        linear_std: times_a(params.linear_std),
        signal_std: a * params.signal_std,
        length_scales: params.length_scales,
        coulomb_std: params.coulomb_std.map(times_a),
    })?)
}

/// F + I of all joints: Σ_i F_i, each about its own (θ_i^x, σ_i) and the common Λ.
///
/// # Shapes
/// `z` (p,) in the order of [`Together`]; the result (p, p).
fn shared_information(
    data: &Stacked,
    covariances: &[MultiTaskCovariance],
    z: &[f64],
) -> Option<Mat<f64>> {
    let n_task = covariances[0].task().n_params();
    let n_joints = covariances.len();
    let n_each = (z.len() - n_task) / n_joints;
    let mut sum = Mat::zeros(z.len(), z.len());
    for (joint, covariance) in covariances.iter().enumerate() {
        // θ^x, Λ, σ of the joint among (θ_1^x, σ_1), …, Λ
        let first = joint * n_each;
        let mut places: Vec<usize> = (first..first + n_each - 1).collect();
        places.extend(z.len() - n_task..z.len());
        places.push(first + n_each - 1);
        let of_joint: Vec<f64> = places.iter().map(|&place| z[place]).collect();
        let f = information(&[data.inputs()], covariance, &of_joint)?;
        for (col, &to_col) in places.iter().enumerate() {
            for (row, &to_row) in places.iter().enumerate() {
                sum[(to_row, to_col)] += f[(row, col)];
            }
        }
    }
    add_prior_information(&mut sum);
    Some(sum)
}

/// −Σ_i log L_i as a function of unconstrained coordinates: (θ_1^x, σ_1), (θ_2^x, σ_2), …, Λ.
struct Together<'a> {
    likelihoods: Vec<LogMarginal<'a>>,
    covariances: Vec<MultiTaskCovariance>,
    layout: ParamLayout,
}

impl<'a> Together<'a> {
    fn new(
        data: &'a Stacked,
        targets: &'a [Vec<f64>],
        covariances: Vec<MultiTaskCovariance>,
        options: &MultiTaskOptions,
    ) -> Result<Self, MtgpError> {
        let noise = Jitter::new(1.0)?.layout();
        let mut layout = ParamLayout::new();
        for covariance in &covariances {
            layout = (layout.followed_by(covariance.input().layout())).followed_by(noise.clone());
        }
        let layout = layout.followed_by(covariances[0].task().layout());
        let likelihood =
            |targets: &'a Vec<f64>| LogMarginal::new(data.inputs(), targets, options.likelihood);
        Ok(Self {
            likelihoods: targets.iter().map(likelihood).collect(),
            covariances,
            layout,
        })
    }

    fn unconstrained(&self, noise_stds: &[f64]) -> Vec<f64> {
        let mut theta = Vec::new();
        for (covariance, noise_std) in self.covariances.iter().zip(noise_stds) {
            theta.extend(covariance.input().params());
            theta.push(*noise_std);
        }
        theta.extend(self.covariances[0].task().params());
        let pairs = self.layout.specs().iter().zip(theta);
        pairs
            .map(|(spec, value)| {
                let inside = spec.transform.clamp_inside(value);
                spec.transform.unconstrained(inside)
            })
            .collect()
    }

    /// Takes the hyperparameters of z; returns σ of every joint.
    fn set(&mut self, z: &[f64]) -> Vec<f64> {
        let specs = self.layout.specs().iter().zip(z);
        let theta: Vec<f64> = specs.map(|(spec, z)| spec.transform.natural(*z)).collect();
        let n_task = self.covariances[0].task().n_params();
        let (of_joints, of_task) = theta.split_at(theta.len() - n_task);
        let n_each = of_joints.len() / self.covariances.len();
        let joints = self
            .covariances
            .iter_mut()
            .zip(of_joints.chunks_exact(n_each));
        joints
            .map(|(covariance, of_joint)| {
                let (noise_std, of_input) = of_joint.split_last().expect("σ is the last");
                covariance.set_params(&[of_input, of_task].concat());
                *noise_std
            })
            .collect()
    }

    /// Σ_i log L_i with its natural gradient.
    fn sum(&mut self, noise_stds: &[f64], gradient: &mut [f64]) -> Result<f64, GpError> {
        gradient.fill(0.0);
        let n_task = self.covariances[0].task().n_params();
        let (of_joints, of_task) = gradient.split_at_mut(gradient.len() - n_task);
        let n_each = of_joints.len() / self.covariances.len();
        let mut value = 0.0;
        for (idx, of_joint) in of_joints.chunks_exact_mut(n_each).enumerate() {
            let mut slopes = vec![0.0; n_each + n_task];
            let (covariance, noise_std) = (&self.covariances[idx], noise_stds[idx]);
            let evaluation = self.likelihoods[idx].evaluate(covariance, noise_std, &mut slopes)?;
            value += evaluation.log_marginal_likelihood;
            // θ^x, Λ, σ → (θ^x, σ), Λ
            let (of_input, rest) = slopes.split_at(n_each - 1);
            of_joint[..n_each - 1].copy_from_slice(of_input);
            of_joint[n_each - 1] = rest[n_task];
            for (total, slope) in of_task.iter_mut().zip(rest) {
                *total += slope;
            }
        }
        Ok(value)
    }
}

impl Objective for Together<'_> {
    fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let noise_stds = self.set(z);
        let Ok(value) = self.sum(&noise_stds, gradient) else {
            return f64::INFINITY;
        };
        for ((slope, spec), z) in gradient.iter_mut().zip(self.layout.specs()).zip(z) {
            *slope *= -spec.transform.derivative(*z);
        }
        if value.is_finite() {
            -value
        } else {
            f64::INFINITY
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use kernels::TorqueForm;

    /// Eight samples of three tasks.
    fn samples() -> Stacked {
        let x = Mat::from_fn(8, 3, |row, col| ((3 * row + 5 * col) as f64).sin());
        let tasks: Vec<usize> = (0..8).map(|row| row % 3).collect();
        Stacked::new(x.as_ref(), &tasks, 3).expect("three tasks")
    }

    /// Rank 2, with a multiple of the signal.
    fn covariance(signal_std: f64) -> MultiTaskCovariance {
        let factor = TaskFactor::from_entries(3, 2, &[1.0, 0.4, 0.8, -0.3, 0.6]).expect("rank 2");
        let unit = TorqueCovariance::unit(1, TorqueForm::Coulomb).named_params();
        let params = TorqueParams { signal_std, ..unit };
        let input = TorqueCovariance::new(params).expect("positive");
        MultiTaskCovariance::new(input, TaskCovariance::Factor(factor))
    }

    #[test]
    fn information_of_the_joints_adds_up_about_what_they_share() {
        let data = samples();
        let targets = vec![vec![0.0; 8]; 2];
        let covariances = vec![covariance(1.0), covariance(2.5)];
        let options = MultiTaskOptions::chapter();
        let sum = Together::new(&data, &targets, covariances.clone(), &options).expect("σ = 1");
        let z = sum.unconstrained(&[0.3, 0.5]);
        let both = shared_information(&data, &covariances, &z).expect("positive definite");
        // (θ_1, σ_1), (θ_2, σ_2), Λ: ten, ten and five, beside θ, Λ, σ of a joint alone.
        let own = |joint: usize| {
            let (of_joint, of_task) = (&z[10 * joint..10 * joint + 10], &z[20..]);
            let (of_input, of_noise) = of_joint.split_at(9);
            let z = [of_input, of_task, of_noise].concat();
            information(&[data.inputs()], &covariances[joint], &z).expect("positive definite")
        };
        let (first, second) = (own(0), own(1));
        let prior = |row: usize, col: usize| f64::from(u8::from(row == col));
        for row in 0..5 {
            for col in 0..5 {
                let of_task = first[(9 + row, 9 + col)] + second[(9 + row, 9 + col)];
                let expected = of_task + prior(row, col);
                assert!(
                    (both[(20 + row, 20 + col)] - expected).abs() < 1e-12 * expected.abs().max(1.0)
                );
            }
        }
        for (joint, own) in [(0, first), (1, second)] {
            let noise = 10 * joint + 9;
            let expected = own[(14, 14)] + 1.0;
            assert!((both[(noise, noise)] / expected - 1.0).abs() < 1e-12);
            assert!((both[(noise, 22)] - own[(14, 11)]).abs() < 1e-12 * expected);
        }
        // The joints are independent.
        assert!((0..10).all(|row| (10..20).all(|col| both[(row, col)].abs() < f64::MIN_POSITIVE)));
    }

    #[test]
    fn gradient_of_the_sum_is_its_central_difference() {
        let data = samples();
        let targets: Vec<Vec<f64>> = (0..2)
            .map(|joint| (0..8).map(|i| f64::from(2 * i + joint).cos()).collect())
            .collect();
        let covariance = covariance(1.0);
        let options = MultiTaskOptions::chapter();
        let covariances = vec![covariance.clone(), covariance];
        let mut sum = Together::new(&data, &targets, covariances, &options).expect("σ = 1");
        let z = sum.unconstrained(&[0.3, 0.5]);
        assert_eq!(z.len(), 2 * 10 + 5);
        let mut gradient = vec![0.0; z.len()];
        sum.value_and_gradient(&z, &mut gradient);
        for idx in 0..z.len() {
            let step = f64::EPSILON.cbrt();
            let mut at = |shift: f64| {
                let mut moved = z.clone();
                moved[idx] += shift;
                sum.value_and_gradient(&moved, &mut vec![0.0; z.len()])
            };
            let difference = (at(step) - at(-step)) / (2.0 * step);
            // Values of some tens, conditions below 10³, third derivatives below 10².
            let tolerance = 1e3 * 50.0 * f64::EPSILON / step + 100.0 * step * step;
            let error = (gradient[idx] - difference).abs();
            assert!(error < tolerance, "{idx}: {error:e} {tolerance:e}");
        }
    }
}
