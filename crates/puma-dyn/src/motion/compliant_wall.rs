//! A wall that gives way: a spring and a dissipation that grows with the depth.

use nalgebra::Vector3;

use crate::dynamics::forward_kin::forward_kinematics;
use crate::dynamics::jacobian::jacobian;
use crate::error::DynError;
use crate::robot::model::Model;
use crate::robot::validate;

/// A half space that pushes the tip of a tool out along its normal, without friction.
///
/// ```text
/// F = k δ (1 + c δ̇), never below zero          δ depth of the tip, m; τ_e = J_tipᵀ F n
/// ```
/// The force is continuous: it starts from zero, as a damper in parallel with the spring would not.
///
/// # Source
/// Hunt & Crossley 1975, "Coefficient of restitution interpreted as damping in vibroimpact", with the
/// exponent 1 of a flat contact; Siciliano et al. 2009, eq. (3.111), for the torques.
#[derive(Debug, Clone, PartialEq)]
pub struct CompliantWall {
    /// Frame that carries the tip, an index into [`Model::frames`].
    pub frame_idx: usize,
    /// The tip in that frame, m.
    pub tip: [f64; 3],
    /// A point of the surface, in root axes, m.
    pub point: [f64; 3],
    /// Unit vector out of the wall, in root axes.
    pub normal: [f64; 3],
    /// Stiffness k, N/m.
    pub stiffness: f64,
    /// Dissipation c, s/m.
    pub dissipation: f64,
}

impl CompliantWall {
    /// # Errors
    /// [`DynError::NonFinite`] or [`DynError::OutOfRange`] for numbers that no wall has.
    pub(crate) fn check(&self, model: &Model) -> Result<(), DynError> {
        let what = "wall";
        let frame = model.frames().get(self.frame_idx);
        let name = frame.map_or("", |frame| frame.name.as_str());
        validate::finite(what, name, "tip", &self.tip)?;
        validate::finite(what, name, "point", &self.point)?;
        validate::finite(what, name, "normal", &self.normal)?;
        validate::finite_not_negative(what, name, "stiffness", self.stiffness)?;
        validate::finite_not_negative(what, name, "dissipation", self.dissipation)?;
        let norm = Vector3::from(self.normal).norm();
        if (norm - 1.0).abs() > 1e-9 {
            return Err(DynError::OutOfRange {
                what,
                name: name.to_owned(),
                quantity: "length of the normal",
                value: norm,
                requirement: "1",
            });
        }
        Ok(())
    }

    /// Adds the torques of the contact to `tau`, and returns its force, N.
    ///
    /// # Shapes
    /// `q`, `qd` and `tau` (n_joints,); scratch `columns` (6, n_joints).
    ///
    /// # Panics
    /// If a slice has another length or there is no such frame.
    pub fn add_torques(
        &self,
        model: &Model,
        q: &[f64],
        qd: &[f64],
        columns: &mut [f64],
        tau: &mut [f64],
    ) -> f64 {
        let pose = forward_kinematics(model, self.frame_idx, q);
        let arm = pose.rotation * Vector3::from(self.tip);
        let normal = Vector3::from(self.normal);
        let depth = normal.dot(&(Vector3::from(self.point) - pose.translation - arm));
        if depth <= 0.0 {
            return 0.0;
        }
        jacobian(model, self.frame_idx, q, columns);
        let n = tau.len();
        let outward = |joint: usize| {
            let part = |row: usize| columns[row * n + joint];
            let linear = Vector3::new(part(0), part(1), part(2));
            let angular = Vector3::new(part(3), part(4), part(5));
            normal.dot(&(linear + angular.cross(&arm)))
        };
        let speed: f64 = qd.iter().enumerate().map(|(j, qd)| outward(j) * qd).sum();
        let force = (self.stiffness * depth * (1.0 - self.dissipation * speed)).max(0.0);
        for (joint, tau) in tau.iter_mut().enumerate() {
            *tau += outward(joint) * force;
        }
        force
    }
}
