//! A robot as plain data: links and joints by name, as a URDF file or a parameter table states them.
//!
//! Nothing here is checked; [`Model::new`](crate::Model::new) validates a description and refuses
//! what it cannot simulate, by name.

use crate::robot::smooth_friction::SmoothFriction;
use crate::spatial::pose::Pose;

/// Standard gravity of the parameter tables this crate reproduces, m/s².
pub const GRAVITY: f64 = 9.81;

/// A tree of links connected by joints.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotDescription {
    /// Name of the robot, for messages only.
    pub name: String,
    /// Acceleration of free fall in the axes of the root link, m/s²; usually (0, 0, −9.81).
    pub gravity: [f64; 3],
    /// Links in any order.
    pub links: Vec<LinkDescription>,
    /// Joints; the order of the moving ones is the order of q, qd, qdd and tau.
    pub joints: Vec<JointDescription>,
}

impl RobotDescription {
    /// A robot without links or joints, under gravity (0, 0, −9.81) m/s².
    #[must_use]
    pub fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            gravity: [0.0, 0.0, -GRAVITY],
            links: Vec::new(),
            joints: Vec::new(),
        }
    }
}

/// A rigid link.
#[derive(Debug, Clone, PartialEq)]
pub struct LinkDescription {
    /// Name, unique in the robot.
    pub name: String,
    /// Mass and inertia; `None` if the source states none.
    pub inertial: Option<Inertial>,
}

impl LinkDescription {
    /// A link of the given name and inertia.
    #[must_use]
    pub fn new(name: &str, inertial: Option<Inertial>) -> Self {
        Self {
            name: name.to_owned(),
            inertial,
        }
    }
}

/// Mass distribution of a link in its own frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Inertial {
    /// kg.
    pub mass: f64,
    /// Centre of mass in the link frame, m.
    pub centre: [f64; 3],
    /// Symmetric inertia tensor about the *centre of mass*, in the axes of the link frame, kg m².
    pub inertia: [[f64; 3]; 3],
}

/// How a joint moves its child link.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about the axis, rad, within limits.
    Revolute,
    /// Turns about the axis, rad, without limits; still one number.
    Continuous,
    /// Slides along the axis, m.
    Prismatic,
    /// Does not move; parent and child are one body.
    Fixed,
}

/// A joint between two links.
#[derive(Debug, Clone, PartialEq)]
pub struct JointDescription {
    /// Name, unique in the robot.
    pub name: String,
    /// How it moves.
    pub kind: JointKind,
    /// Name of the parent link.
    pub parent: String,
    /// Name of the child link.
    pub child: String,
    /// Pose of the child link's frame in the parent link's frame at joint position 0.
    pub origin: Pose,
    /// Axis in the child link's frame; normalised by the model. Ignored for fixed joints.
    pub axis: [f64; 3],
    /// Limits, if the source states any. They are reported, never enforced.
    pub limits: Option<Limits>,
    /// Motor, gear and friction.
    pub drive: Drive,
    /// Friction beyond viscous and Coulomb.
    pub smooth_friction: SmoothFriction,
}

impl JointDescription {
    /// A joint about z at the parent's origin, without limits, drive or friction.
    #[must_use]
    pub fn new(name: &str, kind: JointKind, parent: &str, child: &str) -> Self {
        Self {
            name: name.to_owned(),
            kind,
            parent: parent.to_owned(),
            child: child.to_owned(),
            origin: Pose::identity(),
            axis: [0.0, 0.0, 1.0],
            limits: None,
            drive: Drive::NONE,
            smooth_friction: SmoothFriction::NONE,
        }
    }
}

/// Limits of a joint, as URDF states them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Lowest position, rad or m.
    pub lower: f64,
    /// Highest position, rad or m.
    pub upper: f64,
    /// Largest torque or force, N·m or N.
    pub effort: f64,
    /// Largest speed, rad/s or m/s.
    pub velocity: f64,
}

/// Motor, gear and friction of a joint.
///
/// "Motor side" quantities act before the gear: a motor turns `gear_ratio` times as fast as its
/// joint. For a prismatic joint the ratio has the unit rad/m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Drive {
    /// Inertia of the rotor about its own axis, motor side, kg m².
    pub rotor_inertia: f64,
    /// Signed gear ratio: motor speed divided by joint speed.
    pub gear_ratio: f64,
    /// Viscous friction, motor side, N·m·s/rad.
    pub viscous_motor: f64,
    /// Coulomb friction while the *joint* speed is positive, motor side, N·m.
    pub coulomb_motor_positive: f64,
    /// Coulomb friction while the *joint* speed is negative, motor side, N·m; not above zero.
    pub coulomb_motor_negative: f64,
    /// Viscous friction, joint side (URDF `damping`), N·m·s/rad or N·s/m.
    pub viscous_joint: f64,
    /// Symmetric Coulomb friction, joint side (URDF `friction`), N·m or N.
    pub coulomb_joint: f64,
}

impl Drive {
    /// A direct drive without rotor inertia or friction.
    pub const NONE: Self = Self {
        rotor_inertia: 0.0,
        gear_ratio: 1.0,
        viscous_motor: 0.0,
        coulomb_motor_positive: 0.0,
        coulomb_motor_negative: 0.0,
        viscous_joint: 0.0,
        coulomb_joint: 0.0,
    };
}
