//! What takes part: evaluations of the likelihood at given hyperparameters.

use std::collections::BTreeMap;

use anyhow::Result;
use serde::Serialize;

use crate::hyperparameters::Hyperparameters;

/// One evaluation of likelihood and gradient.
#[derive(Serialize)]
pub struct Answer {
    pub seconds: f64,
    pub value: f64,
    /// Bound on the error of `value` in nats, where the contestant has one.
    pub error_bound: Option<f64>,
    pub rank: usize,
    /// With respect to standard deviations and length scales.
    pub gradient: BTreeMap<String, Vec<f64>>,
}

/// Something that evaluates the likelihood at given hyperparameters and keeps its memory.
pub trait Contestant {
    fn evaluate(&mut self, at: &Hyperparameters) -> Result<Answer>;
}
