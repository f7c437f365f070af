//! One Gaussian process at one state: the squared exponential on basis points, the rest in weights.
//!
//! ```text
//! mean(x*) = k_B(x*)ᵀ β,   k_B(x*) = c(B, x*),   φ = L⁻¹ k_B(x*)
//! var(x*) = c(x*, x*) − |φ|²                      samples as the basis
//! var(x*) = (c(x*, x*) − |φ|²)₊ + σ² |R⁻ᵀ φ|²     pivots of a low-rank K̂ as the basis
//! ```
//! A process of several contexts is one whose covariance with each basis point is scaled by a number
//! that depends on the context asked for; one with the parameters of a rigid body has a covariance
//! that is linear in Y(x) beside that of eq. (7). Everything else is shared.

use faer::MatRef;
use gp_core::Posterior;
use gp_core::fit::RigidBodyAndProcess;
use kernels::{ContinuousJoints, Covariance, TorqueCovariance, sgn};
use linalg::sums::{dot_compensated, dot_pairwise};
use linalg::{PackedLower, exp_in_place};
use mtgp::prior::{TaskMatrix, split};

use crate::predictor::regressor::{ParameterTerms, Parameters};
use crate::process::{Process, TaskProcess};
use crate::rows::{RegressorRows, States};

/// How the covariance of eq. (7) is scaled in one context.
///
/// ```text
/// c(p, x) = s_p c^x(p, x) for basis point p,   c(x, x) = s c^x(x, x)
/// ```
#[derive(Debug, Clone)]
struct Scaling {
    /// s_p, (r,).
    of_points: Vec<f64>,
    /// s.
    of_prior: f64,
}

/// What differs between contexts.
#[derive(Debug, Clone)]
struct View {
    folded: Folded,
    /// v² s_p β_p, (r,).
    signal_weights: Vec<f64>,
    /// None if all are one.
    scaling: Option<Scaling>,
}

impl View {
    fn new(
        terms: &Terms,
        points: &[f64],
        signs: &[f64],
        weights: &[f64],
        scaling: Option<Scaling>,
    ) -> Self {
        let scaled: Vec<f64> = match &scaling {
            None => weights.to_vec(),
            Some(scaling) => (weights.iter().zip(&scaling.of_points))
                .map(|(weight, scale)| weight * scale)
                .collect(),
        };
        Self {
            folded: Folded::new(terms, points, signs, &scaled),
            signal_weights: (scaled.iter())
                .map(|weight| terms.signal_var * weight)
                .collect(),
            scaling,
        }
    }

    fn scale_prior(&self, variance: f64) -> f64 {
        let scaling = self.scaling.as_ref();
        scaling.map_or(variance, |scaling| scaling.of_prior * variance)
    }
}

/// Prior variances of the terms of eq. (7) and the exponents' factors, in the form the loop uses.
#[derive(Debug, Clone)]
struct Terms {
    bias_var: f64,
    linear_var: Vec<f64>, // (d,) for the d columns of embedded states
    signal_var: f64,
    half_precision: Vec<f64>, // (d,) −1/(2 l_j²)
    coulomb_var: Vec<f64>,    // (ℓ,), or empty for GP¬c
}

/// The mean's part that is linear in (1, x, sgn q̇).
#[derive(Debug, Clone)]
struct Folded {
    bias: f64,
    linear: Vec<f64>,  // (d,)
    coulomb: Vec<f64>, // (ℓ,), or empty
}

/// A process ready to be asked at one state, in each of its contexts.
#[derive(Debug, Clone)]
pub(crate) struct ProcessPredictor {
    continuous: ContinuousJoints,
    terms: Terms,
    views: Vec<View>,
    points: Vec<f64>, // (r, d), column after column
    signs: Vec<f64>,  // (r, ℓ), column after column, or empty
    l: PackedLower,
    noise: Option<(PackedLower, f64)>,
    rigid_body: Option<(Parameters, ParameterTerms)>,
}

impl ProcessPredictor {
    /// Of a process of one context.
    pub fn of_states(process: &Process<TorqueCovariance, States>) -> Self {
        let posterior = &process.posterior;
        let points = posterior.basis().points.as_ref();
        Self::new(posterior, posterior.covariance(), points, vec![None])
    }

    /// Of a process of several contexts, with a scaling for each.
    ///
    /// ```text
    /// c((p, δ), (x, γ)) = (K^ρ)_γδ c^x(p, x)
    /// ```
    pub fn of_tasks(process: &TaskProcess) -> Self {
        let covariance = process.covariance();
        let k_task = covariance.task().k_task();
        let rows = process.posterior.basis().points.as_ref();
        let (points, tasks) = split(rows, covariance.n_tasks());
        let scaling = |task: usize| Scaling {
            of_points: tasks.iter().map(|&other| k_task[(other, task)]).collect(),
            of_prior: k_task[(task, task)],
        };
        let scalings = (0..covariance.n_tasks()).map(scaling).map(Some);
        let input = covariance.input();
        Self::new(&process.posterior, input, points, scalings.collect())
    }

    /// Of a process on what a rigid body leaves, and of that.
    pub fn of_rigid_body(process: &Process<RigidBodyAndProcess, RegressorRows>) -> Self {
        let (posterior, rows) = (&process.posterior, &process.rows);
        let covariance = posterior.covariance();
        let (input, spread) = (
            covariance.first().inner(),
            covariance.second().inner().spread(),
        );
        let points = posterior.basis().points.as_ref();
        let states = points.subcols(0, 3 * input.n_joints());
        Self {
            rigid_body: Some(Parameters::new(posterior, rows, spread)),
            ..Self::new(posterior, input, states, vec![None])
        }
    }

    /// # Shapes
    /// `points` (r, 3ℓ), the states of the basis points of `posterior`.
    fn new<C: Covariance>(
        posterior: &Posterior<C>,
        input: &TorqueCovariance,
        points: MatRef<'_, f64>,
        scalings: Vec<Option<Scaling>>,
    ) -> Self {
        let (basis, n_joints) = (posterior.basis(), input.n_joints());
        let terms = Terms::of(input);
        let noise_var = posterior.noise_std() * posterior.noise_std();
        let continuous = input.continuous();
        let embedded = continuous.embed(points);
        let points = embedded.as_ref();
        let velocities = points.subcols(n_joints, terms.coulomb_var.len());
        let points = columns_of(points);
        let signs: Vec<f64> = columns_of(velocities).into_iter().map(sgn).collect();
        let view = |scaling| View::new(&terms, &points, &signs, &basis.weights, scaling);
        Self {
            continuous: continuous.clone(),
            views: scalings.into_iter().map(view).collect(),
            terms,
            points,
            signs,
            l: PackedLower::of(basis.factor.l()),
            noise: (basis.noise_factor.as_ref())
                .map(|r| (PackedLower::of(r.transpose()), noise_var)),
            rigid_body: None,
        }
    }

    /// Number of basis points r.
    pub fn n_points(&self) -> usize {
        self.l.order()
    }

    /// Number of columns d of embedded states.
    pub fn n_embedded(&self) -> usize {
        self.terms.half_precision.len()
    }

    /// Number of columns of Y that it depends on.
    pub fn n_parameters(&self) -> usize {
        (self.rigid_body.as_ref()).map_or(0, |(parameters, _)| parameters.n_columns())
    }

    /// Mean and latent variance at x in a context.
    ///
    /// # Shapes
    /// `signs` sgn q̇, (ℓ,); `of_joint` the joint's row of Y where there is a rigid body; scratch of d entries, of r
    /// entries twice, and one for each column of Y.
    pub fn predict(
        &self,
        view: usize,
        (x, signs, of_joint): (&[f64], &[f64], &[f64]),
        z: &mut [f64],
        correlations: &mut [f64],
        k: &mut [f64],
        y: &mut [f64],
    ) -> (f64, f64) {
        self.continuous.embed_state(x, z);
        let z = &*z;
        let arch = pulp::Arch::new();
        arch.dispatch(
            #[inline(always)]
            || self.exponents_and_features(z, signs, correlations, k),
        );
        exp_in_place(correlations);
        let mut rigid_body = (0.0, 0.0);
        if let Some((parameters, terms)) = &self.rigid_body {
            let mean = parameters.gather(of_joint, y);
            rigid_body = (mean, terms.add_covariances(y, k));
        }
        arch.dispatch(
            #[inline(always)]
            || self.mean_and_var(&self.views[view], (z, signs), rigid_body, correlations, k),
        )
    }

    /// Writes −½ Σ_j ((z_j − p_j)/l_j)² and the rest of c(p, x) for every basis point p.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn exponents_and_features(
        &self,
        z: &[f64],
        signs: &[f64],
        exponents: &mut [f64],
        k: &mut [f64],
    ) {
        let terms = &self.terms;
        exponents.fill(0.0);
        k.fill(terms.bias_var);
        for (j, half_precision) in terms.half_precision.iter().enumerate() {
            let (z, column) = (z[j], column(&self.points, j, self.n_points()));
            let weighted = terms.linear_var[j] * z;
            for ((exponent, k), point) in exponents.iter_mut().zip(k.iter_mut()).zip(column) {
                let difference = z - point;
                *exponent += half_precision * (difference * difference);
                *k += weighted * point;
            }
        }
        for (j, coulomb_var) in terms.coulomb_var.iter().enumerate() {
            let weighted = coulomb_var * signs[j];
            for (k, sign) in k.iter_mut().zip(column(&self.signs, j, self.n_points())) {
                *k += weighted * sign;
            }
        }
    }

    /// Completes k and overwrites it with L⁻¹k and R⁻ᵀL⁻¹k.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn mean_and_var(
        &self,
        view: &View,
        (z, signs): (&[f64], &[f64]),
        (of_parameters, parameter_var): (f64, f64),
        correlations: &[f64],
        k: &mut [f64],
    ) -> (f64, f64) {
        let n_signs = view.folded.coulomb.len();
        let mean = dot_pairwise(&view.signal_weights, correlations)
            + dot_pairwise(&view.folded.linear, z)
            + dot_pairwise(&view.folded.coulomb, &signs[..n_signs])
            + view.folded.bias
            + of_parameters;

        for (k, correlation) in k.iter_mut().zip(correlations) {
            *k += self.terms.signal_var * correlation;
        }
        if let Some(scaling) = &view.scaling {
            for (k, scale) in k.iter_mut().zip(&scaling.of_points) {
                *k *= scale;
            }
        }
        self.l.solve_in_place(k); // φ
        let prior_var = view.scale_prior(self.terms.prior_var(z, &signs[..n_signs]));
        let unexplained = prior_var + parameter_var - dot_pairwise(k, k);
        // The comparison lets NaN through, which f64::max would turn into certainty.
        let mut var = if unexplained < 0.0 { 0.0 } else { unexplained };
        if let Some((r_transposed, noise_var)) = &self.noise {
            r_transposed.solve_in_place(k);
            var += noise_var * dot_pairwise(k, k);
        }
        (mean, var)
    }
}

impl ParameterTerms {
    /// Adds y S Y_Bᵀ to the covariances with the basis points; gives y S y.
    fn add_covariances(&self, y: &[f64], k: &mut [f64]) -> f64 {
        let mut variance = 0.0;
        for (col, (y, prior_var)) in y.iter().zip(&self.prior_var).enumerate() {
            if *y != 0.0 {
                variance += prior_var * y * y;
                for (k, cross) in k.iter_mut().zip(self.cross.col_as_slice(col)) {
                    *k += y * cross;
                }
            }
        }
        variance
    }
}

/// The entries of a matrix, column after column.
fn columns_of(matrix: MatRef<'_, f64>) -> Vec<f64> {
    let columns = matrix.col_iter();
    columns.flat_map(|column| column.iter().copied()).collect()
}

/// Column j of a matrix of r rows, stored column after column.
#[inline(always)]
#[allow(clippy::inline_always, reason = "compiled once per instruction set")]
fn column(columns: &[f64], j: usize, n_rows: usize) -> &[f64] {
    &columns[j * n_rows..(j + 1) * n_rows]
}

impl Terms {
    fn of(covariance: &TorqueCovariance) -> Self {
        let params = covariance.embedded_params();
        let squares = |stds: &[f64]| stds.iter().map(|std| std * std).collect();
        Self {
            bias_var: params.bias_std * params.bias_std,
            linear_var: squares(&params.linear_std),
            signal_var: params.signal_std * params.signal_std,
            half_precision: (params.length_scales.iter())
                .map(|length| -0.5 / (length * length))
                .collect(),
            coulomb_var: squares(params.coulomb_std.as_deref().unwrap_or_default()),
        }
    }

    /// c(x, x).
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn prior_var(&self, z: &[f64], signs: &[f64]) -> f64 {
        let weighted = |vars: &[f64], values: &[f64]| -> f64 {
            let terms = vars.iter().zip(values);
            terms.map(|(var, value)| var * value * value).sum()
        };
        self.bias_var
            + weighted(&self.linear_var, z)
            + self.signal_var
            + weighted(&self.coulomb_var, signs)
    }
}

impl Folded {
    /// ```text
    /// Σ_p β_p (b² + Σ_j u_j² x_j p_j + Σ_j w_j² sgn(q̇_j) sgn(ṗ_j))
    ///   = b² Σ_p β_p + Σ_j x_j [u_j² Σ_p β_p p_j] + Σ_j sgn(q̇_j) [w_j² Σ_p β_p sgn(ṗ_j)]
    /// ```
    /// The weights β can be large and cancel, so the sums over p are compensated.
    fn new(terms: &Terms, points: &[f64], signs: &[f64], weights: &[f64]) -> Self {
        let sums = |columns: &[f64], vars: &[f64]| -> Vec<f64> {
            let sum = |column: &[f64]| {
                dot_compensated(weights.iter().copied().zip(column.iter().copied()))
            };
            let of_column = |(j, var)| var * sum(column(columns, j, weights.len()));
            vars.iter().enumerate().map(of_column).collect()
        };
        Self {
            bias: terms.bias_var * dot_compensated(weights.iter().map(|weight| (*weight, 1.0))),
            linear: sums(points, &terms.linear_var),
            coulomb: sums(signs, &terms.coulomb_var),
        }
    }
}
