//! Joint angles of the PUMA 560 that put its last frame at a given pose, in closed form.
//!
//! The wrist's three axes meet in one point, so the position of that point fixes the first three joints
//! and the orientation fixes the last three.
//!
//! ```text
//! p = Rz(q1)·(X, −d3, Y)                  wrist centre, from the shoulder
//! X = a2 cos q2 + ρ cos(q2 + ψ)           ρ = √(a3² + d4²),  ψ = q3 + atan2(d4, a3)
//! Y = a2 sin q2 + ρ sin(q2 + ψ)
//! R = R03(q1, q2, q3)·Rz(q4)·Ry(−q5)·Rz(q6)
//! ```
//!
//! # Source
//! Paul & Zhang 1986, "Computationally efficient kinematics for manipulators with spherical wrists based on
//! the homogeneous transformation representation", for the method; the formulas are derived here from the
//! standard Denavit–Hartenberg table of the [`puma560`](crate::puma560) module.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Vector3};

use crate::error::DynError;
use crate::spatial::pose::Pose;

/// Link length a2, m (Corke's parameter set, 8/95).
pub(crate) const A2: f64 = 0.4318;
/// Link length a3, m (same source).
pub(crate) const A3: f64 = 0.0203;
/// Link offset d3, m (same source).
pub(crate) const D3: f64 = 0.150_05;
/// Link offset d4, m (same source).
pub(crate) const D4: f64 = 0.4318;

/// Below this sine of q5 the fourth and sixth axes count as aligned: a handful of roundings of a rotation matrix.
pub(crate) const ALIGNED: f64 = 16.0 * f64::EPSILON;
/// A cosine this far above 1 is a stretched arm with rounding, not an unreachable point.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// On which side of the base axis the upper arm is carried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Arm {
    /// X < 0: `q1 = atan2(y, x) + π − asin(d3 / r)`.
    Left,
    /// X > 0: `q1 = atan2(y, x) + asin(d3 / r)`.
    Right,
}

/// On which side of the line from shoulder to wrist the elbow is, for an observer who sees the wrist ahead of the shoulder.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Elbow {
    /// Above the line: ψ > 0 for a left arm, ψ < 0 for a right arm.
    Up,
    /// Below the line: ψ < 0 for a left arm, ψ > 0 for a right arm.
    Down,
}

/// The sign of q5.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wrist {
    /// q5 in [0, π].
    NoFlip,
    /// q5 in [−π, 0].
    Flip,
}

/// One of the eight arm configurations.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// Shoulder.
    pub arm: Arm,
    /// Elbow.
    pub elbow: Elbow,
    /// Wrist.
    pub wrist: Wrist,
}

impl Elbow {
    /// The elbow whose angle is `q3 = sign · acos(..) − atan2(d4, a3)`.
    pub fn from_acos_sign(arm: Arm, is_positive: bool) -> Self {
        if is_positive == (arm == Arm::Left) {
            Self::Up
        } else {
            Self::Down
        }
    }
}

impl Branch {
    /// All eight configurations.
    pub const ALL: [Self; 8] = {
        use {
            Arm::{Left, Right},
            Elbow::{Down, Up},
            Wrist::{Flip, NoFlip},
        };
        [
            Self::new(Left, Up, NoFlip),
            Self::new(Left, Up, Flip),
            Self::new(Left, Down, NoFlip),
            Self::new(Left, Down, Flip),
            Self::new(Right, Up, NoFlip),
            Self::new(Right, Up, Flip),
            Self::new(Right, Down, NoFlip),
            Self::new(Right, Down, Flip),
        ]
    };

    /// A configuration from its three choices.
    pub const fn new(arm: Arm, elbow: Elbow, wrist: Wrist) -> Self {
        Self { arm, elbow, wrist }
    }

    /// The configuration a joint vector is in; on a boundary between two, either.
    pub fn of(q: &[f64; 6]) -> Self {
        let psi = q[2] + D4.atan2(A3);
        let x = A2 * q[1].cos() + A3.hypot(D4) * (q[1] + psi).cos();
        let arm = if x < 0.0 { Arm::Left } else { Arm::Right };
        let wrist = if q[4].sin() < 0.0 {
            Wrist::Flip
        } else {
            Wrist::NoFlip
        };
        Self::new(arm, Elbow::from_acos_sign(arm, psi.sin() >= 0.0), wrist)
    }

    /// Sign of ψ = q3 + atan2(d4, a3).
    fn elbow_sign(self) -> f64 {
        match (self.arm, self.elbow) {
            (Arm::Left, Elbow::Up) | (Arm::Right, Elbow::Down) => 1.0,
            (Arm::Left, Elbow::Down) | (Arm::Right, Elbow::Up) => -1.0,
        }
    }

    /// Sign of q5.
    fn wrist_sign(self) -> f64 {
        match self.wrist {
            Wrist::NoFlip => 1.0,
            Wrist::Flip => -1.0,
        }
    }
}

/// Joint angles that put Denavit–Hartenberg frame 6 at `pose`, in the configuration `branch`.
///
/// `pose` is given in Denavit–Hartenberg frame 0, whose origin is the shoulder; its translation is in metres.
/// Every angle comes back in (−π, π], rad; joint limits are not looked at.
///
/// When the axes of joints 4 and 6 are aligned (|sin q5| ≤ 16 ε) only q4 + q6 (or q6 − q4 for q5 = π) is determined:
/// the answer then has `q4 = 0`.
///
/// # Errors
/// [`DynError::Unreachable`] if the wrist is nearer to the base axis than d3, farther from the shoulder than the
/// stretched arm or nearer than the folded one, or if the pose is not finite.
///
/// ```
/// use puma_dyn::chapter::{Arm, Branch, Elbow, Wrist, inverse_kinematics};
/// use puma_dyn::{forward_kinematics, puma560};
///
/// let model = puma560::model();
/// let flange = model.frame_idx(puma560::LAST_LINK).expect("the arm has a last link");
/// let pose = forward_kinematics(&model, flange, &[0.1, 0.2, -0.3, 0.4, 0.5, 0.6]);
/// let q = inverse_kinematics(&pose, Branch::new(Arm::Right, Elbow::Down, Wrist::NoFlip))?;
/// assert!((q[1] - 0.2).abs() < 1e-14);
/// # Ok::<(), puma_dyn::DynError>(())
/// ```
///
/// # Source
/// The equations are at the top of this source file; branches as in Corke 1996, "A Robotics Toolbox for MATLAB".
pub fn inverse_kinematics(pose: &Pose, branch: Branch) -> Result<[f64; 6], DynError> {
    let wrist = &pose.translation;
    let [q1, q2, q3] = arm_angles(wrist, branch)?;
    if !pose.rotation.iter().all(|entry| entry.is_finite()) {
        return Err(unreachable(
            wrist,
            "its orientation is not finite".to_owned(),
        ));
    }
    let r36 = rot_base_forearm(q1, q2 + q3).transpose() * pose.rotation;
    let [q4, q5, q6] = wrist_angles(&r36, branch);
    Ok([q1, q2, q3, q4, q5, q6].map(wrap))
}

/// The first three angles, from the position of the wrist centre.
fn arm_angles(wrist: &Vector3<f64>, branch: Branch) -> Result<[f64; 3], DynError> {
    // Distance in the plane of the arm, from the shoulder axis; its sign is the arm's side.
    let radius = wrist.x.hypot(wrist.y);
    let reach_sq = (radius - D3) * (radius + D3);
    if !radius.is_finite() || !wrist.z.is_finite() {
        return Err(unreachable(wrist, "its position is not finite".to_owned()));
    }
    if reach_sq < 0.0 {
        let reason = format!(
            "it is {radius:.4} m from the base axis, nearer than the shoulder offset of {D3} m"
        );
        return Err(unreachable(wrist, reason));
    }
    let x = match branch.arm {
        Arm::Left => -reach_sq.sqrt(),
        Arm::Right => reach_sq.sqrt(),
    };
    let q1 = wrist.y.atan2(wrist.x) - (-D3).atan2(x);

    // Triangle shoulder, elbow, wrist.
    let rho = A3.hypot(D4);
    let psi = branch.elbow_sign() * elbow_cosine(wrist, x.hypot(wrist.z), rho)?.acos();
    let q2 = wrist.z.atan2(x) - (rho * psi.sin()).atan2(A2 + rho * psi.cos());
    Ok([q1, q2, psi - D4.atan2(A3)])
}

/// cos ψ from the cosine rule; an error outside the ring that the two links can reach.
fn elbow_cosine(wrist: &Vector3<f64>, distance: f64, rho: f64) -> Result<f64, DynError> {
    let cosine = (distance * distance - A2 * A2 - rho * rho) / (2.0 * A2 * rho);
    if cosine.abs() <= 1.0 + ROUNDING {
        return Ok(cosine.clamp(-1.0, 1.0));
    }
    let reason = if cosine > 1.0 {
        format!(
            "it is {distance:.4} m from the shoulder, farther than the stretched arm's {:.4} m",
            A2 + rho
        )
    } else {
        format!(
            "it is {distance:.4} m from the shoulder, nearer than the folded arm's {:.4} m",
            (A2 - rho).abs()
        )
    };
    Err(unreachable(wrist, reason))
}

/// The last three angles, from R36 = Rz(q4)·Ry(−q5)·Rz(q6).
fn wrist_angles(r36: &Matrix3<f64>, branch: Branch) -> [f64; 3] {
    // Third column: (−cos q4 sin q5, −sin q4 sin q5, cos q5).
    let sign = branch.wrist_sign();
    let is_aligned = r36.m13.hypot(r36.m23) <= ALIGNED;
    let q4 = if is_aligned {
        0.0
    } else {
        (-sign * r36.m23).atan2(-sign * r36.m13)
    };

    // Rz(−q4)·R36 has third column (−sin q5, 0, cos q5) and second row (sin q6, cos q6, 0).
    let (sin4, cos4) = q4.sin_cos();
    let q5 = (-(cos4 * r36.m13 + sin4 * r36.m23)).atan2(r36.m33);
    let q6 = (cos4 * r36.m21 - sin4 * r36.m11).atan2(cos4 * r36.m22 - sin4 * r36.m12);
    [q4, q5, q6]
}

/// R03: orientation of frame 3 in frame 0, Rz(q1)·Rx(π/2)·Rz(q2 + q3)·Rx(−π/2).
pub(crate) fn rot_base_forearm(q1: f64, q23: f64) -> Matrix3<f64> {
    let (s1, c1) = q1.sin_cos();
    let (s23, c23) = q23.sin_cos();
    Matrix3::new(
        c1 * c23,
        -s1,
        -c1 * s23,
        s1 * c23,
        c1,
        -s1 * s23,
        s23,
        0.0,
        c23,
    )
}

/// The same angle in (−π, π].
fn wrap(angle: f64) -> f64 {
    let turn = 2.0 * PI;
    let wrapped = angle - turn * (angle / turn).round();
    if wrapped <= -PI {
        wrapped + turn
    } else {
        wrapped
    }
}

/// The error that names where the wrist centre should have been and why it cannot be there.
pub(crate) fn unreachable(wrist: &Vector3<f64>, reason: String) -> DynError {
    DynError::Unreachable {
        position: [wrist.x, wrist.y, wrist.z],
        reason,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chapter::puma560::dh_links;

    #[test]
    fn lengths_are_those_of_the_parameter_table() {
        let links = dh_links();
        let table = [links[1].a, links[2].a, links[2].d, links[3].d];
        assert_eq!(table.map(f64::to_bits), [A2, A3, D3, D4].map(f64::to_bits));
    }

    #[test]
    fn angles_wrap_into_one_turn_with_plus_pi_kept() {
        for (angle, expected) in [
            (4.0, 4.0 - 2.0 * PI),
            (-PI, PI),
            (PI, PI),
            (-4.0, 2.0 * PI - 4.0),
        ] {
            assert!(
                (wrap(angle) - expected).abs() < 8.0 * f64::EPSILON,
                "{angle} {}",
                wrap(angle)
            );
        }
    }
}
