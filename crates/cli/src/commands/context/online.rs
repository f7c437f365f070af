//! The load that torques show, row after row: probabilities, mass, changes.

use serde::Serialize;
use torque_model::rigid_body::{OnlineLoad, OnlineSettings};
use torque_model::{RobotModel, Samples, TorqueError};

use crate::commands::context::loads::names_of;
use crate::context::columns_error;
use crate::error::CliError;
use crate::text_table;

/// Least part of the seconds between rows that are shown by which one may come too soon.
const ROUNDING: f64 = 1e-9;

/// What is written as JSON.
#[derive(Serialize)]
pub struct Following {
    /// `None`: a load that is not known, by the last row.
    answer: Option<String>,
    n_rows: usize,
    changes: usize,
    contexts: Vec<String>,
    rows: Vec<OfRow>,
}

/// After a row.
#[derive(Serialize)]
struct OfRow {
    /// s
    t: f64,
    probabilities: Vec<f64>,
    unknown: f64,
    /// kg
    mass: f64,
    mass_std: f64,
    /// How often the load has changed.
    changes: usize,
    /// When it did last, or the first row was, s.
    since: f64,
}

/// How rows are followed.
#[derive(Debug, Clone, Copy)]
pub struct How {
    /// Seconds between rows that are shown; all of them without.
    pub every: Option<f64>,
    /// Seconds after which a row tells e times less.
    pub forgetting: Option<f64>,
}

impl Following {
    /// Of all rows of samples, in the order of their times.
    ///
    /// # Errors
    /// Fewer than two rows, no times, or times that do not go on.
    pub fn of(
        model: &RobotModel,
        samples: &Samples,
        file: &str,
        how: How,
    ) -> Result<Self, CliError> {
        let steps = steps(&samples.timeline.t, file)?;
        let following = Self::along(model, samples, &steps, how);
        following.map_err(CliError::of_data(file))
    }

    fn along(
        model: &RobotModel,
        samples: &Samples,
        steps: &[f64],
        how: How,
    ) -> Result<Self, TorqueError> {
        let settings = OnlineSettings::default();
        let mut online = model.online_load(OnlineSettings {
            forgetting: how.forgetting.or(settings.forgetting),
            ..settings
        })?;
        let states = model.states_of(samples)?;
        let mut x = vec![0.0; states.ncols()];
        let mut torques = vec![0.0; samples.n_joints()];
        let (mut rows, mut last) = (Vec::new(), f64::NEG_INFINITY);
        for (row, (t, step)) in samples.timeline.t.iter().zip(steps).enumerate() {
            x.iter_mut()
                .zip(states.row(row).iter())
                .for_each(|(to, from)| *to = *from);
            for joint in &samples.torques {
                torques[joint.joint_idx] = joint.values[row];
            }
            online.update(&x, &torques, *step)?;
            let is_last = row + 1 == steps.len();
            if how
                .every
                .is_none_or(|every| t - last >= every * (1.0 - ROUNDING))
                || is_last
            {
                rows.push(OfRow::new(*t, samples.timeline.t[0], &online));
                last = *t;
            }
        }
        let contexts = model.rigid_body().map_or(Vec::new(), |of| names_of(of));
        let most = rows.last().and_then(OfRow::most_probable);
        Ok(Self {
            answer: most.map(|context| contexts[context].clone()),
            n_rows: steps.len(),
            changes: online.n_changes(),
            contexts,
            rows,
        })
    }

    /// For people: the first row shown after each change, and the last one.
    pub fn table(&self) -> String {
        let known = self.contexts.iter().map(|name| format!("p {name}"));
        let header: Vec<String> = ["t", "load since"]
            .map(str::to_owned)
            .into_iter()
            .chain(known)
            .chain(["p unknown", "mass", "std"].map(str::to_owned))
            .collect();
        let header: Vec<&str> = header.iter().map(String::as_str).collect();
        let changes = |idx: usize| {
            idx.checked_sub(1)
                .map_or(0, |before| self.rows[before].changes)
        };
        let shown = self.rows.iter().enumerate();
        let shown =
            shown.filter(|(idx, row)| row.changes > changes(*idx) || idx + 1 == self.rows.len());
        let rows: Vec<Vec<String>> = shown
            .map(|(_, row)| {
                let probabilities = row.probabilities.iter().chain([&row.unknown]);
                [row.t, row.since]
                    .map(|seconds| format!("{seconds:.2}"))
                    .into_iter()
                    .chain(probabilities.map(|p| format!("{p:.6}")))
                    .chain([row.mass, row.mass_std].map(|kg| format!("{kg:.3}")))
                    .collect()
            })
            .collect();
        let table = text_table::render(&header, &rows);
        let answer = self.answer.as_deref().unwrap_or("a load that is not known");
        let (rows, changes) = (self.n_rows, self.changes);
        format!("{table}\n{rows} rows, {changes} changes, at last: {answer}\n")
    }

    /// The header of a table of the rows.
    pub fn header(&self) -> Vec<String> {
        let known = self.contexts.iter().map(|context| format!("p_{context}"));
        let rest = ["p_unknown", "mass", "mass_std", "changes", "since"];
        std::iter::once("t".to_owned())
            .chain(known)
            .chain(rest.map(str::to_owned))
            .collect()
    }

    /// The rows of it.
    pub fn records(&self) -> impl Iterator<Item = Vec<String>> + '_ {
        self.rows.iter().map(|row| {
            std::iter::once(&row.t)
                .chain(&row.probabilities)
                .chain([&row.unknown, &row.mass, &row.mass_std])
                .map(|number| format!("{number:?}"))
                .chain([row.changes.to_string(), format!("{:?}", row.since)])
                .collect()
        })
    }
}

impl OfRow {
    fn new(t: f64, first: f64, online: &OnlineLoad) -> Self {
        let load = online.load();
        let (unknown, known) = (online.probabilities().split_last()).unwrap_or((&1.0, &[]));
        Self {
            t,
            probabilities: known.to_vec(),
            unknown: *unknown,
            mass: load.mean[0],
            mass_std: load.std[0],
            changes: online.n_changes(),
            since: (t - online.seconds_since_change()).max(first),
        }
    }

    /// The most probable context; `None` for a load that is not known.
    fn most_probable(&self) -> Option<usize> {
        let mut best = (None, self.unknown);
        for (context, probability) in self.probabilities.iter().enumerate() {
            if *probability > best.1 {
                best = (Some(context), *probability);
            }
        }
        best.0
    }
}

/// Seconds since the row before; the first row's are the second one's.
fn steps(times: &[f64], file: &str) -> Result<Vec<f64>, CliError> {
    if times.is_empty() {
        let reason = "--online: there is no column `t` with the rows' times in seconds";
        return Err(columns_error(file, reason.to_owned()));
    }
    if times.len() < 2 {
        let reason = "--online: one row does not say how far rows are apart";
        return Err(columns_error(file, reason.to_owned()));
    }
    if let Some(row) = times.windows(2).position(|pair| pair[1] <= pair[0]) {
        let reason = format!("row {}, column `t`: time does not go on", row + 2);
        return Err(columns_error(file, reason));
    }
    let first = times[1] - times[0];
    let later = times.windows(2).map(|pair| pair[1] - pair[0]);
    Ok(std::iter::once(first).chain(later).collect())
}
