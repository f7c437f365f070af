//! Which load a stretch of measured torques comes from, by a model of a robot's parameters.

use std::path::Path;

use serde::Serialize;
use torque_model::rigid_body::ParameterPosterior;

use crate::error::CliError;
use crate::model_file::ModelFile;
use crate::printed::PrintArgs;
use crate::range_watch::warn_outside;
use crate::samples::DataColumns;
use crate::table::Table;
use crate::text_table;

/// What is written as JSON.
#[derive(Serialize)]
struct Loads {
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

/// Reads the stretch, prints the probabilities.
///
/// # Errors
/// Anything wrong with the data.
pub fn run(
    data: &Path,
    tau_prefix: &str,
    model: &ModelFile,
    posterior: &ParameterPosterior,
    print: &PrintArgs,
) -> Result<(), CliError> {
    let mut table = Table::open(data)?;
    let file = table.file().to_owned();
    let learned = model.learned_joints();
    let columns = DataColumns::of_joints(&table, model.joints(), tau_prefix, &learned)?;
    model.note_order(&file, &columns.states);
    let data = columns.read_as_one(&mut table)?;
    data.warn(&file);
    let samples = &data.samples;
    let x = samples.x.as_ref();
    warn_outside(model.ranges(), x, &file, &columns.states.states);

    let evidence = posterior
        .load_evidence(samples)
        .map_err(CliError::of_data(&file))?;
    let (probabilities, unknown) = evidence.probabilities();
    let names = match model.contexts() {
        [] => vec!["as learned".to_owned()],
        contexts => contexts.to_vec(),
    };
    let mut best = None;
    let mut most = unknown;
    for (name, probability) in names.iter().zip(&probabilities) {
        if *probability > most {
            (best, most) = (Some(name.clone()), *probability);
        }
    }
    let of_context = |((context, log_evidence), probability): ((String, &f64), &f64)| OfContext {
        context,
        log_evidence: *log_evidence,
        probability: *probability,
    };
    let contexts = names
        .into_iter()
        .zip(&evidence.of_contexts)
        .zip(&probabilities);
    let loads = Loads {
        answer: best,
        n_rows: samples.n_rows(),
        contexts: contexts.map(of_context).collect(),
        unknown: OfUnknown {
            log_evidence: evidence.of_unknown,
            probability: unknown,
        },
    };
    print.print(&loads, Loads::table)
}

impl Loads {
    fn table(&self) -> String {
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
