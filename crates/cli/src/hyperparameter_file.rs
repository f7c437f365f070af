//! The hyperparameter TOML: the numbers of eq. (7) for one joint, and the noise.
//!
//! ```toml
//! bias_std = 3.0                          # N·m
//! linear_std = [1.0, 0.2, …]              # one per covariate q1..qN, qd1..qdN, qdd1..qddN; N·m per its unit
//! signal_std = 5.0                        # N·m
//! length_scales = [0.5, 0.7, …]           # one per covariate, in its unit
//! coulomb_std = [1.0, 0.1, …]             # one per joint, N·m; without it: no Coulomb friction
//! noise_std = 0.01                        # N·m
//! continuous = ["wrist"]                  # joints that turn without end, if there are any: u in N·m, l of the chord, no unit
//! ```
//! Data of several contexts needs more: see `context_hyperparameters.rs`.

use std::path::Path;

use kernels::{ContinuousJoints, Covariance, TorqueCovariance, TorqueForm};
use mtgp::{MtgpError, MultiTaskCovariance, TaskCovariance, TaskFactor};
use serde::{Deserialize, Serialize};

use crate::context_hyperparameters::{check, full_rows, lambda, rank};
use crate::error::CliError;
use crate::header_joints::chosen;
use crate::joints::Joints;
use crate::noise_std::NoiseStd;
use crate::toml_fault::fault;

/// One number for every hyperparameter: a value, or the derivative by it.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Hyperparameters {
    /// b.
    pub bias_std: f64,
    /// u, one per covariate.
    pub linear_std: Vec<f64>,
    /// v.
    pub signal_std: f64,
    /// l, one per covariate.
    pub length_scales: Vec<f64>,
    /// w, one per joint.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coulomb_std: Option<Vec<f64>>,
    /// σ, or one for each context.
    pub noise_std: NoiseStd,
    /// Names of the contexts; never in a derivative.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contexts: Option<Vec<String>>,
    /// Λ by rows, one for each context.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub task_factor: Option<Vec<Vec<f64>>>,
    /// Names of the joints that turn without end; never in a derivative.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub continuous: Option<Vec<String>>,
}

impl Hyperparameters {
    /// Reads a file for data of these joints.
    ///
    /// # Errors
    /// A file that cannot be read or is not such a TOML, a list of the wrong length, a number that is not finite,
    /// negative, or zero where that has no meaning, a joint that there is not.
    pub fn load(path: &Path, joints: &Joints) -> Result<Self, CliError> {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path).map_err(CliError::io("read", file.clone()))?;
        let refuse = |reason: String| CliError::Hyperparameters {
            file: file.clone(),
            reason,
        };
        let parsed: Self = toml::from_str(&text).map_err(|error| refuse(fault(&text, &error)))?;
        parsed.check(joints.names.len()).map_err(refuse)?;
        parsed
            .continuous(joints)
            .map_err(|cause| refuse(cause.to_string()))?;
        Ok(parsed)
    }

    /// The hyperparameters of a learned joint.
    pub fn of(covariance: &TorqueCovariance, noise_std: f64) -> Self {
        let params = covariance.named_params();
        Self {
            bias_std: params.bias_std,
            linear_std: params.linear_std,
            signal_std: params.signal_std,
            length_scales: params.length_scales,
            coulomb_std: params.coulomb_std,
            noise_std: NoiseStd::Shared(noise_std),
            contexts: None,
            task_factor: None,
            continuous: None,
        }
    }

    /// The joints that turn without end.
    fn continuous(&self, joints: &Joints) -> Result<ContinuousJoints, CliError> {
        let names = self.continuous.as_deref().unwrap_or_default();
        Ok(ContinuousJoints::of(chosen(
            "`continuous`:",
            names,
            joints,
        )?))
    }

    /// The covariance function, without the noise.
    ///
    /// # Errors
    /// None for hyperparameters that were read from a file for these joints.
    /// # Panics
    /// If there is no joint or the lists are not for so many.
    pub fn covariance(&self, joints: &Joints) -> Result<TorqueCovariance, CliError> {
        let form = match self.coulomb_std {
            None => TorqueForm::Smooth,
            Some(_) => TorqueForm::Coulomb,
        };
        let unit = TorqueCovariance::unit(joints.names.len(), form);
        let of_joints = unit.with_continuous(self.continuous(joints)?);
        let mut covariance = of_joints.map_err(|cause| CliError::Usage(cause.to_string()))?;
        // Not by its constructor, which refuses the zeros that switch a term off.
        covariance.set_params(&self.theta());
        Ok(covariance)
    }

    /// The covariance of several contexts with `input` between states, without the noise; `None` if the file names none.
    ///
    /// # Errors
    /// None for hyperparameters that were read from a file.
    pub fn task_covariance(
        &self,
        input: &TorqueCovariance,
    ) -> Result<Option<MultiTaskCovariance>, MtgpError> {
        let Some(rows) = &self.task_factor else {
            return Ok(None);
        };
        let task = TaskCovariance::Factor(TaskFactor::new(lambda(rows))?);
        Ok(Some(MultiTaskCovariance::new(input.clone(), task)))
    }

    /// The numbers of a gradient in the order (θ^x, free entries of Λ, noise), under the names of these values.
    ///
    /// # Panics
    /// If there is not one number per hyperparameter.
    pub fn named(&self, covariance: &TorqueCovariance, gradient: &[f64]) -> Self {
        let layout = covariance.layout();
        let (of_input, rest) = gradient.split_at(layout.len());
        let (of_factor, of_noise) = rest.split_at(rest.len() - self.noise_std.values().len());
        let vector = |name: &str| Some(of_input[layout.range(name)?].to_vec());
        let scalar = |name: &str| vector(name).and_then(|values| values.first().copied());
        Self {
            bias_std: scalar("bias_std").unwrap_or_default(),
            linear_std: vector("linear_std").unwrap_or_default(),
            signal_std: scalar("signal_std").unwrap_or_default(),
            length_scales: vector("length_scales").unwrap_or_default(),
            coulomb_std: vector("coulomb_std"),
            noise_std: self.noise_std.with_values(of_noise),
            contexts: None,
            task_factor: (self.task_factor.as_ref())
                .map(|rows| full_rows(rows.len(), rank(rows), of_factor)),
            continuous: None,
        }
    }

    /// Every number with its name, counted from 1: `linear_std 4`, `task_factor 3,2`.
    pub fn entries(&self) -> Vec<(String, f64)> {
        let lists = [
            ("linear_std", Some(&self.linear_std)),
            ("length_scales", Some(&self.length_scales)),
            ("coulomb_std", self.coulomb_std.as_ref()),
        ];
        let [linear, lengths, coulomb] = lists.map(|(name, values)| {
            let numbered = values.into_iter().flatten().enumerate();
            numbered.map(move |(idx, value)| (format!("{name} {}", idx + 1), *value))
        });
        std::iter::once(("bias_std".to_owned(), self.bias_std))
            .chain(linear)
            .chain([("signal_std".to_owned(), self.signal_std)])
            .chain(lengths)
            .chain(coulomb)
            .chain(self.factor_entries())
            .chain(self.noise_entries())
            .collect()
    }

    /// The entries of Λ on and below the diagonal.
    fn factor_entries(&self) -> impl Iterator<Item = (String, f64)> {
        let rows = self.task_factor.iter().flatten().enumerate();
        rows.flat_map(|(row, values)| {
            let entries = values.iter().take(row + 1).enumerate();
            entries
                .map(move |(col, value)| (format!("task_factor {},{}", row + 1, col + 1), *value))
        })
    }

    fn noise_entries(&self) -> impl Iterator<Item = (String, f64)> {
        let is_shared = matches!(self.noise_std, NoiseStd::Shared(_));
        let values = self.noise_std.values().iter().enumerate();
        values.map(move |(idx, value)| {
            let number = if is_shared {
                String::new()
            } else {
                format!(" {}", idx + 1)
            };
            (format!("noise_std{number}"), *value)
        })
    }

    /// θ in the order of the covariance.
    fn theta(&self) -> Vec<f64> {
        let mut theta = vec![self.bias_std];
        theta.extend(&self.linear_std);
        theta.push(self.signal_std);
        theta.extend(&self.length_scales);
        theta.extend(self.coulomb_std.iter().flatten());
        theta
    }

    fn check(&self, n_joints: usize) -> Result<(), String> {
        let n_covariates = 3 * n_joints;
        let per_covariate = "one per covariate: q, then qd, then qdd of every joint";
        check_count("linear_std", &self.linear_std, n_covariates, per_covariate)?;
        check_count(
            "length_scales",
            &self.length_scales,
            n_covariates,
            per_covariate,
        )?;
        if let Some(coulomb_std) = &self.coulomb_std {
            check_count("coulomb_std", coulomb_std, n_joints, "one per joint")?;
            check_values("coulomb_std", coulomb_std, May::BeZero)?;
        }
        check_values("bias_std", &[self.bias_std], May::BeZero)?;
        check_values("linear_std", &self.linear_std, May::BeZero)?;
        check_values("signal_std", &[self.signal_std], May::BeZero)?;
        check_values("length_scales", &self.length_scales, May::NotBeZero)?;
        check_values("noise_std", self.noise_std.values(), May::NotBeZero)?;
        check(
            self.contexts.as_deref(),
            self.task_factor.as_deref(),
            &self.noise_std,
        )
    }
}

/// Whether zero has a meaning: it switches a term off, but nothing is zero long.
#[derive(Clone, Copy, PartialEq, Eq)]
enum May {
    BeZero,
    NotBeZero,
}

fn check_count(key: &str, values: &[f64], expected: usize, meaning: &str) -> Result<(), String> {
    let found = values.len();
    if found == expected {
        return Ok(());
    }
    Err(format!(
        "`{key}` has {found} entries; the data needs {expected} ({meaning})"
    ))
}

fn check_values(key: &str, values: &[f64], may: May) -> Result<(), String> {
    let is_bad = |value: &f64| {
        let is_too_small = if may == May::BeZero {
            *value < 0.0
        } else {
            *value <= 0.0
        };
        !value.is_finite() || is_too_small
    };
    let Some(idx) = values.iter().position(is_bad) else {
        return Ok(());
    };
    let place = if values.len() > 1 {
        format!(" entry {}", idx + 1)
    } else {
        String::new()
    };
    let bound = if may == May::BeZero {
        "zero or more"
    } else {
        "greater than zero"
    };
    Err(format!(
        "`{key}`{place} is {}, but must be finite and {bound}",
        values[idx]
    ))
}
