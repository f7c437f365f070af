//! Joint rates and accelerations of the PUMA 560 for a given motion of its wrist centre at fixed orientation.
//!
//! ```text
//! J q̇ = (ṗ, 0)        J q̈ = (p̈, 0) − J̇ q̇
//! ```
//!
//! The last three axes pass through the wrist centre, so J is block triangular: the first three joints follow the
//! position, the last three undo the rotation that the first three cause.

use nalgebra::{Matrix3, Vector3};

use crate::chapter::inverse_kin::{A2, A3, ALIGNED, D3, D4};
use crate::chapter::inverse_kin::{rot_base_forearm, unreachable};
use crate::error::DynError;

/// The first two derivatives of the joint angles, in the derivative's own variable (time or phase).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointMotion {
    /// First derivative.
    pub qd: [f64; 6],
    /// Second derivative.
    pub qdd: [f64; 6],
}

/// Joint rates and accelerations when the wrist centre has the given velocity and acceleration and frame 6 does not turn.
///
/// # Shapes
/// `q` rad; `velocity` and `acceleration` in the base frame, m/s and m/s² (or per unit of any other variable).
///
/// # Errors
/// [`DynError::Unreachable`] if the Jacobian is singular at `q`: arm stretched, or the axes of joints 4 and 6 aligned.
pub fn inverse_rates(
    q: &[f64; 6],
    velocity: &Vector3<f64>,
    acceleration: &Vector3<f64>,
) -> Result<JointMotion, DynError> {
    let axes = Axes::at(q);
    let arm = axes.arm_jacobian().lu();
    let wrist = Matrix3::from_columns(&[axes.z[3], axes.z[4], axes.z[5]]).lu();
    let singular = |reason: &str| unreachable(&axes.wrist, reason.to_owned());
    let arm_singular = || singular("the arm's Jacobian is singular there");
    let wrist_singular = || singular("the axes of joints 4 and 6 are aligned there");
    if axes.z[3].cross(&axes.z[5]).norm() <= ALIGNED {
        return Err(wrist_singular());
    }

    // J q̇ = (ṗ, 0).
    let arm_qd = arm.solve(velocity).ok_or_else(arm_singular)?;
    let wrist_qd = wrist
        .solve(&-axes.forearm_rate(&arm_qd))
        .ok_or_else(wrist_singular)?;
    let qd = [
        arm_qd.x, arm_qd.y, arm_qd.z, wrist_qd.x, wrist_qd.y, wrist_qd.z,
    ];

    // J q̈ = (p̈, 0) − J̇ q̇.
    let (linear_bias, angular_bias) = axes.bias(&qd);
    let arm_qdd = arm
        .solve(&(acceleration - linear_bias))
        .ok_or_else(arm_singular)?;
    let wrist_qdd = wrist
        .solve(&(-axes.forearm_rate(&arm_qdd) - angular_bias))
        .ok_or_else(wrist_singular)?;
    let qdd = [
        arm_qdd.x,
        arm_qdd.y,
        arm_qdd.z,
        wrist_qdd.x,
        wrist_qdd.y,
        wrist_qdd.z,
    ];
    Ok(JointMotion { qd, qdd })
}

/// The joint axes and the points they pass through, in the base frame with its origin at the shoulder.
struct Axes {
    /// Unit vectors along the six axes.
    z: [Vector3<f64>; 6],
    /// A point on axis 3, m; axes 1 and 2 pass through the origin.
    elbow: Vector3<f64>,
    /// The point where axes 4, 5 and 6 meet, m.
    wrist: Vector3<f64>,
}

impl Axes {
    fn at(q: &[f64; 6]) -> Self {
        let (s1, c1) = q[0].sin_cos();
        let (s2, c2) = q[1].sin_cos();
        let lateral = Vector3::new(s1, -c1, 0.0);
        let forward = Vector3::new(c1, s1, 0.0);
        let up = Vector3::z();
        let forearm = rot_base_forearm(q[0], q[1] + q[2]);
        let (s4, c4) = q[3].sin_cos();
        let (s5, c5) = q[4].sin_cos();

        let elbow = A2 * (c2 * forward + s2 * up);
        Self {
            z: [
                up,
                lateral,
                lateral,
                forearm * Vector3::z(),
                forearm * Vector3::new(s4, -c4, 0.0),
                forearm * Vector3::new(-c4 * s5, -s4 * s5, c5),
            ],
            elbow,
            wrist: elbow + D3 * lateral + forearm * Vector3::new(A3, 0.0, D4),
        }
    }

    /// Position of axis `i`'s point relative to which its lever arm to the wrist is taken.
    fn lever(&self, i: usize) -> Vector3<f64> {
        if i == 2 {
            self.wrist - self.elbow
        } else {
            self.wrist
        }
    }

    /// Linear part of the Jacobian's first three columns, zᵢ × (p − oᵢ).
    fn arm_jacobian(&self) -> Matrix3<f64> {
        Matrix3::from_columns(&[0, 1, 2].map(|i| self.z[i].cross(&self.lever(i))))
    }

    /// Angular velocity of the forearm, Σ zᵢ·rateᵢ over the first three joints.
    fn forearm_rate(&self, rates: &Vector3<f64>) -> Vector3<f64> {
        self.z[0] * rates.x + self.z[1] * rates.y + self.z[2] * rates.z
    }

    /// J̇ q̇: linear and angular acceleration of the wrist at q̈ = 0.
    fn bias(&self, qd: &[f64; 6]) -> (Vector3<f64>, Vector3<f64>) {
        // Acceleration of the wrist along the chain: each lever turns with the links before and at its joint.
        let mut omega = Vector3::zeros();
        let mut alpha = Vector3::zeros();
        let mut linear = Vector3::zeros();
        for (i, (axis, rate)) in self.z.iter().zip(qd).enumerate() {
            alpha += omega.cross(axis) * *rate;
            omega += axis * *rate;
            // The rigid pieces origin → elbow (moved by joints 1, 2) and elbow → wrist (by joint 3 as well).
            let piece = match i {
                1 => self.elbow,
                2 => self.wrist - self.elbow,
                _ => continue,
            };
            linear += alpha.cross(&piece) + omega.cross(&omega.cross(&piece));
        }
        (linear, alpha)
    }
}
