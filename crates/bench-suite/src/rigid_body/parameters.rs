//! What is known of an arm's parameters before any torque is measured.

use gp_core::ParameterPrior;
use puma_dyn::{Context, Effects, Model, N_PARAMETERS, drive_parameters, inertial_parameters};

use super::rows::columns;

/// Standard deviation of a parameter as a part of its size.
const RELATIVE_STD: f64 = 0.2;

/// m: arms of first and second moments that a nominal zero may hide.
const ARM: f64 = 0.1;

/// kg: mass of a link whose table leaves it out.
const LEAST_MASS: f64 = 1.0;

/// Standard deviations of a load's mass (kg), its distance from the last joint (m): those of uniform
/// numbers up to 3 kg and 0.2 m about zero, roughly.
const LOAD_MASS_STD: f64 = 1.7;
const LOAD_ARM: f64 = 0.15;

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

/// The prior of (bodies, drives) in the order of [`puma_dyn::full_regressor`], without a load.
fn of_arm(model: &Model, knowledge: Knowledge) -> ParameterPrior {
    let factor = match knowledge {
        Knowledge::HeavyLinks => 3.0,
        Knowledge::Nominal | Knowledge::NoFriction => 1.0,
    };
    let bodies = inertial_parameters(model, &Context::empty());
    let mut mean: Vec<f64> = bodies.iter().map(|value| factor * value).collect();
    let mut std: Vec<f64> = (mean.chunks_exact(N_PARAMETERS))
        .flat_map(|of_link| stds(of_link, of_link[0].abs().max(LEAST_MASS), ARM))
        .collect();
    for (idx, value) in drive_parameters(model, Effects::ALL)
        .into_iter()
        .enumerate()
    {
        let is_rotor = idx % puma_dyn::N_DRIVE_PARAMETERS == 0;
        let is_known = is_rotor || knowledge != Knowledge::NoFriction;
        mean.push(if is_known { value } else { 0.0 });
        std.push(if is_known {
            RELATIVE_STD * value.abs()
        } else {
            0.0
        });
    }
    ParameterPrior { mean, std }
}

/// A fifth of every number, or of mass · armᵖ where that is more.
fn stds(of_link: &[f64], mass: f64, arm: f64) -> Vec<f64> {
    let size = |idx: usize| of_link[idx].abs().max(mass * arm.powi(order(idx)));
    (0..N_PARAMETERS)
        .map(|idx| RELATIVE_STD * size(idx))
        .collect()
}

/// 0 for the mass, 1 for its first moments, 2 for its second.
fn order(idx: usize) -> i32 {
    match idx {
        0 => 0,
        1..4 => 1,
        _ => 2,
    }
}

/// Standard deviations of what a load adds to the ten parameters of the last link.
fn load_std() -> Vec<f64> {
    (0..N_PARAMETERS)
        .map(|idx| LOAD_MASS_STD * LOAD_ARM.powi(order(idx)))
        .collect()
}

/// The prior of a joint, from 1, of an arm with one load: its last link may weigh some kilograms more.
///
/// In the order of [`columns`].
pub fn of_loaded_arm(model: &Model, joint: usize, knowledge: Knowledge) -> ParameterPrior {
    let mut prior = of_arm(model, knowledge);
    let last = (model.n_joints() - 1) * N_PARAMETERS;
    for (std, load) in prior.std[last..last + N_PARAMETERS]
        .iter_mut()
        .zip(load_std())
    {
        *std = std.hypot(load);
    }
    of_joint(&prior, model, joint)
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
        prior.std.extend(load_std());
    }
    prior
}

fn of_joint(prior: &ParameterPrior, model: &Model, joint: usize) -> ParameterPrior {
    let columns = columns(model.n_joints(), joint);
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
        let std = load_std();
        for load in 0..15 {
            let payload = scenario.payload(load);
            assert!(payload.mass() <= 3.0 * std[0], "{}", payload.mass());
        }
    }
}
