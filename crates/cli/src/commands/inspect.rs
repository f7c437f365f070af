//! `torque-gp inspect`: what a model file says of itself.

mod description;

use std::path::PathBuf;

use gp_core::{FitSummary, InformedModel, ModelFileKind, TorqueModel, TrainingRanges};
use mtgp::prior::TaskMatrix;
use mtgp::{MultiTaskModel, TaskCovariance, TaskProcess};
use serde::Serialize;

use crate::commands::inspect::description::{
    Description, FitDescription, JointDescription, ParameterDescription,
};
use crate::context_hyperparameters::full_rows;
use crate::error::CliError;
use crate::hyperparameter_file::Hyperparameters;
use crate::model_file::LearnedModel;
use crate::printed::PrintArgs;
use crate::rigid_body_model::RigidBodyModel;

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
`torque-gp likelihood`, k_task and correlations as rows, and fit.

Exit status: 0, or 2 for bad input or usage; then there is one message.";

/// Reads a model, prints what it holds.
///
/// # Errors
/// A file that is no model.
pub fn run(args: &Args) -> Result<(), CliError> {
    let description = match LearnedModel::load(&args.model)? {
        LearnedModel::OneContext(model) => of_one_context(&model),
        LearnedModel::ManyContexts(model) => of_many_contexts(&model),
        LearnedModel::RigidBody(model) => of_rigid_body(&model),
    };
    args.print.print(&description, Description::text)
}

/// A context and its data.
#[derive(Serialize)]
pub struct ContextDescription {
    pub context: String,
    pub n_samples: usize,
}

/// How the rank was chosen.
#[derive(Serialize)]
pub struct SelectionDescription {
    pub criterion: String,
    pub ranks: Vec<usize>,
    pub values: Vec<f64>,
}

fn of_one_context(model: &TorqueModel) -> Description {
    let joint = |(joint_idx, joint): &(usize, gp_core::JointModel)| JointDescription {
        joint: model.joint_names()[*joint_idx].clone(),
        model: joint.kind().to_string(),
        hyperparameters: match joint {
            gp_core::JointModel::Linear(_) => None,
            gp_core::JointModel::Process(process) => {
                let posterior = &process.posterior;
                Some(Hyperparameters::of(
                    posterior.covariance(),
                    posterior.noise_std(),
                ))
            }
        },
        parameters: None,
        k_task: None,
        correlations: None,
        fit: joint.summary().map(fit),
    };
    let context = model.provenance().context.clone();
    Description {
        context: (!context.is_empty()).then_some(context),
        joints: model.learned().iter().map(joint).collect(),
        ..Description::new(
            ModelFileKind::OneContext,
            model.joint_names(),
            model.provenance(),
            model.ranges(),
        )
    }
}

fn of_rigid_body(model: &RigidBodyModel) -> Description {
    let joint = |(joint_idx, joint): &(usize, InformedModel)| JointDescription {
        joint: model.joint_names()[*joint_idx].clone(),
        model: joint.name().to_owned(),
        hyperparameters: (joint.remainder())
            .map(|covariance| Hyperparameters::of(covariance, joint.noise_std())),
        parameters: Some(ParameterDescription {
            spread: joint.spread(),
            noise_std: joint.noise_std(),
        }),
        k_task: None,
        correlations: None,
        fit: Some(fit(joint.summary())),
    };
    let context = model.provenance().context.clone();
    Description {
        context: (!context.is_empty()).then_some(context),
        joints: model.learned().iter().map(joint).collect(),
        ..Description::new(
            ModelFileKind::RigidBody,
            model.joint_names(),
            model.provenance(),
            model.ranges(),
        )
    }
}

fn of_many_contexts(model: &MultiTaskModel) -> Description {
    let contexts = model.contexts().iter().zip(model.context_ranges());
    let selection = model.parts().selection.as_ref();
    Description {
        contexts: Some(
            contexts
                .map(|(name, ranges)| context(name, ranges))
                .collect(),
        ),
        rank_selection: selection.map(|selection| SelectionDescription {
            criterion: selection.criterion.clone(),
            ranks: selection.values.iter().map(|(rank, _)| *rank).collect(),
            values: selection.values.iter().map(|(_, value)| *value).collect(),
        }),
        joints: (model.learned().iter())
            .map(|(joint_idx, process)| {
                task_joint(model, &model.joint_names()[*joint_idx], process)
            })
            .collect(),
        ..Description::new(
            ModelFileKind::ManyContexts,
            model.joint_names(),
            model.provenance(),
            model.ranges(),
        )
    }
}

fn context(name: &str, ranges: &TrainingRanges) -> ContextDescription {
    ContextDescription {
        context: name.to_owned(),
        n_samples: ranges.n_samples(),
    }
}

fn task_joint(model: &MultiTaskModel, joint: &str, process: &TaskProcess) -> JointDescription {
    let covariance = process.covariance();
    let task = covariance.task();
    let noise_std = process.posterior.noise_std();
    let mut hyperparameters = Hyperparameters::of(covariance.input(), noise_std);
    if let TaskCovariance::Factor(factor) = task {
        let rows = full_rows(factor.n_tasks(), factor.rank(), &factor.entries());
        hyperparameters.contexts = Some(model.contexts().to_vec());
        hyperparameters.task_factor = Some(rows);
    }
    let rows = |matrix: faer::Mat<f64>| -> Vec<Vec<f64>> {
        let rows = matrix.row_iter();
        rows.map(|row| row.iter().copied().collect()).collect()
    };
    JointDescription {
        joint: joint.to_owned(),
        model: process.name(),
        hyperparameters: Some(hyperparameters),
        parameters: None,
        k_task: Some(rows(task.k_task())),
        correlations: Some(rows(task.correlations())),
        fit: Some(fit(&process.summary)),
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
