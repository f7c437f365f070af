//! What a robot file says that is allowed but deserves a look: returned as values, never printed.

use std::fmt;

/// A link that no rigid body could be.
#[derive(Debug, Clone, PartialEq)]
pub struct PhysicalWarning {
    /// Name of the link.
    pub link: String,
    /// What is violated, with the numbers.
    pub reason: String,
}

impl fmt::Display for PhysicalWarning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "link `{}` is not physically consistent: {}",
            self.link, self.reason
        )
    }
}

/// A doubt about a robot that was loaded all the same. `Display` gives one line without the file.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Warning {
    /// No rigid body has the mass distribution stated for a link.
    #[error("{0}")]
    Unphysical(PhysicalWarning),
    /// A moving link has no `<inertial>`, though something beyond it has mass.
    #[error("link `{link}` moves but has no <inertial>: it is simulated without mass")]
    NoInertial {
        /// The link.
        link: String,
    },
    /// An angle is too large for radians: a rotation beyond a full turn, a limit beyond two turns.
    #[error(
        "joint `{joint}`: {quantity} = {value} looks like degrees; URDF angles are radians, and \
         {value}° are {:.6} rad", value.to_radians()
    )]
    LooksLikeDegrees {
        /// The joint, or the joint above the link whose `<inertial>` is meant.
        joint: String,
        /// `limit lower`, `limit upper`, `origin rpy` or `inertial origin rpy`.
        quantity: &'static str,
        /// The number in the file.
        value: f64,
    },
    /// The lower limit is above the upper one.
    #[error("joint `{joint}`: limit lower = {lower} is above upper = {upper}")]
    ReversedLimits {
        /// The joint.
        joint: String,
        /// rad or m.
        lower: f64,
        /// rad or m.
        upper: f64,
    },
    /// A `<transmission>` states a reduction, which URDF does not define precisely enough to use.
    #[error(
        "joint `{joint}`: mechanicalReduction = {reduction} (line {line}) is not read; if rotor inertia or \
         motor-side friction matter, put `gear_ratio` under [joint.{joint}] of the sidecar file"
    )]
    TransmissionNotRead {
        /// The joint.
        joint: String,
        /// The reduction as written.
        reduction: String,
        /// Line of the robot file.
        line: u32,
    },
    /// Both the robot file and the sidecar state a friction; the sidecar's is used.
    #[error(
        "joint `{joint}`: {quantity} = {urdf} of <dynamics> is replaced by the sidecar's {key}"
    )]
    FrictionReplaced {
        /// The joint.
        joint: String,
        /// `damping` or `friction`.
        quantity: &'static str,
        /// The robot file's value, joint side.
        urdf: f64,
        /// The sidecar's key that replaces it.
        key: &'static str,
    },
}

impl Warning {
    /// True for doubts about the robot itself, which [`Loaded::strict`](crate::Loaded::strict)
    /// refuses; false for remarks on how files were combined.
    #[must_use]
    pub fn is_about_the_robot(&self) -> bool {
        !matches!(
            self,
            Self::TransmissionNotRead { .. } | Self::FrictionReplaced { .. }
        )
    }
}
