//! Measured states and torques, under one context or several.

use faer::{Mat, MatRef};
use gp_core::GpError;
use kernels::ContinuousJoints;

use crate::error::{TorqueError, consistent};
use crate::ranges::TrainingRanges;
use crate::timeline::Timeline;

/// What a model is learned from.
///
/// # Shapes
/// n rows of ℓ joints.
#[derive(Debug, Clone)]
pub struct Samples {
    /// Names of all joints of the robot, in the order of the covariates, (ℓ,).
    pub joint_names: Vec<String>,
    /// Names of the contexts, such as the loads carried; empty for samples of one context without a name.
    pub contexts: Vec<String>,
    /// Number of each row's context, (n,); empty for samples of one context.
    pub context_of: Vec<usize>,
    /// States, (n, 3ℓ), columns (q, q̇, q̈): rad, rad/s, rad/s².
    pub x: Mat<f64>,
    /// Torques of some joints, in ascending order of the joints.
    pub torques: Vec<JointTorques>,
    /// When and in which run the rows were measured, as far as the log says it.
    pub timeline: Timeline,
    /// Joints whose positions are angles that count modulo a turn: processes see their cosine and sine.
    pub continuous: ContinuousJoints,
}

/// Measured torques of one joint.
#[derive(Debug, Clone, PartialEq)]
pub struct JointTorques {
    /// Index of the joint among all joints of the robot.
    pub joint_idx: usize,
    /// (n,), N·m.
    pub values: Vec<f64>,
}

impl Samples {
    /// Samples of one context.
    ///
    /// # Errors
    /// [`TorqueError::InconsistentModel`] for torques or states that do not fit together.
    pub fn of_one_context(
        joint_names: Vec<String>,
        x: Mat<f64>,
        torques: Vec<JointTorques>,
    ) -> Result<Self, TorqueError> {
        let samples = Self {
            joint_names,
            contexts: Vec::new(),
            context_of: Vec::new(),
            x,
            torques,
            timeline: Timeline::default(),
            continuous: ContinuousJoints::none(),
        };
        samples.check()?;
        Ok(samples)
    }

    /// Number of rows n.
    pub fn n_rows(&self) -> usize {
        self.x.nrows()
    }

    /// Number of joints ℓ of the robot.
    pub fn n_joints(&self) -> usize {
        self.joint_names.len()
    }

    /// The joint's name.
    ///
    /// # Panics
    /// If there is no such joint.
    pub fn name_of(&self, joint: &JointTorques) -> &str {
        &self.joint_names[joint.joint_idx]
    }

    /// The range of every covariate, of all contexts together.
    ///
    /// # Errors
    /// No row, or states that are not finite.
    pub fn ranges(&self) -> Result<TrainingRanges, TorqueError> {
        TrainingRanges::of(self.x.as_ref())
    }

    /// The range of every covariate in each context.
    ///
    /// # Errors
    /// A context without a row, or states that are not finite.
    pub fn context_ranges(&self) -> Result<Vec<TrainingRanges>, TorqueError> {
        let of_context = |context: usize| {
            let rows = rows_in(&self.context_of, context);
            TrainingRanges::of_rows(self.x.as_ref(), &rows)
        };
        (0..self.contexts.len()).map(of_context).collect()
    }

    /// The rows of some indices, in their order.
    ///
    /// # Panics
    /// If there is no such row.
    #[must_use]
    pub fn rows(&self, rows: &[usize]) -> Self {
        let of_joint = |joint: &JointTorques| JointTorques {
            joint_idx: joint.joint_idx,
            values: rows.iter().map(|&row| joint.values[row]).collect(),
        };
        Self {
            joint_names: self.joint_names.clone(),
            contexts: self.contexts.clone(),
            context_of: (rows.iter())
                .filter_map(|&row| self.context_of.get(row).copied())
                .collect(),
            x: picked(self.x.as_ref(), rows),
            torques: self.torques.iter().map(of_joint).collect(),
            timeline: self.timeline.rows(rows, self.n_joints()),
            continuous: self.continuous.clone(),
        }
    }

    /// At most `most` of the rows, evenly spread.
    #[must_use]
    pub fn spread(&self, most: usize) -> Self {
        self.rows(&spread(self.n_rows(), most))
    }

    /// # Errors
    /// [`TorqueError::InconsistentModel`] or [`GpError::WrongCovariates`] with what does not fit.
    pub fn check(&self) -> Result<(), TorqueError> {
        let (n, n_joints) = (self.n_rows(), self.n_joints());
        let (found, expected) = (self.x.ncols(), 3 * n_joints);
        if found != expected {
            return Err(GpError::WrongCovariates { found, expected }.into());
        }
        self.timeline.check(n, n_joints)?;
        let ascend = self
            .torques
            .windows(2)
            .all(|pair| pair[0].joint_idx < pair[1].joint_idx);
        let bad = (self.torques.iter()).find(|t| t.joint_idx >= n_joints || t.values.len() != n);
        let of_contexts = self.context_of.len();
        let is_numbered = self.context_of.iter().all(|c| *c < self.contexts.len());
        consistent(if !ascend {
            Some("torques of joints that do not ascend".to_owned())
        } else if let Some(joint) = self
            .continuous
            .indices()
            .last()
            .filter(|of| **of >= n_joints)
        {
            Some(format!("a continuous joint {joint} of {n_joints}"))
        } else if let Some(JointTorques { joint_idx, values }) = bad {
            let count = values.len();
            Some(format!(
                "{count} torques of joint {joint_idx} for {n} states of {n_joints} joints"
            ))
        } else {
            let fits = (of_contexts == 0 && self.contexts.len() <= 1) || of_contexts == n;
            (!(fits && is_numbered)).then(|| {
                let names = self.contexts.len();
                format!("contexts of {of_contexts} rows, of {n}, with {names} names")
            })
        })
    }
}

/// Indices of at most `most` of `n` rows, ascending and evenly spread.
pub(crate) fn spread(n: usize, most: usize) -> Vec<usize> {
    let count = n.min(most);
    (0..count).map(|idx| idx * n / count).collect()
}

/// Rows whose entry is `wanted`.
pub(crate) fn rows_in(numbers: &[usize], wanted: usize) -> Vec<usize> {
    let rows = numbers.iter().enumerate();
    rows.filter(|(_, number)| **number == wanted)
        .map(|(row, _)| row)
        .collect()
}

/// Rows of a matrix by their indices.
pub(crate) fn picked(x: MatRef<'_, f64>, rows: &[usize]) -> Mat<f64> {
    Mat::from_fn(rows.len(), x.ncols(), |row, col| x[(rows[row], col)])
}

#[cfg(test)]
mod tests {
    use super::spread;

    #[test]
    fn few_are_all_and_many_are_spread() {
        assert_eq!(spread(3, 5), [0, 1, 2]);
        assert_eq!(spread(10, 4), [0, 2, 5, 7]);
        assert!(spread(0, 4).is_empty());
    }
}
