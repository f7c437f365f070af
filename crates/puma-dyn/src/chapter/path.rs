//! The closed figure-of-eight paths of the tool, with their exact derivatives, and the motion of the wrist behind them.
//!
//! # Source
//! Sec. 2.2 and table 1: centres, rotations and durations; the shape and the tool's orientation are the scenario's own.

use nalgebra::{Matrix3, Vector3};

use crate::spatial::pose::{Pose, rotation_z};

/// A figure of eight in a vertical plane, traced once while the phase φ goes from 0 to 2π.
///
/// ```text
/// point(φ) = centre + Rz(rotation)·(0, half_width·sin φ, half_height·sin 2φ)
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FigureOfEight {
    /// The crossing point, m.
    pub centre: [f64; 3],
    /// Rotation of the plane about the vertical through the crossing point, rad.
    pub rotation: f64,
    /// Half the lateral extent, m.
    pub half_width: f64,
    /// Half the vertical extent, m.
    pub half_height: f64,
}

/// A point and its first two derivatives with respect to the phase, each in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PointMotion {
    /// Position, m.
    pub point: Vector3<f64>,
    /// d point / dφ, m.
    pub velocity: Vector3<f64>,
    /// d² point / dφ², m.
    pub acceleration: Vector3<f64>,
}

impl FigureOfEight {
    /// The point at phase `phi` (rad) and its derivatives there.
    pub fn motion(&self, phi: f64) -> PointMotion {
        let rot = rotation_z(self.rotation);
        let (width, height) = (self.half_width, self.half_height);
        let (sin1, cos1) = phi.sin_cos();
        let (sin2, cos2) = (2.0 * phi).sin_cos();
        PointMotion {
            point: Vector3::from(self.centre)
                + rot * Vector3::new(0.0, width * sin1, height * sin2),
            velocity: rot * Vector3::new(0.0, width * cos1, 2.0 * height * cos2),
            acceleration: rot * Vector3::new(0.0, -width * sin1, -4.0 * height * sin2),
        }
    }
}

/// A pointer on the last link that keeps one orientation along every path.
///
/// ```text
/// R = Rz(yaw)·[x6 y6 z6]    z6 = (cos pitch, 0, sin pitch),  y6 = (0, 1, 0),  x6 = y6 × z6
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tool {
    /// Distance from the wrist centre along z6 to the point that follows the path, m.
    pub offset: f64,
    /// Elevation of z6 above the horizontal, rad.
    pub pitch: f64,
    /// Azimuth of z6, rad.
    pub yaw: f64,
}

impl Tool {
    /// Rotation from frame 6 to the base.
    pub fn rot_base_tool(&self) -> Matrix3<f64> {
        let (sin_pitch, cos_pitch) = self.pitch.sin_cos();
        let z6 = Vector3::new(cos_pitch, 0.0, sin_pitch);
        let y6 = Vector3::y();
        let frame = Matrix3::from_columns(&[y6.cross(&z6), y6, z6]);
        rotation_z(self.yaw) * frame
    }

    /// Pose of frame 6, whose origin is the wrist centre, when the pointer's tip is at `point`.
    pub fn wrist_pose(&self, point: &Vector3<f64>) -> Pose {
        let rot = self.rot_base_tool();
        Pose::new(rot, point - self.offset * rot.column(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATH: FigureOfEight = FigureOfEight {
        centre: [0.35, 0.0, 0.36],
        rotation: -0.2,
        half_width: 0.10,
        half_height: 0.25,
    };

    #[test]
    fn quarter_phase_is_the_widest_point_at_the_height_of_the_centre() {
        let point = PATH.motion(std::f64::consts::FRAC_PI_2).point;
        // Rz(−0.2)·(0, 0.1, 0) = 0.1·(sin 0.2, cos 0.2, 0).
        let expected = Vector3::new(0.35 + 0.1 * 0.2_f64.sin(), 0.1 * 0.2_f64.cos(), 0.36);
        assert!(
            (point - expected).norm() < 8.0 * f64::EPSILON,
            "{point} {expected}"
        );
    }

    #[test]
    fn derivatives_agree_with_central_differences() {
        // Error: h²/6 · max|third derivative| (8·0.25 m) plus ε·|value|/h, for h = ε^(1/3).
        let h = f64::EPSILON.cbrt();
        for phi in [0.0, 0.4, 1.7, 3.9, 6.0] {
            let (before, here, after) =
                (PATH.motion(phi - h), PATH.motion(phi), PATH.motion(phi + h));
            let tolerance = 20.0 * h * h;
            let velocity = (after.point - before.point) / (2.0 * h);
            assert!(
                (velocity - here.velocity).norm() < tolerance,
                "{velocity} {}",
                here.velocity
            );
            let acceleration = (after.velocity - before.velocity) / (2.0 * h);
            assert!(
                (acceleration - here.acceleration).norm() < tolerance,
                "{acceleration} {}",
                here.acceleration
            );
        }
    }

    #[test]
    fn tool_points_forward_and_down_and_its_tip_is_on_the_path() {
        let tool = Tool {
            offset: 0.15,
            pitch: -std::f64::consts::FRAC_PI_4,
            yaw: 0.0,
        };
        let pose = tool.wrist_pose(&Vector3::new(0.5, 0.1, 0.4));
        let reach = 0.15 * std::f64::consts::FRAC_1_SQRT_2;
        let expected = Vector3::new(0.5 - reach, 0.1, 0.4 + reach);
        let wrist = pose.translation;
        assert!(
            (wrist - expected).norm() < 8.0 * f64::EPSILON,
            "{wrist} {expected}"
        );
        let det = tool.rot_base_tool().determinant();
        assert!(
            (det - 1.0).abs() < 8.0 * f64::EPSILON,
            "right-handed: {det}"
        );
    }
}
