//! How a state under a context becomes a row of a covariance, and what is known of its torque beforehand.

use std::sync::Arc;

use faer::{Mat, MatRef};
use gp_core::fit::ParameterPrior;
use gp_core::{GpError, data};
use mtgp::prior::{are_rows_of_tasks, with_task};
use mtgp::{MtgpError, MultiTaskCovariance};
use puma_dyn::dynamics::{N_DRIVE_PARAMETERS, N_PARAMETERS, full_regressor};
use puma_dyn::{Model, Workspace};

use crate::error::TorqueError;

/// Parameters per joint: ten of its body, four of its drive.
const PER_JOINT: usize = N_PARAMETERS + N_DRIVE_PARAMETERS;

/// Rows of a covariance from states under a context.
pub trait Rows: Send + Sync {
    /// Number of joints ℓ.
    fn n_joints(&self) -> usize;

    /// Number of contexts.
    fn n_contexts(&self) -> usize {
        1
    }

    /// Columns of a row.
    fn n_columns(&self) -> usize;

    /// The rows of states under a context.
    ///
    /// # Shapes
    /// `x` (n, 3ℓ), columns (q, q̇, q̈).
    /// # Errors
    /// States that are not finite or of another robot, a context that there is not.
    fn rows(&self, context: usize, x: MatRef<'_, f64>) -> Result<Mat<f64>, TorqueError>;

    /// What is known of the torques of rows before any data, (n,), N·m; `None` for nothing.
    fn known_mean(&self, _rows: MatRef<'_, f64>) -> Option<Vec<f64>> {
        None
    }
}

/// States as they are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct States {
    /// ℓ.
    pub n_joints: usize,
}

impl Rows for States {
    fn n_joints(&self) -> usize {
        self.n_joints
    }

    fn n_columns(&self) -> usize {
        3 * self.n_joints
    }

    fn rows(&self, context: usize, x: MatRef<'_, f64>) -> Result<Mat<f64>, TorqueError> {
        require_context(context, 1)?;
        require_states(x, self.n_joints)?;
        Ok(x.to_owned())
    }
}

/// States with the number of their context behind them: rows (x, task).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TaskRows {
    /// ℓ.
    pub n_joints: usize,
    /// m.
    pub n_contexts: usize,
}

impl TaskRows {
    /// Those of a prior.
    pub fn of(prior: &MultiTaskCovariance) -> Self {
        Self {
            n_joints: prior.input().n_joints(),
            n_contexts: prior.n_tasks(),
        }
    }

    /// Whether the last column of rows holds numbers of these contexts.
    pub(crate) fn admit(self, rows: MatRef<'_, f64>) -> bool {
        are_rows_of_tasks(rows, self.n_contexts)
    }
}

impl Rows for TaskRows {
    fn n_joints(&self) -> usize {
        self.n_joints
    }

    fn n_contexts(&self) -> usize {
        self.n_contexts
    }

    fn n_columns(&self) -> usize {
        3 * self.n_joints + 1
    }

    fn rows(&self, context: usize, x: MatRef<'_, f64>) -> Result<Mat<f64>, TorqueError> {
        require_context(context, self.n_contexts)?;
        require_states(x, self.n_joints)?;
        Ok(with_task(x, context))
    }
}

/// States with what a joint's torque is linear in: rows (x, Y(x)).
///
/// Y has ten columns for each body and then four for each drive, as
/// [`puma_dyn::dynamics::full_regressor`] has them.
#[derive(Debug, Clone)]
pub struct RegressorRows {
    /// The robot whose parameters they are.
    pub robot: Arc<Model>,
    /// The joint, from 0.
    pub joint_idx: usize,
    /// What is known of the parameters before any data.
    pub prior: ParameterPrior,
}

impl Rows for RegressorRows {
    fn n_joints(&self) -> usize {
        self.robot.n_joints()
    }

    fn n_columns(&self) -> usize {
        3 * self.n_joints() + n_parameters(&self.robot)
    }

    fn rows(&self, context: usize, x: MatRef<'_, f64>) -> Result<Mat<f64>, TorqueError> {
        require_context(context, 1)?;
        let y = regressor_of(&self.robot, self.joint_idx, x)?;
        let d = x.ncols();
        Ok(Mat::from_fn(x.nrows(), d + y.ncols(), |row, col| {
            if col < d {
                x[(row, col)]
            } else {
                y[(row, col - d)]
            }
        }))
    }

    fn known_mean(&self, rows: MatRef<'_, f64>) -> Option<Vec<f64>> {
        let d = 3 * self.n_joints();
        let y = rows.subcols(d, rows.ncols() - d);
        self.prior.torques(y).ok()
    }
}

/// Number of columns of Y: 14 ℓ.
pub fn n_parameters(robot: &Model) -> usize {
    PER_JOINT * robot.n_joints()
}

/// Rows of Y(x) of a joint, (n, 14 ℓ), at the rows of `x`, (n, 3ℓ).
///
/// # Errors
/// States that are not finite or of another robot.
/// # Panics
/// If the joint does not exist.
/// # Source
/// Eqs. (10)–(12), with the drives.
pub fn regressor_of(
    robot: &Model,
    joint_idx: usize,
    x: MatRef<'_, f64>,
) -> Result<Mat<f64>, TorqueError> {
    let (n_joints, n_parameters) = (robot.n_joints(), n_parameters(robot));
    require_states(x, n_joints)?;
    let mut workspace = Workspace::new(robot);
    let mut matrix = vec![0.0; n_joints * n_parameters];
    let mut regressor = Mat::zeros(x.nrows(), n_parameters);
    let mut state = vec![0.0; 3 * n_joints];
    for row in 0..x.nrows() {
        for (entry, value) in state.iter_mut().zip(x.row(row).iter()) {
            *entry = *value;
        }
        let (q, rates) = state.split_at(n_joints);
        let (qd, qdd) = rates.split_at(n_joints);
        full_regressor(robot, &mut workspace, q, qd, qdd, &mut matrix);
        let of_joint = &matrix[joint_idx * n_parameters..][..n_parameters];
        for (col, value) in of_joint.iter().enumerate() {
            regressor[(row, col)] = *value;
        }
    }
    Ok(regressor)
}

pub(crate) fn require_states(x: MatRef<'_, f64>, n_joints: usize) -> Result<(), TorqueError> {
    require_finite(x, 3 * n_joints)
}

pub(crate) fn require_finite(x: MatRef<'_, f64>, expected: usize) -> Result<(), TorqueError> {
    let found = x.ncols();
    if found != expected {
        return Err(GpError::WrongCovariates { found, expected }.into());
    }
    Ok(data::require_finite_inputs(x)?)
}

pub(crate) fn require_context(context: usize, n_tasks: usize) -> Result<(), TorqueError> {
    if context < n_tasks {
        return Ok(());
    }
    let (row, task) = (0, context);
    Err(MtgpError::UnknownTask { row, task, n_tasks }.into())
}
