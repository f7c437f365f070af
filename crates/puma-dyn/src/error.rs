//! The one error type of this crate: what is wrong with a robot, a payload or a target, by name.

use thiserror::Error;

use crate::robot::warning::Warning;

/// Everything this crate refuses. Wrong slice lengths are panics, documented at each function.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
pub enum DynError {
    /// Two links or two joints share a name.
    #[error("{what} name `{name}` is used more than once")]
    DuplicateName {
        /// `link` or `joint`.
        what: &'static str,
        /// The name.
        name: String,
    },
    /// A joint names a link that is not in the description.
    #[error("joint `{joint}`: {role} link `{link}` does not exist")]
    UnknownLink {
        /// The joint.
        joint: String,
        /// `parent` or `child`.
        role: &'static str,
        /// The missing link.
        link: String,
    },
    /// A name was asked for that the model does not have.
    #[error("no {what} is named `{name}`; known: {known}")]
    UnknownName {
        /// `link`, `joint` or `frame`.
        what: &'static str,
        /// The name asked for.
        name: String,
        /// The names there are, comma separated.
        known: String,
    },
    /// A link is the child of two joints.
    #[error("link `{link}` is the child of both joint `{first}` and joint `{second}`")]
    TwoParents {
        /// The link.
        link: String,
        /// One joint.
        first: String,
        /// The other joint.
        second: String,
    },
    /// There is no link at all.
    #[error("the robot has no links")]
    NoLinks,
    /// More than one link has no parent.
    #[error("the robot has {} root links, not one: {}", roots.len(), roots.join(", "))]
    SeveralRoots {
        /// Names of the links without a parent.
        roots: Vec<String>,
    },
    /// These joints form a loop.
    #[error("the joints form a loop through link `{link}`")]
    Cycle {
        /// A link on the loop.
        link: String,
    },
    /// The axis of a moving joint is the zero vector.
    #[error("joint `{joint}`: the axis is zero")]
    ZeroAxis {
        /// The joint.
        joint: String,
    },
    /// The rotation of a joint's origin is not orthonormal with determinant +1.
    #[error("joint `{joint}`: the origin's rotation matrix is not a rotation (defect {defect:e})")]
    NotARotation {
        /// The joint.
        joint: String,
        /// Norm of RᵀR − 1, or the determinant's distance from 1.
        defect: f64,
    },
    /// A number is NaN or infinite.
    #[error("{what} `{name}`: {quantity} is {value}")]
    NonFinite {
        /// `link`, `joint`, `payload`, …
        what: &'static str,
        /// Its name.
        name: String,
        /// Which number.
        quantity: &'static str,
        /// Its value.
        value: f64,
    },
    /// A number has a sign it must not have.
    #[error("{what} `{name}`: {quantity} is {value}, must be {requirement}")]
    OutOfRange {
        /// `link`, `joint`, `payload`, …
        what: &'static str,
        /// Its name.
        name: String,
        /// Which number.
        quantity: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        requirement: &'static str,
    },
    /// A rotor inertia is given but its gear ratio is zero.
    #[error("joint `{joint}`: rotor inertia {rotor_inertia} kg m² with a gear ratio of zero")]
    ZeroGearRatio {
        /// The joint.
        joint: String,
        /// kg m².
        rotor_inertia: f64,
    },
    /// An inertia tensor is not symmetric.
    #[error("link `{link}`: the inertia tensor is not symmetric")]
    AsymmetricInertia {
        /// The link.
        link: String,
    },
    /// A moving joint carries nothing.
    #[error("joint `{joint}` moves, but nothing beyond it has mass or inertia")]
    MasslessSubtree {
        /// The joint.
        joint: String,
    },
    /// No rigid body has this mass distribution.
    #[error("{what} `{name}` is not physically consistent: {reason}")]
    Unphysical {
        /// `link` or `payload`.
        what: &'static str,
        /// Its name.
        name: String,
        /// What is violated, with the numbers.
        reason: String,
    },
    /// A payload cannot be attached to a frame that no joint moves.
    #[error("frame `{frame}` is fixed to the ground: a payload there loads no joint")]
    FrameDoesNotMove {
        /// The frame.
        frame: String,
    },
    /// The forward dynamics are singular: a joint sees no inertia along its axis.
    #[error("joint `{joint}`: the inertia along its axis is {inertia:e}, must be positive")]
    SingularInertia {
        /// The joint.
        joint: String,
        /// Articulated-body inertia along the axis, kg m² or kg.
        inertia: f64,
    },
    /// Friction in proportion to a joint's load takes all of it, so that no torque follows from a motion back.
    #[error(
        "joint `{joint}`: friction of the load is {share} times the load; at 1 and beyond the joint locks itself, \
         and no acceleration follows from its torque"
    )]
    LoadFriction {
        /// The joint.
        joint: String,
        /// Friction per load at the state.
        share: f64,
    },
    /// Forward dynamics under friction that grows with the load do not settle.
    #[error("no directions of the joints' loads fit the friction that grows with them")]
    LoadsUnsettled,
    /// Friction that pushes a joint along cannot hold it at rest.
    #[error(
        "joint `{joint}`: its Coulomb friction goes from {negative} to {positive} and would drive the motion; only friction against the motion can be simulated"
    )]
    FrictionDrives {
        /// The joint.
        joint: String,
        /// Coulomb torque at negative speed, N·m or N.
        negative: f64,
        /// Coulomb torque at positive speed, N·m or N.
        positive: f64,
    },
    /// A simulation cannot go on.
    #[error("the simulation stops at {time} s: {reason}")]
    Simulation {
        /// Simulated time, s.
        time: f64,
        /// Why, with the joint or the numbers.
        reason: String,
    },
    /// A motion that is to be followed is not one.
    #[error("reference motion: {reason}")]
    Reference {
        /// What is wrong, with the sample.
        reason: String,
    },
    /// No joint angles of the PUMA 560 put its wrist there.
    #[error(
        "the wrist cannot be at ({}, {}, {}) m from the shoulder: {reason}",
        position[0], position[1], position[2]
    )]
    Unreachable {
        /// The wrist centre that was asked for, in DH frame 0, m.
        position: [f64; 3],
        /// Why it cannot be there, with the numbers.
        reason: String,
    },
    /// A scenario file is not valid TOML, or its values do not fit together.
    #[error("scenario: {reason}")]
    Scenario {
        /// What is wrong, with the key or the line.
        reason: String,
    },
    /// A robot file has no joint that moves.
    #[error("the robot has no moving joint")]
    NoMovingJoint,
    /// A file cannot be read.
    #[error("cannot read {file}: {reason}")]
    Unreadable {
        /// The file.
        file: String,
        /// What the operating system says.
        reason: String,
    },
    /// The text of a file cannot be made.
    #[error("cannot write {file}: {reason}")]
    Unwritable {
        /// The file.
        file: String,
        /// Why.
        reason: String,
    },
    /// A file is not what its format asks for.
    #[error("{file}:{line}:{column}: {reason}")]
    Malformed {
        /// The file.
        file: String,
        /// Line, from 1.
        line: u32,
        /// Column, from 1.
        column: u32,
        /// What is wrong, with a hint where one helps.
        reason: String,
    },
    /// A robot file asks for a joint this crate does not have.
    #[error("{file}:{line}: joint `{joint}` {reason}")]
    UnsupportedJoint {
        /// The file.
        file: String,
        /// Line, from 1.
        line: u32,
        /// The joint.
        joint: String,
        /// What it asks for, with a hint where one helps.
        reason: String,
    },
    /// A robot file is well-formed, but its robot is refused.
    #[error("{file}: {cause}{hint}")]
    InFile {
        /// The file.
        file: String,
        /// What is wrong with the robot.
        cause: Box<DynError>,
        /// Empty, or `; hint: …`.
        hint: String,
    },
    /// A sidecar file states something about a joint that cannot be.
    #[error("{file}: joint `{joint}`: {key}{}{reason}", if key.is_empty() { "" } else { " " })]
    Sidecar {
        /// The file.
        file: String,
        /// The joint as the file names it.
        joint: String,
        /// The key, or empty if the joint itself is wrong.
        key: &'static str,
        /// What is wrong, with the number.
        reason: String,
    },
    /// A robot was to be refused on any doubt, and there are some.
    #[error("{file}: refused in strict mode: {}",
        warnings.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Doubtful {
        /// The file.
        file: String,
        /// The doubts.
        warnings: Vec<Warning>,
    },
}
