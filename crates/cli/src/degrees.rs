//! A watch over joint positions for columns that are probably degrees.

use std::f64::consts::PI;

use puma_dyn::Model;
use puma_dyn::robot::{JointKind, Limits};

use crate::joints::Joints;
use crate::number_column::NumberColumn;

/// Counts of unlikely positions, column by column.
pub struct DegreesWatch {
    columns: Vec<Column>,
    n_rows: u64,
}

struct Column {
    name: String,
    joint: String,
    limits: Option<Limits>,
    /// Whether more than a turn is unlikely.
    is_angle: bool,
    beyond_turn: u64,
    outside_limits: u64,
    largest: f64,
}

impl DegreesWatch {
    /// A watch over the position columns of a robot.
    pub fn new(model: &Model, positions: &[NumberColumn]) -> Self {
        let columns = positions
            .iter()
            .enumerate()
            .map(|(joint_idx, column)| Column {
                name: column.name.clone(),
                joint: column.joint.clone(),
                limits: model.limits(joint_idx),
                is_angle: model.joint_kind(joint_idx) != JointKind::Prismatic,
                beyond_turn: 0,
                outside_limits: 0,
                largest: 0.0,
            });
        Self {
            columns: columns.collect(),
            n_rows: 0,
        }
    }

    /// A watch over positions without limits: all may be angles but those that are known to slide, and those that are
    /// known to turn without end may be many turns away.
    pub fn without_limits(positions: &[NumberColumn], joints: &Joints) -> Self {
        let has_turns = |joint_idx: usize| {
            let kind = joints.kind(joint_idx);
            matches!(kind, Some(JointKind::Prismatic | JointKind::Continuous))
        };
        let columns = positions
            .iter()
            .enumerate()
            .map(|(joint_idx, column)| Column {
                name: column.name.clone(),
                joint: column.joint.clone(),
                limits: None,
                is_angle: !has_turns(joint_idx),
                beyond_turn: 0,
                outside_limits: 0,
                largest: 0.0,
            });
        Self {
            columns: columns.collect(),
            n_rows: 0,
        }
    }

    /// Looks at the positions of one row.
    pub fn see(&mut self, q: &[f64]) {
        self.n_rows += 1;
        for (column, &angle) in self.columns.iter_mut().zip(q) {
            column.beyond_turn += u64::from(angle.abs() > 2.0 * PI);
            let outside = column
                .limits
                .is_some_and(|limits| angle < limits.lower || angle > limits.upper);
            column.outside_limits += u64::from(outside);
            column.largest = column.largest.max(angle.abs());
        }
    }

    /// One sentence for every angle of which more than half the values are unlikely.
    pub fn doubts(&self) -> Vec<String> {
        let angles = self.columns.iter().filter(|column| column.is_angle);
        angles
            .filter_map(|column| column.doubt(self.n_rows))
            .collect()
    }
}

impl Column {
    fn doubt(&self, n_rows: u64) -> Option<String> {
        let Self {
            name,
            joint,
            largest,
            ..
        } = self;
        let (count, finding) = if 2 * self.beyond_turn > n_rows {
            (self.beyond_turn, "are more than a full turn".to_owned())
        } else {
            let limits = self.limits.filter(|_| 2 * self.outside_limits > n_rows)?;
            (
                self.outside_limits,
                format!(
                    "are outside the joint's limits {} … {} rad",
                    limits.lower, limits.upper
                ),
            )
        };
        Some(format!(
            "column `{name}` ({joint}): {count} of {n_rows} values {finding} (largest magnitude {largest}); angles must be \
             in radians: if these are degrees, multiply q, qd and qdd by π/180"
        ))
    }
}
