//! One joint's table of a sidecar: its checks, and how it is laid over the joint's drive.

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use serde::{Deserialize, Serialize};

use crate::robot::description::{Drive, JointDescription, JointKind};
use crate::robot::smooth_friction::{
    HysteresisFriction, LoadHysteresisFriction, SmoothFriction, TanhFriction,
};
use crate::robot::warning::Warning;
use crate::spatial::pose::Pose;

/// The table `[joint.NAME]`: what it states, in the units and on the side the keys say.
///
/// N·m, N·m·s/rad and rad are N, N·s/m and m for a joint that slides.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct JointKeys {
    /// kg m², of the rotor about its own axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotor_inertia: Option<f64>,
    /// Motor speed over joint speed, with its sign.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub gear_ratio: Option<f64>,
    /// N·m·s/rad, motor side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub viscous_motor: Option<f64>,
    /// N·m, motor side, while the joint's speed is positive.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coulomb_motor_positive: Option<f64>,
    /// N·m, motor side, while it is negative.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coulomb_motor_negative: Option<f64>,
    /// N·m·s/rad, joint side.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub viscous_joint: Option<f64>,
    /// N·m, joint side, the same in both directions.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coulomb_joint: Option<f64>,
    /// rad: the joint is fixed there.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub locked_at: Option<f64>,
    /// N·m: what the measured torque is off by.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset: Option<f64>,
    /// s/rad: viscous friction as a part of the rigid-body torque.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub load_viscous: Option<f64>,
    /// Coulomb friction with a smooth change of direction.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub tanh: Vec<TanhFriction>,
    /// Coulomb friction with memory.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub hysteresis: Vec<HysteresisFriction>,
    /// The same as a part of the rigid-body torque.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub load_hysteresis: Vec<LoadHysteresisFriction>,
}

impl JointKeys {
    /// The first key that is wrong, and why.
    pub(super) fn check(&self) -> Result<(), (&'static str, String)> {
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
            ("offset", self.offset, Sign::Any),
            ("load_viscous", self.load_viscous, Sign::Any),
        ];
        for (key, value, sign) in signs {
            if let Some(value) = value {
                sign.check(value).map_err(|reason| (key, reason))?;
            }
        }
        self.check_lists()?;
        self.check_company()
    }

    /// The first entry of a list that is wrong, by its number.
    fn check_lists(&self) -> Result<(), (&'static str, String)> {
        for (number, tanh) in (1..).zip(&self.tanh) {
            entry("tanh", number, "width", tanh.width, Sign::Plus)?;
            entry("tanh", number, "torque", tanh.torque, Sign::Any)?;
        }
        for (number, spring) in (1..).zip(&self.hysteresis) {
            entry("hysteresis", number, "length", spring.length, Sign::Plus)?;
            entry("hysteresis", number, "torque", spring.torque, Sign::Any)?;
        }
        for (number, spring) in (1..).zip(&self.load_hysteresis) {
            let (
                key,
                LoadHysteresisFriction {
                    length,
                    coefficient,
                },
            ) = ("load_hysteresis", *spring);
            entry(key, number, "length", length, Sign::Plus)?;
            entry(key, number, "coefficient", coefficient, Sign::Any)?;
        }
        Ok(())
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
    pub(super) fn replaced(&self, joint: &JointDescription) -> Vec<Warning> {
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

    pub(super) fn lay_over(&self, joint: &mut JointDescription) {
        joint.smooth_friction = SmoothFriction {
            offset: self.offset.unwrap_or_default(),
            tanh: self.tanh.clone(),
            hysteresis: self.hysteresis.clone(),
            load_hysteresis: self.load_hysteresis.clone(),
            load_viscous: self.load_viscous.unwrap_or_default(),
        };
        let drive = &mut joint.drive;
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
pub(super) fn lock(joint: &mut JointDescription, position: f64) {
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
    joint.smooth_friction = SmoothFriction::NONE;
}

/// Checks one number of an entry of a list, counted from 1.
fn entry(
    list: &'static str,
    number: usize,
    key: &str,
    value: f64,
    sign: Sign,
) -> Result<(), (&'static str, String)> {
    let named = |reason| (list, format!("entry {number}: {key} {reason}"));
    sign.check(value).map_err(named)
}

#[derive(Clone, Copy)]
enum Sign {
    Plus,
    PlusOrZero,
    MinusOrZero,
    PlusOrMinus,
    Any,
}

impl Sign {
    fn check(self, value: f64) -> Result<(), String> {
        let (holds, requirement) = match self {
            Self::Plus => (value > 0.0, "must be positive"),
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
