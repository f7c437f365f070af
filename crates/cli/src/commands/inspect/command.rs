//! Reads, describes and prints.

use std::path::PathBuf;

use faer::Mat;
use mtgp::TaskCovariance;
use mtgp::prior::TaskMatrix;
use torque_model::{FitSummary, JointModel, ModelFileKind, RobotModel};

use crate::commands::inspect::description::{
    ContextDescription, Description, FitDescription, JointDescription, ParameterDescription,
    SelectionDescription, hex,
};
use crate::commands::inspect::parameters::ParametersDescription;
use crate::context_hyperparameters::full_rows;
use crate::error::CliError;
use crate::hyperparameter_file::Hyperparameters;
use crate::model_file::ModelFile;
use crate::printed::PrintArgs;

/// What a model file holds: joints, contexts, hyperparameters, how contexts are related, how it was fitted
///
/// Of a model of several contexts, K is the matrix ΛΛᵀ by which the covariance of two states is multiplied for the
/// contexts that they belong to. Only its product with the covariance is known, not its size: correlations do not
/// depend on it.
#[derive(clap::Args, Debug)]
#[command(after_long_help = EXAMPLES)]
pub struct Args {
    /// Model file of `torque-gp fit`
    #[arg(value_name = "FILE.tgp")]
    model: PathBuf,

    #[command(flatten)]
    print: PrintArgs,
}

const EXAMPLES: &str = "\
Examples:
  torque-gp inspect model.tgp
  torque-gp inspect model.tgp --json

JSON: kind; program; data_sha256; n_samples; context or contexts with the samples of each; joint_names;
rank_selection (criterion and its value for each rank); joints, each with its model, hyperparameters by the names of
`torque-gp likelihood`, k_task and correlations as rows, and fit; of rbd, parameters: bodies, loads (ten values each
with std: m, m c, I about the joint), friction of each joint, with its noise.

Exit status: 0, or 2 for bad input or usage; then there is one message.";

/// Reads a model, prints what it holds.
///
/// # Errors
/// A file that is no model.
pub fn run(args: &Args) -> Result<(), CliError> {
    let description = description(&*ModelFile::load(&args.model)?);
    args.print.print(&description, Description::text)
}

fn description(model: &RobotModel) -> Description {
    let provenance = model.provenance();
    let is_of_one = model.contexts().is_empty();
    let contexts = model.contexts().iter().zip(model.context_ranges());
    let contexts = contexts.map(|(name, ranges)| ContextDescription {
        context: name.clone(),
        n_samples: ranges.n_samples(),
    });
    let selection = model.parts().selection.as_ref();
    let joints = model.learned().iter();
    Description {
        kind: match model.kind() {
            ModelFileKind::OneContext => "one context",
            ModelFileKind::ManyContexts => "several contexts",
            ModelFileKind::RigidBody => "one context with a rigid-body prior",
            ModelFileKind::SharedParameters => "parameters of a robot, shared by joints and loads",
        },
        program: provenance.program.clone(),
        data_sha256: hex(&provenance.data_sha256),
        n_samples: model.ranges().n_samples(),
        context: (is_of_one && !provenance.context.is_empty()).then(|| provenance.context.clone()),
        contexts: (!is_of_one).then(|| contexts.collect()),
        joint_names: model.joint_names().to_vec(),
        rank_selection: selection.map(|selection| SelectionDescription {
            criterion: selection.criterion.clone(),
            ranks: selection.values.iter().map(|(rank, _)| *rank).collect(),
            values: selection.values.iter().map(|(_, value)| *value).collect(),
        }),
        joints: joints
            .map(|(idx, joint)| of_joint(model, &model.joint_names()[*idx], joint))
            .collect(),
        parameters: (model.rigid_body()).map(|posterior| ParametersDescription::of(posterior)),
    }
}

fn of_joint(model: &RobotModel, name: &str, joint: &JointModel) -> JointDescription {
    let noise_std = joint.noise_std();
    let covariance = joint.input_covariance();
    let mut hyperparameters = covariance.map(|of| Hyperparameters::of(of, noise_std));
    if let (Some(of), Some(covariance)) = (&mut hyperparameters, covariance) {
        let turning = covariance.continuous().indices().iter();
        let names: Vec<String> = turning
            .map(|idx| model.joint_names()[*idx].clone())
            .collect();
        of.continuous = (!names.is_empty()).then_some(names);
    }
    let task = joint.tasks().map(|process| process.covariance().task());
    if let (Some(of), Some(TaskCovariance::Factor(factor))) = (&mut hyperparameters, task) {
        let rows = full_rows(factor.n_tasks(), factor.rank(), &factor.entries());
        of.contexts = Some(model.contexts().to_vec());
        of.task_factor = Some(rows);
    }
    let rows = |matrix: Mat<f64>| -> Vec<Vec<f64>> {
        let rows = matrix.row_iter();
        rows.map(|row| row.iter().copied().collect()).collect()
    };
    JointDescription {
        joint: name.to_owned(),
        model: joint.name(),
        hyperparameters,
        parameters: (joint.spread()).map(|spread| ParameterDescription { spread, noise_std }),
        k_task: task.map(|task| rows(task.k_task())),
        correlations: task.map(|task| rows(task.correlations())),
        fit: joint.summary().map(fit),
    }
}

fn fit(summary: &FitSummary) -> FitDescription {
    FitDescription {
        log_marginal_likelihood: summary.log_marginal,
        error_bound: summary.error_bound,
        start: summary.start.clone(),
        n_starts: summary.n_starts,
        evaluations: summary.evaluations,
        bounds_hit: summary.bounds_hit.clone(),
        condition_lower_bound: summary.condition_lower_bound,
        method: summary.method.clone(),
        rank: summary.rank,
    }
}
