//! The joints whose states a table must hold: their names, their units, and where they are known from.

use puma_dyn::Model;
use puma_dyn::robot::JointKind;
use torque_model::ContinuousJoints;

/// Unit of a torque whose joint is not known to turn or to slide.
pub const TORQUE_UNIT: &str = "N·m, or N if it slides";

/// Joints in the order of x = (q, qd, qdd).
#[derive(Debug)]
pub struct Joints {
    /// Who has these joints, in messages: `robot` or `model`.
    pub whose: &'static str,
    /// Names.
    pub names: Vec<String>,
    /// Kinds, as far as they are known; empty if none is.
    kinds: Vec<Option<JointKind>>,
}

impl Joints {
    /// The joints of a robot.
    pub fn of_robot(model: &Model) -> Self {
        Self {
            whose: "robot",
            names: model.joint_names().to_vec(),
            kinds: (0..model.n_joints())
                .map(|joint_idx| Some(model.joint_kind(joint_idx)))
                .collect(),
        }
    }

    /// Joints known by name only, from a model file or a table of data.
    pub fn by_name(whose: &'static str, names: Vec<String>) -> Self {
        Self {
            whose,
            names,
            kinds: Vec::new(),
        }
    }

    /// The same joints, of which some are known to turn without end.
    #[must_use]
    pub fn with_continuous(self, continuous: &ContinuousJoints) -> Self {
        let turns = |joint| {
            let turns = continuous.contains(joint).then_some(JointKind::Continuous);
            turns.or(self.kind(joint))
        };
        Self {
            kinds: (0..self.names.len()).map(turns).collect(),
            ..self
        }
    }

    /// The same joints, of which none turns without end: those of an arm whose stops are not described.
    #[must_use]
    pub fn with_stops(self) -> Self {
        let stopped = |kind| match kind {
            Some(JointKind::Continuous) => Some(JointKind::Revolute),
            other => other,
        };
        Self {
            kinds: self.kinds.into_iter().map(stopped).collect(),
            ..self
        }
    }

    /// Whether they are a robot's, whose description says what they are.
    pub fn are_of_robot(&self) -> bool {
        !self.kinds.is_empty() && self.kinds.iter().all(Option::is_some)
    }

    /// Kind of a joint, if it is known.
    pub fn kind(&self, joint_idx: usize) -> Option<JointKind> {
        self.kinds.get(joint_idx).copied().flatten()
    }

    /// Unit of q, qd or qdd (`derivative` 0, 1, 2) of a joint.
    pub fn unit(&self, derivative: usize, joint_idx: usize) -> &'static str {
        let units = match self.kind(joint_idx) {
            Some(JointKind::Prismatic) => ["m", "m/s", "m/s²"],
            Some(_) => ["rad", "rad/s", "rad/s²"],
            None => ["rad or m", "rad/s or m/s", "rad/s² or m/s²"],
        };
        units[derivative]
    }
}
