//! What is known of an arm's parameters before any torque is measured.

use gp_core::FitOptions;
use gp_core::fit::ParameterPrior;
use puma_dyn::dynamics::{
    N_DRIVE_PARAMETERS, N_PARAMETERS, ParameterSpread, drive_parameters, inertial_parameters,
};
use puma_dyn::{Context, Effects, Friction, Model};
use torque_model::learn::{RigidBody, RigidBodyForm};
use torque_model::{Robot, RobotSource};

use super::rows::columns;

/// What the model of the arm gets right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Knowledge {
    /// Nominal values, and every term that there is.
    Nominal,
    /// Links three times as heavy.
    HeavyLinks,
    /// No friction: neither its nominal values nor its columns.
    NoFriction,
}

impl Knowledge {
    /// In the order of the table.
    pub const ALL: [Self; 3] = [Self::Nominal, Self::HeavyLinks, Self::NoFriction];

    /// What the name of a model adds.
    pub fn label(self) -> &'static str {
        match self {
            Self::Nominal => "",
            Self::HeavyLinks => ", masses × 3",
            Self::NoFriction => ", no friction",
        }
    }
}

/// The prior of (bodies, drives) in the order of [`puma_dyn::dynamics::full_regressor`], without a load.
fn of_arm(model: &Model, knowledge: Knowledge) -> ParameterPrior {
    let factor = match knowledge {
        Knowledge::HeavyLinks => 3.0,
        Knowledge::Nominal | Knowledge::NoFriction => 1.0,
    };
    let bodies = inertial_parameters(model, &Context::empty());
    let mut mean: Vec<f64> = bodies.iter().map(|value| factor * value).collect();
    let drives = drive_parameters(model, Effects::ALL);
    mean.extend(drives.into_iter().enumerate().map(|(idx, value)| {
        let is_rotor = idx % N_DRIVE_PARAMETERS == 0;
        let is_known = is_rotor || knowledge != Knowledge::NoFriction;
        if is_known { value } else { 0.0 }
    }));
    let std = ParameterSpread::default().std(&mean);
    ParameterPrior { mean, std }
}

/// The scenario's arm as a user names it: `--robot puma560`.
///
/// # Panics
/// Never: the built-in robot is one.
pub fn robot() -> Robot {
    let source = RobotSource {
        urdf: None,
        sidecar: None,
        gravity: None,
    };
    Robot::new(source, "the scenario's arm").expect("the built-in robot is one")
}

/// The learner of a joint of the scenario's arm with one load: its last link may weigh some kilograms more.
///
/// With [`Knowledge::Nominal`] and a process that of `torque-gp fit --model rbd+gp --robot puma560`, from one start.
pub fn learner(knowledge: Knowledge, form: RigidBodyForm, options: FitOptions) -> RigidBody {
    let mut robot = robot();
    if knowledge == Knowledge::NoFriction {
        robot.effects.friction = Friction::None;
    }
    let mut learner = RigidBody::new(robot, form, options);
    learner.prior = of_arm(&learner.robot.model, knowledge);
    learner.prior.std = ParameterSpread::default().std_with_load(&learner.prior.mean);
    learner
}

/// The prior of a joint, from 1, of an arm with any of several loads.
///
/// In the order of [`columns`], then ten parameters for each load.
pub fn of_arm_and_loads(
    model: &Model,
    joint: usize,
    knowledge: Knowledge,
    n_loads: usize,
) -> ParameterPrior {
    let mut prior = of_joint(&of_arm(model, knowledge), model, joint);
    for _ in 0..n_loads {
        prior.mean.extend([0.0; N_PARAMETERS]);
        prior.std.extend(ParameterSpread::default().load_std());
    }
    prior
}

fn of_joint(prior: &ParameterPrior, model: &Model, joint: usize) -> ParameterPrior {
    let columns = columns(model, joint);
    let pick = |values: &[f64]| columns.iter().map(|&column| values[column]).collect();
    ParameterPrior {
        mean: pick(&prior.mean),
        std: pick(&prior.std),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use puma_dyn::Scenario;

    #[test]
    fn the_learner_of_one_load_is_that_of_the_command() {
        let nominal = learner(
            Knowledge::Nominal,
            RigidBodyForm::Alone,
            FitOptions::several(),
        );
        let options = FitOptions::several();
        let of_command = RigidBody::new(nominal.robot.clone(), RigidBodyForm::Alone, options);
        assert_eq!(nominal.prior, of_command.prior);
        let scenario = Scenario::reference();
        let arm = inertial_parameters(scenario.model(), &Context::empty());
        assert_eq!(nominal.prior.mean[..60], arm);
    }

    #[test]
    fn what_is_not_known_has_neither_mean_nor_spread() {
        let scenario = Scenario::reference();
        let prior = of_arm(scenario.model(), Knowledge::NoFriction);
        // Joint 1: rotor, viscous, Coulomb either way.
        assert!(prior.mean[60] > 0.0 && prior.std[60] > 0.0);
        assert!(
            prior.mean[61..64]
                .iter()
                .chain(&prior.std[61..64])
                .all(|v| *v == 0.0)
        );
        assert_eq!(prior.mean.len(), 84);
    }

    #[test]
    fn heavy_links_weigh_three_times_as_much_and_drives_stay() {
        let scenario = Scenario::reference();
        let nominal = of_arm(scenario.model(), Knowledge::Nominal);
        let heavy = of_arm(scenario.model(), Knowledge::HeavyLinks);
        assert!(
            heavy.mean[10] > 0.0 && heavy.mean[10].to_bits() == (3.0 * nominal.mean[10]).to_bits()
        );
        assert_eq!(heavy.mean[60..], nominal.mean[60..]);
    }

    #[test]
    fn loads_of_the_scenario_are_within_three_standard_deviations() {
        let scenario = Scenario::reference();
        let std = ParameterSpread::default().load_std();
        for load in 0..15 {
            let payload = scenario.payload(load);
            assert!(payload.mass() <= 3.0 * std[0], "{}", payload.mass());
        }
    }
}
