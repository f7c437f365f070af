//! One row of the table: a model of a joint, and its scores.

use serde::{Deserialize, Serialize};

use crate::data_figures::section::{Section, csv};
use crate::report::text_table::{TextTable, score};

/// Scores of a model, averaged over loads.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Number of loads that the model knows: one, or many.
    pub n_loads: usize,
    /// From 1.
    pub joint: usize,
    /// Training samples, of all its loads together.
    pub n: usize,
    /// Name.
    pub model: String,
    /// nMSE on interp.
    pub interp: f64,
    /// nMSE on extrap.
    pub extrap: f64,
    /// Of σ, N·m.
    pub noise_std: f64,
}

/// The lines as a table and a file.
pub fn section(lines: &[Line]) -> Section {
    let header = [
        "loads",
        "joint",
        "n",
        "model",
        "interp",
        "extrap",
        "σ (N·m)",
    ];
    let row = |line: &Line| {
        vec![
            line.n_loads.to_string(),
            line.joint.to_string(),
            line.n.to_string(),
            line.model.clone(),
            score(Some(line.interp)),
            score(Some(line.extrap)),
            format!("{:.3}", line.noise_std),
        ]
    };
    let mut section = Section::of_table(TextTable::new(4, header, lines.iter().map(row)));
    let numbers = lines.iter().map(|line| {
        let counts = [line.n_loads, line.joint, line.n].map(|count| count.to_string());
        let labels = counts.into_iter().chain([format!("\"{}\"", line.model)]);
        (
            labels.collect(),
            vec![line.interp, line.extrap, line.noise_std],
        )
    });
    let header = "loads,joint,n,model,nmse_interp,nmse_extrap,noise_std";
    section.file("section5_rbd.csv", csv(header, numbers));
    section
}
