//! The multi-task process where contexts share inputs, without the block being complete.
//!
//! n observations of m contexts lie at ν < n distinct inputs; K^ρ = ΛΛᵀ with Λ (m, r). What is
//! observed at x_j is linear in the r latent functions there, so no more than r numbers about them:
//!
//! ```text
//! t_j = Λ_j z(x_j) + noise of covariance D_j       Λ_j (n_j, r): rows of Λ of the contexts seen at x_j
//! Ψ_j = D_j^{−½} Λ_j = O_j F_jᵀ                    O_j (n_j, k_j) orthonormal, F_j (r, k_j), k_j ≤ min(n_j, r)
//! y_j = O_jᵀ D_j^{−½} t_j,      ε_j = (I − O_j O_jᵀ) D_j^{−½} t_j
//! ```
//!
//! O_j rotates the whitened torques at x_j into k_j *pseudo-observations* y_j and a rest ε_j that is
//! independent noise of variance one. Pseudo-observation a, at input j(a), has loadings f_a ∈ R^r:
//!
//! ```text
//! C = I + B,   B_ab = f_aᵀf_b c^x(x_j(a), x_j(b))                (N, N), N = Σ_j k_j ≤ min(n, rν)
//! log p = log N(y | 0, C) − ½ Σ_j |ε_j|² − ½ (n − N) log 2π − ½ Σ_i log d_i
//! Σ⁻¹ = D^{−½} (O C⁻¹ Oᵀ + I − OOᵀ) D^{−½}
//! ```
//!
//! C is at least the identity, so its factor needs no jitter; the rest is a projection, so no two
//! large numbers are subtracted. With α = C⁻¹y, Q = αα′ − C⁻¹, β = Fα (ν, r) summed by input and
//! Z = K^x β the posterior means of the latent functions:
//!
//! ```text
//! ∂ log p = ½ Σ_ab Q_ab f_aᵀf_b ∂c^x(x_j(a), x_j(b))                          of θ^x
//! ∂ log p/∂Λ_γ = Σ_{i of γ} d_i^{−½} (O E + ε_i Z_j(i)),   E_a = Σ_b Q_ab c^x_ab f_b     (r,)
//! ∂ log p/∂d_γ = ½ Σ_{i of γ} d_i⁻¹ ((Oα + ε)_i² − (O C⁻¹Oᵀ)_ii − 1 + (OOᵀ)_ii)
//! ```
//!
//! # When it is worth it
//! N³ instead of n³: a complete block of m contexts gains (m/r)³, though for that
//! [`crate::CompleteBlock`] is faster by far. It is for logs in which contexts were driven through the
//! same set points but some runs are missing or short. Where nearly every input is distinct, as with
//! random subsets of trajectories, N ≈ n and nothing is gained; N is never larger than n. Inputs must
//! be equal to the last bit to count as repeated.
//!
//! Source: eqs. (8), (16) and (17) with K^ρ = ΛΛᵀ; the reduction is that of Higdon, Gattiker, Williams
//! & Rightley 2008, "Computer model calibration using high-dimensional output", sec. 2.2, taken input
//! by input.

use std::f64::consts::PI;

use faer::{Mat, MatRef};
use gp_core::{GpError, Prediction};
use kernels::Covariance;
use linalg::{Factor, product, thin_svd};

use crate::error::{MtgpError, require_count};
use crate::structured_prediction::{TaskPosterior, dot, require_finite_inputs, require_noise};

/// Torques of several tasks at inputs that some of them share.
#[derive(Debug, Clone, Copy)]
pub struct SharedObservations<'a> {
    /// The distinct inputs, (ν, d).
    pub x: MatRef<'a, f64>,
    /// Which input each observation is at, (n,).
    pub input_idx: &'a [usize],
    /// Which task each observation is of, (n,).
    pub tasks: &'a [usize],
    /// The observed torques, (n,), N·m.
    pub targets: &'a [f64],
}

/// A multi-task process conditioned on observations at shared inputs.
///
/// # Source
/// Eqs. (16) and (17).
#[derive(Debug, Clone)]
pub struct RepeatedInputs<C> {
    covariance: C,
    x: Mat<f64>,
    lambda: Mat<f64>,
    noise_std: Vec<f64>,
    tasks: Vec<usize>,
    groups: Vec<Group>,
    pseudo: Pseudo,
    /// c^x at the distinct inputs, (ν, ν).
    k_x: Mat<f64>,
    /// Of C, (N, N).
    factor: Factor,
    /// α = C⁻¹y, (N,).
    alpha: Vec<f64>,
    /// yᵀC⁻¹y.
    quadratic: f64,
}

/// Gradient of the log marginal likelihood of [`RepeatedInputs`].
#[derive(Debug, Clone)]
pub struct FactorGradient {
    /// ∂/∂θ^x, in the order of the covariance's layout.
    pub theta: Vec<f64>,
    /// ∂/∂Λ of every entry, (m, r), also of entries that a caller holds at zero.
    pub lambda: Mat<f64>,
    /// ∂/∂σ_γ, (m,); their sum is the derivative by a noise level that all tasks share.
    pub noise_std: Vec<f64>,
}

/// The observations at one input.
#[derive(Debug, Clone)]
struct Group {
    /// Their indices, (n_j,).
    observations: Vec<usize>,
    /// Index of the first of its k_j pseudo-observations.
    first: usize,
    /// O_j, (n_j, k_j).
    rotation: Mat<f64>,
    /// ε_j, (n_j,).
    rest: Vec<f64>,
}

/// All pseudo-observations.
#[derive(Debug, Clone)]
struct Pseudo {
    /// f_a, one per row, (N, r).
    loadings: Mat<f64>,
    /// j(a), (N,).
    input_idx: Vec<usize>,
    /// y, (N,).
    targets: Vec<f64>,
}

impl<C: Covariance> RepeatedInputs<C> {
    /// Conditions on observations at shared inputs.
    ///
    /// # Shapes
    /// `lambda` Λ (m, r); `noise_std` σ (m,), the same number m times for noise that is shared.
    /// # Errors
    /// [`GpError`] for data that is missing or not finite and σ that is not positive;
    /// [`MtgpError::UnknownTask`], [`MtgpError::CountMismatch`];
    /// [`MtgpError::NoSpectrum`] or [`GpError::NotPositiveDefinite`] for hyperparameters that are not finite.
    /// # Panics
    /// If `noise_std` does not have one entry per row of `lambda`, an `input_idx` is out of range, or
    /// `x` does not have the columns that the covariance needs.
    pub fn new(
        covariance: C,
        lambda: MatRef<'_, f64>,
        noise_std: &[f64],
        observations: SharedObservations<'_>,
    ) -> Result<Self, MtgpError> {
        assert_eq!(lambda.nrows(), noise_std.len());
        require_noise(noise_std)?;
        require_observations(&observations, noise_std.len())?;
        let (groups, pseudo) = compress(lambda, noise_std, &observations)?;

        let k_x = covariance.gram(observations.x); // (ν, ν)
        let mut c = product(pseudo.loadings.as_ref(), pseudo.loadings.transpose()); // (N, N)
        for (col, at_col) in pseudo.input_idx.iter().enumerate() {
            for (row, at_row) in pseudo.input_idx.iter().enumerate() {
                c[(row, col)] *= k_x[(*at_row, *at_col)];
            }
            c[(col, col)] += 1.0;
        }
        let factor = Factor::new(c)?;
        let (quadratic, alpha) = factor.quadratic_form_and_solve(&pseudo.targets);
        Ok(Self {
            covariance,
            x: observations.x.to_owned(),
            lambda: lambda.to_owned(),
            noise_std: noise_std.to_vec(),
            tasks: observations.tasks.to_vec(),
            groups,
            pseudo,
            k_x,
            factor,
            alpha,
            quadratic,
        })
    }

    /// Order N ≤ min(n, rν) of the matrix that is factorised.
    pub fn order(&self) -> usize {
        self.factor.order()
    }

    /// The log marginal likelihood, natural log, summed over all n observations.
    ///
    /// # Errors
    /// [`GpError::NonFiniteLikelihood`] if it overflows.
    /// # Source
    /// Eq. (8) with the covariance of eq. (16).
    pub fn log_marginal_likelihood(&self) -> Result<f64, MtgpError> {
        let n_samples = self.tasks.len();
        let rest: f64 = (self.groups.iter())
            .map(|group| dot(&group.rest, &group.rest))
            .sum();
        let log_det_noise: f64 = (self.tasks.iter())
            .map(|&task| 2.0 * self.noise_std[task].ln())
            .sum();
        let log_det = self.factor.log_det() + log_det_noise;
        let value = -0.5 * (self.quadratic + rest + log_det + n_samples as f64 * (2.0 * PI).ln());
        if value.is_finite() {
            return Ok(value);
        }
        Err(GpError::NonFiniteLikelihood { n_samples }.into())
    }

    /// Its gradient with respect to θ^x, Λ and every σ_γ.
    pub fn gradient(&self) -> FactorGradient {
        let inverse = self.inverse(); // C⁻¹, (N, N)
        let adjoint = Mat::from_fn(self.order(), self.order(), |row, col| {
            self.alpha[row] * self.alpha[col] - inverse[(row, col)]
        }); // Q, (N, N)
        FactorGradient {
            theta: self.gradient_of_theta(&adjoint),
            lambda: self.gradient_of_lambda(&adjoint),
            noise_std: self.gradient_of_noise(&inverse),
        }
    }

    /// Posterior mean and latent variance of one context's torque at the rows of `x_test`.
    ///
    /// ```text
    /// mean = Σ_a (λ_γᵀf_a) c(x*, x_j(a)) α_a
    /// var  = |λ_γ|² c(x*, x*) − wᵀC⁻¹w,      w_a = (λ_γᵀf_a) c(x*, x_j(a))
    /// ```
    /// λ_γ is row γ of Λ. Add σ_γ² to the variance for that of a new observation.
    /// # Errors
    /// [`GpError::WrongCovariates`] or [`GpError::NonFiniteInput`].
    /// # Panics
    /// If there is no such task.
    /// # Source
    /// Eqs. (16) and (17); the variance by eq. (4).
    pub fn predict(&self, task: usize, x_test: MatRef<'_, f64>) -> Result<Prediction, MtgpError> {
        let row = self.lambda.subrows(task, 1); // (1, r)
        let along = product(self.pseudo.loadings.as_ref(), row.transpose()); // (N, 1)
        let along = along.col_as_slice(0);
        let mut mean_weights = vec![0.0; self.x.nrows()];
        for ((at, alpha), loading) in self.pseudo.input_idx.iter().zip(&self.alpha).zip(along) {
            mean_weights[*at] += loading * alpha;
        }
        let posterior = TaskPosterior {
            covariance: &self.covariance,
            x: self.x.as_ref(),
            mean_weights,
            prior_scale: row.squared_norm_l2(),
        };
        let explained = |k_xs: &mut Mat<f64>| {
            let mut w = Mat::from_fn(self.order(), k_xs.ncols(), |a, col| {
                along[a] * k_xs[(self.pseudo.input_idx[a], col)]
            });
            self.factor.half_solve_in_place(w.as_mut());
            let squared = |col| dot(w.col_as_slice(col), w.col_as_slice(col));
            (0..w.ncols()).map(squared).collect()
        };
        Ok(posterior.predict(x_test, explained)?)
    }

    /// C⁻¹, (N, N), both triangles.
    fn inverse(&self) -> Mat<f64> {
        let order = self.order();
        let mut inverse = self
            .factor
            .clone()
            .into_inverse(&mut Mat::zeros(order, order));
        for col in 1..order {
            for row in 0..col {
                inverse[(row, col)] = inverse[(col, row)];
            }
        }
        inverse
    }

    /// ½ Σ_ab Q_ab f_aᵀf_b ∂c^x_ab, by way of an adjoint of (ν, ν).
    fn gradient_of_theta(&self, adjoint: &Mat<f64>) -> Vec<f64> {
        let loadings = &self.pseudo.loadings;
        let between = product(loadings.as_ref(), loadings.transpose()); // (N, N)
        let mut of_inputs = Mat::zeros(self.x.nrows(), self.x.nrows());
        for (col, at_col) in self.pseudo.input_idx.iter().enumerate() {
            for (row, at_row) in self.pseudo.input_idx.iter().enumerate() {
                of_inputs[(*at_row, *at_col)] += 0.5 * adjoint[(row, col)] * between[(row, col)];
            }
        }
        let mut theta = vec![0.0; self.covariance.n_params()];
        self.covariance
            .gram_adjoint(self.x.as_ref(), of_inputs.as_ref(), &mut theta);
        theta
    }

    /// ∂/∂Λ, (m, r).
    fn gradient_of_lambda(&self, adjoint: &Mat<f64>) -> Mat<f64> {
        let (at, loadings) = (&self.pseudo.input_idx, &self.pseudo.loadings);
        let weighted = Mat::from_fn(self.order(), self.order(), |row, col| {
            adjoint[(row, col)] * self.k_x[(at[row], at[col])]
        });
        let pulls = product(weighted.as_ref(), loadings.as_ref()); // E, (N, r)
        let latent = self.latent_means(); // Z, (ν, r)

        let r = self.lambda.ncols();
        let mut gradient = Mat::zeros(self.lambda.nrows(), r);
        for (input, group) in self.groups.iter().enumerate() {
            let rotated = product(
                group.rotation.as_ref(),
                pulls.subrows(group.first, group.rotation.ncols()),
            ); // (n_j, r)
            for (local, &observation) in group.observations.iter().enumerate() {
                let task = self.tasks[observation];
                for c in 0..r {
                    let pull = rotated[(local, c)] + group.rest[local] * latent[(input, c)];
                    gradient[(task, c)] += pull / self.noise_std[task];
                }
            }
        }
        gradient
    }

    /// Posterior means of the r latent functions at the distinct inputs, (ν, r).
    fn latent_means(&self) -> Mat<f64> {
        let mut weights = Mat::zeros(self.x.nrows(), self.lambda.ncols()); // β
        for (a, (at, alpha)) in self.pseudo.input_idx.iter().zip(&self.alpha).enumerate() {
            for c in 0..self.lambda.ncols() {
                weights[(*at, c)] += self.pseudo.loadings[(a, c)] * alpha;
            }
        }
        product(self.k_x.as_ref(), weights.as_ref())
    }

    /// ∂/∂σ_γ, (m,).
    fn gradient_of_noise(&self, inverse: &Mat<f64>) -> Vec<f64> {
        let mut gradient = vec![0.0; self.noise_std.len()];
        for group in &self.groups {
            let k = group.rotation.ncols();
            let block = inverse.submatrix(group.first, group.first, k, k);
            let rotated = product(group.rotation.as_ref(), block); // OC⁻¹, (n_j, k_j)
            for (local, &observation) in group.observations.iter().enumerate() {
                let task = self.tasks[observation];
                let (mut weight, mut kept) = (group.rest[local], -1.0);
                for a in 0..k {
                    let o = group.rotation[(local, a)];
                    weight += o * self.alpha[group.first + a];
                    kept += o * (o - rotated[(local, a)]);
                }
                gradient[task] += (weight * weight + kept) / self.noise_std[task];
            }
        }
        gradient
    }
}

/// Fails on observations that are missing, not finite, or of an unknown task.
fn require_observations(
    observations: &SharedObservations<'_>,
    n_tasks: usize,
) -> Result<(), MtgpError> {
    let SharedObservations {
        x,
        input_idx,
        tasks,
        targets,
    } = observations;
    let expected = targets.len();
    for (what, found) in [("input indices", input_idx.len()), ("tasks", tasks.len())] {
        require_count(what, found, expected)?;
    }
    if expected == 0 {
        return Err(GpError::TooFewSamples {
            n_samples: 0,
            needed: 1,
        }
        .into());
    }
    require_finite_inputs(*x)?;
    for (row, (&task, &value)) in tasks.iter().zip(*targets).enumerate() {
        if task >= n_tasks {
            return Err(MtgpError::UnknownTask { row, task, n_tasks });
        }
        if !value.is_finite() {
            return Err(GpError::NonFiniteTarget { row, value }.into());
        }
    }
    Ok(())
}

/// Rotates the whitened observations at every input into pseudo-observations and a rest.
fn compress(
    lambda: MatRef<'_, f64>,
    noise_std: &[f64],
    observations: &SharedObservations<'_>,
) -> Result<(Vec<Group>, Pseudo), MtgpError> {
    let mut members = vec![Vec::new(); observations.x.nrows()];
    for (observation, &at) in observations.input_idx.iter().enumerate() {
        members[at].push(observation);
    }
    let r = lambda.ncols();
    let (mut groups, mut rows) = (Vec::with_capacity(members.len()), Vec::new());
    let (mut input_idx, mut targets) = (Vec::new(), Vec::new());
    for (input, members) in members.into_iter().enumerate() {
        let std = |local: usize| noise_std[observations.tasks[members[local]]];
        let psi = Mat::from_fn(members.len(), r, |local, c| {
            lambda[(observations.tasks[members[local]], c)] / std(local)
        });
        let (rotation, loadings) = rotate(psi.as_ref())?;
        let whitened = Mat::from_fn(members.len(), 1, |local, _| {
            observations.targets[members[local]] / std(local)
        });
        let y = product(rotation.transpose(), whitened.as_ref()); // (k_j, 1)
        let rest = &whitened - product(rotation.as_ref(), y.as_ref()); // (n_j, 1)

        let k = rotation.ncols();
        groups.push(Group {
            first: targets.len(),
            rest: rest.col_as_slice(0).to_vec(),
            observations: members,
            rotation,
        });
        input_idx.extend(std::iter::repeat_n(input, k));
        targets.extend_from_slice(y.col_as_slice(0));
        rows.push(loadings);
    }
    let mut loadings = Mat::zeros(targets.len(), r);
    for (group, rows) in groups.iter().zip(&rows) {
        (loadings.subrows_mut(group.first, rows.nrows())).copy_from(rows);
    }
    let pseudo = Pseudo {
        loadings,
        input_idx,
        targets,
    };
    Ok((groups, pseudo))
}

/// O (n_j, k) and Fᵀ (k, r) of Ψ = O Fᵀ, with k the numerical rank of Ψ.
fn rotate(psi: MatRef<'_, f64>) -> Result<(Mat<f64>, Mat<f64>), MtgpError> {
    let svd = thin_svd(psi)?;
    // What is left out changes B by ε² of its size.
    let smallest = f64::EPSILON * svd.values.first().copied().unwrap_or(0.0);
    let rank = svd.values.iter().filter(|value| **value > smallest).count();
    let loadings = Mat::from_fn(rank, psi.ncols(), |a, c| svd.values[a] * svd.right[(c, a)]);
    Ok((svd.left.subcols(0, rank).to_owned(), loadings))
}
