//! Three-vectors, rotations and rigid transforms.

use nalgebra::{Matrix3, Vector3};

/// Position and orientation of one frame (the *child*) in another (the *parent*).
///
/// ```text
/// p_parent = rotation · p_child + translation
/// ```
/// `rotation` maps child coordinates to parent coordinates; `translation` is in metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Orthonormal matrix of determinant +1 that maps child coordinates to parent coordinates.
    pub rotation: Matrix3<f64>,
    /// Origin of the child frame in parent coordinates, m.
    pub translation: Vector3<f64>,
}

impl Pose {
    /// The pose of a frame in itself.
    #[must_use]
    pub fn identity() -> Self {
        Self {
            rotation: Matrix3::identity(),
            translation: Vector3::zeros(),
        }
    }

    /// A pose from a rotation matrix and a translation in metres.
    #[must_use]
    pub fn new(rotation: Matrix3<f64>, translation: Vector3<f64>) -> Self {
        Self {
            rotation,
            translation,
        }
    }

    /// The pose URDF writes as `<origin xyz rpy>`.
    ///
    /// ```text
    /// rotation = Rz(yaw) · Ry(pitch) · Rx(roll)     fixed axes x, then y, then z
    /// ```
    /// `xyz` in metres, `rpy` = (roll, pitch, yaw) in radians.
    #[must_use]
    pub fn from_xyz_rpy(xyz: [f64; 3], rpy: [f64; 3]) -> Self {
        Self {
            rotation: rotation_from_rpy(rpy),
            translation: Vector3::from(xyz),
        }
    }

    /// The pose of a grandchild: `self` = child in parent, `child` = grandchild in child.
    #[must_use]
    pub fn compose(&self, child: &Self) -> Self {
        Self {
            rotation: self.rotation * child.rotation,
            translation: self.transform_point(&child.translation),
        }
    }

    /// The pose of the parent in the child.
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self {
            rotation,
            translation: -(rotation * self.translation),
        }
    }

    /// Parent coordinates of a point given in child coordinates, m.
    #[must_use]
    pub fn transform_point(&self, point: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * point + self.translation
    }
}

/// Rotation about the x axis by `angle` radians.
#[must_use]
pub fn rotation_x(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(1.0, 0.0, 0.0, 0.0, c, -s, 0.0, s, c)
}

/// Rotation about the y axis by `angle` radians.
#[must_use]
pub fn rotation_y(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(c, 0.0, s, 0.0, 1.0, 0.0, -s, 0.0, c)
}

/// Rotation about the z axis by `angle` radians.
#[must_use]
pub fn rotation_z(angle: f64) -> Matrix3<f64> {
    let (s, c) = angle.sin_cos();
    Matrix3::new(c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0)
}

/// Rotation by roll, pitch, yaw (radians) about the *fixed* axes x, y, z in that order.
///
/// ```text
/// R = Rz(yaw) · Ry(pitch) · Rx(roll)
/// ```
#[must_use]
pub fn rotation_from_rpy(rpy: [f64; 3]) -> Matrix3<f64> {
    rotation_z(rpy[2]) * rotation_y(rpy[1]) * rotation_x(rpy[0])
}

/// The matrix of the cross product: `skew(a) · b = a × b`.
#[must_use]
pub fn skew(a: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// A rotation whose third column is the unit vector `axis`.
///
/// ```text
/// R = 1 + [v]× + [v]×² / (1 + axis_z),   v = ẑ × axis
/// ```
/// Axes along x, y or ±z give matrices of exact zeros and ones.
pub(crate) fn rotation_taking_z_to(axis: &Vector3<f64>) -> Matrix3<f64> {
    if axis.z < 0.0 {
        // The formula loses digits near −z: turn half around x first, where it is exact.
        let flip = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        return flip * rotation_taking_z_to(&(flip * axis));
    }
    let v = skew(&Vector3::new(-axis.y, axis.x, 0.0));
    Matrix3::identity() + v + v * v / (1.0 + axis.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotation_taking_z_to_has_the_axis_as_its_third_column_and_is_a_rotation() {
        let tilted = Vector3::new(0.3, -0.4, -0.866).normalize();
        for axis in [
            Vector3::x(),
            Vector3::y(),
            Vector3::z(),
            -Vector3::z(),
            -Vector3::x(),
            tilted,
        ] {
            let r = rotation_taking_z_to(&axis);
            assert!(
                (r.column(2) - axis).norm() < 4.0 * f64::EPSILON,
                "{axis:?} {r}"
            );
            assert!((r * r.transpose() - Matrix3::identity()).norm() < 16.0 * f64::EPSILON);
            assert!((r.determinant() - 1.0).abs() < 16.0 * f64::EPSILON);
        }
    }

    #[test]
    fn rpy_turns_about_fixed_axes_x_then_y_then_z() {
        // Roll 90° takes y to z; then yaw 90° about the fixed z leaves it there.
        let half_pi = std::f64::consts::FRAC_PI_2;
        let r = rotation_from_rpy([half_pi, 0.0, half_pi]);
        assert!((r * Vector3::y() - Vector3::z()).norm() < 4.0 * f64::EPSILON);
    }

    #[test]
    fn a_pose_composed_with_its_inverse_is_the_identity() {
        let pose = Pose::from_xyz_rpy([0.1, -2.0, 0.7], [0.3, -1.1, 2.0]);
        let back = pose.compose(&pose.inverse());
        assert!((back.rotation - Matrix3::identity()).norm() < 16.0 * f64::EPSILON);
        assert!(back.translation.norm() < 16.0 * f64::EPSILON);
    }
}
