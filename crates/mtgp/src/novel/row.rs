//! A new context: one row of Λ learned from its own few torques, everything else as it was.

use faer::{Mat, MatRef};
use gp_core::GpError;
use gp_core::optimize::StopReason;
use gp_core::optimize::{MinimizeOptions, Objective, minimize};
use linalg::{Factor, thin_svd};

use crate::error::MtgpError;
use crate::latent::{LatentFunctions, require_torques};
use crate::novel::row_prior::RowPopulation;
use crate::prior::TaskRow;

/// Share of the largest singular value below which least squares takes one for zero.
const RANK_TOLERANCE: f64 = 1e-10;

/// Torques of a new context at some states, and the latent functions there.
#[derive(Debug, Clone, Copy)]
pub struct NewTorques<'a> {
    /// Conditioned on the data of the known contexts, at the states of the torques.
    pub latent: &'a LatentFunctions,
    /// t*, (k,), N·m.
    pub torques: &'a [f64],
}

/// How K^ρ grows.
///
/// A border (b, d) leaves K^ρ positive semi-definite if and only if b = Λλ for some λ and
/// d ≥ λᵀλ (of the shortest such λ): the m cross-covariances have the r degrees of freedom of λ
/// however they are counted. Of full rank, r = m, the second kind is the free border of
/// m + 1 numbers; below, it has r + 1.
/// # Source
/// Section 5; Horn & Johnson 2013, theorem 7.7.9 (the Schur complement of a border).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Border {
    /// By a row λ of Λ: the rank stays r.
    InSpan,
    /// By a row λ, and a variance s² of the new context alone: the rank grows by one.
    WithOwnVariance,
}

/// log p(D* | D, λ, s), summed over joints that share the row.
///
/// ```text
/// A = Σ_cc′ λ_c λ_c′ S_cc′ + s² K + σ²I,   e = t* − Mλ,   K = c^x(X*, X*)
/// value = −½ eᵀA⁻¹e − ½ log|A| − (k/2) log 2π
/// ```
/// The n old samples do not enter: O(r²k² + k³).
/// # Errors
/// [`MtgpError::CountMismatch`], [`MtgpError::NonFinite`] for the row;
/// [`MtgpError::CountMismatch`], [`GpError::NonFiniteTarget`] for the torques;
/// [`GpError::NotPositiveDefinite`] if A has no factor.
/// # Source
/// Section 5: marginal likelihood of D* given D.
pub fn log_density_of_row(joints: &[NewTorques<'_>], row: &TaskRow) -> Result<f64, MtgpError> {
    let mut sum = 0.0;
    for joint in joints {
        sum += joint.latent.density(row)?.log_density(joint.torques)?.0;
    }
    Ok(sum)
}

/// The same with its gradient with respect to (λ, s), (r + 1,).
///
/// ```text
/// α = A⁻¹e,   W = A⁻¹ − ααᵀ
/// ∂/∂λ_c = M_cᵀα − Σ_c′ λ_c′ ⟨W, S_cc′⟩        ∂/∂s = −s ⟨W, K⟩
/// ```
/// # Errors
/// As for [`log_density_of_row`].
/// # Source
/// As for [`log_density_of_row`]; Rasmussen & Williams 2006, eq. (5.9), and the mean's part.
pub fn log_density_of_row_with_gradient(
    joints: &[NewTorques<'_>],
    row: &TaskRow,
) -> Result<(f64, Vec<f64>), MtgpError> {
    let mut gradient = vec![0.0; row.entries.len() + 1];
    let mut sum = 0.0;
    for joint in joints {
        sum += add_joint(joint, row, &mut gradient)?;
    }
    Ok((sum, gradient))
}

/// One joint's part of the value, and of the gradient.
fn add_joint(
    joint: &NewTorques<'_>,
    row: &TaskRow,
    gradient: &mut [f64],
) -> Result<f64, MtgpError> {
    let (latent, entries) = (joint.latent, &row.entries);
    row.require(latent.rank())?;
    require_torques(joint.torques, latent.n_points())?;
    let k = latent.n_points();

    // B_c = Σ_c′ λ_c′ S_cc′, of which both A and the gradient are made.
    let mixed: Vec<Mat<f64>> = (0..latent.rank())
        .map(|c| latent.mixed(c, entries))
        .collect();
    let noise_var = latent.noise_std() * latent.noise_std();
    let mut a = faer::Scale(row.own_std * row.own_std) * latent.prior(); // (k, k)
    for (entry, mixed) in entries.iter().zip(&mixed) {
        a += faer::Scale(*entry) * mixed;
    }
    for idx in 0..k {
        a[(idx, idx)] += noise_var;
    }
    let factor = Factor::new(a)?;
    let mean = latent.mean_of(entries);
    let residual: Vec<f64> = joint
        .torques
        .iter()
        .zip(&mean)
        .map(|(t, mean)| t - mean)
        .collect();
    let (squares, alpha) = factor.quadratic_form_and_solve(&residual);
    let value = -0.5 * (squares + factor.log_det() + k as f64 * std::f64::consts::TAU.ln());

    let inverse = factor.into_inverse(&mut Mat::zeros(k, k)); // lower triangle
    for (c, mixed) in mixed.iter().enumerate() {
        let slope = latent.mean().col(c).iter().zip(&alpha);
        gradient[c] += slope.map(|(m, alpha)| m * alpha).sum::<f64>();
        gradient[c] -= weighted_sum(&inverse, &alpha, mixed.as_ref());
    }
    gradient[entries.len()] -= row.own_std * weighted_sum(&inverse, &alpha, latent.prior());
    Ok(value)
}

/// ⟨A⁻¹ − ααᵀ, B⟩, with the lower triangle of A⁻¹.
fn weighted_sum(inverse: &Mat<f64>, alpha: &[f64], b: MatRef<'_, f64>) -> f64 {
    let mut sum = 0.0;
    for (col, alpha_col) in alpha.iter().enumerate() {
        for (row, alpha_row) in alpha.iter().enumerate() {
            let w = inverse[(row.max(col), row.min(col))] - alpha_row * alpha_col;
            sum += w * b[(row, col)];
        }
    }
    sum
}

/// The row that the torques of a new context ask for.
#[derive(Debug, Clone, PartialEq)]
pub struct RowFit {
    /// λ and s.
    pub row: TaskRow,
    /// log p(D* | D, λ, s).
    pub log_density: f64,
    /// Which start led there: 0 for least squares, 1 + γ for the row of the known context γ.
    pub start: usize,
    /// Starts that led to a likelihood.
    pub n_starts: usize,
    /// Evaluations of value and gradient, over all starts.
    pub evaluations: usize,
    /// Why the search from that start ended.
    pub stop: StopReason,
}

/// Learns the row of a new context by maximising log p(D* | D, λ, s).
///
/// The hyperparameters and the rows of the known contexts stay; the data of the known contexts
/// enter through [`LatentFunctions`], computed once.
/// Joints that share one K^ρ are given together; else each is given alone.
/// The starts are the λ that fits t* best on M in least squares, and the `n_nearest` known rows
/// of highest density; with variance of its own, s starts at the root mean square of the known
/// entries.
/// # Shapes
/// `known` one row per known context, of r entries each.
/// # Errors
/// [`MtgpError::NoJoints`]; as for [`log_density_of_row`]; [`GpError::NoUsableStart`].
/// # Source
/// Section 5: novel contexts.
pub fn fit_row(
    joints: &[NewTorques<'_>],
    known: &[TaskRow],
    border: Border,
    n_nearest: usize,
    options: &MinimizeOptions,
) -> Result<RowFit, MtgpError> {
    search_row(joints, known, border, None, n_nearest, options)
}

/// The same with the known rows as a sample of the population that the new one is from.
///
/// ```text
/// maximises log p(D* | D, λ) + log N(λ; λ̄, V)
/// ```
/// so that a few torques move λ only as far as they must; s has no prior. `log_density` of the
/// result is that of the torques alone.
///
/// # Errors
/// As for [`fit_row`] and [`RowPopulation::of`].
/// # Source
/// Section 5: novel contexts, with a prior over the rows of K^ρ.
pub fn fit_row_from_population(
    joints: &[NewTorques<'_>],
    known: &[TaskRow],
    border: Border,
    n_nearest: usize,
    options: &MinimizeOptions,
) -> Result<RowFit, MtgpError> {
    let population = RowPopulation::of(known)?;
    let prior = Some(&population);
    let found = search_row(joints, known, border, prior, n_nearest, options)?;
    let (penalty, _) = population.log_density(&found.row.entries);
    Ok(RowFit {
        log_density: found.log_density - penalty,
        ..found
    })
}

fn search_row(
    joints: &[NewTorques<'_>],
    known: &[TaskRow],
    border: Border,
    population: Option<&RowPopulation>,
    n_nearest: usize,
    options: &MinimizeOptions,
) -> Result<RowFit, MtgpError> {
    let rank = joints.first().ok_or(MtgpError::NoJoints)?.latent.rank();
    let scale = scale_of(known);
    let starts = starts(joints, known, n_nearest)?;
    let n_tried = starts.len();
    let own_std = match border {
        Border::InSpan => 0.0,
        Border::WithOwnVariance => scale,
    };
    let mut search = RowSearch {
        joints,
        border,
        population,
        scale,
    };
    let (mut best, mut evaluations, mut n_starts): (Option<RowFit>, usize, usize) = (None, 0, 0);
    for (start, entries) in starts {
        let z = search.coordinates(&TaskRow { entries, own_std });
        let minimum = minimize(&mut search, &z, options);
        evaluations += minimum.evaluations;
        if !minimum.value.is_finite() {
            continue;
        }
        n_starts += 1;
        if best
            .as_ref()
            .is_none_or(|best| -minimum.value > best.log_density)
        {
            best = Some(RowFit {
                row: search.row(&minimum.z, rank),
                log_density: -minimum.value,
                start,
                n_starts: 0,
                evaluations: 0,
                stop: minimum.stop,
            });
        }
    }
    let best = best.ok_or(GpError::NoUsableStart {
        n_starts: n_tried,
        reason: None,
    })?;
    Ok(RowFit {
        n_starts,
        evaluations,
        ..best
    })
}

/// −log p(D* | D, λ, s) as a function of (λ, s) in units of the known entries.
struct RowSearch<'a> {
    joints: &'a [NewTorques<'a>],
    border: Border,
    population: Option<&'a RowPopulation>,
    scale: f64,
}

impl RowSearch<'_> {
    fn coordinates(&self, row: &TaskRow) -> Vec<f64> {
        let own = (self.border == Border::WithOwnVariance).then_some(&row.own_std);
        let values = row.entries.iter().chain(own);
        values.map(|value| value / self.scale).collect()
    }

    fn row(&self, z: &[f64], rank: usize) -> TaskRow {
        TaskRow {
            entries: z[..rank].iter().map(|z| z * self.scale).collect(),
            own_std: z.get(rank).map_or(0.0, |z| (z * self.scale).abs()),
        }
    }
}

impl Objective for RowSearch<'_> {
    fn value_and_gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> f64 {
        let rank = self.joints[0].latent.rank();
        let mut row = self.row(z, rank);
        if let Some(own) = z.get(rank) {
            row.own_std = own * self.scale; // the sign matters to the gradient
        }
        match log_density_of_row_with_gradient(self.joints, &row) {
            Ok((mut value, mut slopes)) if value.is_finite() => {
                if let Some(population) = self.population {
                    let (prior, of_prior) = population.log_density(&row.entries);
                    value += prior;
                    slopes.iter_mut().zip(of_prior).for_each(|(a, b)| *a += b);
                }
                for (gradient, slope) in gradient.iter_mut().zip(slopes) {
                    *gradient = -slope * self.scale;
                }
                -value
            }
            _ => f64::INFINITY,
        }
    }
}

/// Root mean square of the known entries, or one.
fn scale_of(known: &[TaskRow]) -> f64 {
    let entries = || known.iter().flat_map(|row| &row.entries);
    let mean_square = entries().map(|e| e * e).sum::<f64>() / entries().count() as f64;
    let root = mean_square.sqrt();
    if root.is_normal() { root } else { 1.0 }
}

/// The starts of λ with their numbers: least squares, then the known rows of highest density.
fn starts(
    joints: &[NewTorques<'_>],
    known: &[TaskRow],
    n_nearest: usize,
) -> Result<Vec<(usize, Vec<f64>)>, MtgpError> {
    let mut starts = vec![(0, least_squares(joints)?)];
    let mut nearest = Vec::with_capacity(known.len());
    for (context, row) in known.iter().enumerate() {
        nearest.push((log_density_of_row(joints, row)?, context));
    }
    nearest.sort_by(|a, b| b.0.total_cmp(&a.0)); // stable: the first of equals stays first
    for (_, context) in nearest.into_iter().take(n_nearest) {
        starts.push((1 + context, known[context].entries.clone()));
    }
    Ok(starts)
}

/// The shortest λ of least Σ_i |t*_i − M_i λ|²/σ_i².
fn least_squares(joints: &[NewTorques<'_>]) -> Result<Vec<f64>, MtgpError> {
    let rank = joints[0].latent.rank();
    let n_rows = joints.iter().map(|joint| joint.latent.n_points()).sum();
    let mut design: Mat<f64> = Mat::zeros(n_rows, rank);
    let mut targets = Vec::with_capacity(n_rows);
    for joint in joints {
        let (latent, first) = (joint.latent, targets.len());
        require_torques(joint.torques, latent.n_points())?;
        TaskRow::in_span(vec![0.0; rank]).require(latent.rank())?;
        let weight = latent.noise_std().recip();
        for row in 0..latent.n_points() {
            for c in 0..rank {
                design[(first + row, c)] = weight * latent.mean()[(row, c)];
            }
        }
        targets.extend(joint.torques.iter().map(|torque| weight * torque));
    }
    let svd = thin_svd(design.as_ref())?;
    let floor = RANK_TOLERANCE * svd.values.first().copied().unwrap_or(0.0);
    let mut entries = vec![0.0; rank];
    for (place, value) in svd
        .values
        .iter()
        .enumerate()
        .filter(|(_, value)| **value > floor)
    {
        let left = svd.left.col(place).iter().zip(&targets);
        let size = left.map(|(u, t)| u * t).sum::<f64>() / value;
        for (entry, v) in entries.iter_mut().zip(svd.right.col(place).iter()) {
            *entry += size * v;
        }
    }
    Ok(entries)
}
