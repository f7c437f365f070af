//! How far the parameters of a robot may lie from its description.

use crate::dynamics::drive_regressor::N_DRIVE_PARAMETERS;
use crate::dynamics::regressor::N_PARAMETERS;

/// Standard deviations of (bodies, drives) about the values of a description, for a Gaussian prior of
/// the linear model τ = Y π.
///
/// ```text
/// std(π_k) = relative · max(|π_k|, m arm^p)    bodies: p = 0, 1, 2 for mass, first and second moments
/// std(π_k) = relative · |π_k|                  drives
/// ```
/// m is the body's mass, or `least_mass` where it is less; the second term is for a nominal zero that
/// hides a number.
/// # Source
/// Sec. 3.2, "a Gaussian prior on the inertial parameters", which states no numbers: these are ours.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSpread {
    /// Part of a parameter's size.
    pub relative: f64,
    /// m: arm of the moments that a nominal zero may hide.
    pub arm: f64,
    /// kg: mass of a body whose description leaves it out.
    pub least_mass: f64,
    /// kg: standard deviation of the mass of an unknown load.
    pub load_mass: f64,
    /// m: distance of an unknown load from the joint that carries it.
    pub load_arm: f64,
}

impl Default for ParameterSpread {
    /// A fifth, 0.1 m, 1 kg; loads as if uniform up to 3 kg and 0.2 m about zero, roughly.
    fn default() -> Self {
        Self {
            relative: 0.2,
            arm: 0.1,
            least_mass: 1.0,
            load_mass: 1.7,
            load_arm: 0.15,
        }
    }
}

impl ParameterSpread {
    /// Standard deviations for the values π of a description.
    ///
    /// # Shapes
    /// `parameters` (14 n_joints,) in the order of [`crate::dynamics::full_regressor`]; the result as many.
    /// # Panics
    /// If there are not fourteen per joint.
    #[must_use]
    pub fn std(&self, parameters: &[f64]) -> Vec<f64> {
        let per_joint = N_PARAMETERS + N_DRIVE_PARAMETERS;
        assert_eq!(parameters.len() % per_joint, 0, "fourteen per joint");
        let n_joints = parameters.len() / per_joint;
        let (bodies, drives) = parameters.split_at(n_joints * N_PARAMETERS);
        let of_drives = drives.iter().map(|value| self.relative * value.abs());
        (self.std_of_bodies(bodies).into_iter())
            .chain(of_drives)
            .collect()
    }

    /// The same of the bodies alone.
    ///
    /// # Shapes
    /// `parameters` (10 n_joints,) in the order of [`crate::regressor`]; the result as many.
    #[must_use]
    pub fn std_of_bodies(&self, parameters: &[f64]) -> Vec<f64> {
        let of_body = |body: &[f64]| {
            let mass = body[0].abs().max(self.least_mass);
            let size = |idx: usize| body[idx].abs().max(mass * self.arm.powi(order(idx)));
            std::array::from_fn::<f64, N_PARAMETERS, _>(|idx| self.relative * size(idx))
        };
        parameters
            .chunks_exact(N_PARAMETERS)
            .flat_map(of_body)
            .collect()
    }

    /// Standard deviations of what an unknown load adds to the ten parameters of the body that carries it.
    #[must_use]
    pub fn load_std(&self) -> [f64; N_PARAMETERS] {
        std::array::from_fn(|idx| self.load_mass * self.load_arm.powi(order(idx)))
    }

    /// As [`ParameterSpread::std`], for a robot whose last joint may carry an unknown load.
    ///
    /// # Panics
    /// As for [`ParameterSpread::std`], and without a joint.
    #[must_use]
    pub fn std_with_load(&self, parameters: &[f64]) -> Vec<f64> {
        let mut std = self.std(parameters);
        let n_joints = parameters.len() / (N_PARAMETERS + N_DRIVE_PARAMETERS);
        let last = &mut std[(n_joints - 1) * N_PARAMETERS..n_joints * N_PARAMETERS];
        for (std, load) in last.iter_mut().zip(self.load_std()) {
            *std = std.hypot(load);
        }
        std
    }
}

/// Power of a length in one of a body's ten parameters: 0 for the mass, 1 for its first moments, 2 for its second.
fn order(idx: usize) -> i32 {
    match idx {
        0 => 0,
        1..4 => 1,
        _ => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nominal_zeros_are_uncertain_by_mass_and_arm_and_drives_in_proportion() {
        let spread = ParameterSpread {
            relative: 0.5,
            arm: 0.1,
            least_mass: 1.0,
            load_mass: 2.0,
            load_arm: 0.5,
        };
        let mut parameters = vec![0.0; 28]; // two joints
        parameters[0] = 4.0; // mass
        parameters[1] = 3.0; // m c_x, above 4 · 0.1
        parameters[20] = 0.6; // rotor of joint 1
        let std = spread.std(&parameters);
        let close = |idx: usize, value: f64| assert!((std[idx] - value).abs() < 1e-15, "{idx}");
        close(0, 2.0);
        close(1, 1.5);
        close(2, 0.2); // half of 4 · 0.1
        close(4, 0.02); // half of 4 · 0.01
        close(10, 0.5); // no mass stated: half of 1 kg
        close(20, 0.3);
        assert_eq!(std[21..], [0.0; 7]);

        let with_load = spread.std_with_load(&parameters);
        assert_eq!(with_load[..10], std[..10]);
        assert!((with_load[10] - 0.5_f64.hypot(2.0)).abs() < 1e-15);
        assert!((with_load[14] - 0.005_f64.hypot(0.5)).abs() < 1e-15);
    }
}
