use crate::error::TorqueError;
use crate::rigid_body::{
    choice::TermChoice,
    fit::{FitSettings, fit_passes},
    log::Log,
    posterior::ParameterPosterior,
    term_set::TermSet,
};
use crate::samples::Samples;
use puma_dyn::{Context, Model, dynamics::inertial_parameters};
use std::sync::Arc;
#[derive(Debug, Clone)]
pub struct Fitted {
    pub posterior: ParameterPosterior,
    pub choice: Option<TermChoice>,
}
pub fn fit(
    robot: &Arc<Model>,
    samples: &Samples,
    terms: Option<TermSet>,
    settings: &FitSettings,
) -> Result<Fitted, TorqueError> {
    let log = Log::new(samples)?;
    let described = inertial_parameters(robot, &Context::empty());
    let sets = vec![terms.unwrap_or(TermSet::Minimal); robot.n_joints()];
    Ok(Fitted {
        posterior: fit_passes(robot, &described, &log, &sets, settings)?.into_last()?,
        choice: None,
    })
}
