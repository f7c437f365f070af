//! The table of the fits.

use gp_core::FitSummary;

use crate::text_table;

const HEADER: [&str; 11] = [
    "joint",
    "model",
    "samples",
    "log likelihood",
    "error bound",
    "start",
    "evaluations",
    "noise std (N·m)",
    "factor",
    "seconds",
    "bounds hit",
];

/// One fit.
pub struct Line<'a> {
    pub joint: &'a str,
    pub model: String,
    pub n_samples: usize,
    /// None for models without hyperparameters.
    pub summary: Option<&'a FitSummary>,
    pub noise_std: f64,
    pub seconds: f64,
}

/// The table, a line for each joint.
pub fn table(lines: &[Line<'_>]) -> String {
    let rows: Vec<Vec<String>> = lines.iter().map(Line::entries).collect();
    text_table::render(&HEADER, &rows)
}

impl Line<'_> {
    fn entries(&self) -> Vec<String> {
        let summary = self.summary;
        let entry = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
        let bounds = summary
            .map(|s| s.bounds_hit.join(" "))
            .filter(|names| !names.is_empty());
        let error_bound = summary.and_then(|s| s.error_bound);
        vec![
            self.joint.to_owned(),
            self.model.clone(),
            self.n_samples.to_string(),
            entry(summary.map(|s| format!("{:.3}", s.log_marginal))),
            entry(error_bound.map(|bound| format!("{bound:.1e}"))),
            entry(summary.map(|s| s.start.clone())),
            entry(summary.map(|s| s.evaluations.to_string())),
            format!("{:.4}", self.noise_std),
            entry(summary.map(|s| format!("{}, rank {}", s.method, s.rank))),
            format!("{:.1}", self.seconds),
            entry(bounds),
        ]
    }
}
