//! Hyperparameters of one joint as a TOML file, in natural units.

use std::path::Path;

use anyhow::{Context, Result, bail};
use faer::Mat;
use gp_core::search::Start;
use kernels::{Constant, SeArd, Sum, TorqueCovariance, TorqueParams};
use mtgp::{MultiTaskCovariance, TaskCovariance, TaskFactor};
use serde::{Deserialize, Serialize};

/// The part of the model that scikit-learn and gprx can express: b² + v² exp(−s/2).
pub type SmoothPart = Sum<Constant, SeArd>;

/// Standard deviations and length scales; without `linear_std` and `coulomb_std` the model is
/// bias + squared exponential.
#[derive(Clone, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hyperparameters {
    pub bias_std: f64,
    pub signal_std: f64,
    pub noise_std: f64,
    pub length_scales: Vec<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub linear_std: Vec<f64>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub coulomb_std: Vec<f64>,
    /// Λ row by row, one row a load, with the zeros above its diagonal; none for one load.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub task_factor: Vec<Vec<f64>>,
}

impl Hyperparameters {
    pub fn read(path: &Path) -> Result<Self> {
        let text =
            std::fs::read_to_string(path).with_context(|| format!("reading {}", path.display()))?;
        toml::from_str(&text).with_context(|| format!("reading {}", path.display()))
    }

    /// Of a full model.
    pub fn full(covariance: &TorqueCovariance, noise_std: f64) -> Self {
        let params = covariance.named_params();
        Self {
            bias_std: params.bias_std,
            signal_std: params.signal_std,
            noise_std,
            length_scales: params.length_scales,
            linear_std: params.linear_std,
            coulomb_std: params.coulomb_std.unwrap_or_default(),
            task_factor: Vec::new(),
        }
    }

    /// Of a model of several loads.
    pub fn of_loads(covariance: &MultiTaskCovariance, noise_std: f64) -> Result<Self> {
        let TaskCovariance::Factor(factor) = covariance.task() else {
            bail!("a task covariance without a factor");
        };
        let lambda = factor.lambda();
        let row = |row: usize| lambda.row(row).iter().copied().collect();
        Ok(Self {
            task_factor: (0..lambda.nrows()).map(row).collect(),
            ..Self::full(covariance.input(), noise_std)
        })
    }

    /// The bias and the squared exponential of a start of a full model.
    pub fn smooth_part_of(start: &Start) -> Self {
        Self {
            linear_std: Vec::new(),
            coulomb_std: Vec::new(),
            task_factor: Vec::new(),
            ..Self::full(&start.covariance, start.noise_std)
        }
    }

    /// Every hyperparameter multiplied by 1 + `shift`.
    pub fn shifted(&self, shift: f64) -> Self {
        self.map(|value| (1.0 + shift) * value)
    }

    /// Every weight and length scale moved into the range that every contestant accepts.
    pub fn clipped(&self, lowest: f64, highest: f64) -> Self {
        Self {
            noise_std: self.noise_std,
            task_factor: self.task_factor.clone(),
            ..self.map(|value| value.clamp(lowest, highest))
        }
    }

    fn map(&self, change: impl Fn(f64) -> f64) -> Self {
        let all = |values: &[f64]| values.iter().map(|&value| change(value)).collect();
        Self {
            bias_std: change(self.bias_std),
            signal_std: change(self.signal_std),
            noise_std: change(self.noise_std),
            length_scales: all(&self.length_scales),
            linear_std: all(&self.linear_std),
            coulomb_std: all(&self.coulomb_std),
            task_factor: self.task_factor.iter().map(|row| all(row)).collect(),
        }
    }

    pub fn has_several_loads(&self) -> bool {
        !self.task_factor.is_empty()
    }

    pub fn has_only_smooth_part(&self) -> bool {
        self.linear_std.is_empty() && self.coulomb_std.is_empty()
    }

    /// GPc, eq. (7).
    pub fn torque_covariance(&self) -> Result<TorqueCovariance> {
        if self.has_only_smooth_part() {
            bail!("these hyperparameters are of bias + squared exponential");
        }
        Ok(TorqueCovariance::new(TorqueParams {
            bias_std: self.bias_std,
            linear_std: self.linear_std.clone(),
            signal_std: self.signal_std,
            length_scales: self.length_scales.clone(),
            coulomb_std: Some(self.coulomb_std.clone()),
        })?)
    }

    /// Eq. (16): GPc's covariance times that of the loads.
    pub fn multi_task_covariance(&self) -> Result<MultiTaskCovariance> {
        let rank = self.task_factor.first().map_or(0, Vec::len);
        let lambda = Mat::from_fn(self.task_factor.len(), rank, |row, col| {
            self.task_factor[row][col]
        });
        let task = TaskCovariance::Factor(TaskFactor::new(lambda)?);
        Ok(MultiTaskCovariance::new(self.torque_covariance()?, task))
    }

    /// Bias + squared exponential.
    pub fn smooth_part(&self) -> Result<SmoothPart> {
        Ok(Sum::new(
            Constant::new(self.bias_std)?,
            SeArd::new(self.signal_std, self.length_scales.clone())?,
        ))
    }
}
