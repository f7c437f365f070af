//! A torque with an informative prior: a rigid-body model with uncertain parameters, and a process on
//! what it leaves.
//!
//! ```text
//! rbd       t = Y(x)π + ε,            π ~ N(π₀, s² Σ),  ε ~ N(0, σ²)
//! rbd+gp    t = Y(x)π + f(x) + ε,     f a zero-mean process with the covariance of eq. (7)
//! ```
//! s, σ and the hyperparameters of f are learned by eq. (8).
//! Both are zero-mean processes of t − Y(x)π₀, in rows (x, Y(x)).
//!
//! Source: sec. 3.2.

use faer::{Mat, MatRef};
use kernels::{Covariance, OnColumns, RigidBody, Sum, TorqueCovariance, TorqueForm};

use super::chapter_start::{chapter_start, varied_start};
use super::covariance::{Fit, fit_covariance};
use crate::data::require_training_data;
use crate::error::GpError;
use crate::posterior::Posterior;
use crate::posterior::Prediction;
use crate::search::{FitOptions, Start};

/// Covariance of rbd: the regressor's columns of rows (x, Y(x)).
pub type RigidBodyCovariance = OnColumns<RigidBody>;

/// Covariance of rbd+gp.
pub type RigidBodyAndProcess = Sum<OnColumns<TorqueCovariance>, RigidBodyCovariance>;

/// σ that a search sets out from, as a part of the root mean square of the targets.
const NOISE_PART: f64 = 0.1;

/// What is known of the parameters before any data.
#[derive(Debug, Clone, PartialEq)]
pub struct ParameterPrior {
    /// π₀, (p,).
    pub mean: Vec<f64>,
    /// Standard deviations of the entries of π at s = 1, (p,); zero for one that is known.
    pub std: Vec<f64>,
}

impl ParameterPrior {
    /// Y(x)π₀ of every row, (n,).
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] unless there is one column per parameter.
    pub fn torques(&self, regressor: MatRef<'_, f64>) -> Result<Vec<f64>, GpError> {
        let (found, expected) = (regressor.ncols(), self.mean.len());
        if found != expected || self.std.len() != expected {
            return Err(GpError::WrongCovariates { found, expected });
        }
        let of_row = |row| {
            let terms = (0..expected).map(|col| regressor[(row, col)] * self.mean[col]);
            terms.sum()
        };
        Ok((0..regressor.nrows()).map(of_row).collect())
    }

    /// The covariance of Y(x)(π − π₀) in rows of `n_inputs` columns and then Y(x).
    ///
    /// # Errors
    /// [`GpError::Kernel`] for a standard deviation that is not finite.
    pub fn covariance(&self, n_inputs: usize) -> Result<RigidBodyCovariance, GpError> {
        self.covariance_at(n_inputs, 1.0)
    }

    /// As [`ParameterPrior::covariance`], at another s.
    ///
    /// # Errors
    /// [`GpError::Kernel`] for a standard deviation that is not finite, or an s that is not above zero.
    pub fn covariance_at(
        &self,
        n_inputs: usize,
        spread: f64,
    ) -> Result<RigidBodyCovariance, GpError> {
        let rigid_body = RigidBody::independent(&self.std, spread)?;
        let columns = n_inputs..n_inputs + self.std.len();
        Ok(OnColumns::new(rigid_body, columns))
    }
}

/// A joint's samples with the regressor at each.
#[derive(Debug, Clone, Copy)]
pub struct RegressorSamples<'a> {
    /// What a process on the remainder sees, (n, d).
    pub x: MatRef<'a, f64>,
    /// Rows of Y, (n, p).
    pub regressor: MatRef<'a, f64>,
    /// (n,), N·m.
    pub targets: &'a [f64],
}

impl RegressorSamples<'_> {
    /// Rows (x, Y), (n, d + p).
    ///
    /// # Panics
    /// If x and Y do not have as many rows.
    fn rows(&self) -> Mat<f64> {
        rows(self.x, self.regressor)
    }
}

/// Rows (x, Y).
fn rows(x: MatRef<'_, f64>, regressor: MatRef<'_, f64>) -> Mat<f64> {
    assert_eq!(x.nrows(), regressor.nrows(), "one row of Y per input");
    let d = x.ncols();
    Mat::from_fn(x.nrows(), d + regressor.ncols(), |row, col| {
        if col < d {
            x[(row, col)]
        } else {
            regressor[(row, col - d)]
        }
    })
}

/// A torque with an informative prior, learned.
#[derive(Debug, Clone)]
pub struct InformedFit<C> {
    /// The process of t − Yπ₀ in rows (x, Y).
    pub fit: Fit<C>,
    /// The prior of its parameters.
    pub prior: ParameterPrior,
}

impl<C: Covariance> InformedFit<C> {
    /// Posterior means of the torque at rows of x and Y.
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    /// # Panics
    /// If x and Y do not have as many rows.
    pub fn predict_mean(
        &self,
        x: MatRef<'_, f64>,
        regressor: MatRef<'_, f64>,
    ) -> Result<Vec<f64>, GpError> {
        let expected = self.prior.torques(regressor)?;
        let deviations = (self.fit.posterior).predict_mean(rows(x, regressor).as_ref())?;
        Ok(add(deviations, &expected))
    }

    /// Posterior means and latent variances of the torque at rows of x and Y.
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    /// # Panics
    /// If x and Y do not have as many rows.
    pub fn predict(
        &self,
        x: MatRef<'_, f64>,
        regressor: MatRef<'_, f64>,
    ) -> Result<Prediction, GpError> {
        let expected = self.prior.torques(regressor)?;
        let mut prediction = (self.fit.posterior).predict(rows(x, regressor).as_ref())?;
        prediction.mean = add(prediction.mean, &expected);
        Ok(prediction)
    }
}

impl InformedFit<RigidBodyCovariance> {
    /// Posterior mean of π, (p,): the torque's is Yπ.
    ///
    /// # Errors
    /// Those of [`InformedFit::predict_mean`], for numbers that overflow.
    pub fn parameter_mean(&self) -> Result<Vec<f64>, GpError> {
        parameter_mean(&self.fit.posterior, &self.prior)
    }
}

/// The mean of a sum of processes is a sum, too, with the same weights β in each:
///
/// ```text
/// mean(x, y) = (c_f(x, ·) + c_rbd(y, ·))β + yπ₀ = E[f(x)] + y E[π]
/// ```
impl InformedFit<RigidBodyAndProcess> {
    /// Posterior mean of π, (p,).
    ///
    /// # Errors
    /// As without a process.
    pub fn parameter_mean(&self) -> Result<Vec<f64>, GpError> {
        let rigid_body = self.fit.posterior.covariance().second().clone();
        parameter_mean(&self.fit.posterior.with_covariance(rigid_body), &self.prior)
    }

    /// Posterior mean of f at rows of x, which does not depend on the load.
    ///
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    pub fn process_mean(&self, x: MatRef<'_, f64>) -> Result<Vec<f64>, GpError> {
        let process = self.fit.posterior.covariance().first().clone();
        let unused = Mat::zeros(x.nrows(), self.prior.mean.len());
        let posterior = self.fit.posterior.with_covariance(process);
        posterior.predict_mean(rows(x, unused.as_ref()).as_ref())
    }
}

/// The mean of y(π − π₀) is linear in y: its entries at the unit rows, and π₀.
fn parameter_mean(
    posterior: &Posterior<RigidBodyCovariance>,
    prior: &ParameterPrior,
) -> Result<Vec<f64>, GpError> {
    let (first, p) = (posterior.covariance().columns().start, prior.mean.len());
    let unit = |row: usize, col: usize| if col == first + row { 1.0 } else { 0.0 };
    let deviations = posterior.predict_mean(Mat::from_fn(p, first + p, unit).as_ref())?;
    Ok(add(deviations, &prior.mean))
}

fn add(mut values: Vec<f64>, others: &[f64]) -> Vec<f64> {
    for (value, other) in values.iter_mut().zip(others) {
        *value += other;
    }
    values
}

/// Learns a torque from starts of the caller's choice, in rows (x, Y) and less its prior mean Yπ₀.
///
/// # Errors
/// As for [`fit_covariance`]; [`GpError::WrongCovariates`] unless Y has a column per parameter.
/// # Panics
/// If x and Y do not have as many rows, or not the columns that a covariance needs.
pub fn fit_informed<C: Covariance + Clone>(
    samples: RegressorSamples<'_>,
    prior: &ParameterPrior,
    starts: &[Start<C>],
    options: &FitOptions,
) -> Result<InformedFit<C>, GpError> {
    let deviations = deviations(samples, prior)?;
    let fit = fit_covariance(samples.rows().as_ref(), &deviations, starts, options)?;
    Ok(InformedFit {
        fit,
        prior: prior.clone(),
    })
}

/// Learns rbd: torques that are linear in parameters, and nothing else.
///
/// # Errors
/// As for [`fit_informed`].
/// # Panics
/// If x and Y do not have as many rows.
/// # Source
/// Sec. 3.2.
pub fn fit_rigid_body(
    samples: RegressorSamples<'_>,
    prior: &ParameterPrior,
    options: &FitOptions,
) -> Result<InformedFit<RigidBodyCovariance>, GpError> {
    let covariance = prior.covariance(samples.x.ncols())?;
    let deviations = deviations(samples, prior)?;
    require_training_data(samples.x, &deviations, 2)?;
    let noise_std = noise_start(&deviations);
    // The prior as it is stated, with the noise of a crude and of a good model.
    let starts = [
        Start::given(covariance.clone(), noise_std),
        Start::given(covariance, NOISE_PART * noise_std),
    ];
    fit_informed(samples, prior, &starts, options)
}

/// Learns rbd+gp: a rigid-body model, and a process on what it leaves.
///
/// The starts are those of eq. (22) on the deviations from the prior mean, and the same on what rbd
/// leaves, with the spread that rbd has found.
/// # Errors
/// As for [`fit_informed`]; [`GpError::NotThreePerJoint`] for x of other columns.
/// # Panics
/// If x and Y do not have as many rows.
/// # Source
/// Sec. 3.2.
pub fn fit_rigid_body_and_process(
    samples: RegressorSamples<'_>,
    prior: &ParameterPrior,
    form: TorqueForm,
    options: &FitOptions,
) -> Result<InformedFit<RigidBodyAndProcess>, GpError> {
    let rigid_body = fit_rigid_body(samples, prior, options)?;
    let explained = rigid_body.predict_mean(samples.x, samples.regressor)?;
    let left: Vec<f64> = (samples.targets.iter().zip(explained))
        .map(|(target, mean)| target - mean)
        .collect();
    let as_stated = (
        prior.covariance(samples.x.ncols())?,
        deviations(samples, prior)?,
    );
    let as_found = (rigid_body.fit.posterior.covariance().clone(), left);

    let mut starts = Vec::new();
    for (of_parameters, remainder) in [as_found, as_stated] {
        let chapter = chapter_start(samples.x, &remainder, form, &options.continuous)?;
        for &origin in options.starts.origins() {
            let start = varied_start(&chapter, origin)?;
            let of_process = OnColumns::new(start.covariance, 0..samples.x.ncols());
            let covariance = Sum::new(of_process, of_parameters.clone());
            starts.push(Start::given(covariance, start.noise_std));
        }
    }
    fit_informed(samples, prior, &starts, options)
}

/// t − Yπ₀.
fn deviations(samples: RegressorSamples<'_>, prior: &ParameterPrior) -> Result<Vec<f64>, GpError> {
    let expected = prior.torques(samples.regressor)?;
    if expected.len() != samples.targets.len() {
        return Err(GpError::CountMismatch {
            n_inputs: expected.len(),
            n_targets: samples.targets.len(),
        });
    }
    Ok((samples.targets.iter().zip(expected))
        .map(|(target, mean)| target - mean)
        .collect())
}

/// A part of the root mean square, clearly above the floor of σ.
fn noise_start(targets: &[f64]) -> f64 {
    let power = targets.iter().map(|t| t * t).sum::<f64>() / targets.len().max(1) as f64;
    let bound = kernels::Transform::SquareAbove {
        floor: kernels::params::NOISE_VAR_FLOOR,
    };
    bound.clamp_inside(NOISE_PART * power.sqrt())
}
