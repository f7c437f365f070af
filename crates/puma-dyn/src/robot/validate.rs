//! Checks of a description: every refusal names the link or joint it is about.

use std::collections::BTreeMap;

use nalgebra::{Matrix3, Vector3};

use crate::error::DynError;
use crate::robot::body::Frame;
use crate::robot::description::{
    Drive, Inertial, JointDescription, JointKind, LinkDescription, RobotDescription,
};
use crate::robot::smooth_friction::SmoothFriction;
use crate::robot::warning::PhysicalWarning;
use crate::spatial::inertia::trace_complement;
use crate::spatial::pose::Pose;

/// Largest defect of an origin's rotation matrix: far above rounding, far below a wrong matrix.
const ROTATION_TOLERANCE: f64 = 1e-9;

/// Inertia tensors may be asymmetric or break an inequality by this fraction of their norm, which
/// is what printing them with a dozen digits costs.
const INERTIA_TOLERANCE: f64 = 1e-12;

/// Everything that can be checked link by link and joint by joint.
pub(crate) fn description(robot: &RobotDescription) -> Result<(), DynError> {
    finite("robot", &robot.name, "gravity", &robot.gravity)?;
    unique("link", robot.links.iter().map(|link| &link.name))?;
    unique("joint", robot.joints.iter().map(|joint| &joint.name))?;
    robot.links.iter().try_for_each(link)?;
    for joint in &robot.joints {
        ends(robot, joint)?;
        geometry(joint)?;
        drive(&joint.name, &joint.drive)?;
        smooth_friction(&joint.name, &joint.smooth_friction)?;
    }
    one_parent_each(robot)
}

/// The one link that is no joint's child.
pub(crate) fn root_link(robot: &RobotDescription) -> Result<&str, DynError> {
    let is_child = |name: &str| robot.joints.iter().any(|joint| joint.child == name);
    let mut roots = robot.links.iter().filter(|link| !is_child(&link.name));
    match (roots.next(), roots.next()) {
        (Some(root), None) => Ok(&root.name),
        (None, _) => match robot.links.first() {
            None => Err(DynError::NoLinks),
            Some(link) => Err(DynError::Cycle {
                link: link.name.clone(),
            }),
        },
        (Some(first), Some(second)) => {
            let names = [first, second].into_iter().chain(roots);
            Err(DynError::SeveralRoots {
                roots: names.map(|link| link.name.clone()).collect(),
            })
        }
    }
}

/// After the walk from the root: a link that was not reached is on a loop, or behind one.
pub(crate) fn all_links_reached(
    robot: &RobotDescription,
    frames: &[Frame],
) -> Result<(), DynError> {
    let reached = |link: &&LinkDescription| frames.iter().any(|frame| frame.name == link.name);
    match robot.links.iter().find(|link| !reached(link)) {
        None => Ok(()),
        Some(link) => Err(DynError::Cycle {
            link: link.name.clone(),
        }),
    }
}

/// Links whose stated inertia no rigid body can have.
pub(crate) fn physical_warnings(robot: &RobotDescription) -> Vec<PhysicalWarning> {
    let reason = |link: &LinkDescription| {
        let inertial = link.inertial?;
        let reason = unphysical(inertial.mass, &tensor(&inertial))?;
        Some(PhysicalWarning {
            link: link.name.clone(),
            reason,
        })
    };
    robot.links.iter().filter_map(reason).collect()
}

/// Why no rigid body has this mass and this inertia tensor about its centre, if so.
///
/// ```text
/// Σ = ½ tr(I) 1 − I ⪰ 0   ⇔   principal moments I1 ≤ I2 + I3 and so on, hence also I ⪰ 0
/// ```
///
/// # Source
/// Wensing, Kim & Slotine 2018, "Linear matrix inequalities for physically consistent inertial
/// parameter identification", sec. III.
pub(crate) fn unphysical(mass: f64, inertia: &Matrix3<f64>) -> Option<String> {
    let allowance = INERTIA_TOLERANCE * inertia.norm();
    let moments = inertia.symmetric_eigenvalues();
    if moments.min() < -allowance {
        return Some(format!(
            "its inertia tensor has the negative eigenvalue {:e}",
            moments.min()
        ));
    }
    if trace_complement(inertia).symmetric_eigenvalues().min() < -allowance {
        let mut sorted: [f64; 3] = moments.into();
        sorted.sort_by(f64::total_cmp);
        let [small, middle, large] = sorted.map(|moment| four_digits(moment, allowance));
        return Some(format!(
            "its principal moments break the triangle inequality: {large} > {middle} + {small}"
        ));
    }
    (mass <= 0.0 && inertia.norm() > 0.0).then(|| "it has inertia but no mass".to_owned())
}

/// A number as messages show it: four digits, and 0 where it is rounding noise.
fn four_digits(value: f64, noise: f64) -> f64 {
    if value.abs() <= noise {
        return 0.0;
    }
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// An error if any of the numbers is NaN or infinite.
pub(crate) fn finite(
    what: &'static str,
    name: &str,
    quantity: &'static str,
    values: &[f64],
) -> Result<(), DynError> {
    match values.iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(&value) => Err(DynError::NonFinite {
            what,
            name: name.to_owned(),
            quantity,
            value,
        }),
    }
}

/// An error if the number is NaN, infinite or negative.
pub(crate) fn finite_not_negative(
    what: &'static str,
    name: &str,
    quantity: &'static str,
    value: f64,
) -> Result<(), DynError> {
    finite(what, name, quantity, &[value])?;
    if value >= 0.0 {
        return Ok(());
    }
    let requirement = "zero or positive";
    Err(DynError::OutOfRange {
        what,
        name: name.to_owned(),
        quantity,
        value,
        requirement,
    })
}

/// An error if the number is NaN, infinite, zero or negative.
pub(crate) fn finite_positive(
    what: &'static str,
    name: &str,
    quantity: &'static str,
    value: f64,
) -> Result<(), DynError> {
    finite(what, name, quantity, &[value])?;
    if value > 0.0 {
        return Ok(());
    }
    Err(DynError::OutOfRange {
        what,
        name: name.to_owned(),
        quantity,
        value,
        requirement: "above zero",
    })
}

/// The tensor of an [`Inertial`] as a matrix.
pub(crate) fn tensor(inertial: &Inertial) -> Matrix3<f64> {
    Matrix3::from_fn(|row, column| inertial.inertia[row][column])
}

fn unique<'a>(what: &'static str, names: impl Iterator<Item = &'a String>) -> Result<(), DynError> {
    let mut seen = std::collections::BTreeSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(DynError::DuplicateName {
                what,
                name: name.clone(),
            });
        }
    }
    Ok(())
}

fn link(link: &LinkDescription) -> Result<(), DynError> {
    let Some(inertial) = &link.inertial else {
        return Ok(());
    };
    finite_not_negative("link", &link.name, "mass", inertial.mass)?;
    finite("link", &link.name, "centre of mass", &inertial.centre)?;
    finite(
        "link",
        &link.name,
        "inertia",
        inertial.inertia.as_flattened(),
    )?;
    let tensor = tensor(inertial);
    if (tensor - tensor.transpose()).norm() > INERTIA_TOLERANCE * tensor.norm() {
        return Err(DynError::AsymmetricInertia {
            link: link.name.clone(),
        });
    }
    Ok(())
}

fn ends(robot: &RobotDescription, joint: &JointDescription) -> Result<(), DynError> {
    for (role, name) in [("parent", &joint.parent), ("child", &joint.child)] {
        if !robot.links.iter().any(|link| link.name == *name) {
            let (joint, link) = (joint.name.clone(), name.clone());
            return Err(DynError::UnknownLink { joint, role, link });
        }
    }
    Ok(())
}

fn one_parent_each(robot: &RobotDescription) -> Result<(), DynError> {
    let mut parent_of: BTreeMap<&str, &str> = BTreeMap::new();
    for joint in &robot.joints {
        if let Some(first) = parent_of.insert(&joint.child, &joint.name) {
            return Err(DynError::TwoParents {
                link: joint.child.clone(),
                first: first.to_owned(),
                second: joint.name.clone(),
            });
        }
    }
    Ok(())
}

fn geometry(joint: &JointDescription) -> Result<(), DynError> {
    let Pose {
        rotation,
        translation,
    } = &joint.origin;
    finite("joint", &joint.name, "origin", translation.as_slice())?;
    finite("joint", &joint.name, "origin", rotation.as_slice())?;
    let defect = (rotation.transpose() * rotation - Matrix3::identity())
        .norm()
        .max((rotation.determinant() - 1.0).abs());
    if defect > ROTATION_TOLERANCE {
        return Err(DynError::NotARotation {
            joint: joint.name.clone(),
            defect,
        });
    }
    if joint.kind == JointKind::Fixed {
        return Ok(());
    }
    finite("joint", &joint.name, "axis", &joint.axis)?;
    if Vector3::from(joint.axis).norm() > 0.0 {
        Ok(())
    } else {
        Err(DynError::ZeroAxis {
            joint: joint.name.clone(),
        })
    }
}

fn drive(joint: &str, drive: &Drive) -> Result<(), DynError> {
    finite("joint", joint, "gear ratio", &[drive.gear_ratio])?;
    for (quantity, value) in [
        ("rotor inertia", drive.rotor_inertia),
        ("viscous friction (motor side)", drive.viscous_motor),
        ("viscous friction (joint side)", drive.viscous_joint),
        ("Coulomb friction (joint side)", drive.coulomb_joint),
        (
            "Coulomb friction at positive speed",
            drive.coulomb_motor_positive,
        ),
    ] {
        finite_not_negative("joint", joint, quantity, value)?;
    }
    let (quantity, value) = (
        "Coulomb friction at negative speed",
        drive.coulomb_motor_negative,
    );
    finite("joint", joint, quantity, &[value])?;
    if value > 0.0 {
        return Err(DynError::OutOfRange {
            what: "joint",
            name: joint.to_owned(),
            quantity,
            value,
            requirement: "zero or negative",
        });
    }
    if drive.gear_ratio.abs() <= 0.0 && drive.rotor_inertia > 0.0 {
        let (joint, rotor_inertia) = (joint.to_owned(), drive.rotor_inertia);
        return Err(DynError::ZeroGearRatio {
            joint,
            rotor_inertia,
        });
    }
    Ok(())
}

fn smooth_friction(joint: &str, friction: &SmoothFriction) -> Result<(), DynError> {
    let is_finite = |quantity, value: f64| finite("joint", joint, quantity, &[value]);
    let is_positive = |quantity, value: f64| finite_positive("joint", joint, quantity, value);
    is_finite("torque offset", friction.offset)?;
    is_finite("viscous friction of the load", friction.load_viscous)?;
    for tanh in &friction.tanh {
        is_positive("width of tanh friction", tanh.width)?;
        is_finite("torque of tanh friction", tanh.torque)?;
    }
    for hysteresis in &friction.hysteresis {
        is_positive("length of hysteresis", hysteresis.length)?;
        is_finite("torque of hysteresis", hysteresis.torque)?;
    }
    for of_load in &friction.load_hysteresis {
        is_positive("length of the load's hysteresis", of_load.length)?;
        is_finite("coefficient of the load's hysteresis", of_load.coefficient)?;
    }
    Ok(())
}
