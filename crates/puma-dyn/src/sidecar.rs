//! The sidecar TOML: motors, gears and friction, which URDF cannot say, joint by joint.
//!
//! ```toml
//! friction_convention = "modern"        # or "toolbox-2008" or "none"; optional
//!
//! [joint.shoulder]                      # the joint's name in the URDF; every key is optional
//! rotor_inertia = 200e-6                # kg m², about the motor's own axis
//! gear_ratio = -62.6                    # motor speed / joint speed, signed; needed by every motor-side key
//! viscous_motor = 1.5e-3                # N·m·s/rad, motor side
//! coulomb_motor_positive = 0.395        # N·m, motor side, while the joint speed is positive; ≥ 0
//! coulomb_motor_negative = -0.435       # N·m, motor side, while it is negative; ≤ 0
//!
//! [joint.finger]
//! viscous_joint = 0.7                   # N·m·s/rad (prismatic: N·s/m), joint side
//! coulomb_joint = 1.2                   # N·m (prismatic: N), joint side, the same both ways; ≥ 0
//!
//! [joint.mimicking_finger]
//! locked_at = 0.02                      # rad or m: the joint is fixed there and is no longer a number of q
//! ```
//! A key that is not in this list is an error, and so is a joint the robot does not have.

use std::collections::BTreeMap;
use std::path::Path;

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use serde::Deserialize;

use crate::description::{Drive, JointDescription, JointKind, RobotDescription};
use crate::error::DynError;
use crate::friction::Friction;
use crate::spatial::Pose;
use crate::urdf::read;
use crate::warning::Warning;

/// The contents of a sidecar file, checked for all that can be checked without the robot.
#[derive(Debug, Clone)]
pub struct Sidecar {
    file: String,
    friction: Option<Friction>,
    joints: BTreeMap<String, JointKeys>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SidecarToml {
    friction_convention: Option<FrictionName>,
    #[serde(default)]
    joint: BTreeMap<String, JointKeys>,
}

#[derive(Clone, Copy, Deserialize)]
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

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct JointKeys {
    rotor_inertia: Option<f64>,
    gear_ratio: Option<f64>,
    viscous_motor: Option<f64>,
    coulomb_motor_positive: Option<f64>,
    coulomb_motor_negative: Option<f64>,
    viscous_joint: Option<f64>,
    coulomb_joint: Option<f64>,
    locked_at: Option<f64>,
}

impl Sidecar {
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
    ///   motor-side key without `gear_ratio`, one Coulomb torque without the other.
    pub fn parse(file: &str, text: &str) -> Result<Self, DynError> {
        let toml: SidecarToml =
            toml::from_str(text).map_err(|error| not_toml(file, text, &error))?;
        for (joint, keys) in &toml.joint {
            keys.check()
                .map_err(|(key, reason)| refuse(file, joint, key, reason))?;
        }
        Ok(Self {
            file: file.to_owned(),
            friction: toml.friction_convention.map(Friction::from),
            joints: toml.joint,
        })
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
                keys.lay_over(&mut joint.drive);
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

impl JointKeys {
    /// The first key that is wrong, and why.
    fn check(&self) -> Result<(), (&'static str, String)> {
        let signs = [
            ("rotor_inertia", self.rotor_inertia, Sign::PlusOrZero),
            ("gear_ratio", self.gear_ratio, Sign::PlusOrMinus),
            ("viscous_motor", self.viscous_motor, Sign::PlusOrZero),
            (
                "coulomb_motor_positive",
                self.coulomb_motor_positive,
                Sign::PlusOrZero,
            ),
            (
                "coulomb_motor_negative",
                self.coulomb_motor_negative,
                Sign::MinusOrZero,
            ),
            ("viscous_joint", self.viscous_joint, Sign::PlusOrZero),
            ("coulomb_joint", self.coulomb_joint, Sign::PlusOrZero),
            ("locked_at", self.locked_at, Sign::Any),
        ];
        for (key, value, sign) in signs {
            if let Some(value) = value {
                sign.check(value).map_err(|reason| (key, reason))?;
            }
        }
        self.check_company()
    }

    /// Motor-side keys need the gear ratio, and the two Coulomb torques come together.
    fn check_company(&self) -> Result<(), (&'static str, String)> {
        let on_the_motor = [
            ("rotor_inertia", self.rotor_inertia),
            ("viscous_motor", self.viscous_motor),
            ("coulomb_motor_positive", self.coulomb_motor_positive),
            ("coulomb_motor_negative", self.coulomb_motor_negative),
        ];
        let first = on_the_motor.iter().find(|(_, value)| value.is_some());
        if let (Some((key, _)), None) = (first, self.gear_ratio) {
            let reason = "is on the motor's side and needs `gear_ratio` (1 for a direct drive)";
            return Err((key, reason.to_owned()));
        }
        let missing = match (self.coulomb_motor_positive, self.coulomb_motor_negative) {
            (Some(_), None) => "coulomb_motor_negative",
            (None, Some(_)) => "coulomb_motor_positive",
            _ => return Ok(()),
        };
        Err((missing, "is missing: state both directions".to_owned()))
    }

    /// The frictions of the robot file that these keys replace.
    fn replaced(&self, joint: &JointDescription) -> Vec<Warning> {
        let replaced = |quantity, urdf: f64, key: Option<&'static str>| {
            key.filter(|_| urdf.abs() > 0.0)
                .map(|key| Warning::FrictionReplaced {
                    joint: joint.name.clone(),
                    quantity,
                    urdf,
                    key,
                })
        };
        let drive = &joint.drive;
        [
            replaced("damping", drive.viscous_joint, self.viscous_key()),
            replaced("friction", drive.coulomb_joint, self.coulomb_key()),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    fn viscous_key(&self) -> Option<&'static str> {
        let joint = self.viscous_joint.map(|_| "viscous_joint");
        joint.or(self.viscous_motor.map(|_| "viscous_motor"))
    }

    fn coulomb_key(&self) -> Option<&'static str> {
        let joint = self.coulomb_joint.map(|_| "coulomb_joint");
        joint.or(self
            .coulomb_motor_positive
            .map(|_| "coulomb_motor_positive"))
    }

    fn lay_over(&self, drive: &mut Drive) {
        drive.rotor_inertia = self.rotor_inertia.unwrap_or(drive.rotor_inertia);
        drive.gear_ratio = self.gear_ratio.unwrap_or(drive.gear_ratio);
        if self.viscous_key().is_some() {
            drive.viscous_motor = self.viscous_motor.unwrap_or(0.0);
            drive.viscous_joint = self.viscous_joint.unwrap_or(0.0);
        }
        if self.coulomb_key().is_some() {
            drive.coulomb_motor_positive = self.coulomb_motor_positive.unwrap_or(0.0);
            drive.coulomb_motor_negative = self.coulomb_motor_negative.unwrap_or(0.0);
            drive.coulomb_joint = self.coulomb_joint.unwrap_or(0.0);
        }
    }
}

/// Makes a joint a fixed one, its child standing where the joint's `position` (rad or m) puts it.
fn lock(joint: &mut JointDescription, position: f64) {
    let axis = Vector3::from(joint.axis);
    // A zero axis is the model's to refuse: it stays a moving joint here.
    let Some(axis) = Unit::try_new(axis, 0.0) else {
        return;
    };
    let moved = match joint.kind {
        JointKind::Prismatic => Pose::new(Matrix3::identity(), axis.into_inner() * position),
        _ => Pose::new(
            Rotation3::from_axis_angle(&axis, position).into_inner(),
            Vector3::zeros(),
        ),
    };
    joint.origin = joint.origin.compose(&moved);
    joint.kind = JointKind::Fixed;
    joint.limits = None;
    joint.drive = Drive::NONE;
}

#[derive(Clone, Copy)]
enum Sign {
    PlusOrZero,
    MinusOrZero,
    PlusOrMinus,
    Any,
}

impl Sign {
    fn check(self, value: f64) -> Result<(), String> {
        let (holds, requirement) = match self {
            Self::PlusOrZero => (value >= 0.0, "must not be negative"),
            Self::MinusOrZero => (value <= 0.0, "must not be positive"),
            Self::Any => (true, ""),
            Self::PlusOrMinus => (value.abs() > 0.0, "must not be zero"),
        };
        if !value.is_finite() {
            return Err(format!("= {value}, must be finite"));
        }
        if holds {
            Ok(())
        } else {
            Err(format!("= {value}, {requirement}"))
        }
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
    let at = error.span().map_or(0, |span| span.start).min(text.len());
    let before = &text[..at];
    let line = before.matches('\n').count() + 1;
    let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    DynError::Malformed {
        file: file.to_owned(),
        line: count(line),
        column: count(column),
        reason: error.message().to_owned(),
    }
}
