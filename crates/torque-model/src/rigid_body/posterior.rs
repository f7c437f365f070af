//! The posterior of a robot's parameters: one normal of all joints and loads together.

use std::sync::Arc;

use faer::Mat;
use linalg::Factor;
use puma_dyn::Model;

use crate::error::TorqueError;
use crate::rigid_body::noise::JointNoise;
use crate::rigid_body::normal_equations::NormalEquations;
use crate::rigid_body::term_set::TermSet;
use crate::rigid_body::unknowns::Unknowns;

/// What is learned of a joint beside the parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct LearnedJoint {
    /// The friction terms that it keeps.
    pub terms: TermSet,
    /// Its noise.
    pub noise: JointNoise,
    /// Whether rows of it counted; without, its friction is not known and its noise is that of its standing torques.
    pub is_seen: bool,
}

/// What a posterior is made of.
#[derive(Debug, Clone)]
pub struct PosteriorParts {
    /// The robot of the description.
    pub robot: Arc<Model>,
    /// The unknowns, in their order.
    pub unknowns: Unknowns,
    /// π₀, (10 ℓ,).
    pub described: Vec<f64>,
    /// Names of the contexts; none where the data name none.
    pub contexts: Vec<String>,
    /// Number of each context's load; `None` for one that carries nothing. One entry for each context, or for all data.
    pub loads: Vec<Option<usize>>,
    /// S: standard deviations of the prior, (p,); an unknown with zero is fixed at its mean.
    pub prior_std: Vec<f64>,
    /// H, (p, p).
    pub h: Mat<f64>,
    /// b, (p,).
    pub b: Vec<f64>,
    /// Of every joint; `None` for those without torques.
    pub joints: Vec<Option<LearnedJoint>>,
    /// Median step of the training data, s.
    pub step: Option<f64>,
}

/// Normal posterior of the unknowns w.
///
/// ```text
/// w = (H + S⁻²)⁻¹ b = S M⁻¹ S b,   cov = S M⁻¹ S,   M = S H S + 1 = LLᵀ
/// ```
#[derive(Debug, Clone)]
pub struct ParameterPosterior {
    parts: PosteriorParts,
    factor: Factor,
    mean: Vec<f64>,
}

impl ParameterPosterior {
    /// Solves the normal equations.
    ///
    /// # Errors
    /// [`TorqueError::InconsistentModel`] for parts that do not fit together; numbers that overflow.
    pub fn new(parts: PosteriorParts) -> Result<Self, TorqueError> {
        let std = &parts.prior_std;
        let p = parts.unknowns.len();
        let fits =
            std.len() == p && parts.b.len() == p && parts.h.nrows() == p && parts.h.ncols() == p;
        crate::error::consistent((!fits).then(|| format!("equations of other than {p} unknowns")))?;
        let matrix = Mat::from_fn(p, p, |row, col| {
            let unit = if row == col { 1.0 } else { 0.0 };
            std[row] * parts.h[(row, col)] * std[col] + unit
        });
        let factor = Factor::new(matrix).map_err(gp_core::GpError::from)?;
        let scaled: Vec<f64> = parts.b.iter().zip(std).map(|(b, std)| std * b).collect();
        let solved = factor.solve(&scaled);
        let mean = solved.iter().zip(std).map(|(w, std)| std * w).collect();
        Ok(Self {
            parts,
            factor,
            mean,
        })
    }

    /// The posterior of other equations about the same unknowns.
    pub(crate) fn with_equations(&self, equations: NormalEquations) -> Result<Self, TorqueError> {
        let NormalEquations { h, b } = equations;
        Self::new(PosteriorParts {
            h,
            b,
            ..self.parts.clone()
        })
    }

    /// The same with other noise; the parameters stay.
    pub(crate) fn with_joints(&self, joints: Vec<Option<LearnedJoint>>) -> Self {
        let mut same = self.clone();
        same.parts.joints = joints;
        same
    }

    /// All that it is made of.
    pub fn parts(&self) -> &PosteriorParts {
        &self.parts
    }

    /// The unknowns.
    pub fn unknowns(&self) -> &Unknowns {
        &self.parts.unknowns
    }

    /// Posterior mean ŵ, (p,).
    pub fn mean(&self) -> &[f64] {
        &self.mean
    }

    /// Normal equations of the data, H and b.
    pub(crate) fn equations(&self) -> NormalEquations {
        NormalEquations {
            h: self.parts.h.clone(),
            b: self.parts.b.clone(),
        }
    }

    /// Number of a context's load; `None` for one that carries nothing.
    pub fn load_of(&self, context: usize) -> Option<usize> {
        self.parts.loads[context]
    }

    /// Number of contexts; one where the data name none.
    pub fn n_contexts(&self) -> usize {
        self.parts.loads.len()
    }

    /// π̂ + Eψ̂ in a context, (10 ℓ,).
    pub fn body_parameters(&self, context: usize) -> Vec<f64> {
        self.body_parameters_with(self.load_of(context))
    }

    /// π̂ + Eψ̂ with a load, (10 ℓ,).
    pub fn body_parameters_with(&self, load: Option<usize>) -> Vec<f64> {
        let unknowns = self.unknowns();
        let described = self.parts.described.iter();
        let mut parameters: Vec<f64> = described
            .zip(&self.mean)
            .map(|(known, change)| known + change)
            .collect();
        if let Some(load) = load {
            let of_load = &self.mean[unknowns.load(load)];
            let carrier = parameters[unknowns.carrier()].iter_mut();
            carrier
                .zip(of_load)
                .for_each(|(parameter, psi)| *parameter += psi);
        }
        parameters
    }

    /// L⁻¹ S of some unknowns, (p, k): the inner product of two columns is their covariance.
    pub fn root_of(&self, unknowns: &[usize]) -> Mat<f64> {
        let mut root = Mat::zeros(self.mean.len(), unknowns.len());
        for (col, unknown) in unknowns.iter().enumerate() {
            root[(*unknown, col)] = self.parts.prior_std[*unknown];
        }
        self.factor.half_solve_in_place(root.as_mut());
        root
    }

    /// Covariances of some unknowns, (k, k).
    pub fn covariance_of(&self, unknowns: &[usize]) -> Mat<f64> {
        let root = self.root_of(unknowns);
        linalg::product(root.transpose(), root.as_ref())
    }

    /// Standard deviations of all unknowns, (p,).
    pub fn std(&self) -> Vec<f64> {
        let all: Vec<usize> = (0..self.mean.len()).collect();
        let root = self.root_of(&all);
        root.col_iter().map(|column| column.norm_l2()).collect()
    }
}
