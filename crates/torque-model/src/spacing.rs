//! How far apart in time the rows of a log are, and which of them tell something of their own.
//!
//! What is not modelled of a torque changes slowly, so that rows close in time share it: of a log at 100 Hz thirty rows
//! are about one. A process that takes them for independent takes its noise for small and its torques for certain.

use crate::error::TorqueError;
use crate::rigid_body::{
    LEAST_SECONDS, Run, RunRows, correlation, least_correlation, median, runs_of,
};
use crate::samples::Samples;

/// Rows that a process is learned from at least, for each covariate.
///
/// # Source
/// Loeppky, Sacks & Welch 2009, "Choosing the sample size of a computer experiment", Technometrics 51(4).
const ROWS_PER_COVARIATE: usize = 10;

/// Part of a distance in time that rounding may take off it.
const ROUNDING: f64 = 1e-6;

/// Part of the quicker pairs of rows that move on as their speeds say, where rows follow each other in time.
const FOLLOWING: f64 = 0.8;

/// Pairs of rows that it takes to say so.
const FEWEST_PAIRS: usize = 10;

/// The rows of a log that a process is learned from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum ProcessRows {
    /// All: without times, or where they are apart as they are.
    All,
    /// Some, 0.3 s apart or more in each run, by their indices.
    Apart(Vec<usize>),
    /// All, as there are too few that are so far apart.
    TooFewApart {
        /// Rows that are.
        found: usize,
        /// Rows that it takes.
        needed: usize,
    },
}

impl Samples {
    /// Rows at least so far apart in each run, ascending: the first of a run, and each that is far enough from the last
    /// one taken. All of them without times.
    ///
    /// # Errors
    /// [`TorqueError::Log`] for time that does not rise within a run; samples that do not fit together.
    pub fn rows_apart(&self, seconds: f64) -> Result<Vec<usize>, TorqueError> {
        self.check()?;
        let t = &self.timeline.t;
        if t.is_empty() {
            return Ok((0..self.n_rows()).collect());
        }
        let mut kept = Vec::new();
        for run in runs_of(self)? {
            let mut last = f64::NEG_INFINITY;
            for row in run.rows {
                if t[row] - last >= seconds * (1.0 - ROUNDING) {
                    last = t[row];
                    kept.push(row);
                }
            }
        }
        kept.sort_unstable();
        Ok(kept)
    }

    /// The samples thinned to [`Samples::rows_apart`].
    ///
    /// # Errors
    /// As there.
    pub fn thinned(&self, seconds: f64) -> Result<Self, TorqueError> {
        Ok(self.rows(&self.rows_apart(seconds)?))
    }

    /// The rows that a process is learned from: those [`LEAST_SECONDS`] apart, if they are ten for each covariate.
    ///
    /// # Errors
    /// As for [`Samples::rows_apart`].
    pub fn process_rows(&self) -> Result<ProcessRows, TorqueError> {
        let (apart, n) = (self.rows_apart(LEAST_SECONDS)?, self.n_rows());
        let needed = ROWS_PER_COVARIATE * self.x.ncols();
        Ok(if apart.len() == n {
            ProcessRows::All
        } else if apart.len() < needed {
            ProcessRows::TooFewApart {
                found: apart.len(),
                needed,
            }
        } else {
            ProcessRows::Apart(apart)
        })
    }

    /// Rows that tell as much as one, where those of `seconds` do: n over the number of independent ones.
    ///
    /// ```text
    /// n / Σ_r max(1, n_r min(1, g_r/seconds))      g_r: mean step of run r
    /// ```
    /// 1 without times.
    /// # Errors
    /// As for [`Samples::rows_apart`].
    pub fn rows_per_independent(&self, seconds: f64) -> Result<f64, TorqueError> {
        self.check()?;
        let t = &self.timeline.t;
        if t.is_empty() || self.n_rows() == 0 {
            return Ok(1.0);
        }
        let of_run = |rows: &[usize]| {
            let n = rows.len() as f64;
            let length = t[rows[rows.len() - 1]] - t[rows[0]];
            let step = length / (n - 1.0).max(1.0);
            (n * (step / seconds).min(1.0)).max(1.0)
        };
        let runs = runs_of(self)?;
        let independent: f64 = runs.iter().map(|run| of_run(&run.rows)).sum();
        Ok(self.n_rows() as f64 / independent)
    }

    /// The step between rows as the states tell it, s; `None` where neighbouring rows do not follow each other in time.
    ///
    /// ```text
    /// Δt_i = Δq_i·v_i/|v_i|²,   v_i = (q̇_i + q̇_{i+1})/2;   the median over the quicker half of the pairs
    /// ```
    /// They do where four of five of these are within a factor of two of it.
    pub fn apparent_step(&self) -> Option<f64> {
        let n_joints = self.n_joints();
        let context = |row: usize| self.context_of.get(row);
        let pair = |row: usize| {
            let (mut along, mut square) = (0.0, 0.0);
            for joint in 0..n_joints {
                let at = |row: usize, column: usize| self.x[(row, column)];
                let moved = at(row + 1, joint) - at(row, joint);
                let qd = n_joints + joint;
                let speed = 0.5 * (at(row, qd) + at(row + 1, qd));
                along += moved * speed;
                square += speed * speed;
            }
            (square, along / square)
        };
        let starts = 0..self.n_rows().saturating_sub(1);
        let pairs = starts.filter(|row| context(*row) == context(row + 1));
        let pairs: Vec<(f64, f64)> = pairs
            .map(pair)
            .filter(|(square, _)| *square > 0.0)
            .collect();
        if pairs.len() < FEWEST_PAIRS {
            return None;
        }
        let typical = median(pairs.iter().map(|(square, _)| *square).collect());
        let quick = pairs.iter().filter(|(square, _)| *square >= typical);
        let steps: Vec<f64> = quick.map(|(_, step)| *step).collect();
        let step = median(steps.clone());
        let near = steps
            .iter()
            .filter(|of| (0.5 * step..=2.0 * step).contains(*of));
        let is_following = near.count() as f64 >= FOLLOWING * steps.len() as f64;
        (step > 0.0 && is_following).then_some(step)
    }
}

/// Rows of a log that tell as much as one independent row, by what a model leaves of a torque: the rule of rbd, whose
/// least is the rows of [`LEAST_SECONDS`]. 1 without times.
///
/// # Shapes
/// `residuals` (n,).
/// # Errors
/// As for [`Samples::rows_apart`].
/// # Panics
/// If there are not n residuals.
pub fn residual_correlation(samples: &Samples, residuals: &[f64]) -> Result<f64, TorqueError> {
    assert_eq!(residuals.len(), samples.n_rows());
    samples.check()?;
    if samples.timeline.t.is_empty() {
        return Ok(1.0);
    }
    let runs = runs_of(samples)?;
    let timed: Vec<_> = runs.iter().filter(|run| run.step.is_some()).collect();
    if timed.is_empty() {
        return Ok(1.0);
    }
    let of_run = |run: &&Run| -> (Vec<f64>, Vec<bool>) {
        let rows = run.rows.iter();
        (
            rows.map(|row| residuals[*row]).collect(),
            vec![true; run.rows.len()],
        )
    };
    let values: Vec<(Vec<f64>, Vec<bool>)> = timed.iter().map(of_run).collect();
    let steps: Vec<Option<f64>> = timed.iter().map(|run| run.step).collect();
    let rows: Vec<RunRows<'_>> = (values.iter().zip(&steps))
        .map(|((residuals, used), step)| RunRows {
            residuals,
            used,
            step: *step,
        })
        .collect();
    Ok(correlation(&rows, least_correlation(&steps, LEAST_SECONDS)))
}
