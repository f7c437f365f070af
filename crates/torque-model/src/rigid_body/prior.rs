//! What is known of the unknowns before any data: independent normals whose widths are not learned.

use puma_dyn::dynamics::{N_PARAMETERS, ParameterSpread};
use puma_dyn::robot::FrictionTerm;

/// Standard deviations of a load's ten parameters: 3 kg, 0.6 kg m, 0.15 kg m².
pub const LOAD_STD: [f64; N_PARAMETERS] = [3.0, 0.6, 0.6, 0.6, 0.15, 0.15, 0.15, 0.15, 0.15, 0.15];

/// Part of the other terms' width that an offset has.
const OFFSET_PART: f64 = 0.1;

/// Part of its unit at which the size of a column that hardly moved is taken.
const LEAST_PART: f64 = 0.1;

/// Least root mean square of torques that makes a width, N·m.
const LEAST_TORQUE: f64 = 1e-6;

/// Standard deviations of a robot's inertial parameters about their description, (10 ℓ,).
///
/// ```text
/// std(π_k) = 0.2 max(|π_k|, max(|m|, 1 kg) (0.1 m)^o),   o = 0, 1, 2 for mass, first, second moments
/// ```
/// With a tool that no context is known to be without, those of the last body are
/// hypot(std, 1.7 kg (0.15 m)^o).
/// # Shapes
/// `described` (10 ℓ,).
#[must_use]
pub fn body_std(described: &[f64], has_unknown_tool: bool) -> Vec<f64> {
    let spread = ParameterSpread::default();
    let mut std = spread.std_of_bodies(described);
    if has_unknown_tool {
        let last = std.len() - N_PARAMETERS;
        for (std, of_tool) in std[last..].iter_mut().zip(spread.load_std()) {
            *std = std.hypot(of_tool);
        }
    }
    std
}

/// Standard deviations of a joint's friction coefficients, (terms,).
///
/// ```text
/// std(θ_x) = κ rms(y)/max(rms(column), u/10),   a tenth of it for the offset
/// ```
/// u is the column's unit, rms(y) for terms that grow with the load.
/// # Shapes
/// `rms` (terms,): root mean squares of the columns; `torque_rms` that of the joint's torques, N·m.
#[must_use]
pub fn friction_std(terms: &[FrictionTerm], rms: &[f64], torque_rms: f64, factor: f64) -> Vec<f64> {
    let torque = torque_rms.max(LEAST_TORQUE);
    let of_term = |(term, rms): (&FrictionTerm, &f64)| {
        let unit = if term.is_of_load() { torque } else { 1.0 };
        let part = if *term == FrictionTerm::Offset {
            OFFSET_PART
        } else {
            1.0
        };
        part * factor * torque / rms.max(LEAST_PART * unit)
    };
    terms.iter().zip(rms).map(of_term).collect()
}
