//! The sidecar TOML: motors, gears and friction, which URDF cannot say, joint by joint.

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};

use super::joint_keys::{JointKeys, lock};
use crate::error::DynError;
use crate::robot::description::{JointKind, RobotDescription};
use crate::robot::friction_law::Friction;
use crate::robot::text_file::{line_and_column, read};
use crate::robot::warning::Warning;

/// The contents of a sidecar file, checked for all that can be checked without the robot.
///
/// ```toml
/// friction_convention = "modern"        # or "toolbox-2008" or "none"; optional
///
/// [joint.shoulder]                      # the joint's name in the URDF; every key is optional
/// rotor_inertia = 200e-6                # kg m², about the motor's own axis
/// gear_ratio = -62.6                    # motor speed / joint speed, signed; needed by every motor-side key
/// viscous_motor = 1.5e-3                # N·m·s/rad, motor side
/// coulomb_motor_positive = 0.395        # N·m, motor side, while the joint speed is positive; ≥ 0
/// coulomb_motor_negative = -0.435       # N·m, motor side, while it is negative; ≤ 0
///
/// [joint.finger]
/// viscous_joint = 0.7                   # N·m·s/rad (prismatic: N·s/m), joint side
/// coulomb_joint = 1.2                   # N·m (prismatic: N), joint side, the same both ways; ≥ 0
///
/// [joint.mimicking_finger]
/// locked_at = 0.02                      # rad or m: the joint is fixed there and is no longer a number of q
///
/// [joint.elbow]                         # smooth friction, joint side; z goes to ±1 within a few lengths of travel
/// offset = 0.3                                              # N·m
/// tanh = [{ width = 0.02, torque = 1.5 }]                   # rad/s, N·m: c tanh(q̇/v)
/// hysteresis = [{ length = 5e-4, torque = 2.0 }]            # rad, N·m: h z
/// load_hysteresis = [{ length = 5e-4, coefficient = 0.05 }] # rad, 1: l |τ^rb| z
/// load_viscous = 0.08                                       # s/rad: b |τ^rb| q̇
/// ```
/// τ^rb is the joint's torque of links and payload, without drives.
/// A key that is not in this list is an error, and so is a joint the robot does not have.
#[derive(Debug, Clone, PartialEq)]
pub struct Sidecar {
    file: String,
    friction: Option<Friction>,
    joints: BTreeMap<String, JointKeys>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SidecarToml {
    #[serde(skip_serializing_if = "Option::is_none")]
    friction_convention: Option<FrictionName>,
    #[serde(default)]
    joint: BTreeMap<String, JointKeys>,
}

#[derive(Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum FrictionName {
    Modern,
    #[serde(rename = "toolbox-2008")]
    Toolbox2008,
    None,
}

impl From<FrictionName> for Friction {
    fn from(name: FrictionName) -> Self {
        match name {
            FrictionName::Modern => Self::Modern,
            FrictionName::Toolbox2008 => Self::Toolbox2008,
            FrictionName::None => Self::None,
        }
    }
}

impl From<Friction> for FrictionName {
    fn from(friction: Friction) -> Self {
        match friction {
            Friction::Modern => Self::Modern,
            Friction::Toolbox2008 => Self::Toolbox2008,
            Friction::None => Self::None,
        }
    }
}

impl Sidecar {
    /// A sidecar of values; `file` is its name in messages.
    ///
    /// # Errors
    /// `DynError::Sidecar` with joint and key, as [`Sidecar::parse`].
    pub fn new(
        file: &str,
        friction: Option<Friction>,
        joints: BTreeMap<String, JointKeys>,
    ) -> Result<Self, DynError> {
        for (joint, keys) in &joints {
            keys.check()
                .map_err(|(key, reason)| refuse(file, joint, key, reason))?;
        }
        Ok(Self {
            file: file.to_owned(),
            friction,
            joints,
        })
    }

    /// The text of its file, in digits that read back exactly.
    ///
    /// # Errors
    /// `DynError::Unwritable` if TOML has no words for it, which no sidecar has been seen to do.
    pub fn to_toml(&self) -> Result<String, DynError> {
        let toml = SidecarToml {
            friction_convention: self.friction.map(FrictionName::from),
            joint: self.joints.clone(),
        };
        toml::to_string(&toml).map_err(|error| DynError::Unwritable {
            file: self.file.clone(),
            reason: error.to_string(),
        })
    }

    /// Reads a sidecar file.
    ///
    /// # Errors
    /// `DynError::Unreadable` if the file does not exist or is not UTF-8; otherwise as
    /// [`Sidecar::parse`].
    pub fn load(path: &Path) -> Result<Self, DynError> {
        Self::parse(&path.display().to_string(), &read(path)?)
    }

    /// Reads the text of a sidecar; `file` is its name in messages.
    ///
    /// # Errors
    /// - `DynError::Malformed` with line and column: not TOML, an unknown key, a word for a number.
    /// - `DynError::Sidecar` with joint and key: a NaN, a wrong sign, a gear ratio of zero, a
    ///   motor-side key without `gear_ratio`, one Coulomb torque without the other, an entry of a
    ///   list with a width or length that is not positive.
    pub fn parse(file: &str, text: &str) -> Result<Self, DynError> {
        let toml: SidecarToml =
            toml::from_str(text).map_err(|error| not_toml(file, text, &error))?;
        let friction = toml.friction_convention.map(Friction::from);
        Self::new(file, friction, toml.joint)
    }

    /// The friction convention, if the file states one.
    #[must_use]
    pub fn friction(&self) -> Option<Friction> {
        self.friction
    }

    /// True if the gear ratio of this joint is stated.
    #[must_use]
    pub fn states_gear_ratio(&self, joint: &str) -> bool {
        self.joints
            .get(joint)
            .is_some_and(|keys| keys.gear_ratio.is_some())
    }

    /// True if this joint is to be fixed.
    #[must_use]
    pub fn locks(&self, joint: &str) -> bool {
        self.joints
            .get(joint)
            .is_some_and(|keys| keys.locked_at.is_some())
    }

    /// Lays the drives of this file over a robot's, and fixes the joints it locks.
    ///
    /// What the file states replaces what the robot stated; viscous and Coulomb friction are
    /// replaced as a whole, whichever side of the gear they are on, with a warning.
    ///
    /// # Errors
    /// `DynError::Sidecar` if a joint does not exist or is fixed; the robot is then unchanged.
    pub fn apply(&self, robot: &mut RobotDescription) -> Result<Vec<Warning>, DynError> {
        for name in self.joints.keys() {
            self.check_joint(robot, name)?;
        }
        let mut warnings = Vec::new();
        for joint in &mut robot.joints {
            if let Some(keys) = self.joints.get(&joint.name) {
                warnings.extend(keys.replaced(joint));
                keys.lay_over(joint);
                if let Some(position) = keys.locked_at {
                    lock(joint, position);
                }
            }
        }
        Ok(warnings)
    }

    fn check_joint(&self, robot: &RobotDescription, name: &str) -> Result<(), DynError> {
        let reason = match robot.joints.iter().find(|j| j.name == name) {
            None => {
                let known: Vec<&str> = robot.joints.iter().map(|j| j.name.as_str()).collect();
                format!("the robot has no such joint; it has {}", known.join(", "))
            }
            Some(joint) if joint.kind == JointKind::Fixed => "the joint is fixed".to_owned(),
            Some(_) => return Ok(()),
        };
        Err(refuse(&self.file, name, "", reason))
    }
}

fn refuse(file: &str, joint: &str, key: &'static str, reason: String) -> DynError {
    DynError::Sidecar {
        file: file.to_owned(),
        joint: joint.to_owned(),
        key,
        reason,
    }
}

/// A TOML error in one line: position, then what is wrong.
fn not_toml(file: &str, text: &str, error: &toml::de::Error) -> DynError {
    let (line, column) = line_and_column(text, error);
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    DynError::Malformed {
        file: file.to_owned(),
        line: count(line),
        column: count(column),
        reason: error.message().to_owned(),
    }
}
