//! How a body moves at unit speed of one of the joints that move it.

use nalgebra::Vector3;

use crate::robot::body::Motion;
use crate::spatial::Pose;

/// How a body moves at unit speed of one joint, in its own axes and at its own origin.
#[derive(Debug, Clone)]
pub(crate) struct UnitMotion {
    /// rad/s per rad/s or m/s.
    pub angular: Vector3<f64>,
    /// m/s per rad/s or m/s.
    pub linear: Vector3<f64>,
}

impl UnitMotion {
    pub fn zero() -> Self {
        Self {
            angular: Vector3::zeros(),
            linear: Vector3::zeros(),
        }
    }

    pub fn of_own_joint(motion: Motion) -> Self {
        let mut own = Self::zero();
        match motion {
            Motion::Revolute => own.angular.z = 1.0,
            Motion::Prismatic => own.linear.z = 1.0,
        }
        own
    }

    /// That of a body welded to the moving one.
    pub fn carried(&self, pose: &Pose) -> Self {
        let linear = self.linear + self.angular.cross(&pose.translation);
        Self {
            angular: pose.rotation.tr_mul(&self.angular),
            linear: pose.rotation.tr_mul(&linear),
        }
    }
}
