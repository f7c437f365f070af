//! Which load a stretch of a log was measured with: the evidence of each, and of one that is not known.

use std::f64::consts::PI;

use faer::{ColRef, Mat};
use linalg::{Factor, mirror, product};

use crate::error::TorqueError;
use crate::rigid_body::design::Design;
use crate::rigid_body::log::Log;
use crate::rigid_body::posterior::ParameterPosterior;
use crate::samples::Samples;

/// Name that the load that is not known has while its evidence is computed.
const UNKNOWN: &str = "unknown";

/// Log evidence of a stretch under each context and under an unknown load.
#[derive(Debug, Clone, PartialEq)]
pub struct LoadEvidence {
    /// Of each context, natural log, (contexts,).
    pub of_contexts: Vec<f64>,
    /// Of a load that is none of them.
    pub of_unknown: f64,
}

impl LoadEvidence {
    /// Probabilities of each context and of an unknown load, all equally probable beforehand.
    #[must_use]
    pub fn probabilities(&self) -> (Vec<f64>, f64) {
        let all = self.of_contexts.iter().chain([&self.of_unknown]);
        let largest = all.clone().copied().fold(f64::NEG_INFINITY, f64::max);
        let weights: Vec<f64> = all.map(|log| (log - largest).exp()).collect();
        let total: f64 = weights.iter().sum();
        let mut probabilities: Vec<f64> = weights.iter().map(|weight| weight / total).collect();
        let unknown = probabilities.pop().unwrap_or_default();
        (probabilities, unknown)
    }
}

/// Rows of a joint, standardised by the noise, with their residuals and the sum of their log variances.
#[derive(Default)]
struct OfJoint {
    blocks: Vec<Mat<f64>>,
    residuals: Vec<f64>,
    log_var: f64,
}

impl ParameterPosterior {
    /// Evidence of a stretch of rows under each context and under an unknown load.
    ///
    /// ```text
    /// log N(ỹ − Aŵ | 0, A cov Aᵀ + D),   D = diag max(1, c/g) σ² h²
    /// ```
    /// The rows that count of all joints together; what the stretch tells is not kept.
    /// # Errors
    /// [`TorqueError::Log`] as for a fit; rows that leave no joint anything to compare.
    pub fn load_evidence(&self, samples: &Samples) -> Result<LoadEvidence, TorqueError> {
        let log = Log::new(samples)?;
        // A further load stands behind all others, so that the same equations serve with it and without.
        let grown = self.with_context(UNKNOWN)?;
        let design = grown.design(&log)?;
        let of_context = |context| self.evidence(&design, self.load_of(context), self.mean());
        let of_contexts = (0..self.n_contexts())
            .map(of_context)
            .collect::<Result<_, _>>()?;
        let context = grown.n_contexts() - 1;
        let learned = grown.given_rows(context, &design)?;
        let mean = learned.last().map_or(grown.mean(), Self::mean);
        let of_unknown = grown.evidence(&design, grown.load_of(context), mean)?;
        Ok(LoadEvidence {
            of_contexts,
            of_unknown,
        })
    }

    /// Under a load; `mean` says how large the friction is that grows with it.
    fn evidence(
        &self,
        design: &Design<'_>,
        load: Option<usize>,
        mean: &[f64],
    ) -> Result<f64, TorqueError> {
        let unknowns = self.unknowns();
        let mut of_joints: Vec<OfJoint> = (0..unknowns.n_joints())
            .map(|_| OfJoint::default())
            .collect();
        design.for_each(&mut of_joints, |of, joint, panel| {
            let Some(rows) = self.new_rows(design, (joint, panel), load, mean) else {
                return;
            };
            let residuals =
                design.residuals(joint, rows.panel, self.mean(), load, Some(&rows.rigid));
            for (residual, var) in residuals.iter().zip(&rows.vars) {
                of.residuals.push(residual / var.sqrt());
                of.log_var += var.ln();
            }
            of.blocks.push(rows.columns);
        });
        // V = D^-½ A S L⁻ᵀ: the determinant lemma needs 1 + VᵀV, (p, p), whatever the number of rows.
        let p = unknowns.len();
        let (mut inner, mut projected) = (Mat::<f64>::identity(p, p), vec![0.0; p]);
        let (mut square, mut log_var, mut n) = (0.0, 0.0, 0.0);
        for (joint, of) in of_joints.iter().enumerate() {
            let root = self.joint_root(joint, load);
            let mut first = 0;
            for block in &of.blocks {
                let rows = product(block.as_ref(), root.transpose());
                let residuals = &of.residuals[first..first + block.nrows()];
                first += block.nrows();
                linalg::add_inner_product(&mut inner, 1.0, rows.as_ref());
                let moment = product(rows.transpose(), ColRef::from_slice(residuals).as_mat());
                projected
                    .iter_mut()
                    .zip(moment.col(0).iter())
                    .for_each(|(sum, part)| *sum += part);
            }
            square += of.residuals.iter().map(|r| r * r).sum::<f64>();
            log_var += of.log_var;
            n += of.residuals.len() as f64;
        }
        mirror(&mut inner);
        let factor = Factor::new(inner).map_err(gp_core::GpError::from)?;
        let (explained, _) = factor.quadratic_form_and_solve(&projected);
        Ok(-0.5 * (square - explained + log_var + factor.log_det() + n * (2.0 * PI).ln()))
    }
}
