//! What a fit says while it goes on, and how long each joint takes.

use std::collections::BTreeMap;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use torque_model::learn::Watch;

use crate::messages;

/// Samples up to which a joint takes seconds, and says no more than that it is learned.
const SOON_LEARNED: usize = 512;

/// A line for each joint that is finished, and for each stage of a longer one.
pub struct Progress {
    /// What stages are called, if not what the learner calls them.
    stage: Option<String>,
    n_joints: usize,
    times: Mutex<Times>,
}

/// Of joints by their names.
#[derive(Default)]
struct Times {
    begun: BTreeMap<String, Instant>,
    /// Seconds that a finished joint took.
    taken: BTreeMap<String, f64>,
}

impl Progress {
    /// Before the first joint.
    pub fn new(stage: Option<String>, n_joints: usize) -> Self {
        Self {
            stage,
            n_joints,
            times: Mutex::default(),
        }
    }

    /// Seconds that a joint took.
    pub fn seconds(&self, joint: &str) -> f64 {
        let seconds = self.times().taken.get(joint).copied();
        seconds.unwrap_or_default()
    }

    fn times(&self) -> MutexGuard<'_, Times> {
        self.times.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Watch for Progress {
    fn begins(&self, joint: &str) {
        self.times().begun.insert(joint.to_owned(), Instant::now());
    }

    fn stage(&self, joint: &str, n_samples: usize, stage: &str) {
        if n_samples > SOON_LEARNED {
            let stage = self.stage.as_deref().unwrap_or(stage);
            messages::note(format!("{joint}, {n_samples} samples: {stage} …"));
        }
    }

    fn learned(&self, joint: &str) {
        let mut times = self.times();
        let begun = times.begun.get(joint);
        let seconds = begun.map_or(0.0, |begun| begun.elapsed().as_secs_f64());
        times.taken.insert(joint.to_owned(), seconds);
        let n_finished = times.taken.len();
        messages::note(format!(
            "{joint} learned ({n_finished} of {})",
            self.n_joints
        ));
    }
}
