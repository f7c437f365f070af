//! Joints learned several at a time, with a line for each that is finished.

use std::fmt::Display;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use mtgp::MtgpError;
use rayon::prelude::*;

use crate::error::CliError;
use crate::messages;
use crate::samples::JointTorques;

/// What was learned of one joint, and how long it took.
pub struct Learned<T> {
    pub joint_idx: usize,
    pub model: T,
    pub n_samples: usize,
    pub seconds: f64,
}

/// Samples up to which a joint takes seconds, and says no more than that it is learned.
const SOON_LEARNED: usize = 512;

/// Says what a long fit of a joint begins with.
pub fn tell_stage(joint: &str, n_samples: usize, stage: impl Display) {
    if n_samples > SOON_LEARNED {
        messages::note(format!("{joint}, {n_samples} samples: {stage} …"));
    }
}

/// Learns the joints side by side, each sequentially; of several failures the first joint's counts.
///
/// # Errors
/// A joint that cannot be learned from the data of `file`.
pub fn learn_all<T: Send>(
    jobs: &[JointTorques],
    joint_names: &[String],
    file: &str,
    threads: Option<NonZeroUsize>,
    learn: impl Fn(&JointTorques) -> Result<T, MtgpError> + Sync,
) -> Result<Vec<Learned<T>>, CliError> {
    let asked = threads.or(std::thread::available_parallelism().ok());
    let n_threads = asked.map_or(1, NonZeroUsize::get).min(jobs.len());
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads)
        .build()
        .map_err(|error| CliError::Usage(format!("cannot start {n_threads} threads: {error}")))?;
    let n_finished = AtomicUsize::new(0);
    let learn_one = |job: &JointTorques| {
        let started = Instant::now();
        let joint = &joint_names[job.joint_idx];
        let model = learn(job).map_err(|cause| CliError::Joint {
            file: file.to_owned(),
            joint: joint.clone(),
            cause: Box::new(cause),
        })?;
        let n_finished = n_finished.fetch_add(1, Ordering::Relaxed) + 1;
        messages::note(format!("{joint} learned ({n_finished} of {})", jobs.len()));
        Ok(Learned {
            joint_idx: job.joint_idx,
            model,
            n_samples: job.values.len(),
            seconds: started.elapsed().as_secs_f64(),
        })
    };
    let all: Vec<_> = pool.install(|| jobs.par_iter().map(learn_one).collect());
    all.into_iter().collect()
}
