//! The joints whose states a table must hold: their names, their units, and where they are known from.

use puma_dyn::Model;
use puma_dyn::robot::JointKind;

/// Unit of a torque whose joint is not known to turn or to slide.
pub const TORQUE_UNIT: &str = "N·m, or N if it slides";

/// Joints in the order of x = (q, qd, qdd).
#[derive(Debug)]
pub struct Joints {
    /// Who has these joints, in messages: `robot` or `model`.
    pub whose: &'static str,
    /// Names.
    pub names: Vec<String>,
    /// Kinds; empty if they are not known.
    kinds: Vec<JointKind>,
}

impl Joints {
    /// The joints of a robot.
    pub fn of_robot(model: &Model) -> Self {
        Self {
            whose: "robot",
            names: model.joint_names().to_vec(),
            kinds: (0..model.n_joints())
                .map(|joint_idx| model.joint_kind(joint_idx))
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

    /// Unit of q, qd or qdd (`derivative` 0, 1, 2) of a joint.
    pub fn unit(&self, derivative: usize, joint_idx: usize) -> &'static str {
        let units = match self.kinds.get(joint_idx) {
            Some(JointKind::Prismatic) => ["m", "m/s", "m/s²"],
            Some(_) => ["rad", "rad/s", "rad/s²"],
            None => ["rad or m", "rad/s or m/s", "rad/s² or m/s²"],
        };
        units[derivative]
    }
}
