//! `urdf-rs`'s answer → [`RobotDescription`], with the zeros it invented taken out again.

use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::Matrix3;
use roxmltree::TextPos;

use super::element::malformed;
use super::scan::Scan;
use crate::error::DynError;
use crate::robot::description::{
    Drive, Inertial, JointDescription, JointKind, Limits, LinkDescription, RobotDescription,
};
use crate::robot::warning::Warning;
use crate::spatial::pose::{Pose, rotation_from_rpy};

/// A rotation beyond a rounded full turn (6.2832) looks like degrees.
const FULL_TURN: f64 = TAU + 1e-2;

/// A limit in this range looks like degrees: joints of several turns have less, "no limit" written
/// as a number is more.
const LIMITS_IN_DEGREES: Range<f64> = 2.0 * FULL_TURN..1001.0;

/// Reads the dynamics of a scanned file with `urdf-rs`; `file` is its name in messages.
///
/// # Errors
/// `DynError::Malformed` for what the scan let pass and `urdf-rs` does not.
pub(super) fn convert(
    file: &str,
    scan: &Scan,
) -> Result<(RobotDescription, Vec<Warning>), DynError> {
    let robot = urdf_rs::read_from_string(&scan.dynamics)
        .map_err(|error| malformed(file, TextPos::new(1, 1), &error.to_string()))?;
    let mut description = RobotDescription::new(&robot.name);
    let mut warnings = Vec::new();
    for source in &robot.links {
        let inertial = scan
            .inertials
            .contains(&source.name)
            .then(|| inertial(&source.inertial));
        description
            .links
            .push(LinkDescription::new(&source.name, inertial));
    }
    for source in &robot.joints {
        let joint = joint(file, source, scan)?;
        warnings.extend(joint_doubts(source, &joint, &robot, scan));
        description.joints.push(joint);
    }
    Ok((description, warnings))
}

/// Mass distribution in the link's axes: URDF states the tensor in axes of its own, `rpy`.
///
/// ```text
/// I_link = R I Rᵀ,   R = Rz(yaw) · Ry(pitch) · Rx(roll)
/// ```
fn inertial(source: &urdf_rs::Inertial) -> Inertial {
    let i = &source.inertia;
    let tensor = Matrix3::new(
        i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz,
    );
    let rot_link_inertial = rotation_from_rpy(source.origin.rpy.0);
    let tensor = rot_link_inertial * tensor * rot_link_inertial.transpose();
    Inertial {
        mass: source.mass.value,
        centre: source.origin.xyz.0,
        // Rounding leaves the product a little asymmetric; the upper triangle stands for both.
        inertia: [0, 1, 2].map(|i| [0, 1, 2].map(|j| tensor[(i.min(j), i.max(j))])),
    }
}

fn joint(file: &str, source: &urdf_rs::Joint, scan: &Scan) -> Result<JointDescription, DynError> {
    let (parent, child) = (&source.parent.link, &source.child.link);
    let dynamics = source.dynamics.clone().unwrap_or_default();
    Ok(JointDescription {
        origin: Pose::from_xyz_rpy(source.origin.xyz.0, source.origin.rpy.0),
        axis: source.axis.xyz.0,
        limits: limits(source, scan),
        drive: Drive {
            viscous_joint: dynamics.damping,
            coulomb_joint: dynamics.friction,
            ..Drive::NONE
        },
        ..JointDescription::new(&source.name, kind(file, source)?, parent, child)
    })
}

fn kind(file: &str, source: &urdf_rs::Joint) -> Result<JointKind, DynError> {
    match source.joint_type {
        urdf_rs::JointType::Revolute => Ok(JointKind::Revolute),
        urdf_rs::JointType::Continuous => Ok(JointKind::Continuous),
        urdf_rs::JointType::Prismatic => Ok(JointKind::Prismatic),
        urdf_rs::JointType::Fixed => Ok(JointKind::Fixed),
        ref other => Err(DynError::UnsupportedJoint {
            file: file.to_owned(),
            line: 1,
            joint: source.name.clone(),
            reason: format!("is {other:?}"),
        }),
    }
}

/// The stated limits; an end of the range that is not stated is infinite, not `urdf-rs`'s zero.
fn limits(source: &urdf_rs::Joint, scan: &Scan) -> Option<Limits> {
    let stated = scan.limits.get(&source.name)?;
    let ranged = source.joint_type != urdf_rs::JointType::Continuous;
    let limit = &source.limit;
    Some(Limits {
        lower: if stated.lower && ranged {
            limit.lower
        } else {
            f64::NEG_INFINITY
        },
        upper: if stated.upper && ranged {
            limit.upper
        } else {
            f64::INFINITY
        },
        effort: limit.effort,
        velocity: limit.velocity,
    })
}

fn joint_doubts(
    source: &urdf_rs::Joint,
    joint: &JointDescription,
    robot: &urdf_rs::Robot,
    scan: &Scan,
) -> Vec<Warning> {
    let looks_like_degrees = |(quantity, value)| Warning::LooksLikeDegrees {
        joint: joint.name.clone(),
        quantity,
        value,
    };
    let rotations = rotations(source, joint, robot);
    let rotations = rotations.filter(|(_, angle)| angle.abs() > FULL_TURN);
    let limits = limit_angles(joint);
    let limits = limits.filter(|(_, angle)| LIMITS_IN_DEGREES.contains(&angle.abs()));
    let mut doubts: Vec<Warning> = rotations.chain(limits).map(looks_like_degrees).collect();
    if let Some(Limits { lower, upper, .. }) = joint.limits.filter(|l| l.lower > l.upper) {
        doubts.push(Warning::ReversedLimits {
            joint: joint.name.clone(),
            lower,
            upper,
        });
    }
    let is_stated = scan.inertials.contains(&joint.child);
    if joint.kind != JointKind::Fixed && !is_stated {
        doubts.push(Warning::NoInertial {
            link: joint.child.clone(),
        });
    }
    doubts
}

/// The angles of a joint's origin and of its child's inertial, rad if the file is right.
fn rotations<'a>(
    source: &'a urdf_rs::Joint,
    joint: &JointDescription,
    robot: &'a urdf_rs::Robot,
) -> impl Iterator<Item = (&'static str, f64)> + 'a {
    let child = robot.links.iter().find(|link| link.name == joint.child);
    let inertial = child
        .into_iter()
        .flat_map(|link| link.inertial.origin.rpy.0);
    let origin = source.origin.rpy.iter().map(|&angle| ("origin rpy", angle));
    origin.chain(inertial.map(|angle| ("inertial origin rpy", angle)))
}

/// The limits of a joint that turns, rad if the file is right.
fn limit_angles(joint: &JointDescription) -> impl Iterator<Item = (&'static str, f64)> + use<> {
    let limits = joint.limits.filter(|_| joint.kind == JointKind::Revolute);
    limits
        .into_iter()
        .flat_map(|l| [("limit lower", l.lower), ("limit upper", l.upper)])
}
