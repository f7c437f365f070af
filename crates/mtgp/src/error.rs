//! What can go wrong with data of several tasks, with the numbers of the case.

use gp_core::GpError;

/// Why a multi-task model cannot be built from what was given.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MtgpError {
    /// A model needs at least one task.
    #[error("a model of no tasks")]
    NoTasks,
    /// A sample or a prediction belongs to a task that the model does not have.
    #[error("row {row} belongs to task {task}, but there are only {n_tasks}, counted from zero")]
    UnknownTask {
        /// Row (sample), from zero.
        row: usize,
        /// The task given, from zero.
        task: usize,
        /// Number of tasks m.
        n_tasks: usize,
    },
    /// A context that a model does not have.
    #[error("unknown context `{name}`; the model has {}", .known.join(", "))]
    UnknownContext {
        /// The name given.
        name: String,
        /// Names of the contexts that it has.
        known: Vec<String>,
    },
    /// A task is never observed, so that nothing determines its row of Λ.
    #[error("task {task} of {n_tasks} has no samples")]
    TaskWithoutSamples {
        /// The first such task, from zero.
        task: usize,
        /// Number of tasks m.
        n_tasks: usize,
    },
    /// The rank of K^ρ is zero or above the number of tasks.
    #[error("rank {rank} of a task matrix of {n_tasks} tasks, which must be 1 to {n_tasks}")]
    BadRank {
        /// The rank r given.
        rank: usize,
        /// Number of tasks m.
        n_tasks: usize,
    },
    /// There is not one value for each thing that needs one.
    #[error("{found} {what}, expected {expected}")]
    CountMismatch {
        /// What was counted.
        what: &'static str,
        /// Values given.
        found: usize,
        /// Values needed.
        expected: usize,
    },
    /// An entry of a matrix or vector is NaN or infinite.
    #[error("{what} at row {row}, column {column} is {value}, not a finite number")]
    NonFinite {
        /// Which matrix or vector.
        what: &'static str,
        /// Row, from zero.
        row: usize,
        /// Column, from zero; 0 of a vector.
        column: usize,
        /// The value found.
        value: f64,
    },
    /// A factor Λ that is not lower triangular.
    #[error("task_factor[{row},{column}] is {value}, but is above the diagonal and must be zero")]
    AboveDiagonal {
        /// Row of Λ, from zero.
        row: usize,
        /// Column of Λ, from zero.
        column: usize,
        /// The value found.
        value: f64,
    },
    /// The contexts' torques are linearly dependent, so that K^ρ has no inverse.
    #[error("torques of {n_tasks} tasks have rank {rank}: without noise, their K^ρ is singular")]
    DependentContexts {
        /// Numerical rank of Tᵀ(K^x)⁻¹T.
        rank: usize,
        /// Number of tasks m.
        n_tasks: usize,
    },
    /// A matrix has no eigen- or singular value decomposition, which an entry that is not finite causes.
    #[error("matrix of {rows} rows and {columns} columns has no spectral decomposition")]
    NoSpectrum {
        /// Rows.
        rows: usize,
        /// Columns.
        columns: usize,
    },
    /// A context is asked for without the torques of any joint.
    #[error("no joint has torques to tell the context by")]
    NoJoints,
    /// Numbers that are not probabilities: negative, not finite, or of another sum than one.
    #[error("row {row} of the {what} does not hold probabilities: its sum is {sum}")]
    NotProbabilities {
        /// Which numbers.
        what: &'static str,
        /// Row, from zero; 0 of a vector.
        row: usize,
        /// The sum found.
        sum: f64,
    },
    /// A test is to be calibrated without held-out scores.
    #[error("no held-out scores to calibrate a test with")]
    NoCalibration,
    /// No context can have made the torques, or a density is not a number.
    #[error("no context has a usable density of the new torques")]
    NoUsableDensity,
    /// Hyperparameters that no covariance has.
    #[error(transparent)]
    Kernel(#[from] kernels::KernelError),
    /// A likelihood, posterior or fit without an answer.
    #[error(transparent)]
    Gp(#[from] GpError),
}

impl From<linalg::LinalgError> for MtgpError {
    fn from(error: linalg::LinalgError) -> Self {
        match error {
            linalg::LinalgError::NoSpectrum { rows, columns } => Self::NoSpectrum { rows, columns },
            other => Self::Gp(other.into()),
        }
    }
}

/// Fails unless there are as many as expected.
pub(crate) fn require_count(
    what: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), MtgpError> {
    if found == expected {
        return Ok(());
    }
    Err(MtgpError::CountMismatch {
        what,
        found,
        expected,
    })
}
