//! The ten inertial parameters of a rigid body, and what is done with them: moved to another frame
//! and added up.

use nalgebra::{Matrix3, Vector3};

use crate::spatial::pose::Pose;

/// Mass, first and second mass moments of a rigid body about a frame's origin, in its axes.
///
/// ```text
/// mass = ∫ dm,   first_moment = ∫ r dm = m c,   second_moment = ∫ r rᵀ dm = ½ tr(I) 1 − I
/// ```
/// The ten numbers are linear in the mass distribution, so rigidly connected bodies simply add.
///
/// # Source
/// The second moment is the 3 × 3 block of the pseudo-inertia matrix: Wensing, Kim & Slotine 2018,
/// "Linear matrix inequalities for physically consistent inertial parameter identification".
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BodyInertia {
    /// kg.
    pub mass: f64,
    /// kg m.
    pub first_moment: Vector3<f64>,
    /// kg m², symmetric.
    pub second_moment: Matrix3<f64>,
}

impl BodyInertia {
    pub(crate) fn zero() -> Self {
        Self {
            mass: 0.0,
            first_moment: Vector3::zeros(),
            second_moment: Matrix3::zeros(),
        }
    }

    /// From mass, centre of mass and the inertia tensor about the *centre*.
    pub(crate) fn from_central(mass: f64, centre: Vector3<f64>, inertia: &Matrix3<f64>) -> Self {
        Self {
            mass,
            first_moment: mass * centre,
            second_moment: trace_complement(inertia) + mass * centre * centre.transpose(),
        }
    }

    /// Inertia tensor about the frame's *origin*, kg m².
    pub(crate) fn inertia_at_origin(&self) -> Matrix3<f64> {
        Matrix3::from_diagonal_element(self.second_moment.trace()) - self.second_moment
    }

    /// The same body in a parent frame, where `pose` is this frame in the parent.
    ///
    /// ```text
    /// r' = R r + p:   h' = R h + m p,   Σ' = R Σ Rᵀ + (R h) pᵀ + p (R h)ᵀ + m p pᵀ
    /// ```
    pub(crate) fn in_parent(&self, pose: &Pose) -> Self {
        let (r, p) = (&pose.rotation, &pose.translation);
        let rh = r * self.first_moment;
        let cross = rh * p.transpose();
        Self {
            mass: self.mass,
            first_moment: rh + self.mass * p,
            second_moment: r * self.second_moment * r.transpose()
                + cross
                + cross.transpose()
                + self.mass * p * p.transpose(),
        }
    }

    pub(crate) fn add(&mut self, other: &Self) {
        self.mass += other.mass;
        self.first_moment += other.first_moment;
        self.second_moment += other.second_moment;
    }

    /// True if the body carries neither mass nor inertia.
    pub(crate) fn is_zero(&self) -> bool {
        self.mass <= 0.0 && self.second_moment.iter().all(|s| s.abs() <= 0.0)
    }
}

/// `½ tr(A) 1 − A`: turns an inertia tensor into its second moment.
pub(crate) fn trace_complement(a: &Matrix3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal_element(0.5 * a.trace()) - a
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moving_a_body_obeys_the_parallel_axis_rule() {
        // 2 kg point at (0, 0, 1), seen from an origin 3 m along −x: I_zz = 2 · 9, I_xx = 2 · 1.
        let point = BodyInertia::from_central(2.0, Vector3::z(), &Matrix3::zeros());
        let moved = point.in_parent(&Pose::from_xyz_rpy([3.0, 0.0, 0.0], [0.0; 3]));
        let inertia = moved.inertia_at_origin();
        assert!((inertia[(2, 2)] - 18.0).abs() < 1e-14, "{inertia}");
        assert!((inertia[(0, 0)] - 2.0).abs() < 1e-14, "{inertia}");
        assert!((inertia[(0, 2)] + 6.0).abs() < 1e-14, "{inertia}");
    }
}
