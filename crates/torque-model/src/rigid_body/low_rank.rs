//! The variance of a joint's torque by as few directions as its training states need.
//!
//! ```text
//! C = L_c L_cᵀ,   U Λ Uᵀ = L_cᵀ (AᵀA/n) L_c,   B = (L_c U)ᵀ,   var ≈ |B_k a|²
//! ```

use faer::Mat;
use linalg::{Factor, product, symmetric_eigen};

use crate::error::TorqueError;
use crate::rigid_body::log::Log;
use crate::rigid_body::new_rows::all_gathered;
use crate::rigid_body::posterior::ParameterPosterior;
use crate::samples::Samples;

/// Part of a variance that may be left out.
const LEFT_OUT: f64 = 0.01;
/// Added to the covariance in units of the prior, so that it has a factor.
const JITTER: f64 = 1e-14;

/// Directions of a joint's unknowns, by which its variance in one context is a sum of few squares.
#[derive(Debug, Clone)]
pub struct LowRank {
    /// The unknowns that a row has entries of.
    pub unknowns: Vec<usize>,
    /// B_k, (k, number of unknowns).
    pub directions: Mat<f64>,
}

impl ParameterPosterior {
    /// As many directions as it takes for at most a hundredth of the variance of a measurement to be left out at
    /// every row of a log, taken as of a context.
    ///
    /// # Errors
    /// As for a fit; a covariance without a factor.
    pub fn low_rank(
        &self,
        joint: usize,
        context: usize,
        samples: &Samples,
    ) -> Result<LowRank, TorqueError> {
        let (parts, unknowns, load) = (self.parts(), self.unknowns(), self.load_of(context));
        let mut used: Vec<usize> = unknowns.own(joint);
        let own = used.len();
        if let (Some(load), Some(_)) = (load, unknowns.carrier_of(joint)) {
            used.extend(unknowns.load(load));
        }
        let kept: Vec<usize> = (0..used.len())
            .filter(|k| parts.prior_std[used[*k]] > 0.0)
            .collect();
        let used: Vec<usize> = kept.iter().map(|k| used[*k]).collect();
        let log = Log::new(samples)?;
        let design = self.design(&log)?;
        let mut rows: Vec<(Vec<Vec<f64>>, Vec<f64>)> =
            vec![(Vec::new(), Vec::new()); unknowns.n_joints()];
        let carrier = unknowns
            .carrier_of(joint)
            .map_or(0, |carrier| carrier.start);
        design.for_each(&mut rows, |(rows, noise), of, panel| {
            let Some(learned) = parts.joints[joint].as_ref().filter(|_| of == joint) else {
                return;
            };
            let panel = &panel.joints[joint];
            let rigid = design.rigid(joint, panel, self.mean(), load);
            let block = all_gathered(self, panel, &rigid);
            for (row, qd) in panel.qd.iter().enumerate() {
                let entry = |k: &usize| block[(row, if *k < own { *k } else { carrier + k - own })];
                rows.push(kept.iter().map(entry).collect());
                noise.push(learned.noise.var_at(*qd));
            }
        });
        let (rows, noise) = rows.swap_remove(joint);
        let a = Mat::from_fn(rows.len(), used.len(), |row, col| rows[row][col]);
        let mut covariance = self.covariance_of(&used);
        for (k, unknown) in used.iter().enumerate() {
            covariance[(k, k)] += JITTER * parts.prior_std[*unknown].powi(2);
        }
        let factor = Factor::new(covariance).map_err(gp_core::GpError::from)?;
        let l = factor.l();
        let l = Mat::from_fn(used.len(), used.len(), |row, col| {
            if row >= col { l[(row, col)] } else { 0.0 }
        });
        let al = product(a.as_ref(), l.as_ref());
        let gram = product(al.transpose(), al.as_ref());
        let eigen = symmetric_eigen((faer::Scale(1.0 / rows.len() as f64) * gram).as_ref())
            .map_err(gp_core::GpError::from)?;
        // Largest eigenvalue first.
        let vectors = eigen.vectors.as_ref().reverse_cols();
        let directions = product(l.as_ref(), vectors).transpose().to_owned();
        let squares = product(al.as_ref(), vectors);
        let k = least_rank(&squares, &noise, LEFT_OUT);
        Ok(LowRank {
            unknowns: used,
            directions: directions.subrows(0, k).to_owned(),
        })
    }
}

/// Least number of columns whose squares leave out at most a part of the variance in every row.
pub(crate) fn least_rank(roots: &Mat<f64>, noise: &[f64], left_out: f64) -> usize {
    let mut rest: Vec<f64> = (0..roots.nrows())
        .map(|row| roots.row(row).squared_norm_l2())
        .collect();
    let total: Vec<f64> = rest
        .iter()
        .zip(noise)
        .map(|(var, noise)| var + noise)
        .collect();
    for k in 0..roots.ncols() {
        for (row, rest) in rest.iter_mut().enumerate() {
            *rest -= roots[(row, k)].powi(2);
        }
        if rest
            .iter()
            .zip(&total)
            .all(|(rest, total)| rest / total <= left_out)
        {
            return k + 1;
        }
    }
    roots.ncols()
}
