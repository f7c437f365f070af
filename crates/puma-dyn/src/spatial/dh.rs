//! One link of a standard Denavit–Hartenberg chain and its transform.
//!
//! ```text
//! A_j(q) = Rz(q) · Tz(d) · Tx(a) · Rx(alpha)          frame j in frame j − 1
//! ```
//! The joint turns about the z axis of frame j − 1, and frame j sits at the *far* end of link j.
//! URDF puts the link frame at the joint instead; [`DhLink::offset`] leads from one to the other.

use nalgebra::Vector3;

use crate::spatial::pose::{Pose, rotation_x, rotation_z};

/// Twist, length and offset of one standard-DH link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DhLink {
    /// Twist about x, rad.
    pub alpha: f64,
    /// Length along x, m.
    pub a: f64,
    /// Offset along z, m.
    pub d: f64,
}

impl DhLink {
    /// The part of the transform that does not depend on the joint: `Tz(d) · Tx(a) · Rx(alpha)`.
    ///
    /// It is the pose of DH frame j in the URDF-style frame of link j, which sits at the joint.
    #[must_use]
    pub fn offset(&self) -> Pose {
        Pose::new(rotation_x(self.alpha), Vector3::new(self.a, 0.0, self.d))
    }

    /// Pose of DH frame j in DH frame j − 1 at joint angle `q` rad.
    ///
    /// ```text
    /// A_j(q) = Rz(q) · Tz(d) · Tx(a) · Rx(alpha)
    /// ```
    ///
    /// # Source
    /// Corke, *Robotics, Vision and Control*, 2nd ed., sec. 7.1.2, "standard" convention.
    #[must_use]
    pub fn transform(&self, q: f64) -> Pose {
        Pose::new(rotation_z(q), Vector3::zeros()).compose(&self.offset())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_quarter_turn_of_a_link_worked_by_hand() {
        let link = DhLink {
            alpha: 0.0,
            a: 2.0,
            d: 3.0,
        };
        let pose = link.transform(std::f64::consts::FRAC_PI_2);
        let expected = Vector3::new(0.0, 2.0, 3.0);
        assert!(
            (pose.translation - expected).norm() < 4.0 * f64::EPSILON,
            "{pose:?}"
        );
    }

    #[test]
    fn the_twist_turns_the_far_frame_about_its_x_axis() {
        let link = DhLink {
            alpha: std::f64::consts::FRAC_PI_2,
            a: 0.0,
            d: 0.0,
        };
        let z_axis = link.transform(0.0).rotation * Vector3::z();
        assert!(
            (z_axis + Vector3::y()).norm() < 4.0 * f64::EPSILON,
            "{z_axis}"
        );
    }
}
