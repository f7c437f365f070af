//! A log cut into runs, with the rows that count for each joint.

use std::collections::BTreeMap;
use std::ops::Range;

use puma_dyn::robot::next_hysteresis;

use crate::error::TorqueError;
use crate::rigid_body::correlation::median;
use crate::samples::Samples;
use crate::timeline::{HysteresisColumns, is_same_length};

/// Speed below which a joint stands, rad/s.
pub(crate) const STANDING_SPEED: f64 = 0.01;
/// Time before and after a row in which a standing joint stands, s.
pub(crate) const STANDING_SECONDS: f64 = 0.5;
/// Way after which the hysteresis of a run's start is forgotten, rad: three times the longest length.
pub(crate) const FORGETTING_WAY: f64 = 0.006;
/// Longest step at which the rule of standing rows tells something, s.
pub(crate) const LONGEST_STEP: f64 = 0.05;
/// Part by which the steps of a log's runs may differ.
const STEP_TOLERANCE: f64 = 0.1;

/// One run: rows of one context and label, in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Run {
    /// Its label.
    pub name: String,
    /// Number of its context.
    pub context: usize,
    /// Its rows among the samples.
    pub rows: Vec<usize>,
    /// Its place among the rows of all runs.
    pub span: Range<usize>,
    /// Median step, s.
    pub step: Option<f64>,
}

/// Samples in runs.
#[derive(Debug, Clone)]
pub(crate) struct Log<'a> {
    pub samples: &'a Samples,
    pub runs: Vec<Run>,
    /// Whether a row counts for a joint, (n, ℓ), in the order of the runs.
    used: Vec<bool>,
}

impl<'a> Log<'a> {
    /// The runs of samples, each row in the context of its own.
    ///
    /// # Errors
    /// [`TorqueError::Log`] for time that does not rise within a run; samples that do not fit together.
    pub fn new(samples: &'a Samples) -> Result<Self, TorqueError> {
        samples.check()?;
        let mut log = Self {
            samples,
            runs: runs_of(samples)?,
            used: Vec::new(),
        };
        log.used = log.used_rows();
        Ok(log)
    }

    /// The same of some of the runs.
    #[must_use]
    pub fn of_runs(&self, kept: &[usize]) -> Self {
        let n_joints = self.samples.n_joints();
        let mut part = Self {
            samples: self.samples,
            runs: Vec::new(),
            used: Vec::new(),
        };
        for run in kept.iter().map(|run| &self.runs[*run]) {
            let start = part.n_rows();
            let span = run.span.start * n_joints..run.span.end * n_joints;
            part.used.extend_from_slice(&self.used[span]);
            part.runs.push(Run {
                span: start..start + run.rows.len(),
                ..run.clone()
            });
        }
        part
    }

    /// The same runs, of whose rows only some count, by their places among those of all runs.
    #[must_use]
    pub fn counting(&self, counts: impl Fn(usize) -> bool) -> Self {
        let mut part = self.clone();
        let n_joints = self.samples.n_joints();
        for (place, used) in part.used.chunks_exact_mut(n_joints).enumerate() {
            if !counts(place) {
                used.fill(false);
            }
        }
        part
    }

    /// Rows of all runs.
    pub fn n_rows(&self) -> usize {
        self.runs.last().map_or(0, |run| run.span.end)
    }

    /// Whether a row, by its place among those of all runs, counts for a joint.
    pub fn is_used(&self, place: usize, joint: usize) -> bool {
        self.used[place * self.samples.n_joints() + joint]
    }

    /// Number of rows that count for a joint.
    pub fn n_used(&self, joint: usize) -> usize {
        (0..self.n_rows())
            .filter(|place| self.is_used(*place, joint))
            .count()
    }

    /// Median steps of the runs, s.
    pub fn steps(&self) -> Vec<Option<f64>> {
        self.runs.iter().map(|run| run.step).collect()
    }

    /// Median of the runs' steps, s; `None` where one of them has none.
    pub fn step(&self) -> Option<f64> {
        let steps: Option<Vec<f64>> = self.steps().into_iter().collect();
        steps.filter(|steps| !steps.is_empty()).map(median)
    }

    /// # Errors
    /// [`TorqueError::Log`] with two runs whose rows are not as far apart as each other's.
    pub fn require_one_step(&self) -> Result<(), TorqueError> {
        let (Some(step), Some(first)) = (self.step(), self.runs.first()) else {
            return Ok(());
        };
        let is_other = |run: &&Run| {
            let of_run = run.step.unwrap_or(step);
            (of_run / step - 1.0).abs() > STEP_TOLERANCE
        };
        let Some(other) = self.runs.iter().find(is_other) else {
            return Ok(());
        };
        Err(TorqueError::Log {
            what: format!(
                "the rows of run `{}` are {} s apart, those of run `{}` {} s: bring all runs to one rate before",
                other.name,
                other.step.unwrap_or(step),
                first.name,
                first.step.unwrap_or(step)
            ),
        })
    }

    /// Steps of the training data between neighbouring rows of a run.
    ///
    /// Infinite for a single row, which tells all that it can; 1 where there is no time.
    pub fn spacing(&self, run: &Run, training_step: Option<f64>) -> f64 {
        let n = run.rows.len();
        if n < 2 {
            return f64::INFINITY;
        }
        let t = &self.samples.timeline.t;
        match training_step {
            Some(step) if !t.is_empty() => {
                (t[run.rows[n - 1]] - t[run.rows[0]]) / (n - 1) as f64 / step
            }
            _ => 1.0,
        }
    }

    /// # Errors
    /// [`TorqueError::Log`] where there are neither times nor states of a length.
    pub fn require_memory(&self, lengths: &[f64]) -> Result<(), TorqueError> {
        let timeline = &self.samples.timeline;
        let missing = lengths
            .iter()
            .find(|length| timeline.t.is_empty() && self.given(**length).is_none());
        let Some(length) = missing else {
            return Ok(());
        };
        let mrad = 1e3 * length;
        Err(TorqueError::Log {
            what: format!(
                "friction with memory needs a column t, or the columns z{mrad}_<joint> of its state"
            ),
        })
    }

    /// The hysteresis states at a row of a run, from those at the one before: (lengths, ℓ).
    pub fn advance(&self, run: &Run, row: usize, lengths: &[f64], z: &mut [f64]) {
        let (samples, n_joints) = (self.samples, self.samples.n_joints());
        let (place, t) = (run.rows[row], &samples.timeline.t);
        for (length, z) in lengths.iter().zip(z.chunks_exact_mut(n_joints)) {
            if let Some(given) = self.given(*length) {
                z.copy_from_slice(&given.z[place * n_joints..(place + 1) * n_joints]);
            } else if row > 0 {
                let step = t[place] - t[run.rows[row - 1]];
                for (joint, z) in z.iter_mut().enumerate() {
                    *z = next_hysteresis(*z, samples.x[(place, n_joints + joint)], step, *length);
                }
            }
        }
    }

    /// States of a length that the log has columns of.
    fn given(&self, length: f64) -> Option<&HysteresisColumns> {
        let mut columns = self.samples.timeline.hysteresis.iter();
        columns.find(|of| is_same_length(of.length, length))
    }

    fn used_rows(&self) -> Vec<bool> {
        let n_joints = self.samples.n_joints();
        let given = &self.samples.timeline.used;
        let mut used = vec![true; self.n_rows() * n_joints];
        for run in &self.runs {
            let of_run = &mut used[run.span.start * n_joints..run.span.end * n_joints];
            if !given.is_empty() {
                for (used, row) in of_run.chunks_exact_mut(n_joints).zip(&run.rows) {
                    used.copy_from_slice(&given[row * n_joints..(row + 1) * n_joints]);
                }
            } else if run.step.is_some_and(|step| step <= LONGEST_STEP + 1e-9) {
                for joint in 0..n_joints {
                    let (t, qd) = (self.times(run), self.speeds(run, joint));
                    let of_joint = used_rows(&t, &qd);
                    for (row, is_used) in of_joint.into_iter().enumerate() {
                        of_run[row * n_joints + joint] = is_used;
                    }
                }
            }
        }
        used
    }

    fn times(&self, run: &Run) -> Vec<f64> {
        let t = &self.samples.timeline.t;
        run.rows.iter().map(|row| t[*row]).collect()
    }

    fn speeds(&self, run: &Run, joint: usize) -> Vec<f64> {
        let column = self.samples.n_joints() + joint;
        let x = &self.samples.x;
        run.rows.iter().map(|row| x[(*row, column)]).collect()
    }
}

/// Rows of a joint that count: it moves within half a second of them, and has moved 6 mrad since the run began.
///
/// # Shapes
/// `t`, s, and `qd`, rad/s, (n,).
pub fn used_rows(t: &[f64], qd: &[f64]) -> Vec<bool> {
    let mut way = 0.0;
    let mut used = moving(t, qd);
    for (row, used) in used.iter_mut().enumerate() {
        if row > 0 && qd[row].abs() >= STANDING_SPEED {
            way += qd[row].abs() * (t[row] - t[row - 1]);
        }
        *used &= way >= FORGETTING_WAY;
    }
    used
}

/// Rows with a speed of at least 0.01 rad/s within half a second before or after them.
pub(crate) fn moving(t: &[f64], qd: &[f64]) -> Vec<bool> {
    let mut is_moving = vec![false; qd.len()];
    let mut mark = |order: &mut dyn Iterator<Item = usize>| {
        let mut last: Option<f64> = None;
        for row in order {
            if qd[row].abs() >= STANDING_SPEED {
                last = Some(t[row]);
            }
            let is_near = |last: f64| (t[row] - last).abs() <= STANDING_SECONDS;
            is_moving[row] |= last.is_some_and(is_near);
        }
    };
    mark(&mut (0..qd.len()));
    mark(&mut (0..qd.len()).rev());
    is_moving
}

/// The rows of each label of each context; without labels a context's rows, cut where time falls.
///
/// # Errors
/// [`TorqueError::Log`] for time that does not rise within a run.
pub(crate) fn runs_of(samples: &Samples) -> Result<Vec<Run>, TorqueError> {
    let timeline = &samples.timeline;
    let mut runs: Vec<Run> = Vec::new();
    let mut last_of: BTreeMap<(usize, Option<usize>), usize> = BTreeMap::new();
    let falls = |before: usize, row: usize| {
        (timeline.t.get(before).zip(timeline.t.get(row))).is_some_and(|(before, t)| t < before)
    };
    for row in 0..samples.n_rows() {
        let context = samples.context_of.get(row).copied().unwrap_or(0);
        let label = timeline.run_of.get(row).copied();
        let known = last_of.get(&(context, label)).copied();
        let run = match known {
            Some(run) if label.is_some() || !falls(*runs[run].rows.last().unwrap_or(&row), row) => {
                run
            }
            _ => {
                runs.push(Run {
                    name: name_of(samples, label, runs.len()),
                    context,
                    rows: Vec::new(),
                    span: 0..0,
                    step: None,
                });
                runs.len() - 1
            }
        };
        last_of.insert((context, label), run);
        runs[run].rows.push(row);
    }
    let mut place = 0;
    for run in &mut runs {
        run.span = place..place + run.rows.len();
        place = run.span.end;
        run.step = step_of(run, &timeline.t)?;
    }
    Ok(runs)
}

fn name_of(samples: &Samples, label: Option<usize>, number: usize) -> String {
    let name = label.map(|label| samples.timeline.run_names[label].clone());
    name.unwrap_or_else(|| (number + 1).to_string())
}

/// Median step of a run, s; `None` without times or of a single row.
fn step_of(run: &Run, t: &[f64]) -> Result<Option<f64>, TorqueError> {
    if t.is_empty() || run.rows.len() < 2 {
        return Ok(None);
    }
    let pairs = run.rows.windows(2);
    let steps: Vec<f64> = pairs.clone().map(|pair| t[pair[1]] - t[pair[0]]).collect();
    let rises = |step: &f64| *step > 0.0; // not so of NaN
    let fault = steps.iter().position(|step| !rises(step));
    if let Some(row) = fault {
        let (before, after) = (run.rows[row], run.rows[row + 1]);
        return Err(TorqueError::Log {
            what: format!(
                "row {}: time does not rise in run `{}`: {} s after {} s",
                after + 1,
                run.name,
                t[after],
                t[before]
            ),
        });
    }
    Ok(Some(median(steps)))
}
