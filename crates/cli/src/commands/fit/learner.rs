//! The way to learn that the options ask for.

use std::path::Path;

use gp_core::{FitOptions, LikelihoodOptions, Starts};
use kernels::TorqueForm;
use mtgp::MultiTaskOptions;
use puma_dyn::Effects;
use torque_model::Robot;
use torque_model::learn::{
    DescribedContexts, InOwnUnit, Learn, Linear, ManyContexts, Ranks, RigidBody, RigidBodyForm,
    SharedParameters, SingleProcess, Tasks,
};
use torque_model::rigid_body::FitSettings;

use crate::commands::fit::args::{Args, FrictionTermsArg, ModelArg, RankArg, StartsArg};
use crate::error::CliError;
use crate::payload_folder;

/// The learner, with the robot that its parameters are of, if any.
///
/// # Errors
/// A robot that is missing or refused.
pub fn learner(args: &Args) -> Result<Box<dyn Learn>, CliError> {
    Ok(match args.model {
        ModelArg::Gpc => process(args, TorqueForm::Coulomb),
        ModelArg::Gp => process(args, TorqueForm::Smooth),
        ModelArg::Lrc => Box::new(linear(args, Linear::coulomb())),
        ModelArg::Lr => Box::new(linear(args, Linear::smooth())),
        ModelArg::Rbd => Box::new(shared_parameters(args)?),
        ModelArg::RbdGp => Box::new(rigid_body(args)?),
        ModelArg::Mgp => many_contexts(args, Tasks::Transfer(ranks(args))),
        ModelArg::Igp => many_contexts(args, Tasks::Independent),
        ModelArg::Pgp => many_contexts(args, Tasks::Pooled),
    })
}

fn linear(args: &Args, of_chapter: Linear) -> Linear {
    match (args.chapter, args.all_rows) {
        (true, _) => of_chapter,
        (false, true) => of_chapter.by_evidence(),
        (false, false) => of_chapter.by_evidence_within_runs(),
    }
}

fn process(args: &Args, form: TorqueForm) -> Box<dyn Learn> {
    let mut options = match args.starts {
        StartsArg::Chapter => FitOptions::chapter(),
        StartsArg::Several => FitOptions::several(),
    };
    options.likelihood.method = args.method.method();
    let likelihood = options.likelihood;
    of_unit(args, SingleProcess { form, options }, likelihood)
}

fn robot(args: &Args) -> Result<Robot, CliError> {
    let Some(request) = args.robot.request() else {
        return Err(CliError::Usage(format!(
            "--model {} needs the robot whose parameters it learns: --robot FILE.urdf or puma560",
            args.model.name()
        )));
    };
    request.load_with_source()
}

fn shared_parameters(args: &Args) -> Result<SharedParameters, CliError> {
    let robot = robot(args)?;
    if robot.effects != Effects::ALL {
        return Err(CliError::Usage(
            "--model rbd learns friction and rotors whatever is described of them: leave --friction and \
             --no-rotor-inertia out; --friction-terms says which terms"
                .to_owned(),
        ));
    }
    let settings = FitSettings {
        bare: args
            .bare
            .iter()
            .map(|name| name.trim().to_owned())
            .collect(),
        ..FitSettings::default()
    };
    Ok(SharedParameters {
        robot,
        terms: args.friction_terms.and_then(FrictionTermsArg::terms),
        settings,
    })
}

fn rigid_body(args: &Args) -> Result<RigidBody, CliError> {
    let mut options = FitOptions {
        starts: match args.starts {
            StartsArg::Chapter => Starts::Chapter,
            StartsArg::Several => Starts::Several,
        },
        ..FitOptions::several()
    };
    options.likelihood.method = args.method.method();
    Ok(RigidBody::new(
        robot(args)?,
        RigidBodyForm::WithProcess,
        options,
    ))
}

fn many_contexts(args: &Args, tasks: Tasks) -> Box<dyn Learn> {
    let options = multi_task_options(args);
    let likelihood = options.likelihood;
    of_unit(args, ManyContexts { tasks, options }, likelihood)
}

/// The learner of contexts with the loads of `--payloads`.
///
/// # Errors
/// A context without a payload file that is not declared bare, or with both; files that are no payloads or on
/// different links.
pub fn described_contexts(
    args: &Args,
    folder: &Path,
    contexts: &[String],
) -> Result<Box<dyn Learn>, CliError> {
    let bare: Vec<&str> = args.bare.iter().map(|name| name.trim()).collect();
    let options = multi_task_options(args);
    let likelihood = options.likelihood;
    let loads = payload_folder::read(folder, contexts, &bare)?;
    Ok(of_unit(
        args,
        DescribedContexts { loads, options },
        likelihood,
    ))
}

fn multi_task_options(args: &Args) -> MultiTaskOptions {
    let mut options = match args.starts {
        StartsArg::Chapter => MultiTaskOptions::chapter(),
        StartsArg::Several => MultiTaskOptions::several(),
    };
    options.likelihood.method = args.method.method();
    options
}

/// With the chapter's bounds, which are in N·m, or with bounds that follow the torques.
fn of_unit(
    args: &Args,
    learner: impl Learn + 'static,
    likelihood: LikelihoodOptions,
) -> Box<dyn Learn> {
    if args.chapter {
        return Box::new(learner);
    }
    Box::new(InOwnUnit {
        learner,
        likelihood,
    })
}

fn ranks(args: &Args) -> Ranks {
    match args.rank {
        Some(RankArg::Given(rank)) => Ranks::Given(rank),
        _ => Ranks::Chosen(args.criterion.unwrap_or_default().criterion()),
    }
}
