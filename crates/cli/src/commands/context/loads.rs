//! Which load a stretch of measured torques comes from, by a model of a robot's parameters.

use serde::Serialize;
use torque_model::rigid_body::ParameterPosterior;
use torque_model::{Samples, TorqueError};

use crate::text_table;

/// What is written as JSON.
#[derive(Serialize)]
pub struct Loads {
    /// `None`: a load that is not known.
    answer: Option<String>,
    n_rows: usize,
    contexts: Vec<OfContext>,
    unknown: OfUnknown,
}

#[derive(Serialize)]
struct OfContext {
    context: String,
    log_evidence: f64,
    probability: f64,
}

#[derive(Serialize)]
struct OfUnknown {
    log_evidence: f64,
    probability: f64,
}

impl Loads {
    /// Of a stretch.
    ///
    /// # Errors
    /// Rows that the evidence cannot be computed of.
    pub fn of(posterior: &ParameterPosterior, samples: &Samples) -> Result<Self, TorqueError> {
        let evidence = posterior.load_evidence(samples)?;
        let (probabilities, unknown) = evidence.probabilities();
        let names = names_of(posterior);
        let mut best = None;
        let mut most = unknown;
        for (name, probability) in names.iter().zip(&probabilities) {
            if *probability > most {
                (best, most) = (Some(name.clone()), *probability);
            }
        }
        let logs = evidence.of_contexts.iter().zip(&probabilities);
        let of_context =
            |(context, (log_evidence, probability)): (String, (&f64, &f64))| OfContext {
                context,
                log_evidence: *log_evidence,
                probability: *probability,
            };
        Ok(Self {
            answer: best,
            n_rows: samples.n_rows(),
            contexts: names.into_iter().zip(logs).map(of_context).collect(),
            unknown: OfUnknown {
                log_evidence: evidence.of_unknown,
                probability: unknown,
            },
        })
    }

    /// For people.
    pub fn table(&self) -> String {
        let row = |name: &str, log_evidence: f64, probability: f64| {
            vec![
                name.to_owned(),
                format!("{log_evidence:.2}"),
                format!("{probability:.6}"),
            ]
        };
        let contexts = self.contexts.iter();
        let rows: Vec<Vec<String>> = contexts
            .map(|of| row(&of.context, of.log_evidence, of.probability))
            .chain([row(
                "unknown",
                self.unknown.log_evidence,
                self.unknown.probability,
            )])
            .collect();
        let table = text_table::render(&["context", "log evidence", "probability"], &rows);
        let answer = self.answer.as_deref().unwrap_or("a load that is not known");
        format!("{table}\n{} rows: {answer}\n", self.n_rows)
    }
}

/// What the loads that a model knows are called.
pub fn names_of(posterior: &ParameterPosterior) -> Vec<String> {
    match posterior.parts().contexts.as_slice() {
        [] => vec!["as learned".to_owned()],
        contexts => contexts.to_vec(),
    }
}
