//! A part of an experiment of section 5: computed by itself, its result kept.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::BenchError;
use crate::store::{Finished, Work};

/// Fingerprints of sources, data and dependencies behind each experiment's parts, made by the build script.
///
/// An experiment, an equals sign and its fingerprint, then a blank.
const MEASURED_BY: &str = env!("SECTION5_MEASURED_BY");

/// Fingerprint behind the parts of an experiment.
///
/// # Errors
/// `UnknownName` if there is no such experiment.
pub fn measured_by(experiment: &str) -> Result<&'static str, BenchError> {
    let known = || MEASURED_BY.split(' ').filter_map(|one| one.split_once('='));
    let found = known().find(|(name, _)| *name == experiment);
    found
        .map(|(_, fingerprint)| fingerprint)
        .ok_or_else(|| BenchError::UnknownName {
            what: "experiment of section 5",
            name: experiment.to_string(),
            known: known().map(|(name, _)| name).collect::<Vec<_>>().join(", "),
        })
}

/// What is computed: which part of which experiment, under which settings.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Part {
    /// Place among the experiment's parts, from 0: the order of the results.
    pub place: usize,
    /// Name of the experiment.
    pub experiment: String,
    /// What tells it from the experiment's other parts.
    pub label: String,
    /// Fingerprint of the sources.
    pub measured_by: String,
    /// All settings of the experiment, as TOML.
    pub settings: String,
    /// Key of an order in which what takes longer is greater.
    pub cost: usize,
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}, {}", self.experiment, self.label)
    }
}

impl Work for Part {
    type Record = PartRecord;

    fn key(&self) -> String {
        format!(
            "format 1; measured by {}; experiment {}; part {}; settings {}",
            self.measured_by, self.experiment, self.label, self.settings
        )
    }

    fn cost(&self) -> impl Ord {
        self.cost
    }
}

/// Result of a part.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PartRecord {
    /// The part.
    pub part: Part,
    /// What the experiment found; its type is the experiment's own.
    pub found: toml::Value,
}

impl Finished for PartRecord {
    type Work = Part;

    fn work(&self) -> &Part {
        &self.part
    }
}

/// A part before it is computed: its label, its cost, and what the experiment needs to know of it.
pub struct Task<T> {
    /// What tells it from the experiment's other parts.
    pub label: String,
    /// Key of an order in which what takes longer is greater.
    pub cost: usize,
    /// What is to be done.
    pub task: T,
}

impl<T> Task<T> {
    /// A part that takes about as long as the others of its experiment.
    pub fn new(label: impl Into<String>, task: T) -> Self {
        Self {
            label: label.into(),
            cost: 0,
            task,
        }
    }

    /// The same with a cost.
    #[must_use]
    pub fn costing(self, cost: usize) -> Self {
        Self { cost, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::section_experiment::{Kind, SectionExperiment};
    use crate::store::Store;

    #[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
    struct Found {
        name: String,
        delays: Vec<f64>,
        nested: Vec<Vec<f64>>,
        none: Option<f64>,
    }

    #[test]
    fn numbers_of_every_kind_come_back_bit_for_bit() {
        let found = Found {
            name: "c3, \"quoted\"".to_string(),
            delays: vec![f64::INFINITY, -0.0, f64::MIN_POSITIVE / 3.0, 0.1 + 0.2],
            nested: vec![vec![1.0, 1.0 / 3.0], Vec::new()],
            none: None,
        };
        let part = Part {
            place: 3,
            experiment: "rbd".to_string(),
            label: "joint 3".to_string(),
            measured_by: "0".to_string(),
            settings: "n_total = 280\n".to_string(),
            cost: 7,
        };
        let record = PartRecord {
            part: part.clone(),
            found: toml::Value::try_from(&found).unwrap(),
        };
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        store.save(&record).unwrap();
        let read: Found = store.load(&part).unwrap().found.try_into().unwrap();
        let bits = |found: &Found| -> Vec<u64> {
            let nested = found.nested.iter().flatten();
            let all = found.delays.iter().chain(nested);
            all.map(|number| number.to_bits()).collect()
        };
        assert_eq!((bits(&read), &read.name), (bits(&found), &found.name));
        let other = Part {
            settings: "n_total = 281\n".to_string(),
            ..part
        };
        assert!(store.load(&other).is_none());
    }

    #[test]
    fn every_experiment_has_a_fingerprint() {
        for name in SectionExperiment::names(Kind::Section5).unwrap() {
            assert!(!measured_by(&name).unwrap().is_empty(), "{name}");
        }
    }
}
