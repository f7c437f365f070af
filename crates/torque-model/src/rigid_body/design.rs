//! The columns that the rows of a log have, a panel of rows at a time.

use std::borrow::Cow;
use std::ops::Range;
use std::sync::Arc;

use faer::{ColRef, Mat, MatRef};
use linalg::product;
use puma_dyn::{Model, Workspace, regressor};
use rayon::prelude::*;

use crate::error::TorqueError;
use crate::rigid_body::log::{Log, Run};
use crate::rigid_body::unknowns::Unknowns;
use crate::rows::require_states;

/// Rows of a panel.
const PANEL: usize = 1024;

/// Panels that are worked out together where they are not kept.
const GROUP: usize = 8;

/// Numbers of all panels together that are kept from pass to pass: 160 MB.
const KEPT: usize = 20_000_000;

/// The rows of a log as equations for the unknowns.
#[derive(Debug)]
pub(crate) struct Design<'a> {
    robot: &'a Arc<Model>,
    unknowns: &'a Unknowns,
    described: &'a [f64],
    log: &'a Log<'a>,
    /// Number of each joint's torques among the samples'.
    torques: Vec<Option<usize>>,
    /// Joints whose rows all stand in their panels, since none of them counts.
    unused: Vec<bool>,
    spans: Vec<Span>,
    kept: Option<Vec<Panel>>,
}

/// Neighbouring rows of one run.
#[derive(Debug, Clone)]
struct Span {
    run: usize,
    /// Among the rows of the run.
    rows: Range<usize>,
    /// z before the first row, length after length, (lengths, ℓ).
    z: Vec<f64>,
}

/// The rows of a span.
#[derive(Debug, Clone)]
pub(crate) struct Panel {
    pub run: usize,
    pub joints: Vec<JointPanel>,
}

/// Rows of a joint.
#[derive(Debug, Clone)]
pub(crate) struct JointPanel {
    /// Their places among the rows of all runs.
    pub places: Vec<usize>,
    /// Speeds of the joint, rad/s.
    pub qd: Vec<f64>,
    /// Columns of π that the joint depends on, then φ; those of terms that grow with the load
    /// are to be multiplied by |τ^rb|. (m, p_j).
    pub columns: Mat<f64>,
    /// y − Yπ₀, N·m.
    pub targets: Vec<f64>,
    /// Yπ₀, N·m.
    pub described: Vec<f64>,
}

impl<'a> Design<'a> {
    /// # Errors
    /// States that are not finite or of another robot; [`TorqueError::Log`] for terms with memory where the log has
    /// neither times nor states of it.
    pub fn new(
        robot: &'a Arc<Model>,
        unknowns: &'a Unknowns,
        described: &'a [f64],
        log: &'a Log<'a>,
    ) -> Result<Self, TorqueError> {
        let samples = log.samples;
        require_states(samples.x.as_ref(), robot.n_joints())?;
        let torques: Vec<Option<usize>> = (0..robot.n_joints())
            .map(|joint| samples.torques.iter().position(|t| t.joint_idx == joint))
            .collect();
        let unused = (0..robot.n_joints()).map(|joint| log.n_used(joint) == 0);
        let mut design = Self {
            robot,
            unknowns,
            described,
            log,
            torques,
            unused: unused.collect(),
            spans: Vec::new(),
            kept: None,
        };
        design.spans = design.all_spans()?;
        let per_row: usize = (0..robot.n_joints()).map(|j| design.n_columns(j) + 4).sum();
        if per_row * log.n_rows() <= KEPT {
            let panels: Vec<Panel> = (0..design.spans.len())
                .into_par_iter()
                .map(|span| design.panel(span))
                .collect();
            design.kept = Some(panels);
        }
        Ok(design)
    }

    /// Whether torques of a joint are there.
    pub fn is_measured(&self, joint: usize) -> bool {
        self.torques[joint].is_some()
    }

    /// Whether a joint has rows that count.
    pub fn is_seen(&self, joint: usize) -> bool {
        self.is_measured(joint) && !self.unused[joint]
    }

    /// Columns p_j of a joint's rows.
    pub fn n_columns(&self, joint: usize) -> usize {
        self.unknowns.bodies_of(joint).len() + self.unknowns.terms().len()
    }

    /// Hands the panels of all rows, in their order, to every joint's state, the joints side by side.
    pub fn for_each<S: Send>(
        &self,
        states: &mut [S],
        visit: impl Fn(&mut S, usize, &Panel) + Sync,
    ) {
        for first in (0..self.spans.len()).step_by(GROUP) {
            let group = first..(first + GROUP).min(self.spans.len());
            let panels: Vec<Cow<'_, Panel>> = match &self.kept {
                Some(kept) => kept[group].iter().map(Cow::Borrowed).collect(),
                None => group
                    .into_par_iter()
                    .map(|span| Cow::Owned(self.panel(span)))
                    .collect(),
            };
            states
                .par_iter_mut()
                .enumerate()
                .for_each(|(joint, state)| {
                    for panel in &panels {
                        visit(state, joint, panel);
                    }
                });
        }
    }

    /// Steps of the training data between neighbouring rows of a panel's run: see [`Log::spacing`].
    pub fn spacing(&self, panel: &Panel, training_step: Option<f64>) -> f64 {
        self.log.spacing(&self.log.runs[panel.run], training_step)
    }

    /// Rigid-body torques of a joint's rows, N·m.
    ///
    /// ```text
    /// τ^rb = Y (π + E ψ_c)
    /// ```
    pub fn rigid(
        &self,
        joint: usize,
        panel: &JointPanel,
        w: &[f64],
        load: Option<usize>,
    ) -> Vec<f64> {
        let n_bodies = self.unknowns.bodies_of(joint).len();
        let weights = self.unknowns.own_weights(joint, w, load);
        let columns = panel.columns.as_ref().subcols(0, n_bodies);
        let change = product(columns, ColRef::from_slice(&weights[..n_bodies]).as_mat());
        let described = panel.described.iter();
        described
            .zip(change.col(0).iter())
            .map(|(known, change)| known + change)
            .collect()
    }

    /// y − Yπ̂ − φθ̂ of a joint's rows, N·m; `rigid` makes the terms that grow with the load, zero without.
    pub fn residuals(
        &self,
        joint: usize,
        panel: &JointPanel,
        w: &[f64],
        load: Option<usize>,
        rigid: Option<&[f64]>,
    ) -> Vec<f64> {
        let n_bodies = self.unknowns.bodies_of(joint).len();
        let weights = self.unknowns.own_weights(joint, w, load);
        let terms = self.unknowns.terms();
        let plain: Vec<f64> = (weights.iter().enumerate())
            .map(|(k, weight)| {
                let is_of_load = k >= n_bodies && terms[k - n_bodies].is_of_load();
                if is_of_load { 0.0 } else { *weight }
            })
            .collect();
        let explained = product(panel.columns.as_ref(), ColRef::from_slice(&plain).as_mat());
        let mut residuals: Vec<f64> = (panel.targets.iter().zip(explained.col(0).iter()))
            .map(|(target, explained)| target - explained)
            .collect();
        let Some(rigid) = rigid else {
            return residuals;
        };
        for (term, k) in terms.iter().zip(n_bodies..) {
            if term.is_of_load() {
                let column = panel.columns.col(k);
                for ((residual, value), rigid) in residuals.iter_mut().zip(column.iter()).zip(rigid)
                {
                    *residual -= weights[k] * value * rigid.abs();
                }
            }
        }
        residuals
    }

    fn all_spans(&self) -> Result<Vec<Span>, TorqueError> {
        let lengths = self.unknowns.lengths();
        self.log.require_memory(lengths)?;
        let n = lengths.len() * self.robot.n_joints();
        let mut spans = Vec::new();
        for (number, run) in self.log.runs.iter().enumerate() {
            let mut z = vec![0.0; n];
            for start in (0..run.rows.len()).step_by(PANEL) {
                let rows = start..(start + PANEL).min(run.rows.len());
                spans.push(Span {
                    run: number,
                    rows: rows.clone(),
                    z: z.clone(),
                });
                rows.for_each(|row| self.log.advance(run, row, self.unknowns.lengths(), &mut z));
            }
        }
        Ok(spans)
    }

    fn panel(&self, span: usize) -> Panel {
        let span = &self.spans[span];
        let run = &self.log.runs[span.run];
        let (samples, n_joints) = (self.log.samples, self.robot.n_joints());
        let mut joints: Vec<JointPanel> = (0..n_joints)
            .map(|joint| self.empty_panel(joint, run, span))
            .collect();
        let mut workspace = Workspace::new(self.robot);
        let mut matrix = vec![0.0; self.described.len() * n_joints];
        let (mut state, mut z) = (vec![0.0; 3 * n_joints], span.z.clone());
        let mut filled = vec![0; n_joints];
        for row in span.rows.clone() {
            let place = run.rows[row];
            state
                .iter_mut()
                .zip(samples.x.row(place).iter())
                .for_each(|(to, from)| *to = *from);
            let (q, rates) = state.split_at(n_joints);
            let (qd, qdd) = rates.split_at(n_joints);
            self.log.advance(run, row, self.unknowns.lengths(), &mut z);
            regressor(self.robot, &mut workspace, q, qd, qdd, &mut matrix);
            for (joint, panel) in joints.iter_mut().enumerate() {
                let at = filled[joint];
                if panel.places.get(at) != Some(&(run.span.start + row)) {
                    continue;
                }
                filled[joint] += 1;
                let y = &matrix[joint * self.described.len()..][..self.described.len()];
                panel.qd[at] = qd[joint];
                self.fill(
                    joint,
                    y,
                    (qd[joint], qdd[joint]),
                    &z,
                    panel.columns.as_mut().row_mut(at),
                );
                panel.described[at] = linalg::sums::dot(y, self.described);
                if let Some(torques) = self.torques[joint] {
                    panel.targets[at] =
                        samples.torques[torques].values[place] - panel.described[at];
                }
            }
        }
        Panel {
            run: span.run,
            joints,
        }
    }

    fn empty_panel(&self, joint: usize, run: &Run, span: &Span) -> JointPanel {
        let is_taken = |place: &usize| self.unused[joint] || self.log.is_used(*place, joint);
        let places = span.rows.clone().map(|row| run.span.start + row);
        let places: Vec<usize> = if self.is_measured(joint) {
            places.filter(is_taken).collect()
        } else {
            Vec::new()
        };
        let m = places.len();
        JointPanel {
            places,
            qd: vec![0.0; m],
            columns: Mat::zeros(m, self.n_columns(joint)),
            targets: vec![0.0; m],
            described: vec![0.0; m],
        }
    }

    fn fill(
        &self,
        joint: usize,
        y: &[f64],
        rates: (f64, f64),
        z: &[f64],
        row: faer::RowMut<'_, f64>,
    ) {
        let of_bodies = self
            .unknowns
            .bodies_of(joint)
            .iter()
            .map(|column| y[*column]);
        let friction = self.unknowns.friction_row(joint, rates, z, 1.0);
        for (entry, value) in row.iter_mut().zip(of_bodies.chain(friction)) {
            *entry = value;
        }
    }
}

/// Rows of a joint's columns picked, with terms of the load made from τ^rb.
pub(crate) fn gathered(
    unknowns: &Unknowns,
    columns: MatRef<'_, f64>,
    rows: &[usize],
    rigid: Option<&[f64]>,
) -> Mat<f64> {
    let first = columns.ncols() - unknowns.terms().len();
    let mut block = Mat::from_fn(rows.len(), columns.ncols(), |row, col| {
        columns[(rows[row], col)]
    });
    for (term, k) in unknowns.terms().iter().zip(first..) {
        if term.is_of_load() {
            for (row, place) in rows.iter().enumerate() {
                block[(row, k)] *= rigid.map_or(0.0, |rigid| rigid[*place].abs());
            }
        }
    }
    block
}
