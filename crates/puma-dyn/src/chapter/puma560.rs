//! The PUMA 560: the parameter table everybody uses, with its sources.
//!
//! The set is Corke's "params of 8/95" (SI units, standard Denavit–Hartenberg), consolidated in
//! Corke & Armstrong-Hélouvry 1994 and distributed unchanged as `puma560.m` with the Robotics
//! Toolbox for MATLAB since 1996. It is *not* the modified-DH set of Armstrong, Khatib & Burdick
//! 1986, whose rotor inertias are 291e-6, 409e-6 and 299e-6 kg m².
//!
//! Two oddities are deliberate and kept: link 1 has no mass (only its inertia about the first axis
//! matters, and that is given), and the inertias of links 1 and 3 break the triangle inequality of
//! rigid bodies, so [`Model::physical_warnings`] names them.
//!
//! # Source
//! - \[T\] `puma560.m`, Robotics Toolbox for MATLAB, "params of 8/95".
//! - \[C\] Corke & Armstrong-Hélouvry 1994, "A search for consensus among model parameters reported
//!   for the PUMA 560 robot", ICRA, pp. 1608–1613, the tables of kinematic, inertial and motor
//!   parameters.

use std::f64::consts::FRAC_PI_2;

use nalgebra::{Matrix3, Vector3};

use crate::robot::description::{
    Drive, Inertial, JointDescription, JointKind, LinkDescription, RobotDescription,
};
use crate::robot::model::Model;
use crate::spatial::dh::DhLink;
use crate::spatial::pose::Pose;

/// Number of joints.
pub const N_JOINTS: usize = 6;

/// Name of the root link: DH frame 0.
pub const BASE_LINK: &str = "base";

/// Name of the last link; its frame is DH frame 6, to which payloads are attached.
pub const LAST_LINK: &str = "link6";

/// One row of the parameter table; masses and centres are in DH frame j.
struct Row {
    dh: DhLink,
    mass: f64,         // kg
    centre: [f64; 3],  // m
    inertia: [f64; 3], // xx, yy, zz about the centre, kg m²; all products are zero [T] [C]
    rotor_inertia: f64,
    gear_ratio: f64,
    viscous_motor: f64,
    coulomb_motor: [f64; 2], // positive, negative speed
}

const fn dh(alpha: f64, a: f64, d: f64) -> DhLink {
    DhLink { alpha, a, d }
}

/// The parameter table: kinematics, mass distribution, drives, for joints 1 to 6.
const TABLE: [Row; N_JOINTS] = [
    Row {
        dh: dh(FRAC_PI_2, 0.0, 0.0),    // alpha, a, d: rad, m, m [T]
        mass: 0.0,                      // kg [T], deliberate: the first axis carries it
        centre: [0.0, 0.0, 0.0],        // m [T]
        inertia: [0.0, 0.35, 0.0],      // kg m² [T] [C]; only yy acts
        rotor_inertia: 200e-6,          // kg m², motor side [T]
        gear_ratio: -62.6111,           // [T] [C]
        viscous_motor: 1.48e-3,         // N·m·s/rad, motor side [T] [C]
        coulomb_motor: [0.395, -0.435], // N·m, motor side [T] [C]
    },
    Row {
        dh: dh(0.0, 0.4318, 0.0),         // alpha, a, d: rad, m, m [T] [C]
        mass: 17.4,                       // kg [T] [C]
        centre: [-0.3638, 0.006, 0.2275], // m [T] [C]
        inertia: [0.13, 0.524, 0.539],    // kg m² [T] [C]
        rotor_inertia: 200e-6,            // kg m², motor side [T]
        gear_ratio: 107.815,              // [T] [C]
        viscous_motor: 0.817e-3,          // N·m·s/rad, motor side [T] [C]
        coulomb_motor: [0.126, -0.071],   // N·m, motor side [T] [C]
    },
    Row {
        dh: dh(-FRAC_PI_2, 0.0203, 0.15005), // alpha, a, d: rad, m, m [T] [C]
        mass: 4.8,                           // kg [T] [C]
        centre: [-0.0203, -0.0141, 0.070],   // m [T] [C]
        inertia: [0.066, 0.086, 0.0125],     // kg m² [T] [C]
        rotor_inertia: 200e-6,               // kg m², motor side [T]
        gear_ratio: -53.7063,                // [T] [C]
        viscous_motor: 1.38e-3,              // N·m·s/rad, motor side [T] [C]
        coulomb_motor: [0.132, -0.105],      // N·m, motor side [T] [C]
    },
    Row {
        dh: dh(FRAC_PI_2, 0.0, 0.4318),     // alpha, a, d: rad, m, m [T] [C]
        mass: 0.82,                         // kg [T] [C]
        centre: [0.0, 0.019, 0.0],          // m [T] [C]
        inertia: [1.8e-3, 1.3e-3, 1.8e-3],  // kg m² [T] [C]
        rotor_inertia: 33e-6,               // kg m², motor side [T]
        gear_ratio: 76.0364,                // [T] [C]
        viscous_motor: 71.2e-6,             // N·m·s/rad, motor side [T] [C]
        coulomb_motor: [11.2e-3, -16.9e-3], // N·m, motor side [T] [C]
    },
    Row {
        dh: dh(-FRAC_PI_2, 0.0, 0.0),       // alpha, a, d: rad, m, m [T] [C]
        mass: 0.34,                         // kg [T] [C]
        centre: [0.0, 0.0, 0.0],            // m [T] [C]
        inertia: [0.3e-3, 0.4e-3, 0.3e-3],  // kg m² [T] [C]
        rotor_inertia: 33e-6,               // kg m², motor side [T]
        gear_ratio: 71.923,                 // [T] [C]
        viscous_motor: 82.6e-6,             // N·m·s/rad, motor side [T] [C]
        coulomb_motor: [9.26e-3, -14.5e-3], // N·m, motor side [T] [C]
    },
    Row {
        dh: dh(0.0, 0.0, 0.0),                // alpha, a, d: rad, m, m [T] [C]
        mass: 0.09,                           // kg [T] [C]
        centre: [0.0, 0.0, 0.032],            // m [T] [C]
        inertia: [0.15e-3, 0.15e-3, 0.04e-3], // kg m² [T] [C]
        rotor_inertia: 33e-6,                 // kg m², motor side [T]
        gear_ratio: 76.686,                   // [T] [C]
        viscous_motor: 36.7e-6,               // N·m·s/rad, motor side [T] [C]
        coulomb_motor: [3.96e-3, -10.5e-3],   // N·m, motor side [T] [C]
    },
];

/// The standard-DH parameters of the six links.
#[must_use]
pub fn dh_links() -> [DhLink; N_JOINTS] {
    TABLE.map(|row| row.dh)
}

/// The table as links and joints: `base`, `link1` … `link6`, `joint1` … `joint6`.
///
/// Link j's frame sits at joint j, as in a URDF: it is DH frame j moved back by
/// [`DhLink::offset`], so masses and inertias are moved along. Gravity is (0, 0, −9.81) m/s².
#[must_use]
pub fn description() -> RobotDescription {
    let mut robot = RobotDescription::new("puma560");
    robot.links.push(LinkDescription::new(BASE_LINK, None));
    let mut origin = Pose::identity();
    let mut parent = BASE_LINK.to_owned();

    for (row, number) in TABLE.iter().zip(1..) {
        let child = format!("link{number}");
        robot
            .links
            .push(LinkDescription::new(&child, Some(inertial_at_joint(row))));
        robot.joints.push(JointDescription {
            origin,
            drive: drive(row),
            ..JointDescription::new(
                &format!("joint{number}"),
                JointKind::Continuous,
                &parent,
                &child,
            )
        });
        origin = row.dh.offset();
        parent = child;
    }
    robot
}

/// The PUMA 560 ready for use.
///
/// # Panics
/// Never: a test builds it.
#[must_use]
pub fn model() -> Model {
    Model::new(&description()).expect("the built-in table is a valid robot")
}

/// Mass distribution of a row in the frame at the joint instead of DH frame j.
fn inertial_at_joint(row: &Row) -> Inertial {
    let offset = row.dh.offset();
    let r = offset.rotation;
    let inertia = r * Matrix3::from_diagonal(&Vector3::from(row.inertia)) * r.transpose();
    Inertial {
        mass: row.mass,
        centre: offset.transform_point(&Vector3::from(row.centre)).into(),
        inertia: inertia.transpose().into(), // rows of the tensor; nalgebra stores columns
    }
}

fn drive(row: &Row) -> Drive {
    Drive {
        rotor_inertia: row.rotor_inertia,
        gear_ratio: row.gear_ratio,
        viscous_motor: row.viscous_motor,
        coulomb_motor_positive: row.coulomb_motor[0],
        coulomb_motor_negative: row.coulomb_motor[1],
        ..Drive::NONE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_a_valid_robot_that_breaks_the_triangle_inequality_in_links_1_and_3() {
        let model = model();
        assert_eq!(model.n_joints(), N_JOINTS);
        let named: Vec<_> = model
            .physical_warnings()
            .iter()
            .map(|w| w.link.as_str())
            .collect();
        assert_eq!(named, ["link1", "link3"]);
        assert!(model.check_physical().is_err());
    }
}
