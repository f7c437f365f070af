//! What was identified of a robot, in the words of a URDF, a sidecar and a payload.

use std::collections::BTreeMap;

use puma_dyn::dynamics::N_PARAMETERS;
use puma_dyn::robot::{
    FrictionTerm, HysteresisFriction, JointDynamics, JointKeys, LoadHysteresisFriction,
    TanhFriction, write_urdf,
};
use puma_dyn::{Friction, Sidecar};

use crate::error::TorqueError;
use crate::rigid_body::consistency::{nearest_bodies, nearest_body};
use crate::rigid_body::posterior::ParameterPosterior;
use crate::robot_source::RobotSource;

/// Texts for other programs.
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifiedRobot {
    /// The URDF with the parameters of the bare arm and the viscous friction of its joints.
    pub urdf: String,
    /// The sidecar with rotors and the rest of the friction.
    pub sidecar: String,
    /// Joints that move what was not learned to be a body, by their numbers; if there is one, the URDF has the nearest
    /// bodies of all joints: [`nearest_bodies`].
    pub projected: Vec<usize>,
    /// What neither of them can say.
    pub notes: Vec<String>,
}

/// A load as a body: kg, m, kg m².
#[derive(Debug, Clone, PartialEq)]
pub struct IdentifiedLoad {
    /// Mass, kg.
    pub mass: f64,
    /// Centre of mass in the axes of the link that carries it, m.
    pub centre: [f64; 3],
    /// I_xx, I_yy, I_zz, I_xy, I_xz, I_yz about the centre, kg m².
    pub inertia: [f64; 6],
    /// Whether what was learned is not that of a body, and this is the nearest: [`nearest_body`].
    pub is_projected: bool,
}

impl ParameterPosterior {
    /// The robot without a load as identified, in the texts that described it.
    ///
    /// The torques of the URDF's bodies are Y π̂ where all of π̂ are those of bodies; else the bodies are the nearest by its
    /// covariance: [`nearest_bodies`].
    /// # Errors
    /// [`TorqueError::OtherKind`] for a robot that no URDF describes; numbers that overflow.
    pub fn to_robot(&self, source: &RobotSource) -> Result<IdentifiedRobot, TorqueError> {
        let Some(text) = &source.urdf else {
            return Err(TorqueError::OtherKind {
                what: "a built-in robot has no URDF to write into".to_owned(),
            });
        };
        let mut notes = Vec::new();
        let own = source.sidecar.as_deref();
        let own = own
            .map(|text| Sidecar::parse("the model's sidecar", text))
            .transpose()?;
        if own.is_some() {
            notes.push("joints that the former sidecar locks have to be locked again".to_owned());
        }
        if let Some([x, y, z]) = source.gravity {
            notes.push(format!(
                "gravity ({x}, {y}, {z}) m/s² is not part of a URDF"
            ));
        }
        let of_bodies: Vec<usize> = self.unknowns().bodies().collect();
        let learned = self.body_parameters_with(None);
        let (nearest, projected) = nearest_bodies(&learned, self.covariance_of(&of_bodies))?;
        let bodies: Vec<[f64; N_PARAMETERS]> = (nearest.chunks_exact(N_PARAMETERS))
            .map(|body| std::array::from_fn(|k| body[k]))
            .collect();
        let (mut joints, mut dynamics) = (BTreeMap::new(), Vec::new());
        for (joint, name) in self.parts().robot.joint_names().iter().enumerate() {
            let (keys, viscous) = self.drive_of(joint, name, &mut notes);
            joints.insert(name.clone(), keys);
            dynamics.push(JointDynamics {
                damping: viscous,
                friction: 0.0,
            });
        }
        let urdf = write_urdf(
            "the model's robot",
            text,
            own.as_ref(),
            &bodies,
            Some(&dynamics),
        )?;
        let sidecar = Sidecar::new("the model's sidecar", Some(Friction::Modern), joints)?;
        Ok(IdentifiedRobot {
            urdf,
            sidecar: sidecar.to_toml()?,
            projected,
            notes,
        })
    }

    /// The load of a context, as a body; `None` for one that carries nothing.
    ///
    /// # Errors
    /// Numbers that overflow.
    pub fn to_load(&self, context: usize) -> Result<Option<IdentifiedLoad>, TorqueError> {
        let Some(load) = self.load_of(context) else {
            return Ok(None);
        };
        let of_load: Vec<usize> = self.unknowns().load(load).collect();
        let learned: [f64; N_PARAMETERS] = std::array::from_fn(|k| self.mean()[of_load[k]]);
        let (psi, is_projected) = nearest_body(&learned, self.covariance_of(&of_load))?;
        let mass = psi[0];
        let c = [psi[1] / mass, psi[2] / mass, psi[3] / mass];
        let square: f64 = c.iter().map(|c| c * c).sum();
        // I_c = I − m (|c|² 1 − c cᵀ)
        let about_centre = |entry: f64, row: usize, col: usize| {
            let unit = if row == col { square } else { 0.0 };
            entry - mass * (unit - c[row] * c[col])
        };
        Ok(Some(IdentifiedLoad {
            mass,
            centre: c,
            inertia: [
                about_centre(psi[4], 0, 0),
                about_centre(psi[6], 1, 1),
                about_centre(psi[9], 2, 2),
                about_centre(psi[5], 0, 1),
                about_centre(psi[7], 0, 2),
                about_centre(psi[8], 1, 2),
            ],
            is_projected,
        }))
    }

    /// A joint's rotor and friction, and its viscous coefficient; what has the wrong sign goes into the notes.
    fn drive_of(&self, joint: usize, name: &str, notes: &mut Vec<String>) -> (JointKeys, f64) {
        let unknowns = self.unknowns();
        let mut keys = JointKeys::default();
        let mut viscous = 0.0;
        let mut note = |what: &str, value: f64| {
            notes.push(format!(
                "joint `{name}`: {what} {value:.4e} has the wrong sign, and is left out"
            ));
        };
        let coefficients = unknowns.terms().iter().zip(unknowns.friction(joint));
        for (term, unknown) in coefficients {
            let theta = self.mean()[unknown];
            if self.parts().prior_std[unknown] <= 0.0 {
                continue;
            }
            match *term {
                FrictionTerm::Acceleration if theta >= 0.0 => {
                    (keys.rotor_inertia, keys.gear_ratio) = (Some(theta), Some(1.0));
                }
                FrictionTerm::Acceleration => note("rotor inertia", theta),
                FrictionTerm::Speed if theta >= 0.0 => viscous = theta,
                FrictionTerm::Speed => note("viscous friction", theta),
                FrictionTerm::Offset => keys.offset = Some(theta),
                FrictionTerm::Tanh { width } => {
                    keys.tanh.push(TanhFriction {
                        width,
                        torque: theta,
                    });
                }
                FrictionTerm::StepUp if theta >= 0.0 => {
                    (keys.coulomb_motor_positive, keys.gear_ratio) = (Some(theta), Some(1.0));
                }
                FrictionTerm::StepDown if theta <= 0.0 => {
                    (keys.coulomb_motor_negative, keys.gear_ratio) = (Some(theta), Some(1.0));
                }
                FrictionTerm::StepUp | FrictionTerm::StepDown => note("Coulomb friction", theta),
                FrictionTerm::Hysteresis { length } => {
                    keys.hysteresis.push(HysteresisFriction {
                        length,
                        torque: theta,
                    });
                }
                FrictionTerm::LoadHysteresis { length } => {
                    keys.load_hysteresis.push(LoadHysteresisFriction {
                        length,
                        coefficient: theta,
                    });
                }
                FrictionTerm::LoadSpeed => keys.load_viscous = Some(theta),
            }
        }
        // The two directions come together in a sidecar.
        if keys.coulomb_motor_positive.is_some() || keys.coulomb_motor_negative.is_some() {
            keys.coulomb_motor_positive.get_or_insert(0.0);
            keys.coulomb_motor_negative.get_or_insert(-0.0);
        }
        (keys, viscous)
    }
}
