//! A model file described: as JSON by its fields, as text in tables.

use std::fmt::Write;

use serde::Serialize;

use crate::commands::inspect::parameters::ParametersDescription;
use crate::hyperparameter_file::Hyperparameters;
use crate::text_table;

/// What a model file holds.
#[derive(Serialize)]
pub struct Description {
    pub kind: &'static str,
    pub program: String,
    pub data_sha256: String,
    pub n_samples: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub context: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contexts: Option<Vec<ContextDescription>>,
    pub joint_names: Vec<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rank_selection: Option<SelectionDescription>,
    pub joints: Vec<JointDescription>,
    /// Of a model that learned a robot's parameters.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameters: Option<ParametersDescription>,
}

/// A context and its data.
#[derive(Serialize)]
pub struct ContextDescription {
    pub context: String,
    pub n_samples: usize,
}

/// How the rank was chosen.
#[derive(Serialize)]
pub struct SelectionDescription {
    pub criterion: String,
    pub ranks: Vec<usize>,
    pub values: Vec<f64>,
}

/// One joint's model.
#[derive(Serialize)]
pub struct JointDescription {
    pub joint: String,
    pub model: String,
    /// None for linear models.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hyperparameters: Option<Hyperparameters>,
    /// None without a rigid-body prior.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub parameters: Option<ParameterDescription>,
    /// K^ρ by rows.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub k_task: Option<Vec<Vec<f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub correlations: Option<Vec<Vec<f64>>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fit: Option<FitDescription>,
}

/// What was learned of the prior of a robot's parameters.
#[derive(Serialize)]
pub struct ParameterDescription {
    /// Factor of the prior's standard deviations.
    pub spread: f64,
    /// Standard deviation of the noise, N·m.
    pub noise_std: f64,
}

/// How the hyperparameters of a joint were found.
#[derive(Serialize)]
pub struct FitDescription {
    pub log_marginal_likelihood: f64,
    pub error_bound: Option<f64>,
    pub start: String,
    pub n_starts: usize,
    pub evaluations: usize,
    pub bounds_hit: Vec<String>,
    pub condition_lower_bound: f64,
    pub method: String,
    pub rank: usize,
}

impl Description {
    /// The description for people.
    pub fn text(&self) -> String {
        let mut lines = vec![
            format!("model of {}, by {}", self.kind, self.program),
            format!(
                "data      {} samples, SHA-256 {}",
                self.n_samples, self.data_sha256
            ),
            format!("joints    {}", self.joint_names.join(", ")),
        ];
        lines.extend(self.context.iter().map(|name| format!("context   {name}")));
        lines.extend(self.contexts.iter().map(|contexts| {
            let names = contexts
                .iter()
                .map(|c| format!("{} ({})", c.context, c.n_samples));
            format!(
                "contexts  {} (samples)",
                names.collect::<Vec<_>>().join(", ")
            )
        }));
        lines.extend(self.rank_selection.iter().map(|selection| {
            let values = selection.ranks.iter().zip(&selection.values);
            let values = values.map(|(rank, value)| format!("{rank} {value:.1}"));
            let values = values.collect::<Vec<_>>().join(", ");
            format!("ranks     {} by rank: {values}", selection.criterion)
        }));
        let names = self.contexts.iter().flatten().map(|c| c.context.as_str());
        let names: Vec<&str> = names.collect();
        let joints = self.joints.iter().map(|joint| joint.text(&names));
        let parameters = self.parameters.as_ref().map(ParametersDescription::text);
        let joints: String = match &parameters {
            Some(_) => String::new(), // said with the parameters
            None => joints.collect(),
        };
        lines.join("\n") + "\n" + &joints + &parameters.unwrap_or_default()
    }
}

impl JointDescription {
    fn text(&self, contexts: &[&str]) -> String {
        let mut text = format!("\n{}: {}\n", self.joint, self.model);
        if let Some(fit) = &self.fit {
            text += &fit.text();
        }
        if let Some(parameters) = &self.parameters {
            let _ = writeln!(
                text,
                "standard deviations of the robot's parameters times {:.3e}; noise std {:.6} N·m",
                parameters.spread, parameters.noise_std
            );
        }
        if let Some(hyperparameters) = &self.hyperparameters {
            let entries = hyperparameters.entries().into_iter();
            let rows: Vec<_> = entries
                .map(|(name, value)| vec![name, format!("{value:.6e}")])
                .collect();
            let table = text_table::render(&["hyperparameter", "value"], &rows);
            let _ = write!(text, "\n{table}");
            if let Some(continuous) = &hyperparameters.continuous {
                let names = continuous.join(", ");
                let _ = writeln!(
                    text,
                    "turning without end: {names}; of their q, linear_std is in N·m of cosine and sine, and length_scales \
                     of the chord 2 sin(½ difference)"
                );
            }
        }
        for (name, matrix) in [("K", &self.k_task), ("correlation", &self.correlations)] {
            if let Some(matrix) = matrix {
                let _ = write!(text, "\n{}", matrix_table(name, matrix, contexts));
            }
        }
        text
    }
}

impl FitDescription {
    fn text(&self) -> String {
        let bounds = match self.bounds_hit.as_slice() {
            [] => "none".to_owned(),
            names => names.join(" "),
        };
        let error = self
            .error_bound
            .map_or(String::new(), |bound| format!(" ± {bound:.1e}"));
        format!(
            "log marginal likelihood {:.3}{error} nats ({}, rank {}); start {} of {}, {} evaluations; bounds hit: {bounds}\n",
            self.log_marginal_likelihood,
            self.method,
            self.rank,
            self.start,
            self.n_starts,
            self.evaluations
        )
    }
}

fn matrix_table(name: &str, matrix: &[Vec<f64>], contexts: &[&str]) -> String {
    let mut header = vec![name];
    header.extend(contexts);
    let rows = matrix.iter().zip(contexts).map(|(values, context)| {
        let entries = values.iter().map(|value| format!("{value:.4}"));
        std::iter::once((*context).to_owned())
            .chain(entries)
            .collect()
    });
    text_table::render(&header, &rows.collect::<Vec<Vec<String>>>())
}

/// Bytes as hexadecimal digits.
pub fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}
