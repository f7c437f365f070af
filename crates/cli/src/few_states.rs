//! Rows of a context that leave open how it mixes the latent functions of a model.

use std::fmt;

use faer::MatRef;
use torque_model::{RobotModel, TorqueError, different_states};

/// Fewer different states than the rank, in more rows than one.
pub struct FewStates {
    n_rows: usize,
    n_states: usize,
    rank: usize,
}

impl FewStates {
    /// Of the first joint with fewer states than its rank; `None` where all have enough.
    ///
    /// # Errors
    /// States of another robot.
    pub fn of(model: &RobotModel, x: MatRef<'_, f64>) -> Result<Option<Self>, TorqueError> {
        let n_rows = x.nrows();
        for (_, process) in model.tasks() {
            let rank = process.covariance().task().rank();
            let n_states = different_states(process, x, rank)?;
            if n_states < rank && n_rows > 1 {
                return Ok(Some(Self {
                    n_rows,
                    n_states,
                    rank,
                }));
            }
        }
        Ok(None)
    }
}

impl fmt::Display for FewStates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self {
            n_rows,
            n_states,
            rank,
        } = self;
        let states = if *n_states == 1 { "state" } else { "states" };
        write!(
            f,
            "{n_rows} rows, but only {n_states} different {states} for a model of rank {rank}: the known contexts say what \
             they leave open, and predictions elsewhere are less sure than their standard deviations; measure it in motion"
        )
    }
}
