//! A task matrix to start from, estimated from a model that has none: eq. (28).
//!
//! Were all tasks observed at all ν distinct inputs, TᵀK⁻¹T/ν would estimate K^ρ,
//! eq. (27). Where they are not, the model of stage 1 fills in.

use faer::{Mat, MatRef};
use gp_core::{LikelihoodOptions, Posterior};
use kernels::TorqueCovariance;

use super::task_fit::TaskFit;
use crate::error::MtgpError;
use crate::prior::Stacked;

/// The torques of all tasks at all distinct inputs.
#[derive(Debug, Clone)]
pub struct AugmentedTargets {
    /// The distinct inputs, (ν, 3ℓ).
    pub x: Mat<f64>,
    /// T_aug, (ν, m): observed where there is an observation (the mean of several),
    /// else the posterior mean of the noise-free torque.
    pub t_aug: Mat<f64>,
}

/// Fills the torques that were not observed with a model's posterior means.
///
/// # Shapes
/// `targets` (n,), in the order of the rows of `data`.
/// # Errors
/// [`MtgpError::Gp`] if the model is of another robot.
/// # Panics
/// If there is not one target per row.
/// # Source
/// A.3.2, between eqs. (27) and (28).
pub fn augmented_targets(
    data: &Stacked,
    targets: &[f64],
    model: &TaskFit,
) -> Result<AugmentedTargets, MtgpError> {
    assert_eq!(targets.len(), data.tasks().len(), "one target per row");
    let (x, input_of_row) = data.unique_inputs();
    let mut t_aug = Mat::zeros(x.nrows(), data.n_tasks());
    for task in 0..data.n_tasks() {
        let means = model.predict_mean(task, x.as_ref())?;
        t_aug.col_as_slice_mut(task).copy_from_slice(&means);
    }

    let mut observations = Mat::<f64>::zeros(x.nrows(), data.n_tasks());
    let mut sums = Mat::<f64>::zeros(x.nrows(), data.n_tasks());
    for ((&task, &input), target) in data.tasks().iter().zip(&input_of_row).zip(targets) {
        observations[(input, task)] += 1.0;
        sums[(input, task)] += target;
        t_aug[(input, task)] = sums[(input, task)] / observations[(input, task)];
    }
    Ok(AugmentedTargets { x, t_aug })
}

/// K^ρ_aug of eq. (28).
///
/// ```text
/// K_aug = T_augᵀ (K^x + η²I)⁻¹ T_aug / ν      η² = tr(T_augᵀT_aug)/(mν)
/// ```
/// The solutions come from the residuals of a posterior with noise η,
/// (K^x + η²I)⁻¹t = (t − mean)/η², so that many inputs cost no more than the rank of
/// K^x beside the large η² asks for.
/// Zero if all torques are.
/// # Shapes
/// (m, m), symmetric.
/// # Errors
/// [`MtgpError::Gp`] if K^x + η²I has no factor.
/// # Source
/// Eq. (28).
pub fn augmented_k_task(
    input: &TorqueCovariance,
    augmented: &AugmentedTargets,
    likelihood: LikelihoodOptions,
) -> Result<Mat<f64>, MtgpError> {
    let t_aug = augmented.t_aug.as_ref(); // (ν, m)
    let (n_inputs, n_tasks) = (t_aug.nrows(), t_aug.ncols());
    let eta_var = t_aug.squared_norm_l2() / (n_tasks * n_inputs) as f64;
    if eta_var == 0.0 {
        return Ok(Mat::zeros(n_tasks, n_tasks));
    }

    let mut solved = Mat::zeros(n_inputs, n_tasks); // (K^x + η²I)⁻¹ T_aug
    for task in 0..n_tasks {
        let (x, targets) = (augmented.x.as_ref(), augmented.t_aug.col_as_slice(task));
        let smoother = Posterior::new(input.clone(), eta_var.sqrt(), x, targets, likelihood)?;
        let means = smoother.predict_mean(x)?;
        for (row, (target, mean)) in targets.iter().zip(means).enumerate() {
            solved[(row, task)] = (target - mean) / eta_var;
        }
    }
    let k_aug = t_aug.transpose() * &solved; // (m, m)
    Ok(symmetric_part(k_aug.as_ref(), n_inputs as f64))
}

/// (A + Aᵀ) / 2c
fn symmetric_part(a: MatRef<'_, f64>, divisor: f64) -> Mat<f64> {
    Mat::from_fn(a.nrows(), a.ncols(), |row, col| {
        (a[(row, col)] + a[(col, row)]) / (2.0 * divisor)
    })
}
