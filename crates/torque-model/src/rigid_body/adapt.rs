//! A new load, or more rows of a known one: the same posterior given further rows.

use faer::Mat;

use crate::error::TorqueError;
use crate::rigid_body::design::{Design, gathered};
use crate::rigid_body::log::Log;
use crate::rigid_body::normal_equations::NormalEquations;
use crate::rigid_body::posterior::{ParameterPosterior, PosteriorParts};
use crate::rigid_body::prior::LOAD_STD;
use crate::samples::Samples;

/// Times that the load is found where friction grows with it.
const SOLVES: usize = 3;

impl ParameterPosterior {
    /// The posterior with a further context, whose load no row has seen.
    ///
    /// # Errors
    /// Numbers that overflow.
    pub fn with_context(&self, name: &str) -> Result<Self, TorqueError> {
        let parts = self.parts();
        let load = self.unknowns().n_loads();
        let unknowns = self.unknowns().with_loads(load + 1);
        let NormalEquations { h, b } = self.equations().grown(&unknowns);
        Self::new(PosteriorParts {
            contexts: parts
                .contexts
                .iter()
                .map(String::as_str)
                .chain([name])
                .map(str::to_owned)
                .collect(),
            loads: parts.loads.iter().copied().chain([Some(load)]).collect(),
            prior_std: parts.prior_std.iter().copied().chain(LOAD_STD).collect(),
            unknowns,
            h,
            b,
            ..parts.clone()
        })
    }

    /// The posterior whose one context, of data that name none, has a name.
    ///
    /// # Errors
    /// Numbers that overflow.
    pub fn with_first_context(&self, name: &str) -> Result<Self, TorqueError> {
        Self::new(PosteriorParts {
            contexts: vec![name.to_owned()],
            ..self.parts().clone()
        })
    }

    /// The posterior given rows of a context that it has, as if they had been there from the start with the noise
    /// that it has found.
    ///
    /// Each row counts 1/max(1, c/g) where rows are g steps of the training data apart.
    /// # Errors
    /// [`TorqueError::Log`] for times that do not rise, or terms with memory without times.
    pub fn given(&self, context: usize, samples: &Samples) -> Result<Self, TorqueError> {
        let steps = self.given_in_steps(context, samples)?;
        Ok(steps
            .into_iter()
            .next_back()
            .unwrap_or_else(|| self.clone()))
    }

    /// The same after each solution: friction that grows with the load is made from the one before.
    pub(crate) fn given_in_steps(
        &self,
        context: usize,
        samples: &Samples,
    ) -> Result<Vec<Self>, TorqueError> {
        let log = Log::new(samples)?;
        let parts = self.parts();
        let design = Design::new(&parts.robot, self.unknowns(), &parts.described, &log)?;
        let solves = if self.unknowns().have_load_friction() {
            SOLVES
        } else {
            1
        };
        let mut steps: Vec<Self> = Vec::new();
        for _ in 0..solves {
            let current = steps.last().unwrap_or(self);
            let equations = self.equations_given(&design, &log, context, current.mean());
            steps.push(self.with_equations(equations)?);
        }
        Ok(steps)
    }

    /// H and b with further rows, whose friction grows with the load at `mean`.
    fn equations_given(
        &self,
        design: &Design<'_>,
        log: &Log<'_>,
        context: usize,
        mean: &[f64],
    ) -> NormalEquations {
        let (unknowns, parts, load) = (self.unknowns(), self.parts(), self.load_of(context));
        let p = |joint| design.n_columns(joint);
        let empty = |joint| {
            (
                Mat::<f64>::zeros(p(joint), p(joint)),
                Mat::<f64>::zeros(p(joint), 1),
            )
        };
        let mut sums: Vec<_> = (0..unknowns.n_joints()).map(empty).collect();
        design.for_each(&mut sums, |(gram, moment), joint, panel| {
            let rows = &panel.joints[joint];
            let Some(learned) = parts.joints[joint]
                .as_ref()
                .filter(|of| of.is_seen && design.is_seen(joint))
            else {
                return;
            };
            let rigid = design.rigid(joint, rows, mean, load);
            let all: Vec<usize> = (0..rows.qd.len()).collect();
            let mut block = gathered(unknowns, rows.columns.as_ref(), &all, Some(&rigid));
            let spacing = log.spacing(&log.runs[panel.run], parts.step);
            let mut targets = Mat::from_fn(all.len(), 1, |row, _| rows.targets[row]);
            for (row, qd) in rows.qd.iter().enumerate() {
                let root = learned.noise.weighted_var_at(*qd, spacing).sqrt();
                block
                    .row_mut(row)
                    .iter_mut()
                    .for_each(|entry| *entry /= root);
                targets[(row, 0)] /= root;
            }
            linalg::add_inner_product(gram, 1.0, block.as_ref());
            *moment += linalg::product(block.transpose(), targets.as_ref());
        });
        let mut equations = self.equations();
        for (joint, (gram, moment)) in sums.iter().enumerate() {
            equations.add_block(unknowns, joint, load, gram.as_ref(), moment.as_ref());
        }
        equations
    }
}
