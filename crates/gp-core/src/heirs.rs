//! Where the searches of one stage set out, from where those of the stage before ended.

use kernels::{Covariance, TorqueCovariance};

use crate::error::GpError;
use crate::init::{StartKind, StartPoint};
use crate::search::{SearchEnd, inside_bounds};

/// Factor beyond which a hyperparameter that has faded is brought back.
const FADED: f64 = 10.0;

/// A point from which a stage sets out.
#[derive(Debug, Clone)]
pub(crate) struct Candidate {
    pub kind: StartKind,
    pub covariance: TorqueCovariance,
    pub noise_std: f64,
    /// Whether it comes from a stage with fewer samples.
    pub is_heir: bool,
}

impl Candidate {
    /// A start of the first stage.
    pub fn of(start: &StartPoint) -> Self {
        Self {
            kind: start.kind,
            covariance: start.covariance.clone(),
            noise_std: start.noise_std,
            is_heir: false,
        }
    }

    fn heir(end: &SearchEnd<TorqueCovariance>) -> Self {
        Self {
            kind: end.report.kind,
            covariance: end.covariance.clone(),
            noise_std: end.noise_std,
            is_heir: true,
        }
    }

    /// Moves hyperparameters that sit on a bound a little inside it.
    pub fn keep_inside(&mut self) {
        self.noise_std = inside_bounds(&mut self.covariance, self.noise_std);
    }
}

/// Candidates of the next stage: the best end, and the best end revived if that differs.
///
/// In this order, as the first of them may use up the work of the stage.
/// Empty if no end has a likelihood.
/// # Errors
/// [`GpError::Kernel`] if a revived hyperparameter leaves double precision.
pub(crate) fn heirs(
    best: Option<&SearchEnd<TorqueCovariance>>,
    scale: &TorqueCovariance,
) -> Result<Vec<Candidate>, GpError> {
    let mut heirs: Vec<Candidate> = best.map(Candidate::heir).into_iter().collect();
    if let Some(end) = best {
        let mut revived = Candidate::heir(end);
        if revive(&mut revived.covariance, scale)? {
            heirs.push(revived);
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

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "bounds are taken over as they are")]
mod tests {
    use kernels::TorqueParams;

    use super::*;

    fn params() -> TorqueParams {
        TorqueParams {
            bias_std: 1.0,
            linear_std: vec![2.0, 1e-12, 1.0],
            signal_std: 1.0,
            length_scales: vec![1e9, 2.0, 5.0],
            coulomb_std: Some(vec![1e-9]),
        }
    }

    #[test]
    fn what_has_faded_comes_back_to_a_tenth_of_its_usual_size() {
        let mut covariance = TorqueCovariance::new(params()).unwrap();
        let scale = TorqueCovariance::unit(1, kernels::TorqueForm::Coulomb);
        assert!(revive(&mut covariance, &scale).unwrap());
        let revived = covariance.named_params();
        assert_eq!(revived.length_scales, [10.0, 2.0, 5.0]);
        assert_eq!(revived.linear_std, [2.0, 0.1, 1.0]);
        assert_eq!(revived.coulomb_std, Some(vec![0.1]));
        // Once more there is nothing to do.
        assert!(!revive(&mut covariance, &scale).unwrap());
    }

    #[test]
    fn without_an_end_there_are_no_heirs() {
        let scale = TorqueCovariance::unit(1, kernels::TorqueForm::Coulomb);
        assert!(heirs(None, &scale).unwrap().is_empty());
    }
}
