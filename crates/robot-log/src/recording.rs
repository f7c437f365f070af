//! What every log is, whatever its format: measurements of all joints, one after another.

use crate::error::LogError;

/// One measurement of all joints, in rad, rad/s, N·m and s (m, m/s, N for sliding joints).
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Measurement {
    /// Where it stands in its file, from 1.
    pub row: u64,
    /// Stamp, s; `None` of a log without.
    pub t: Option<f64>,
    /// q, (ℓ,).
    pub position: Vec<f64>,
    /// q̇, (ℓ,); empty of a log without.
    pub velocity: Vec<f64>,
    /// τ, (ℓ,).
    pub effort: Vec<f64>,
    /// Label of the run, and what the arm carries; empty where the log does not say.
    pub run: String,
    /// What the arm carries.
    pub context: String,
}

/// A log that is read from front to back.
pub trait Recording {
    /// Its name in messages.
    fn file(&self) -> &str;

    /// Names of the joints, in the order of the arm.
    fn joints(&self) -> &[String];

    /// Whether it has speeds.
    fn has_velocity(&self) -> bool;

    /// The next measurement, in the place of the one before; `false` after the last.
    ///
    /// # Errors
    /// Text or bytes that are none, with their place.
    fn next(&mut self, into: &mut Measurement) -> Result<bool, LogError>;
}
