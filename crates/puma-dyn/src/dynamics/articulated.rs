//! The inertia of a body with everything beyond it hanging on free joints, and its one step inwards.

use nalgebra::{Matrix3, Vector3};

use crate::robot::body::Motion;
use crate::spatial::inertia::BodyInertia;
use crate::spatial::pose::{Pose, skew};

/// Inertia of a body as its joint feels it, with everything beyond hanging on free joints.
///
/// ```text
/// | n |   | rotational  coupling      | | ω̇ |   | moment |
/// | f | = | couplingᵀ   translational | | a | + | force  |
/// ```
/// at the origin of the body's frame, in its axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Articulated {
    rotational: Matrix3<f64>,
    coupling: Matrix3<f64>,
    translational: Matrix3<f64>,
    moment: Vector3<f64>,
    force: Vector3<f64>,
    /// Wrench per unit of joint acceleration: the inertia's column of the joint's axis.
    pub column_moment: Vector3<f64>,
    pub column_force: Vector3<f64>,
    /// The column's component along the axis, rotor included.
    pub along_axis: f64,
    /// Torque that is left for the joint's acceleration.
    pub torque: f64,
    pub omega_dot: Vector3<f64>,
    pub accel: Vector3<f64>,
}

impl Articulated {
    /// A rigid body on its own, at rest.
    pub(crate) fn rigid(inertia: &BodyInertia) -> Self {
        Self {
            rotational: inertia.inertia_at_origin(),
            coupling: skew(&inertia.first_moment),
            translational: Matrix3::from_diagonal_element(inertia.mass),
            moment: Vector3::zeros(),
            force: Vector3::zeros(),
            column_moment: Vector3::zeros(),
            column_force: Vector3::zeros(),
            along_axis: 0.0,
            torque: 0.0,
            omega_dot: Vector3::zeros(),
            accel: Vector3::zeros(),
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.rotational += other.rotational;
        self.coupling += other.coupling;
        self.translational += other.translational;
        self.moment += other.moment;
        self.force += other.force;
    }

    /// Sets the column of the joint's axis and the torque that is left for its acceleration.
    pub(crate) fn split_off_joint(&mut self, motion: Motion, rotor_inertia: f64, torque: f64) {
        let along_axis = match motion {
            Motion::Revolute => {
                self.column_moment = self.rotational.column(2).into();
                self.column_force = self.coupling.row(2).transpose();
                self.torque = torque - self.moment.z;
                self.column_moment.z
            }
            Motion::Prismatic => {
                self.column_moment = self.coupling.column(2).into();
                self.column_force = self.translational.column(2).into();
                self.torque = torque - self.force.z;
                self.column_force.z
            }
        };
        self.along_axis = along_axis + rotor_inertia;
    }

    /// What the parent has to move: this body less what its joint lets go, in the parent's frame.
    ///
    /// ```text
    /// I_a = I − c cᵀ / d,   p_a = p + c u / d           c column, d along the axis, u torque left
    /// J' = J − H P + P (H + P M)ᵀ,   H' = H + P M       P = [p]×, all rotated to parent axes
    /// ```
    pub(crate) fn felt_by_parent(&self, pose: &Pose) -> Self {
        let (c_n, c_f) = (&self.column_moment, &self.column_force);
        let scaled_n = c_n / self.along_axis;
        let scaled_f = c_f / self.along_axis;

        let r = &pose.rotation;
        let rotate = |block: Matrix3<f64>| r * block * r.transpose();
        let rotational = rotate(self.rotational - scaled_n * c_n.transpose());
        let coupling = rotate(self.coupling - scaled_n * c_f.transpose());
        let translational = rotate(self.translational - scaled_f * c_f.transpose());
        let force = r * (self.force + scaled_f * self.torque);
        let moment = r * (self.moment + scaled_n * self.torque);

        let p = skew(&pose.translation);
        let shifted_coupling = coupling + p * translational;
        Self {
            rotational: rotational - coupling * p + p * shifted_coupling.transpose(),
            coupling: shifted_coupling,
            translational,
            moment: moment + pose.translation.cross(&force),
            force,
            ..*self
        }
    }
}
