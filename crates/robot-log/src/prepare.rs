//! A recording made into samples: even time, zero-phase low-pass, accelerations, hysteresis, standing rows, decimation.
//!
//! ```text
//! q = F(unwrap q),   q̇ = F(q̇),   q̈ = F(d q̇/dt),   τ = F(τ),   z from q̇ at the full rate;   then every k-th row
//! ```
//! F is a [`LowPass`] forwards and backwards. It acts before decimation, so that nothing above the new rate is folded
//! into what is learned; commanded accelerations are never used.

use std::f64::consts::TAU;

use puma_dyn::robot::next_hysteresis;
use torque_model::rigid_body::used_rows;

use crate::error::LogError;
use crate::low_pass::{LowPass, derivative};
use crate::recording::{Measurement, Recording};
use crate::spool::Spool;
use crate::time_base::{Stretch, TimeBase};

/// Lengths of the hysteresis states that samples have columns of, rad.
pub const HYSTERESIS_LENGTHS: [f64; 2] = [5e-4, 2e-3];
/// No joint of any arm has a position, speed or torque of this size in SI units: it is garbage of the recorder.
pub const ABSURD: f64 = 1e4;
/// Cut-off where none is given, Hz.
const CUT_OFF: f64 = 10.0;
/// Rows for each period of the cut-off that are kept where nothing else is asked.
const ROWS_PER_PERIOD: f64 = 10.0;

/// How a recording is made into samples.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    /// Rate of the recording, Hz; `None`: of its stamps.
    pub rate: Option<f64>,
    /// Cut-off of the low-pass, Hz.
    pub cut_off: f64,
    /// Which rows are kept; `None`: ten for each period of the cut-off.
    pub every: Option<usize>,
    /// Whether positions are filtered too.
    pub filters_positions: bool,
    /// What the arm carries, where the log does not say.
    pub context: Option<String>,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            rate: None,
            cut_off: CUT_OFF,
            every: None,
            filters_positions: true,
            context: None,
        }
    }
}

/// Samples of one run.
#[derive(Debug)]
pub struct PreparedRun {
    /// Its label.
    pub name: String,
    /// What the arm carries; empty where nothing says.
    pub context: String,
    /// Rate before decimation, Hz.
    pub rate: f64,
    /// Which rows were kept.
    pub every: usize,
    /// Times, s, (m,).
    pub t: Vec<f64>,
    /// Of all joints, one quantity after the other as in [`Quantity::ALL`], (m, 7ℓ).
    pub columns: Spool,
}

/// What samples have of every joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// q, rad.
    Position,
    /// q̇, rad/s.
    Velocity,
    /// q̈, rad/s².
    Acceleration,
    /// τ, N·m.
    Torque,
    /// Hysteresis state of a length, by its number among [`HYSTERESIS_LENGTHS`].
    Hysteresis(usize),
    /// One where the joint moves, else zero.
    Used,
}

impl Quantity {
    /// All, in the order of columns.
    pub const ALL: [Self; 7] = [
        Self::Position,
        Self::Velocity,
        Self::Acceleration,
        Self::Torque,
        Self::Hysteresis(0),
        Self::Hysteresis(1),
        Self::Used,
    ];
}

/// What was left out or changed on the way.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Tally {
    /// Rows read.
    pub n_read: usize,
    /// Rows with a number that is not finite or absurd, and the first of them.
    pub n_garbage: usize,
    /// The first such row.
    pub first_garbage: Option<u64>,
    /// Rows of a moment that was there before.
    pub n_duplicates: usize,
    /// Gaps at which a run was cut.
    pub n_gaps: usize,
    /// Stretches too short for the filter, and their rows.
    pub n_short: usize,
    /// Rows of the samples.
    pub n_written: usize,
}

/// Reads a recording run by run, and gives each prepared stretch to `take`.
///
/// # Errors
/// A recording that cannot be read; time that runs backwards; a cut-off above half the rate; no rate where there are no
/// stamps; nothing that is long enough; what `take` fails with.
pub fn prepare<E: From<LogError>>(
    recording: &mut dyn Recording,
    settings: &Settings,
    mut take: impl FnMut(&mut PreparedRun) -> Result<(), E>,
) -> Result<Tally, E> {
    let mut preparation = Preparation {
        file: recording.file().to_owned(),
        settings,
        names: Vec::new(),
        tally: Tally::default(),
    };
    let mut raw = RawRun::new(recording);
    let mut measurement = Measurement::default();
    loop {
        let is_more = recording.next(&mut measurement)?;
        let is_same = is_more && raw.is_of(&measurement);
        if raw.n_rows() > 0 && !is_same {
            preparation.finish(raw, &mut take)?;
            raw = RawRun::new(recording);
        }
        if !is_more {
            break;
        }
        if preparation.counts(&measurement) {
            raw.push(&measurement).map_err(LogError::from)?;
        }
    }
    Ok(preparation.into_tally()?)
}

/// A recording on its way to samples.
struct Preparation<'a> {
    file: String,
    settings: &'a Settings,
    /// Of the runs so far.
    names: Vec<String>,
    tally: Tally,
}

impl Preparation<'_> {
    /// Counts a measurement; whether it is one to learn from.
    fn counts(&mut self, measurement: &Measurement) -> bool {
        let is_garbage = measurement.is_garbage();
        self.tally.n_read += 1;
        if is_garbage {
            self.tally.n_garbage += 1;
            self.tally.first_garbage.get_or_insert(measurement.row);
        }
        !is_garbage
    }

    /// Prepares a run that was read to its end, stretch by stretch.
    fn finish<E: From<LogError>>(
        &mut self,
        mut raw: RawRun,
        take: &mut impl FnMut(&mut PreparedRun) -> Result<(), E>,
    ) -> Result<(), E> {
        let label = if raw.run.is_empty() {
            stem(&self.file)
        } else {
            &raw.run
        };
        let name = unused(label, &mut self.names);
        let of_run = |cause| LogError::Run {
            file: self.file.clone(),
            run: name.clone(),
            cause: Box::new(cause),
        };
        let given = self.settings.context.as_ref();
        let given = given.filter(|_| raw.context.is_empty());
        let context = given.unwrap_or(&raw.context).clone();
        let n_rows = raw.n_rows();
        let base = raw.time_base(self.settings).map_err(of_run)?;
        self.tally.n_duplicates += base.n_duplicates(n_rows);
        self.tally.n_gaps += base.stretches.len() - 1;
        for stretch in &base.stretches {
            let mut run = match raw.prepared(&base, stretch, self.settings) {
                Ok(run) => run,
                Err(LogError::Short { .. }) => {
                    self.tally.n_short += 1;
                    continue;
                }
                Err(cause) => return Err(of_run(cause).into()),
            };
            run.name = match stretch.places.start {
                0 => name.clone(),
                _ => unused(&name, &mut self.names),
            };
            run.context.clone_from(&context);
            self.tally.n_written += run.t.len();
            take(&mut run)?;
        }
        Ok(())
    }

    fn into_tally(self) -> Result<Tally, LogError> {
        let tally = self.tally;
        if tally.n_written > 0 {
            return Ok(tally);
        }
        let what = match tally.n_read {
            0 => "no measurement in it".to_owned(),
            n if tally.n_garbage == n => format!(
                "each of the {n} rows has a number that is not finite or beyond {ABSURD} in SI units"
            ),
            n => format!("{n} rows, and no stretch without a gap is long enough for the filter"),
        };
        Err(LogError::file(self.file, what))
    }
}

impl Measurement {
    fn is_garbage(&self) -> bool {
        let numbers = self
            .position
            .iter()
            .chain(&self.velocity)
            .chain(&self.effort);
        let is_absurd = |x: &f64| !x.is_finite() || x.abs() >= ABSURD;
        numbers.into_iter().any(is_absurd) || self.t.is_some_and(|t| !t.is_finite())
    }
}

/// A run as it was recorded.
struct RawRun {
    run: String,
    context: String,
    n_joints: usize,
    has_velocity: bool,
    t: Vec<f64>,
    has_time: bool,
    /// Positions, efforts and speeds, joint by joint.
    columns: Spool,
    row: Vec<f64>,
}

impl RawRun {
    fn new(recording: &dyn Recording) -> Self {
        let (n_joints, has_velocity) = (recording.joints().len(), recording.has_velocity());
        let n_columns = if has_velocity { 3 } else { 2 } * n_joints;
        Self {
            run: String::new(),
            context: String::new(),
            n_joints,
            has_velocity,
            t: Vec::new(),
            has_time: true,
            columns: Spool::new(n_columns),
            row: Vec::with_capacity(n_columns),
        }
    }

    fn n_rows(&self) -> usize {
        self.columns.n_rows()
    }

    fn is_of(&self, measurement: &Measurement) -> bool {
        self.run == measurement.run && self.context == measurement.context
    }

    fn push(&mut self, measurement: &Measurement) -> std::io::Result<()> {
        if self.n_rows() == 0 {
            self.run.clone_from(&measurement.run);
            self.context.clone_from(&measurement.context);
            self.has_time = measurement.t.is_some();
        }
        self.t.extend(measurement.t);
        self.row.clear();
        self.row.extend_from_slice(&measurement.position);
        self.row.extend_from_slice(&measurement.effort);
        self.row.extend_from_slice(&measurement.velocity);
        self.columns.push(&self.row)
    }

    fn time_base(&mut self, settings: &Settings) -> Result<TimeBase, LogError> {
        if !self.has_time {
            let rate = settings.rate.ok_or_else(|| {
                LogError::Mapping(
                    "the log has no time: say --rate HZ, or which column has it".to_owned(),
                )
            })?;
            self.t = (0..self.n_rows()).map(|row| row as f64 / rate).collect();
        }
        let base = TimeBase::new(&self.t, settings.rate)?;
        if base.rows.len() < self.t.len() {
            self.t = base.rows.iter().map(|row| self.t[*row]).collect();
        }
        Ok(base)
    }

    /// A column at the even times of a stretch.
    fn values(
        &mut self,
        base: &TimeBase,
        stretch: &Stretch,
        column: usize,
    ) -> Result<Vec<f64>, LogError> {
        let n_rows = self.n_rows();
        let (first, last) = (stretch.places.start, stretch.places.end - 1);
        let rows = base.rows[first]..(base.rows[last] + 1).min(n_rows);
        let all = self.columns.column(column, rows.clone())?;
        let kept: Vec<f64> = base.rows[stretch.places.clone()]
            .iter()
            .map(|row| all[row - rows.start])
            .collect();
        let t = &self.t[stretch.places.clone()];
        let own = Stretch {
            places: 0..kept.len(),
            grid: stretch.grid.clone(),
        };
        Ok(own.values(t, &kept))
    }

    fn prepared(
        &mut self,
        base: &TimeBase,
        stretch: &Stretch,
        settings: &Settings,
    ) -> Result<PreparedRun, LogError> {
        let filter = LowPass::butterworth(settings.cut_off, 1.0 / base.step)?;
        let every = settings.every_of(base.step);
        let n_joints = self.n_joints;
        let t = stretch.times(&self.t).to_vec();
        let n_kept = t.len().div_ceil(every);
        let mut columns = Spool::of_columns(Quantity::ALL.len() * n_joints, n_kept);
        for joint in 0..n_joints {
            let q = unwrapped(self.values(base, stretch, joint)?);
            let tau = filter.zero_phase(&self.values(base, stretch, n_joints + joint)?)?;
            let filtered = filter.zero_phase(&q)?;
            let qd = if self.has_velocity {
                filter.zero_phase(&self.values(base, stretch, 2 * n_joints + joint)?)?
            } else {
                derivative(&filtered, base.step)
            };
            let q = if settings.filters_positions {
                filtered
            } else {
                q
            };
            let mut number = 0;
            let mut keep = |values: &[f64]| {
                let kept: Vec<f64> = values.iter().copied().step_by(every).collect();
                number += 1;
                columns.set_column((number - 1) * n_joints + joint, &kept)
            };
            keep(&q)?;
            keep(&qd)?;
            keep(&filter.zero_phase(&derivative(&qd, base.step))?)?;
            keep(&tau)?;
            for length in HYSTERESIS_LENGTHS {
                keep(&hysteresis(&t, &qd, length))?;
            }
            let used = used_rows(&t, &qd).into_iter();
            keep(
                &used
                    .map(|is_used| f64::from(u8::from(is_used)))
                    .collect::<Vec<_>>(),
            )?;
        }
        Ok(PreparedRun {
            name: String::new(),
            context: String::new(),
            rate: 1.0 / base.step,
            every,
            t: t.into_iter().step_by(every).collect(),
            columns,
        })
    }
}

impl Settings {
    fn every_of(&self, step: f64) -> usize {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a positive number of rows, far below 2³²"
        )]
        let of_cut_off = (1.0 / (step * ROWS_PER_PERIOD * self.cut_off) + 1e-9) as usize;
        self.every.unwrap_or(of_cut_off).max(1)
    }
}

/// Angles without jumps by whole turns.
///
/// A step of more than half a turn becomes that of the same angle of less; sliding joints never move so far in a step.
fn unwrapped(mut q: Vec<f64>) -> Vec<f64> {
    let mut turns = 0.0;
    let mut last = q.first().copied().unwrap_or_default();
    for q in &mut q {
        let step = *q - last;
        last = *q;
        if step.abs() > TAU / 2.0 {
            turns -= TAU * (step / TAU).round();
        }
        *q += turns;
    }
    q
}

/// Hysteresis states of a length along a run that begins at rest.
fn hysteresis(t: &[f64], qd: &[f64], length: f64) -> Vec<f64> {
    let mut z = 0.0;
    let next = |row: usize| {
        if row > 0 {
            z = next_hysteresis(z, qd[row], t[row] - t[row - 1], length);
        }
        z
    };
    (0..t.len()).map(next).collect()
}

/// A file's name without folders and extension.
fn stem(file: &str) -> &str {
    let path = std::path::Path::new(file);
    path.file_stem()
        .and_then(|stem| stem.to_str())
        .unwrap_or(file)
}

/// A name that is not taken yet: itself, or with a number.
fn unused(name: &str, taken: &mut Vec<String>) -> String {
    let mut free = name.to_owned();
    let mut number = 1;
    while taken.contains(&free) {
        number += 1;
        free = format!("{name}/{number}");
    }
    taken.push(free.clone());
    free
}
