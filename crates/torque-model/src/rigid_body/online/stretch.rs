//! Rows under one load, as they come: the arm is taken out of them, and what is left tells the load.
//!
//! ```text
//! G = P Aᵀ,  S = 1 + A G = LLᵀ,  X = (r, E) − A Z,   X̃ = L⁻¹X,  Γ = G L⁻ᵀ
//! Z ← Z + Γ X̃,   P ← P − Γ Γᵀ,   H ← H + ẼᵀẼ,   b ← b + Ẽᵀ r̃
//! ```
//! Residuals r and load columns E of a tick go through the same filter: for a load u the arm's deviation has mean
//! Z₀ − Z_E u and covariance P, which does not depend on u.

use linalg::sums::dot_in_lanes;
use puma_dyn::dynamics::N_PARAMETERS;

use crate::rigid_body::online::arm_basis::{ArmBasis, KnownLoad};
use crate::rigid_body::online::load_belief::{LoadBelief, LoadInformation, LoadPrior, log_mean_exp};
use crate::rigid_body::online::load_factor::{Square, Ten, unit};
use crate::rigid_body::online::tick_rows::JointRow;

/// Columns of Z: the residuals', and the load's.
const N_COLUMNS: usize = 1 + N_PARAMETERS;
/// Rows that are taken together.
pub(super) const BLOCK: usize = 8;
/// Entries of a column that are worked out side by side.
const LANES: usize = 8;

/// One stretch.
#[derive(Debug, Clone)]
pub(super) struct Stretch {
    stride: usize,
    /// P, column after column, (stride, k).
    covariance: Vec<f64>,
    /// Z, column after column, (stride, 11).
    response: Vec<f64>,
    of_loads: Vec<Coupled>,
    information: LoadInformation,
    /// Γ, column after column, (stride, 8).
    gain: Vec<f64>,
}

/// C P Cᵀ and C Z of a known load.
#[derive(Debug, Clone)]
struct Coupled {
    spread: Square,
    response: [[f64; N_COLUMNS]; N_PARAMETERS],
}

impl Stretch {
    /// Without a row.
    pub fn new(basis: &ArmBasis) -> Self {
        let stride = basis.stride();
        let none = Coupled {
            spread: [[0.0; N_PARAMETERS]; N_PARAMETERS],
            response: [[0.0; N_COLUMNS]; N_PARAMETERS],
        };
        let mut stretch = Self {
            stride,
            covariance: vec![0.0; stride * basis.n_directions()],
            response: vec![0.0; stride * N_COLUMNS],
            of_loads: vec![none; basis.loads.len()],
            information: LoadInformation::NONE,
            gain: vec![0.0; stride * BLOCK],
        };
        stretch.begin(basis);
        stretch
    }

    /// Forgets all rows.
    pub fn begin(&mut self, basis: &ArmBasis) {
        self.covariance.fill(0.0);
        self.covariance
            .iter_mut()
            .step_by(self.stride + 1)
            .for_each(|entry| *entry = 1.0);
        self.response.fill(0.0);
        self.information = LoadInformation::NONE;
        for (coupled, load) in self.of_loads.iter_mut().zip(&basis.loads) {
            coupled.response = [[0.0; N_COLUMNS]; N_PARAMETERS];
            if let Some(load) = load {
                let row = |k: usize| &load.coupling[k * self.stride..][..self.stride];
                for (at, of_row) in coupled.spread.iter_mut().enumerate() {
                    for (col, to) in of_row.iter_mut().enumerate() {
                        *to = linalg::sums::dot(row(at), row(col));
                    }
                }
            }
        }
    }

    /// Every row counts `part` of what it did for the load.
    pub fn forget(&mut self, part: f64) {
        self.information.forget(part);
    }

    /// Mean of the arm's deviation z with a load, (stride,).
    pub fn arm_into(&self, load: &Ten, z: &mut [f64]) {
        let (of_residuals, of_load) = self.response.split_at(self.stride);
        z.copy_from_slice(of_residuals);
        for (column, u) in of_load.chunks_exact(self.stride).zip(load) {
            z.iter_mut().zip(column).for_each(|(z, response)| *z -= u * response);
        }
    }

    /// Takes up to [`BLOCK`] rows whose noise is independent.
    pub fn take(&mut self, basis: &ArmBasis, rows: &[&JointRow]) {
        match *rows {
            [] => {}
            [a] => self.take_block(basis, [a]),
            [a, b] => self.take_block(basis, [a, b]),
            [a, b, c] => self.take_block(basis, [a, b, c]),
            [a, b, c, d] => self.take_block(basis, [a, b, c, d]),
            [a, b, c, d, e] => self.take_block(basis, [a, b, c, d, e]),
            [a, b, c, d, e, f] => self.take_block(basis, [a, b, c, d, e, f]),
            [a, b, c, d, e, f, g] => self.take_block(basis, [a, b, c, d, e, f, g]),
            [a, b, c, d, e, f, g, h, ..] => self.take_block(basis, [a, b, c, d, e, f, g, h]),
        }
    }

    fn take_block<const M: usize>(&mut self, basis: &ArmBasis, rows: [&JointRow; M]) {
        pulp::Arch::new().dispatch(
            #[inline(always)]
            || {
                let root = self.gains(&rows);
                let whitened = self.whitened(&rows, &root);
                self.learn(&whitened);
                for (load, coupled) in basis.loads.iter().zip(&mut self.of_loads) {
                    if let Some(load) = load {
                        coupled.learn(load, &self.gain, &whitened);
                    }
                }
                for (k, row) in whitened.iter().enumerate() {
                    let columns: Ten = std::array::from_fn(|column| row[1 + column]);
                    let log_var = rows[k].log_var + 2.0 * root[k][k].ln();
                    self.information.add(row[0], &columns, log_var);
                }
            },
        );
    }

    /// Leaves Γ in the scratch and gives L.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn gains<const M: usize>(&mut self, rows: &[&JointRow; M]) -> [[f64; M]; M] {
        let stride = self.stride;
        for first in (0..stride).step_by(LANES) {
            let mut sums = [[0.0; LANES]; M];
            for (col, column) in self.covariance.chunks_exact(stride).enumerate() {
                let column = &column[first..first + LANES];
                for (sums, row) in sums.iter_mut().zip(rows) {
                    let entry = row.arm[col];
                    for lane in 0..LANES {
                        sums[lane] += column[lane] * entry;
                    }
                }
            }
            for (sums, gain) in sums.iter().zip(self.gain.chunks_exact_mut(stride)) {
                gain[first..first + LANES].copy_from_slice(sums);
            }
        }
        let mut root = [[0.0; M]; M];
        for row in 0..M {
            for col in 0..=row {
                let gain = &self.gain[col * stride..][..stride];
                let unit = if row == col { 1.0 } else { 0.0 };
                let known: f64 = (0..col).map(|k| root[row][k] * root[col][k]).sum();
                let rest = unit + dot_in_lanes(&rows[row].arm, gain) - known;
                root[row][col] = if row == col { rest.sqrt() } else { rest / root[col][col] };
            }
        }
        root
    }

    /// X̃; turns the scratch into Γ = G L⁻ᵀ.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn whitened<const M: usize>(
        &mut self,
        rows: &[&JointRow; M],
        root: &[[f64; M]; M],
    ) -> [[f64; N_COLUMNS]; M] {
        let stride = self.stride;
        let mut whitened = [[0.0; N_COLUMNS]; M];
        for row in 0..M {
            let (done, rest) = self.gain.split_at_mut(row * stride);
            let gain = &mut rest[..stride];
            let (before, of_row) = whitened.split_at_mut(row);
            let of_row = &mut of_row[0];
            for (col, response) in self.response.chunks_exact(stride).enumerate() {
                of_row[col] = rows[row].datum(col) - dot_in_lanes(&rows[row].arm, response);
            }
            for (k, (gamma, solved)) in done.chunks_exact(stride).zip(before.iter()).enumerate() {
                let l = root[row][k];
                gain.iter_mut().zip(gamma).for_each(|(to, gamma)| *to -= l * gamma);
                of_row.iter_mut().zip(solved).for_each(|(to, x)| *to -= l * x);
            }
            let inverse = 1.0 / root[row][row];
            gain.iter_mut().for_each(|value| *value *= inverse);
            of_row.iter_mut().for_each(|value| *value *= inverse);
        }
        whitened
    }

    /// Z and P after the rows.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn learn<const M: usize>(&mut self, whitened: &[[f64; N_COLUMNS]; M]) {
        let stride = self.stride;
        let gains: [&[f64]; M] = std::array::from_fn(|row| &self.gain[row * stride..][..stride]);
        for (col, response) in self.response.chunks_exact_mut(stride).enumerate() {
            for (gain, row) in gains.iter().zip(whitened) {
                response.iter_mut().zip(*gain).for_each(|(to, gain)| *to += gain * row[col]);
            }
        }
        for (col, column) in self.covariance.chunks_exact_mut(stride).enumerate() {
            let entries: [f64; M] = std::array::from_fn(|row| gains[row][col]);
            for first in (0..stride).step_by(LANES) {
                let lanes = &mut column[first..first + LANES];
                for (gain, entry) in gains.iter().zip(entries) {
                    let gain = &gain[first..first + LANES];
                    for lane in 0..LANES {
                        lanes[lane] -= gain[lane] * entry;
                    }
                }
            }
        }
    }

    /// What the rows say of a load that is not known.
    pub fn unknown(&self) -> LoadBelief {
        LoadBelief::of_unknown(&self.information)
    }

    /// What they say of a context's.
    pub fn known(&self, basis: &ArmBasis, context: usize) -> LoadBelief {
        match &basis.loads[context] {
            None => LoadBelief::of_none(&self.information),
            Some(load) => {
                let prior = self.of_loads[context].prior(load);
                LoadBelief::of_known(&self.information, &prior)
            }
        }
    }

    /// Log evidence of the rows, all loads and one that is not known equally probable beforehand.
    pub fn log_evidence(&self, basis: &ArmBasis) -> f64 {
        let known = (0..basis.loads.len()).map(|context| self.known(basis, context));
        let all = known.chain(std::iter::once_with(|| self.unknown()));
        log_mean_exp(all.map(|belief| belief.log_evidence))
    }
}

impl Coupled {
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn learn<const M: usize>(
        &mut self,
        load: &KnownLoad,
        gain: &[f64],
        whitened: &[[f64; N_COLUMNS]; M],
    ) {
        let stride = load.coupling.len() / N_PARAMETERS;
        let mut seen = [[0.0; M]; N_PARAMETERS]; // C Γ
        for (seen, coupling) in seen.iter_mut().zip(load.coupling.chunks_exact(stride)) {
            for (seen, gain) in seen.iter_mut().zip(gain.chunks_exact(stride)) {
                *seen = dot_in_lanes(coupling, gain);
            }
        }
        for (row, of_row) in seen.iter().enumerate() {
            for (to, of_col) in self.spread[row].iter_mut().zip(&seen) {
                *to -= of_row.iter().zip(of_col).map(|(a, b)| a * b).sum::<f64>();
            }
            for (part, whitened) in of_row.iter().zip(whitened) {
                let response = self.response[row].iter_mut();
                response.zip(whitened).for_each(|(to, x)| *to += part * x);
            }
        }
    }

    /// N(Bu; m, W).
    fn prior(&self, load: &KnownLoad) -> LoadPrior {
        let mut prior = LoadPrior {
            map: unit(),
            mean: load.mean,
            covariance: load.covariance,
        };
        for row in 0..N_PARAMETERS {
            prior.mean[row] += self.response[row][0];
            for col in 0..N_PARAMETERS {
                prior.map[row][col] += self.response[row][1 + col];
                prior.covariance[row][col] += self.spread[row][col];
            }
        }
        prior
    }
}
