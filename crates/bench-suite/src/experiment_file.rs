//! Descriptions of experiments: TOML files that are compiled in, so that the program runs from anywhere.

use serde::de::DeserializeOwned;

use crate::error::BenchError;

/// Names and texts of files below `experiments/`.
macro_rules! experiment_files {
    ($($name:literal),+ $(,)?) => {
        [$((
            $name,
            include_str!(concat!(env!("CARGO_MANIFEST_DIR"), "/experiments/", $name)),
        )),+]
    };
}
pub(crate) use experiment_files;

/// Reads one description.
///
/// # Errors
/// `Experiment` if it is not TOML of this format.
pub fn parse<T: DeserializeOwned>(name: &str, source: &str) -> Result<T, BenchError> {
    toml::from_str(source).map_err(|error| BenchError::experiment(name, error))
}

/// Refuses a number that is not in 1..=max, by the name of what it counts.
///
/// # Errors
/// The sentence that says which.
pub fn check(what: &str, numbers: &[usize], max: usize) -> Result<(), String> {
    match numbers.iter().find(|i| !(1..=max).contains(i)) {
        Some(i) => Err(format!("{what} {i} is not in 1 to {max}")),
        None => Ok(()),
    }
}
