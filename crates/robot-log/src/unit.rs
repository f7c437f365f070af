//! Units that logs come in, as factors of SI.

use std::f64::consts::TAU;
use std::fmt;

use crate::error::LogError;

/// Of positions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionUnit(Unit);

/// Of speeds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityUnit(Unit);

/// Of stamps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeUnit(Unit);

/// Of efforts: torques, or currents that a gain makes torques.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EffortUnit(Unit);

/// A name and how many of SI's unit it is.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Unit {
    name: &'static str,
    factor: f64,
}

const fn unit(name: &'static str, factor: f64) -> Unit {
    Unit { name, factor }
}

const POSITIONS: [Unit; 6] = [
    unit("rad", 1.0),
    unit("deg", TAU / 360.0),
    unit("turn", TAU),
    unit("mrad", 1e-3),
    unit("m", 1.0),
    unit("mm", 1e-3),
];
const VELOCITIES: [Unit; 7] = [
    unit("rad/s", 1.0),
    unit("deg/s", TAU / 360.0),
    unit("turn/s", TAU),
    unit("rpm", TAU / 60.0),
    unit("mrad/s", 1e-3),
    unit("m/s", 1.0),
    unit("mm/s", 1e-3),
];
const TIMES: [Unit; 4] = [
    unit("s", 1.0),
    unit("ms", 1e-3),
    unit("us", 1e-6),
    unit("ns", 1e-9),
];
const EFFORTS: [Unit; 6] = [
    unit("Nm", 1.0),
    unit("mNm", 1e-3),
    unit("kNm", 1e3),
    unit("N", 1.0),
    unit("A", 1.0),
    unit("mA", 1e-3),
];

/// Spellings that mean a unit of the lists.
const SPELLINGS: [(&str, &str); 22] = [
    ("N·m", "Nm"),
    ("N.m", "Nm"),
    ("N*m", "Nm"),
    ("N m", "Nm"),
    ("mN·m", "mNm"),
    ("mN.m", "mNm"),
    ("kN·m", "kNm"),
    ("radian", "rad"),
    ("radians", "rad"),
    ("degree", "deg"),
    ("degrees", "deg"),
    ("°", "deg"),
    ("turns", "turn"),
    ("rev", "turn"),
    ("revolutions", "turn"),
    ("°/s", "deg/s"),
    ("rev/s", "turn/s"),
    ("turns/s", "turn/s"),
    ("rev/min", "rpm"),
    ("µs", "us"),
    ("μs", "us"),
    ("sec", "s"),
];

fn find(what: &str, known: &[Unit], text: &str) -> Result<Unit, LogError> {
    let text = text.trim();
    let spelling = SPELLINGS.iter().find(|(other, _)| *other == text);
    let name = spelling.map_or(text, |(_, name)| name);
    let found = known.iter().find(|unit| unit.name == name).copied();
    found.ok_or_else(|| {
        let names: Vec<&str> = known.iter().map(|unit| unit.name).collect();
        LogError::Mapping(format!(
            "`{text}` is no unit of {what}; known are {}",
            names.join(", ")
        ))
    })
}

macro_rules! unit_of {
    ($name:ident, $what:literal, $known:ident, $si:literal) => {
        impl $name {
            /// The unit of a spelling.
            ///
            /// # Errors
            /// One that is not known, with those that are.
            pub fn parse(text: &str) -> Result<Self, LogError> {
                find($what, &$known, text).map(Self)
            }

            #[doc = concat!("How many ", $si, " it is.")]
            pub fn factor(self) -> f64 {
                self.0.factor
            }
        }

        impl Default for $name {
            fn default() -> Self {
                Self($known[0])
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(self.0.name)
            }
        }
    };
}

unit_of!(PositionUnit, "positions", POSITIONS, "rad (m)");
unit_of!(VelocityUnit, "speeds", VELOCITIES, "rad/s (m/s)");
unit_of!(TimeUnit, "time", TIMES, "s");
unit_of!(EffortUnit, "efforts", EFFORTS, "N·m (N), or A");

impl EffortUnit {
    /// Whether it is a current, which takes a gain to be a torque.
    pub fn is_current(self) -> bool {
        matches!(self.0.name, "A" | "mA")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_known_by_their_spellings_and_others_named() {
        let turn = PositionUnit::parse(" revolutions ").unwrap().factor();
        assert!((turn - TAU).abs() < 1e-15);
        let degrees = VelocityUnit::parse("°/s").unwrap().factor();
        assert!((degrees * 180.0 - TAU / 2.0).abs() < 1e-15);
        assert_eq!(EffortUnit::parse("N·m").unwrap().to_string(), "Nm");
        assert!(EffortUnit::parse("mA").unwrap().is_current());
        let error = TimeUnit::parse("min").unwrap_err().to_string();
        assert!(error.contains("`min`") && error.contains("ms"), "{error}");
    }
}
