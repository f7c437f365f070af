//! A robot identified: the posterior of its parameters, and how its friction was chosen.

use std::sync::Arc;

use puma_dyn::dynamics::inertial_parameters;
use puma_dyn::{Context, Model};

use crate::error::TorqueError;
use crate::rigid_body::choice::{TermChoice, choose_terms};
use crate::rigid_body::fit::{FitSettings, fit_passes};
use crate::rigid_body::log::Log;
use crate::rigid_body::posterior::ParameterPosterior;
use crate::rigid_body::term_set::TermSet;
use crate::samples::Samples;

/// What a fit gives.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// The posterior of bodies, friction and loads.
    pub posterior: ParameterPosterior,
    /// How the friction terms were chosen, if they were.
    pub choice: Option<TermChoice>,
}

/// Learns a robot's parameters from samples of one or several loads.
///
/// Five passes over the rows, in closed form: O(n p²) for n rows and p unknowns, and no matrix of order n.
/// Without given terms each joint has those that predict left-out runs best: see [`TermChoice`].
/// # Errors
/// [`TorqueError::Log`] for times that do not rise, runs of different rates, and friction with memory without times;
/// contexts said to be bare that there are not; states of another robot or not finite; numbers that overflow.
/// # Source
/// Sec. 3.2 for the prior about a description; Swevers, Verdonck & De Schutter 2007, "Dynamic model identification for
/// industrial robots", IEEE Control Systems Magazine 27(5), for the estimate.
pub fn fit(
    robot: &Arc<Model>,
    samples: &Samples,
    terms: Option<TermSet>,
    settings: &FitSettings,
) -> Result<Fitted, TorqueError> {
    let log = Log::new(samples)?;
    let described = inertial_parameters(robot, &Context::empty());
    let choice = match terms {
        Some(_) => None,
        None => Some(choose_terms(robot, &described, &log, settings)?),
    };
    let given = || vec![terms.unwrap_or(TermSet::Minimal); robot.n_joints()];
    let sets = choice
        .as_ref()
        .map_or_else(given, |choice| choice.kept.clone());
    let passes = fit_passes(robot, &described, &log, &sets, settings)?;
    Ok(Fitted {
        posterior: passes.into_last()?,
        choice,
    })
}
