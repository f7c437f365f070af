//! The parameters of a robot that a model has learned: bodies, loads, friction and noise.

use std::fmt::Write;

use puma_dyn::robot::FrictionTerm;
use serde::Serialize;
use torque_model::rigid_body::{ParameterPosterior, SPEED_EDGES};

use crate::body_table::PARAMETERS;
use crate::text_table;

/// What was learned of a robot.
#[derive(Serialize)]
pub struct ParametersDescription {
    /// Of each joint's body: m, m c, I about the joint's origin, as the bare arm has them.
    bodies: Vec<BodyDescription>,
    /// What each context adds to the last body.
    loads: Vec<BodyDescription>,
    friction: Vec<FrictionDescription>,
}

/// Ten parameters with their standard deviations: kg, kg m, kg m².
#[derive(Serialize)]
struct BodyDescription {
    name: String,
    values: Vec<f64>,
    std: Vec<f64>,
}

/// Friction and noise of a joint.
#[derive(Serialize)]
struct FrictionDescription {
    joint: String,
    /// Name of the set of terms.
    terms: &'static str,
    coefficients: Vec<Coefficient>,
    /// σ, N·m.
    noise_std: f64,
    /// h of each bin of |q̇|, whose edges are 0, 0.01, 0.03, 0.06, 0.1, 0.3 and 1 rad/s.
    noise_profile: Vec<f64>,
    /// Rows that tell as much as one independent row.
    correlation: f64,
}

#[derive(Serialize)]
struct Coefficient {
    term: String,
    value: f64,
    std: f64,
}

impl ParametersDescription {
    /// Of a posterior.
    pub fn of(posterior: &ParameterPosterior) -> Self {
        let (parts, unknowns, std) = (posterior.parts(), posterior.unknowns(), posterior.std());
        let names = parts.robot.joint_names();
        let body = |name: &str, range: std::ops::Range<usize>, known: Option<&[f64]>| {
            let value = |(place, unknown): (usize, usize)| {
                known.map_or(0.0, |known| known[place]) + posterior.mean()[unknown]
            };
            BodyDescription {
                name: name.to_owned(),
                values: range.clone().enumerate().map(value).collect(),
                std: std[range].to_vec(),
            }
        };
        let of_joint = |(joint, name): (usize, &String)| {
            let range = 10 * joint..10 * (joint + 1);
            body(name, range.clone(), Some(&parts.described[range]))
        };
        let loads = parts.contexts.iter().zip(&parts.loads);
        let joints = names.iter().zip(&parts.joints).enumerate();
        Self {
            bodies: names.iter().enumerate().map(of_joint).collect(),
            loads: loads
                .filter_map(|(name, load)| Some(body(name, unknowns.load((*load)?), None)))
                .collect(),
            friction: joints
                .filter_map(|(joint, (name, learned))| {
                    let learned = learned.as_ref()?;
                    let terms = unknowns.terms().iter().zip(unknowns.friction(joint));
                    let kept = terms.filter(|(_, unknown)| parts.prior_std[*unknown] > 0.0);
                    Some(FrictionDescription {
                        joint: name.clone(),
                        terms: learned.terms.name(),
                        coefficients: kept
                            .map(|(term, unknown)| Coefficient {
                                term: term_name(*term),
                                value: posterior.mean()[unknown],
                                std: std[unknown],
                            })
                            .collect(),
                        noise_std: learned.noise.std,
                        noise_profile: learned.noise.profile.to_vec(),
                        correlation: learned.noise.correlation,
                    })
                })
                .collect(),
        }
    }

    /// For people.
    pub fn text(&self) -> String {
        let mut text = String::new();
        for (what, bodies) in [("body", &self.bodies), ("load", &self.loads)] {
            if bodies.is_empty() {
                continue;
            }
            let units = PARAMETERS
                .iter()
                .map(|(name, unit)| format!("{name} ({unit})"));
            let header: Vec<String> = std::iter::once(what.to_owned()).chain(units).collect();
            let header: Vec<&str> = header.iter().map(String::as_str).collect();
            let row = |body: &BodyDescription| {
                let entries = body.values.iter().zip(&body.std);
                let entries = entries.map(|(value, std)| format!("{value:.4} ± {std:.4}"));
                std::iter::once(body.name.clone()).chain(entries).collect()
            };
            let rows: Vec<Vec<String>> = bodies.iter().map(row).collect();
            let _ = write!(text, "\n{}", text_table::render(&header, &rows));
        }
        for joint in &self.friction {
            let FrictionDescription {
                joint,
                terms,
                coefficients,
                noise_std,
                noise_profile,
                correlation,
            } = joint;
            let _ = writeln!(
                text,
                "\n{joint}: friction {terms}; noise {noise_std:.4} N·m; {correlation:.1} rows tell as much as one independent row"
            );
            let rows: Vec<Vec<String>> = (coefficients.iter())
                .map(|of| vec![of.term.clone(), format!("{:.4} ± {:.4}", of.value, of.std)])
                .collect();
            text += &text_table::render(&["term", "coefficient"], &rows);
            let bins = SPEED_EDGES.iter().zip(noise_profile);
            let bins = bins.map(|(edge, h)| format!("{edge}: {h:.2}"));
            let _ = writeln!(
                text,
                "noise from each speed on (rad/s), in parts of it: {}",
                bins.collect::<Vec<_>>().join(", ")
            );
        }
        text
    }
}

/// A term as in the help of `torque-gp fit`, with its unit.
fn term_name(term: FrictionTerm) -> String {
    match term {
        FrictionTerm::Acceleration => "qdd (kg m²)".to_owned(),
        FrictionTerm::Speed => "qd (N·m·s/rad)".to_owned(),
        FrictionTerm::Offset => "offset (N·m)".to_owned(),
        FrictionTerm::Tanh { width } => format!("tanh(qd/{width}) (N·m)"),
        FrictionTerm::StepUp => "qd > 0 (N·m)".to_owned(),
        FrictionTerm::StepDown => "qd < 0 (N·m)".to_owned(),
        FrictionTerm::Hysteresis { length } => format!("z, {} mrad (N·m)", 1e3 * length),
        FrictionTerm::LoadHysteresis { length } => format!("|tau| z, {} mrad", 1e3 * length),
        FrictionTerm::LoadSpeed => "|tau| qd (s/rad)".to_owned(),
    }
}
