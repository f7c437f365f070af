//! A new load, or more rows of a known one: the same posterior given further rows.

use faer::Mat;
use linalg::{add_inner_product, product};

use crate::error::TorqueError;
use crate::rigid_body::design::Design;
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
            contexts: [parts.contexts.as_slice(), &[name.to_owned()]].concat(),
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
        let mut steps = self.given_in_steps(context, samples)?;
        Ok(steps.pop().unwrap_or_else(|| self.clone()))
    }

    /// The same after each solution: friction that grows with the load is made from the one before.
    pub(crate) fn given_in_steps(
        &self,
        context: usize,
        samples: &Samples,
    ) -> Result<Vec<Self>, TorqueError> {
        let log = Log::new(samples)?;
        self.given_rows(context, &self.design(&log)?)
    }

    /// The same of rows that are equations already.
    pub(crate) fn given_rows(
        &self,
        context: usize,
        design: &Design<'_>,
    ) -> Result<Vec<Self>, TorqueError> {
        let solves = if self.unknowns().have_load_friction() {
            SOLVES
        } else {
            1
        };
        let mut steps: Vec<Self> = Vec::new();
        for _ in 0..solves {
            let current = steps.last().unwrap_or(self);
            let equations = self.equations_given(design, context, current.mean());
            steps.push(self.with_equations(equations)?);
        }
        Ok(steps)
    }

    /// H and b with further rows, whose friction grows with the load at `mean`.
    fn equations_given(
        &self,
        design: &Design<'_>,
        context: usize,
        mean: &[f64],
    ) -> NormalEquations {
        let (unknowns, load) = (self.unknowns(), self.load_of(context));
        let empty = |joint| {
            let p = design.n_columns(joint);
            (Mat::<f64>::zeros(p, p), Mat::<f64>::zeros(p, 1))
        };
        let mut sums: Vec<_> = (0..unknowns.n_joints()).map(empty).collect();
        design.for_each(&mut sums, |(gram, moment), joint, panel| {
            let Some(rows) = self.new_rows(design, (joint, panel), load, mean) else {
                return;
            };
            let targets = Mat::from_fn(rows.vars.len(), 1, |row, _| {
                rows.panel.targets[row] / rows.vars[row].sqrt()
            });
            add_inner_product(gram, 1.0, rows.columns.as_ref());
            *moment += product(rows.columns.transpose(), targets.as_ref());
        });
        let mut equations = self.equations();
        for (joint, (gram, moment)) in sums.iter().enumerate() {
            equations.add_block(unknowns, joint, load, gram.as_ref(), moment.as_ref());
        }
        equations
    }
}
