//! One joint's table of a sidecar: its checks, and how it is laid over the joint's drive.

use nalgebra::{Matrix3, Rotation3, Unit, Vector3};
use serde::Deserialize;

use crate::robot::description::{Drive, JointDescription, JointKind};
use crate::robot::warning::Warning;
use crate::spatial::pose::Pose;

/// The table `[joint.NAME]`: what it states, in the units and on the side the keys say.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct JointKeys {
    rotor_inertia: Option<f64>,
    pub gear_ratio: Option<f64>,
    viscous_motor: Option<f64>,
    coulomb_motor_positive: Option<f64>,
    coulomb_motor_negative: Option<f64>,
    viscous_joint: Option<f64>,
    coulomb_joint: Option<f64>,
    pub locked_at: Option<f64>,
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

    pub(super) fn lay_over(&self, drive: &mut Drive) {
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
