//! Joint friction: viscous plus asymmetric Coulomb, under one of two published conventions.
//!
//! ```text
//! modern         τ_f = G² B q̇ + |G| Tc      + b q̇ + c sgn(q̇)
//! toolbox-2008   τ_f = G (B q̇ + Tc)         + b q̇ + c sgn(q̇)
//! Tc = Tc⁺ for q̇ > 0,  Tc⁻ for q̇ < 0,  0 at rest
//! ```
//! G is the signed gear ratio, B and Tc are motor-side, b and c joint-side (URDF's `damping` and
//! `friction`).

use crate::robot::description::Drive;

/// Which friction torques are part of the answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Friction {
    /// None at all.
    None,
    // DEVIATION(sec. 2.1): the absolute gear ratio; the toolbox of the time used the signed one.
    /// Both motor-side terms act against the motion whatever the sign of the gear ratio.
    Modern,
    /// `G (B q̇ + Tc)` with *signed* G, as the Robotics Toolbox of 2002–2008 computed it: a joint with
    /// a negative gear ratio is helped by its friction. For reproduction studies only.
    Toolbox2008,
}

/// Which motor effects are part of the answer; always stated, so there is no `Default`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effects {
    /// Friction convention.
    pub friction: Friction,
    /// Whether rotors, seen through their gears, add G² Jm q̈.
    pub rotor_inertia: bool,
}

impl Effects {
    /// Rigid bodies only: neither friction nor rotors.
    pub const RIGID_BODY: Self = Self {
        friction: Friction::None,
        rotor_inertia: false,
    };
    /// Modern friction and rotor inertia: the torques a drive must really supply.
    pub const ALL: Self = Self {
        friction: Friction::Modern,
        rotor_inertia: true,
    };
}

/// Friction of one joint, reduced to the joint side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Law {
    viscous: f64,
    coulomb_positive: f64,
    coulomb_negative: f64,
}

impl Law {
    /// Torque that overcomes friction at joint speed `qd`, N·m or N.
    #[inline]
    pub(crate) fn torque(&self, qd: f64) -> f64 {
        self.viscous * qd + self.coulomb(qd)
    }

    /// Torque per joint speed, N·m·s/rad or N·s/m.
    pub(crate) fn viscous(&self) -> f64 {
        self.viscous
    }

    /// What friction can be at rest: from the Coulomb torque of negative to that of positive speed.
    pub(crate) fn at_rest(&self) -> (f64, f64) {
        (self.coulomb_negative, self.coulomb_positive)
    }

    /// Viscous coefficient and Coulomb levels of either direction.
    pub(crate) fn parameters(&self) -> [f64; 3] {
        [self.viscous, self.coulomb_positive, self.coulomb_negative]
    }

    /// The part that depends on the direction alone, N·m or N.
    #[inline]
    pub(crate) fn coulomb(&self, qd: f64) -> f64 {
        if qd > 0.0 {
            self.coulomb_positive
        } else if qd < 0.0 {
            self.coulomb_negative
        } else {
            0.0
        }
    }
}

/// Friction of one joint under each convention.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct JointFriction {
    pub modern: Law,
    pub toolbox_2008: Law,
}

impl JointFriction {
    pub(crate) fn new(drive: &Drive) -> Self {
        let ratio = drive.gear_ratio;
        let law = |viscous_ratio: f64, coulomb_ratio: f64| Law {
            viscous: viscous_ratio * drive.viscous_motor + drive.viscous_joint,
            coulomb_positive: coulomb_ratio * drive.coulomb_motor_positive + drive.coulomb_joint,
            coulomb_negative: coulomb_ratio * drive.coulomb_motor_negative - drive.coulomb_joint,
        };
        Self {
            modern: law(ratio * ratio, ratio.abs()),
            toolbox_2008: law(ratio, ratio),
        }
    }
}

impl JointFriction {
    /// The law under a convention.
    pub(crate) fn law(&self, friction: Friction) -> Law {
        match friction {
            Friction::None => Law {
                viscous: 0.0,
                coulomb_positive: 0.0,
                coulomb_negative: 0.0,
            },
            Friction::Modern => self.modern,
            Friction::Toolbox2008 => self.toolbox_2008,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DRIVE: Drive = Drive {
        gear_ratio: -2.0,
        viscous_motor: 0.5,
        coulomb_motor_positive: 0.3,
        coulomb_motor_negative: -0.1,
        viscous_joint: 0.25,
        coulomb_joint: 0.01,
        ..Drive::NONE
    };

    #[test]
    fn both_conventions_worked_by_hand() {
        let joint = JointFriction::new(&DRIVE);
        // modern, q̇ = 3: 4·0.5·3 + 2·0.3 + 0.25·3 + 0.01
        assert!((joint.modern.torque(3.0) - 7.36).abs() < 1e-14);
        // modern, q̇ = −1: −4·0.5 − 2·0.1 − 0.25 − 0.01
        assert!((joint.modern.torque(-1.0) + 2.46).abs() < 1e-14);
        // toolbox-2008, q̇ = 3: −2 (0.5·3 + 0.3) + 0.25·3 + 0.01
        assert!((joint.toolbox_2008.torque(3.0) + 2.84).abs() < 1e-14);
        // toolbox-2008, q̇ = −1: −2 (−0.5 − 0.1) − 0.25 − 0.01
        assert!((joint.toolbox_2008.torque(-1.0) - 0.94).abs() < 1e-14);
    }

    #[test]
    fn a_joint_at_rest_has_no_friction() {
        let joint = JointFriction::new(&DRIVE);
        assert!(joint.modern.torque(0.0).abs() <= 0.0);
        assert!(joint.toolbox_2008.torque(-0.0).abs() <= 0.0);
    }
}
