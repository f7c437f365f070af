//! What a log says of its rows beside states and torques: when, in which run, and which of them count.

use crate::error::{TorqueError, consistent};

/// When and in which run each row was measured.
///
/// Everything may be missing; [`Timeline::default`] says nothing.
/// A *run* is the rows of one context and label in their order; without labels, a context's rows, cut
/// where time falls.
/// # Shapes
/// n rows of ℓ joints.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Timeline {
    /// Label of each row's run, a number, (n,); empty without labels.
    pub run_of: Vec<usize>,
    /// What the labels are called, by their numbers.
    pub run_names: Vec<String>,
    /// Time of each row, s, (n,); empty without times.
    pub t: Vec<f64>,
    /// Hysteresis states that were made at the log's full rate.
    pub hysteresis: Vec<HysteresisColumns>,
    /// Whether each row counts for a joint, (n, ℓ), row after row; empty where a rule has to say it.
    pub used: Vec<bool>,
}

/// Hysteresis states of one length, one per row and joint.
#[derive(Debug, Clone, PartialEq)]
pub struct HysteresisColumns {
    /// Length δ, rad.
    pub length: f64,
    /// z, (n, ℓ), row after row, within −1 and 1.
    pub z: Vec<f64>,
}

impl Timeline {
    /// The rows of some indices, in their order.
    ///
    /// # Panics
    /// If there is no such row.
    #[must_use]
    pub fn rows(&self, rows: &[usize], n_joints: usize) -> Self {
        let of_rows = |values: &[f64]| picked(values, rows, n_joints);
        let states = self.hysteresis.iter();
        Self {
            run_of: picked(&self.run_of, rows, 1),
            run_names: self.run_names.clone(),
            t: picked(&self.t, rows, 1),
            hysteresis: states
                .map(|HysteresisColumns { length, z }| HysteresisColumns {
                    length: *length,
                    z: of_rows(z),
                })
                .collect(),
            used: picked(&self.used, rows, n_joints),
        }
    }

    /// # Errors
    /// [`TorqueError::InconsistentModel`] with what does not fit `n` rows of `n_joints` joints.
    pub fn check(&self, n: usize, n_joints: usize) -> Result<(), TorqueError> {
        let is_other = |found: usize, expected: usize| found != 0 && found != expected;
        let of_joints = n * n_joints;
        let states = self
            .hysteresis
            .iter()
            .map(|h| (h.z.len(), "hysteresis states"));
        let columns = states.chain([
            (self.run_of.len() * n_joints, "labels of runs"),
            (self.t.len() * n_joints, "times"),
            (self.used.len(), "rows used"),
        ]);
        let other = columns
            .clone()
            .find(|(found, _)| is_other(*found, of_joints));
        let unnamed = self.run_of.iter().find(|run| **run >= self.run_names.len());
        consistent(match (other, unnamed) {
            (Some((found, what)), _) => {
                Some(format!("{found} {what} for {n} rows of {n_joints} joints"))
            }
            (None, Some(run)) => Some(format!("a run {run} without a name")),
            (None, None) => None,
        })
    }
}

/// Whether two lengths are the same; one that is written in mrad need not read back to the same bits.
pub fn is_same_length(length: f64, other: f64) -> bool {
    (length / other - 1.0).abs() < 1e-9
}

/// Groups of `width` values by their indices; nothing of nothing.
fn picked<T: Copy>(values: &[T], rows: &[usize], width: usize) -> Vec<T> {
    if values.is_empty() {
        return Vec::new();
    }
    let of_row = |row: &usize| values[row * width..(row + 1) * width].iter().copied();
    rows.iter().flat_map(of_row).collect()
}
