//! A load that is known, in the place of what is learned of one.

use faer::Mat;
use linalg::{Factor, product};
use puma_dyn::Context;
use puma_dyn::dynamics::inertial_parameters;

use crate::error::TorqueError;
use crate::rigid_body::normal_equations::NormalEquations;
use crate::rigid_body::posterior::{ParameterPosterior, PosteriorParts};

impl ParameterPosterior {
    /// The posterior of the robot carrying what is known exactly, in one context of that name.
    ///
    /// ```text
    /// τ = Y(π + π*) + φᵀθ,   π* the ten numbers of each payload at the body that carries it
    /// ```
    /// π and θ keep their posterior, with that of the learned loads summed out: what is not sure of the arm stays so,
    /// and of the load nothing is.
    /// Where no context carries nothing, what the arm is without a load is known by its description and the prior of a
    /// load alone, and the prediction is as unsure as that says.
    /// # Errors
    /// Numbers that overflow.
    /// # Panics
    /// If a payload is of another robot.
    pub fn carrying(&self, name: &str, carried: &Context) -> Result<Self, TorqueError> {
        let parts = self.parts();
        let loaded = inertial_parameters(&parts.robot, carried);
        let bare = inertial_parameters(&parts.robot, &Context::empty());
        let of_load = loaded
            .iter()
            .zip(bare)
            .map(|(with, without)| with - without);
        let unknowns = self.unknowns().with_loads(0);
        let NormalEquations { h, b } = self.without_loads()?;
        Self::new(PosteriorParts {
            described: (parts.described.iter().zip(of_load))
                .map(|(known, of_load)| known + of_load)
                .collect(),
            contexts: vec![name.to_owned()],
            loads: vec![None],
            prior_std: parts.prior_std[..unknowns.len()].to_vec(),
            unknowns,
            h,
            b,
            ..parts.clone()
        })
    }

    /// H and b of the arm alone, the loads summed out under their prior.
    ///
    /// ```text
    /// H′ = H_aa − CᵀM⁻¹C,   b′ = b_a − CᵀM⁻¹S_l b_l,   M = S_l H_ll S_l + 1,   C = S_l H_la
    /// ```
    fn without_loads(&self) -> Result<NormalEquations, TorqueError> {
        let NormalEquations { h, b } = self.equations();
        let (n_own, n_all) = (self.unknowns().with_loads(0).len(), b.len());
        let std = &self.parts().prior_std[n_own..];
        let n_loads = n_all - n_own;
        let matrix = Mat::from_fn(n_loads, n_loads, |row, col| {
            let unit = if row == col { 1.0 } else { 0.0 };
            std[row] * h[(n_own + row, n_own + col)] * std[col] + unit
        });
        let factor = Factor::new(matrix).map_err(gp_core::GpError::from)?;
        let mut half = Mat::from_fn(n_loads, n_own + 1, |row, col| {
            let entry = if col < n_own {
                h[(n_own + row, col)]
            } else {
                b[n_own + row]
            };
            std[row] * entry
        });
        factor.half_solve_in_place(half.as_mut()); // L⁻¹ (C, S_l b_l)
        let explained = product(half.transpose(), half.as_ref());
        Ok(NormalEquations {
            h: Mat::from_fn(n_own, n_own, |row, col| {
                h[(row, col)] - explained[(row, col)]
            }),
            b: (0..n_own)
                .map(|row| b[row] - explained[(row, n_own)])
                .collect(),
        })
    }
}
