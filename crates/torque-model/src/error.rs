//! What can be wrong with data, models and their parts.

use gp_core::GpError;
use mtgp::MtgpError;
use puma_dyn::DynError;

/// Why a model cannot be learned, put together or asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TorqueError {
    /// One load's processes, or data for them.
    #[error(transparent)]
    Gp(#[from] GpError),
    /// Several loads' processes, or data for them.
    #[error(transparent)]
    Mtgp(#[from] MtgpError),
    /// A robot's description.
    #[error(transparent)]
    Robot(#[from] DynError),
    /// The parts of a robot's model do not fit together.
    #[error("inconsistent model: {what}")]
    InconsistentModel {
        /// Which parts, with their numbers.
        what: String,
    },
    /// What is asked of a model is not what its kind can do.
    #[error("{what}")]
    OtherKind {
        /// What is asked, and of which kind.
        what: String,
    },
    /// A log's times, runs or columns do not allow what is asked.
    #[error("{what}")]
    Log {
        /// What does not fit, with its place.
        what: String,
    },
    /// A state is so large that a torque overflows.
    #[error(
        "row {row}: the state is so large that the torque of joint {joint_idx} is not a finite number"
    )]
    NotFinite {
        /// Row of the state.
        row: usize,
        /// Index of the joint.
        joint_idx: usize,
    },
    /// One joint cannot be learned.
    #[error("joint {joint}: {cause}")]
    Joint {
        /// Its name.
        joint: String,
        /// Why.
        cause: Box<TorqueError>,
    },
    /// No rank can be chosen for all joints.
    #[error("no rank can be chosen: {cause}")]
    Rank {
        /// Why.
        cause: MtgpError,
    },
}

impl From<kernels::KernelError> for TorqueError {
    fn from(cause: kernels::KernelError) -> Self {
        Self::Gp(cause.into())
    }
}

impl TorqueError {
    /// The same error, of a row among several.
    pub(crate) fn in_row(self, row: usize) -> Self {
        match self {
            Self::NotFinite { joint_idx, .. } => Self::NotFinite { row, joint_idx },
            other => other,
        }
    }
}

/// # Errors
/// [`TorqueError::InconsistentModel`] with what does not fit, if anything.
pub(crate) fn consistent(what: Option<String>) -> Result<(), TorqueError> {
    what.map_or(Ok(()), |what| Err(TorqueError::InconsistentModel { what }))
}
