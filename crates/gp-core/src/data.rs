//! The checks that inputs and targets must pass before anything is computed from them.

use faer::MatRef;

use crate::error::GpError;

/// Fails on the first input that is NaN or infinite, row by row.
///
/// # Errors
/// [`GpError::NonFiniteInput`].
pub fn require_finite_inputs(x: MatRef<'_, f64>) -> Result<(), GpError> {
    for row in 0..x.nrows() {
        for column in 0..x.ncols() {
            let value = x[(row, column)];
            if !value.is_finite() {
                return Err(GpError::NonFiniteInput { row, column, value });
            }
        }
    }
    Ok(())
}

/// Fails unless inputs have the model's columns and are finite.
///
/// # Errors
/// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
pub fn require_inputs(x: MatRef<'_, f64>, expected: usize) -> Result<(), GpError> {
    let found = x.ncols();
    if found != expected {
        return Err(GpError::WrongCovariates { found, expected });
    }
    require_finite_inputs(x)
}

/// Fails unless there is one finite target per row of finite inputs, and enough of them.
///
/// # Errors
/// [`GpError::CountMismatch`], [`GpError::TooFewSamples`], [`GpError::NonFiniteInput`] or
/// [`GpError::NonFiniteTarget`].
pub fn require_training_data(
    x: MatRef<'_, f64>,
    targets: &[f64],
    needed: usize,
) -> Result<(), GpError> {
    if x.nrows() != targets.len() {
        return Err(GpError::CountMismatch {
            n_inputs: x.nrows(),
            n_targets: targets.len(),
        });
    }
    if targets.len() < needed {
        return Err(GpError::TooFewSamples {
            n_samples: targets.len(),
            needed,
        });
    }
    require_finite_inputs(x)?;
    match targets.iter().position(|t| !t.is_finite()) {
        None => Ok(()),
        Some(row) => Err(GpError::NonFiniteTarget {
            row,
            value: targets[row],
        }),
    }
}

/// Fails unless σ is finite and above zero.
///
/// # Errors
/// [`GpError::BadNoise`].
pub fn require_noise(noise_std: f64) -> Result<(), GpError> {
    if noise_std.is_finite() && noise_std > 0.0 {
        return Ok(());
    }
    Err(GpError::BadNoise { value: noise_std })
}

/// Number of joints ℓ of inputs with 3ℓ columns.
///
/// # Errors
/// [`GpError::NotThreePerJoint`] for another number of columns.
pub fn joints_of(x: MatRef<'_, f64>) -> Result<usize, GpError> {
    match (x.ncols() / 3, x.ncols() % 3) {
        (n_joints, 0) if n_joints > 0 => Ok(n_joints),
        _ => Err(GpError::NotThreePerJoint { columns: x.ncols() }),
    }
}
