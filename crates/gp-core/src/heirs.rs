//! Where the searches of one stage set out, from where those of the stage before ended.

use kernels::{Covariance, TorqueCovariance};

use crate::error::GpError;
use crate::init::{StartKind, StartPoint};
use crate::optimize::Curvature;
use crate::search::SearchEnd;

/// Factor beyond which a hyperparameter that has faded is brought back.
const FADED: f64 = 10.0;

/// A point from which a stage sets out, with what is known of the curvature there.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub kind: StartKind,
    pub covariance: TorqueCovariance,
    pub noise_std: f64,
    pub curvature: Curvature,
}

impl Candidate {
    /// A start of the first stage.
    pub fn of(start: &StartPoint) -> Self {
        Self {
            kind: start.kind,
            covariance: start.covariance.clone(),
            noise_std: start.noise_std,
            curvature: Curvature::default(),
        }
    }

    fn heir(end: &SearchEnd<TorqueCovariance>) -> Self {
        Self {
            kind: end.report.kind,
            covariance: end.covariance.clone(),
            noise_std: end.noise_std,
            curvature: end.curvature.clone(),
        }
    }
}

/// Candidates of the next stage: the best end, the best end revived, the second best revived.
///
/// In this order, as the first of them may use up the work of the stage.
/// # Errors
/// [`GpError::Kernel`] if a revived hyperparameter leaves double precision.
pub(crate) fn heirs(
    ends: &[SearchEnd<TorqueCovariance>],
    scale: &TorqueCovariance,
) -> Result<Vec<Candidate>, GpError> {
    let mut ranked: Vec<&SearchEnd<TorqueCovariance>> = (ends.iter())
        .filter(|end| end.report.log_marginal.is_finite())
        .collect();
    // Stable: of equals the earlier one is first.
    ranked.sort_by(|a, b| b.report.log_marginal.total_cmp(&a.report.log_marginal));
    let mut heirs: Vec<Candidate> = ranked.iter().take(1).map(|e| Candidate::heir(e)).collect();
    for end in ranked.into_iter().take(2) {
        let mut heir = Candidate::heir(end);
        if revive(&mut heir.covariance, scale)? {
            heir.curvature = Curvature::default();
            heirs.push(heir);
        } else if heirs.len() > 1 || heir.covariance != heirs[0].covariance {
            heirs.push(heir);
        }
    }
    Ok(heirs)
}

/// Brings back what few samples did not need and more may; whether there was anything.
///
/// ```text
/// l_j ≤ 10 l_j⁰,   u_j ≥ u_j⁰/10,   w_j ≥ w_j⁰/10    with θ⁰ of eq. (22)
/// ```
/// Length scales that have run off to infinity, and weights to zero, have no
/// gradient left by which a search could find them again.
fn revive(covariance: &mut TorqueCovariance, scale: &TorqueCovariance) -> Result<bool, GpError> {
    let (mut params, scale) = (covariance.named_params(), scale.named_params());
    for (length_scale, usual) in params.length_scales.iter_mut().zip(&scale.length_scales) {
        *length_scale = length_scale.min(FADED * usual);
    }
    for (weight, usual) in params.linear_std.iter_mut().zip(&scale.linear_std) {
        *weight = weight.max(usual / FADED);
    }
    let weights = params.coulomb_std.iter_mut().flatten();
    for (weight, usual) in weights.zip(scale.coulomb_std.iter().flatten()) {
        *weight = weight.max(usual / FADED);
    }
    let revived = TorqueCovariance::new(params)?;
    let has_changed = revived.params() != covariance.params();
    *covariance = revived;
    Ok(has_changed)
}
