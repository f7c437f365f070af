//! The noise of a hyperparameter file: one number, or one for each context.

use std::fmt;

use serde::de::{SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

/// A number for σ, or one for each σ_γ.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum NoiseStd {
    /// One noise for all data.
    Shared(f64),
    /// One for each context.
    OfContexts(Vec<f64>),
}

impl NoiseStd {
    /// The number or numbers.
    pub fn values(&self) -> &[f64] {
        match self {
            Self::Shared(value) => std::slice::from_ref(value),
            Self::OfContexts(values) => values,
        }
    }

    /// Other numbers of the same kind.
    ///
    /// # Panics
    /// If there are none.
    pub fn with_values(&self, values: &[f64]) -> Self {
        match self {
            Self::Shared(_) => Self::Shared(values[0]),
            Self::OfContexts(_) => Self::OfContexts(values.to_vec()),
        }
    }
}

impl<'de> Deserialize<'de> for NoiseStd {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(NoiseVisitor)
    }
}

/// By hand, so that a message says what was found and expected.
struct NoiseVisitor;

impl<'de> Visitor<'de> for NoiseVisitor {
    type Value = NoiseStd;

    fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str("a number, or a list of one number for each context")
    }

    fn visit_f64<E>(self, value: f64) -> Result<NoiseStd, E> {
        Ok(NoiseStd::Shared(value))
    }

    #[allow(
        clippy::cast_precision_loss,
        reason = "as TOML's integers are read for every other number"
    )]
    fn visit_i64<E>(self, value: i64) -> Result<NoiseStd, E> {
        Ok(NoiseStd::Shared(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<NoiseStd, A::Error> {
        let mut values = Vec::new();
        while let Some(value) = list.next_element()? {
            values.push(value);
        }
        Ok(NoiseStd::OfContexts(values))
    }
}
