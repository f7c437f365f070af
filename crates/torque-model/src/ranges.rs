//! The range of every covariate in the training data, to tell interpolation from extrapolation.

use std::f64::consts::TAU;

use faer::MatRef;
use gp_core::GpError;
use kernels::ContinuousJoints;

use crate::continuous::LARGEST_GAP;
use crate::error::{TorqueError, consistent};

/// What a position may lie outside of its range on the circle, rad: rounding of a position after many turns.
const ROUNDING: f64 = 1e-9;

/// Smallest and largest value of every covariate in the training data.
///
/// # Shapes
/// `min`, `max` (3ℓ,) in the order (q, q̇, q̈): rad, rad/s, rad/s².
#[derive(Debug, Clone, PartialEq)]
pub struct TrainingRanges {
    min: Vec<f64>,
    max: Vec<f64>,
    n_samples: usize,
    /// Joints whose positions are compared modulo a turn.
    continuous: ContinuousJoints,
}

impl TrainingRanges {
    /// The ranges of the columns of `x`, (n, 3ℓ).
    ///
    /// # Errors
    /// [`GpError::TooFewSamples`] without a row, [`GpError::NonFiniteInput`].
    pub fn of(x: MatRef<'_, f64>) -> Result<Self, TorqueError> {
        if x.nrows() == 0 {
            let (n_samples, needed) = (0, 1);
            return Err(GpError::TooFewSamples { n_samples, needed }.into());
        }
        gp_core::data::require_finite_inputs(x)?;
        let extreme = |pick: fn(f64, f64) -> f64| {
            let columns = x.col_iter();
            columns
                .map(|column| column.iter().copied().fold(column[0], pick))
                .collect()
        };
        Ok(Self {
            min: extreme(f64::min),
            max: extreme(f64::max),
            n_samples: x.nrows(),
            continuous: ContinuousJoints::none(),
        })
    }

    /// The ranges of the columns of some rows of `x`, (n, 3ℓ), without a copy of them.
    ///
    /// # Errors
    /// As for [`TrainingRanges::of`].
    /// # Panics
    /// If there is no such row.
    pub fn of_rows(x: MatRef<'_, f64>, rows: &[usize]) -> Result<Self, TorqueError> {
        let Some(first) = rows.first() else {
            let (n_samples, needed) = (0, 1);
            return Err(GpError::TooFewSamples { n_samples, needed }.into());
        };
        gp_core::data::require_finite_inputs(x)?;
        let extreme = |pick: fn(f64, f64) -> f64| {
            let of_column = |col: usize| {
                let values = rows.iter().map(|row| x[(*row, col)]);
                values.fold(x[(*first, col)], pick)
            };
            (0..x.ncols()).map(of_column).collect()
        };
        Ok(Self {
            min: extreme(f64::min),
            max: extreme(f64::max),
            n_samples: rows.len(),
            continuous: ContinuousJoints::none(),
        })
    }

    /// Given ranges of `n_samples` samples.
    ///
    /// # Errors
    /// [`TorqueError::InconsistentModel`] unless min ≤ max, both finite, for every covariate,
    /// and there is at least one sample.
    pub fn new(min: Vec<f64>, max: Vec<f64>, n_samples: usize) -> Result<Self, TorqueError> {
        let is_range = |(min, max): (&f64, &f64)| min.is_finite() && max.is_finite() && min <= max;
        let what = if min.len() != max.len() {
            Some(format!("{} lower and {} upper ends", min.len(), max.len()))
        } else if let Some(idx) = min.iter().zip(&max).position(|ends| !is_range(ends)) {
            Some(format!("range {idx} is from {} to {}", min[idx], max[idx]))
        } else {
            (n_samples == 0).then(|| "ranges of no sample".to_owned())
        };
        consistent(what)?;
        Ok(Self {
            min,
            max,
            n_samples,
            continuous: ContinuousJoints::none(),
        })
    }

    /// Compares the positions of these joints modulo a turn from now on.
    ///
    /// # Panics
    /// If there is no such joint.
    pub(crate) fn set_continuous(&mut self, continuous: ContinuousJoints) {
        let n_joints = self.n_covariates() / 3;
        assert!(continuous.indices().iter().all(|joint| *joint < n_joints));
        self.continuous = continuous;
    }

    /// Joints whose positions are compared modulo a turn.
    pub fn continuous(&self) -> &ContinuousJoints {
        &self.continuous
    }

    /// The ranges of both sets of samples together.
    ///
    /// # Panics
    /// If they have other numbers of covariates.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        assert_eq!(self.n_covariates(), other.n_covariates());
        let both = |a: &[f64], b: &[f64], pick: fn(f64, f64) -> f64| {
            a.iter().zip(b).map(|(a, b)| pick(*a, *b)).collect()
        };
        Self {
            min: both(&self.min, &other.min, f64::min),
            max: both(&self.max, &other.max, f64::max),
            n_samples: self.n_samples + other.n_samples,
            continuous: self.continuous.clone(),
        }
    }

    /// Smallest value of every covariate, (3ℓ,).
    pub fn min(&self) -> &[f64] {
        &self.min
    }

    /// Largest value of every covariate, (3ℓ,).
    pub fn max(&self) -> &[f64] {
        &self.max
    }

    /// Number of training samples.
    pub fn n_samples(&self) -> usize {
        self.n_samples
    }

    /// Number of covariates 3ℓ.
    pub fn n_covariates(&self) -> usize {
        self.min.len()
    }

    /// Indices of the covariates of `x` that lie outside their range; NaN counts as outside.
    ///
    /// Of a continuous joint the position may be any number of turns away; if the training positions span the turn but
    /// for a twelfth, none is outside.
    /// Allocates nothing.
    /// # Panics
    /// If `x` does not have 3ℓ entries.
    pub fn outside<'a>(&'a self, x: &'a [f64]) -> impl Iterator<Item = usize> + 'a {
        assert_eq!(x.len(), self.n_covariates());
        let is_inside = |idx: usize| {
            (self.min[idx] <= x[idx] && x[idx] <= self.max[idx])
                || (self.continuous.contains(idx) && self.is_inside_on_circle(idx, x[idx]))
        };
        (0..x.len()).filter(move |idx| !is_inside(*idx))
    }
    fn is_inside_on_circle(&self, joint: usize, q: f64) -> bool {
        let span = self.max[joint] - self.min[joint];
        let beyond_min = (q - self.min[joint] + ROUNDING).rem_euclid(TAU);
        q.is_finite() && (span >= TAU - LARGEST_GAP || beyond_min <= span + 2.0 * ROUNDING)
    }
}
