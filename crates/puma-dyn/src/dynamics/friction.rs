//! Friction torques of all joints at once.

use crate::dynamics::check::check_len;
use crate::dynamics::hysteresis::Memory;
use crate::robot::friction_law::{Friction, JointFriction};
use crate::robot::model::Model;
use crate::robot::smooth_friction::SmoothTorque;

/// Coulomb torques of every joint: what changes by a jump when the joint turns back.
///
/// ```text
/// modern  |G| Tc + c sgn(q̇)      toolbox-2008  G Tc + c sgn(q̇)
/// ```
/// Taken away from the joint torques, they leave a function of (q, q̇, q̈) without jumps, if friction has no
/// memory; smooth friction is not among them.
///
/// # Shapes
/// `qd` and `tau` (n_joints,), rad/s and N·m; m/s and N for sliding joints.
///
/// # Panics
/// If a slice has another length.
///
/// # Source
/// Sec. 2.1; fig. 5 shows them as a square wave.
pub fn coulomb_torques(model: &Model, friction: Friction, qd: &[f64], tau: &mut [f64]) {
    check_len("qd", qd, model.n_joints());
    check_len("tau", tau, model.n_joints());
    let rows = tau.iter_mut().zip(qd).zip(model.joint_friction());
    for ((tau, &qd), joint) in rows {
        *tau = match friction {
            Friction::None => 0.0,
            Friction::Modern => joint.modern.coulomb(qd),
            Friction::Toolbox2008 => joint.toolbox_2008.coulomb(qd),
        };
    }
}

/// Adds the friction torques of every joint to `tau`, which holds those of the rigid bodies.
#[inline]
pub(crate) fn add_friction(
    model: &Model,
    friction: Friction,
    memory: Memory<'_>,
    qd: &[f64],
    tau: &mut [f64],
) {
    if friction != Friction::None && model.has_smooth_friction() {
        for (joint_idx, tau) in tau.iter_mut().enumerate() {
            *tau += joint_friction(model, friction, memory, joint_idx, qd[joint_idx], *tau);
        }
    } else {
        add_laws(model.joint_friction(), friction, qd, tau);
    }
}

/// Friction torque of a joint at a speed and a rigid-body torque.
pub(crate) fn joint_friction(
    model: &Model,
    friction: Friction,
    memory: Memory<'_>,
    joint_idx: usize,
    qd: f64,
    rigid: f64,
) -> f64 {
    let law = model.joint_friction()[joint_idx].law(friction).torque(qd);
    law + smooth_torque(model, friction, memory, joint_idx, qd).under(rigid)
}

/// Smooth friction of a joint at a speed.
#[inline]
pub(crate) fn smooth_torque(
    model: &Model,
    friction: Friction,
    memory: Memory<'_>,
    joint_idx: usize,
    qd: f64,
) -> SmoothTorque {
    match friction {
        Friction::None => SmoothTorque::NONE,
        Friction::Modern | Friction::Toolbox2008 => {
            let law = &model.smooth_friction()[joint_idx];
            law.at(qd, |spring_idx| memory.z(spring_idx, qd))
        }
    }
}

fn add_laws(joints: &[JointFriction], friction: Friction, qd: &[f64], tau: &mut [f64]) {
    let rows = tau.iter_mut().zip(qd).zip(joints);
    match friction {
        Friction::None => {}
        Friction::Modern => rows.for_each(|((tau, qd), joint)| *tau += joint.modern.torque(*qd)),
        Friction::Toolbox2008 => {
            rows.for_each(|((tau, qd), joint)| *tau += joint.toolbox_2008.torque(*qd));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::chapter::puma560;

    #[test]
    fn coulomb_torques_of_the_puma_worked_by_hand() {
        // Joint 6: |G| = 76.686, Tc⁺ = 3.96e-3 N·m, Tc⁻ = −10.5e-3 N·m (Corke 1996).
        let model = puma560::model();
        let mut tau = [f64::NAN; 6];
        let mut last = |qd6: f64, friction| {
            coulomb_torques(&model, friction, &[0.0, 0.0, 0.0, 0.0, 0.0, qd6], &mut tau);
            tau[5]
        };
        let close = |ours: f64, expected: f64| (ours - expected).abs() < 1e-12;
        assert!(close(last(0.3, Friction::Modern), 76.686 * 3.96e-3));
        assert!(close(last(-2.0, Friction::Modern), -76.686 * 10.5e-3));
        assert!(last(-2.0, Friction::None).abs() <= 0.0);
        assert!(last(0.0, Friction::Modern).abs() <= 0.0);
    }
}
