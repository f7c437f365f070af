//! A load changed for another in mid-motion, with feed-forward of whichever load the tracker believes in.

use mtgp::MtgpError;
use mtgp::context::{ContextPrior, ContextTracker, ContextTransition, Outliers};
use puma_dyn::motion::{FeedForward, JointState, ReferenceMotion, Tick};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use torque_model::RobotModel;

use super::plant::{Control, PERIOD, Plant, Tally};
use super::settings::Settings;
use super::source::TorqueTable;
use crate::dataset::N_JOINTS;
use crate::error::BenchError;

/// Time before the change from which on the tracker is asked, s.
const BEFORE: f64 = 0.25;
/// Time after it up to which the tracker is asked, and over which errors are compared, s.
const AFTER: f64 = 0.75;

/// Who says which load it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Belief {
    /// The load of before, for ever.
    Unaware,
    /// The tracker.
    Tracked,
    /// The truth.
    Told,
}

impl Belief {
    /// All, in the order of the tables.
    pub const ALL: [Self; 3] = [Self::Unaware, Self::Tracked, Self::Told];

    /// Name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Unaware => "unaware",
            Self::Tracked => "tracked",
            Self::Told => "told",
        }
    }
}

/// What came of one change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Change {
    /// Loads, from 1.
    pub from: usize,
    pub to: usize,
    /// Root mean square error after the change, rad, of each belief.
    pub errors: [f64; 3],
    /// Time after which the tracker says the new load up to the end of its watch, s; infinite if it does not.
    pub delay: f64,
}

/// Feed-forward of the believed load.
struct Believed<'a> {
    tables: &'a [TorqueTable],
    current: usize,
    tick: usize,
    tracker: Option<ContextTracker>,
    /// Ticks in which the tracker is asked.
    watch: std::ops::Range<usize>,
    /// First tick since which the tracker has said `expected`.
    found_at: Option<usize>,
    expected: usize,
    fault: Option<MtgpError>,
}

impl FeedForward for Believed<'_> {
    fn torques(&mut self, _desired: &JointState, tau: &mut [f64]) {
        self.tables[self.current].row(self.tick, tau);
    }

    /// The state half-way between two ticks, with the torques that were held.
    fn observe(&mut self, tick: &Tick<'_>) {
        if let Some(tracker) = (self.tracker.as_mut()).filter(|_| self.watch.contains(&self.tick)) {
            let (mut x, mut torques) = ([0.0; 3 * N_JOINTS], [None; N_JOINTS]);
            for joint in 0..N_JOINTS {
                let (before, after) = (tick.qd[joint], tick.next_qd[joint]);
                x[joint] = 0.5 * (tick.q[joint] + tick.next_q[joint]);
                x[N_JOINTS + joint] = 0.5 * (before + after);
                x[2 * N_JOINTS + joint] = (after - before) / PERIOD;
                // A joint that stops or turns back has no one friction torque in this time.
                torques[joint] = (before * after > 0.0).then_some(tick.tau[joint]);
            }
            match tracker.step(&x, &torques) {
                Ok(_) => self.current = tracker.filter().most_probable(),
                Err(error) => self.fault = Some(error),
            }
            let is_right = self.current == self.expected;
            self.found_at = is_right.then(|| self.found_at.unwrap_or(self.tick));
        }
        self.tick += 1;
    }
}

/// Runs of every pair of loads.
pub struct Switching<'a> {
    pub plant: &'a Plant,
    pub model: &'a RobotModel,
    pub settings: &'a Settings,
    pub reference: &'a ReferenceMotion,
    /// Torques of the mGP for every load.
    pub tables: &'a [TorqueTable],
}

impl Switching<'_> {
    /// All changes of the settings, in their order.
    ///
    /// # Errors
    /// `MultiTask`, `Dynamics`.
    pub fn changes(&self) -> Result<Vec<Change>, BenchError> {
        let pairs = self.settings.switch.pairs.par_iter();
        pairs.map(|(from, to)| self.change(*from, *to)).collect()
    }

    fn change(&self, from: usize, to: usize) -> Result<Change, BenchError> {
        let mut change = Change {
            from,
            to,
            errors: [0.0; 3],
            delay: f64::INFINITY,
        };
        for (belief, error) in Belief::ALL.into_iter().zip(&mut change.errors) {
            let (rms, delay) = self.follow(belief, from, to)?;
            *error = rms;
            if belief == Belief::Tracked {
                change.delay = delay;
            }
        }
        Ok(change)
    }

    /// Error after the change, rad, and the delay of the tracker, s.
    fn follow(&self, belief: Belief, from: usize, to: usize) -> Result<(f64, f64), BenchError> {
        let Settings {
            switch,
            damping_ratio,
            n_steps,
            ..
        } = self.settings;
        let control = Control {
            bandwidth: switch.bandwidth,
            damping_ratio: *damping_ratio,
            n_steps: *n_steps,
        };
        let controller = self.plant.controller(control)?;
        let context = self.plant.context(from)?;
        let mut robot = self.plant.control_loop(self.reference, context, *n_steps)?;

        let at = robot.n_ticks() / 2;
        let [before, after] = [BEFORE, AFTER].map(ticks);
        let mut feed_forward = Believed {
            tables: self.tables,
            current: from - 1,
            tick: 0,
            tracker: (belief == Belief::Tracked)
                .then(|| self.tracker())
                .transpose()?,
            watch: at.saturating_sub(before)..at + after,
            found_at: None,
            expected: to - 1,
            fault: None,
        };
        let time = |tick: usize| PERIOD * (tick as f64 - 0.5); // between two ticks
        robot.run(&controller, &mut feed_forward, time(at), |_| {})?;
        robot.arm_mut().set_context(self.plant.context(to)?);
        feed_forward.found_at = None;
        if belief == Belief::Told {
            feed_forward.current = to - 1;
        }
        let mut tally = Tally::default();
        let end = time(at + after);
        robot.run(&controller, &mut feed_forward, end, |tick| tally.add(tick))?;
        if let Some(fault) = feed_forward.fault {
            return Err(fault.into());
        }
        let found = feed_forward.found_at;
        let delay = found.map_or(f64::INFINITY, |tick| PERIOD * (tick + 1 - at) as f64);
        Ok((tally.outcome().error(), delay))
    }

    fn tracker(&self) -> Result<ContextTracker, BenchError> {
        let m = self.model.contexts().len();
        let posteriors = self.model.tasks().map(|(_, process)| &process.posterior);
        let prior = ContextPrior::uniform(m)?;
        let switch = &self.settings.switch;
        let chain = ContextTransition::switching(m, switch.rate, PERIOD)?;
        let tracker = ContextTracker::new(posteriors, switch.window, &prior, chain)?;
        let outliers = Outliers::new(switch.outlier_probability, switch.outlier_spread)?;
        Ok(tracker.with_outliers(outliers))
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a number of ticks is positive and small"
)]
fn ticks(time: f64) -> usize {
    (time / PERIOD).round() as usize
}
