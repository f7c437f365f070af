//! The table of the fits.

use torque_model::Samples;
use torque_model::learn::{Learned, LearnedJoint};
use torque_model::rigid_body::TermChoice;

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

/// What left-out parts say of each set of friction terms, a line for each joint.
pub fn terms(samples: &Samples, choice: &TermChoice) -> String {
    let sets = choice.scores.iter().map(|(set, _)| set.name());
    let header: Vec<&str> = ["joint", "friction terms"]
        .into_iter()
        .chain(sets)
        .collect();
    let row = |joint_idx: usize| {
        let scores = choice.scores.iter().map(|(_, of_joints)| {
            let score = of_joints[joint_idx].map(f64::exp);
            score.map_or_else(|| "-".to_owned(), |nmse| format!("{nmse:.2e}"))
        });
        let names = [
            samples.joint_names[joint_idx].clone(),
            choice.kept[joint_idx].name().to_owned(),
        ];
        names.into_iter().chain(scores).collect()
    };
    let rows: Vec<Vec<String>> = samples.torques.iter().map(|of| row(of.joint_idx)).collect();
    format!(
        "nMSE of what was left out, the geometric mean, with each set of friction terms:\n{}",
        text_table::render(&header, &rows)
    )
}

/// Joints whose left-out parts the description alone predicts better than what was learned, a line for each.
pub fn worse_than_described(samples: &Samples, choice: &TermChoice) -> Vec<String> {
    let line = |joint_idx: usize| {
        let (learned, described) = choice.kept_and_described(joint_idx)?;
        (learned > described).then(|| {
            format!(
                "{}: what was left out is predicted worse than by the links as described, without friction (nMSE {:.2e} \
                 against {:.2e}): the log says too little of this joint; motions at speeds of its own help",
                samples.joint_names[joint_idx],
                learned.exp(),
                described.exp()
            )
        })
    };
    let joints = samples.torques.iter();
    joints.filter_map(|of| line(of.joint_idx)).collect()
}
