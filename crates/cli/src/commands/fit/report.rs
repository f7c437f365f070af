//! The table of the fits.

use torque_model::Samples;
use torque_model::learn::{Learned, LearnedJoint};

use crate::commands::fit::progress::Progress;
use crate::text_table;

const HEADER: [&str; 11] = [
    "joint",
    "model",
    "samples",
    "log likelihood",
    "error bound",
    "start",
    "evaluations",
    "noise std (N·m)",
    "factor",
    "seconds",
    "bounds hit",
];

/// The table, a line for each joint.
pub fn table(samples: &Samples, learned: &Learned, progress: &Progress) -> String {
    let row = |joint: &LearnedJoint| {
        let name = &samples.joint_names[joint.joint_idx];
        entries(joint, name, samples.n_rows(), progress.seconds(name))
    };
    let rows: Vec<Vec<String>> = learned.joints.iter().map(row).collect();
    text_table::render(&HEADER, &rows)
}

/// A line, with dashes for what models without hyperparameters do not have.
fn entries(joint: &LearnedJoint, name: &str, n_samples: usize, seconds: f64) -> Vec<String> {
    let (model, summary) = (&joint.model, joint.model.summary());
    let entry = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
    let bounds = summary
        .map(|s| s.bounds_hit.join(" "))
        .filter(|names| !names.is_empty());
    let error_bound = summary.and_then(|s| s.error_bound);
    vec![
        name.to_owned(),
        model.name(),
        n_samples.to_string(),
        entry(summary.map(|s| format!("{:.3}", s.log_marginal))),
        entry(error_bound.map(|bound| format!("{bound:.1e}"))),
        entry(summary.map(|s| s.start.clone())),
        entry(summary.map(|s| s.evaluations.to_string())),
        format!("{:.3e}", model.noise_std()),
        entry(summary.map(|s| format!("{}, rank {}", s.method, s.rank))),
        format!("{seconds:.1}"),
        entry(bounds),
    ]
}
