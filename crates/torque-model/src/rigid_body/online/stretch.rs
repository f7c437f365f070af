//! Rows under one load, as they come: the arm is taken out of them, and what is left tells the load.
//!
//! ```text
//! G = P Aᵀ,  S = 1 + A G = LLᵀ,  X = (r, E) − A Z,   X̃ = L⁻¹X,  Γ = G L⁻ᵀ
//! Z ← Z + Γ X̃,   P ← P − Γ Γᵀ,   H ← H + ẼᵀẼ,   b ← b + Ẽᵀ r̃
//! ```
//! Residuals r and load columns E of a tick go through the same filter: for a load u the arm's deviation has mean
//! Z₀ − Z_E u and covariance P, which does not depend on u.

use std::f64::consts::TAU;

use pulp::Simd;
use puma_dyn::dynamics::N_PARAMETERS;

use crate::rigid_body::online::arm_basis::{ArmBasis, KnownLoad};
use crate::rigid_body::online::lanes::{Lanes, N_LANES, ZEROS, plus_product, plus_scaled, total};
use crate::rigid_body::online::load_belief::{
    LoadBelief, LoadInformation, LoadPrior, N_COLUMNS, WIDTH,
};
use crate::rigid_body::online::load_factor::{Ten, unit};
use crate::rigid_body::online::outer_products::{BLOCK, add_outer, combine};
use crate::rigid_body::online::tick_rows::JointRow;

/// One stretch.
#[derive(Debug, Clone)]
pub(super) struct Stretch {
    /// P: eight rows after another, each column after column, (chunks, k).
    covariance: Vec<Lanes>,
    /// Z, direction after direction, (k, 16).
    response: Vec<[f64; WIDTH]>,
    of_loads: Vec<Coupled>,
    information: LoadInformation,
    /// Γ: eight rows after another, column after column, (chunks,).
    gain: Vec<[Lanes; BLOCK]>,
    /// Aᵀ, and then Γ, row after row, (8 chunks,).
    entries: Vec<[f64; BLOCK]>,
}

/// C P Cᵀ and C Z of a known load, zero behind their columns.
#[derive(Debug, Clone)]
struct Coupled {
    spread: [[f64; WIDTH]; N_PARAMETERS],
    response: [[f64; WIDTH]; N_PARAMETERS],
}

impl Stretch {
    /// Without a row.
    pub fn new(basis: &ArmBasis) -> Self {
        let (k, n_chunks) = (basis.n_directions(), basis.n_chunks());
        let none = Coupled {
            spread: [[0.0; WIDTH]; N_PARAMETERS],
            response: [[0.0; WIDTH]; N_PARAMETERS],
        };
        let mut stretch = Self {
            covariance: vec![ZEROS; n_chunks * k],
            response: vec![[0.0; WIDTH]; k],
            of_loads: vec![none; basis.loads.len()],
            information: LoadInformation::NONE,
            gain: vec![[ZEROS; BLOCK]; n_chunks],
            entries: vec![[0.0; BLOCK]; n_chunks * N_LANES],
        };
        stretch.begin(basis);
        stretch
    }

    /// Forgets all rows.
    pub fn begin(&mut self, basis: &ArmBasis) {
        let k = basis.n_directions();
        self.covariance.fill(ZEROS);
        for row in 0..k {
            self.covariance[row / N_LANES * k + row][row % N_LANES] = 1.0;
        }
        self.response.fill([0.0; WIDTH]);
        self.information = LoadInformation::NONE;
        for (coupled, load) in self.of_loads.iter_mut().zip(&basis.loads) {
            if let Some(load) = load {
                coupled.response = [[0.0; WIDTH]; N_PARAMETERS];
                coupled.spread = load.spread;
            }
        }
    }

    /// Every row counts `part` of what it did for the load.
    pub fn forget(&mut self, part: f64) {
        self.information.forget(part);
    }

    /// Mean of the arm's deviation z with a load, (chunks,).
    pub fn arm_into(&self, load: &Ten, z: &mut [Lanes]) {
        for (z, response) in z.as_flattened_mut().iter_mut().zip(&self.response) {
            let of_load = linalg::sums::dot_in_sequence(&response[1..], load);
            *z = response[0] - of_load;
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
        pulp::Arch::new().dispatch(Taking {
            stretch: self,
            basis,
            rows,
        });
    }

    /// G, in the place of Γ; leaves Aᵀ in the entries.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn spread_rows<S: Simd, const M: usize>(&mut self, simd: S, rows: &[&JointRow; M]) {
        for (row, of_row) in rows.iter().enumerate() {
            let arm = of_row.arm.as_flattened();
            for (entries, arm) in self.entries.iter_mut().zip(arm) {
                entries[row] = *arm;
            }
        }
        let k = self.response.len();
        for (rows, gain) in self.covariance.chunks_exact(k).zip(&mut self.gain) {
            gain[..M].copy_from_slice(&combine::<S, M, N_LANES>(simd, rows, &self.entries));
        }
    }

    /// L
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn root<const M: usize>(&self, rows: &[&JointRow; M]) -> [[f64; M]; M] {
        let mut root = [[0.0; M]; M];
        for row in 0..M {
            for col in 0..=row {
                let mut sum = ZEROS;
                for (gain, arm) in self.gain.iter().zip(&rows[row].arm) {
                    sum = plus_product(sum, &gain[col], arm);
                }
                let known: f64 = (0..col).map(|k| root[row][k] * root[col][k]).sum();
                let rest = total(&sum) - known;
                root[row][col] = if row == col {
                    (1.0 + rest).sqrt()
                } else {
                    rest / root[col][col]
                };
            }
        }
        root
    }

    /// X̃
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn whitened<S: Simd, const M: usize>(
        &self,
        simd: S,
        rows: &[&JointRow; M],
        root: &[[f64; M]; M],
    ) -> [[f64; WIDTH]; M] {
        let mut whitened = combine::<S, M, WIDTH>(simd, &self.response, &self.entries);
        for row in 0..M {
            let (before, rest) = whitened.split_at_mut(row);
            let inverse = 1.0 / root[row][row];
            for col in 0..WIDTH {
                let mut left = rows[row].data[col] - rest[0][col];
                for (k, solved) in before.iter().enumerate() {
                    left -= root[row][k] * solved[col];
                }
                rest[0][col] = left * inverse;
            }
        }
        whitened
    }

    /// Γ, in both of its places.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn solve_gain<const M: usize>(&mut self, root: &[[f64; M]; M]) {
        let eights = self.entries.as_chunks_mut::<N_LANES>().0;
        for (gain, entries) in self.gain.iter_mut().zip(eights) {
            for row in 0..M {
                let mut lanes = gain[row];
                for col in 0..row {
                    lanes = plus_scaled(lanes, &gain[col], -root[row][col]);
                }
                let inverse = 1.0 / root[row][row];
                gain[row] = lanes.map(|value| value * inverse);
                for (entries, value) in entries.iter_mut().zip(gain[row]) {
                    entries[row] = value;
                }
            }
        }
    }

    /// Z, P, H and b after the rows.
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn learn<S: Simd, const M: usize>(&mut self, simd: S, whitened: &[[f64; WIDTH]; M]) {
        add_outer(simd, &mut self.response, &self.entries, whitened, 1.0);
        let k = self.response.len();
        for (rows, gain) in self.covariance.chunks_exact_mut(k).zip(&self.gain) {
            let gain: [Lanes; M] = std::array::from_fn(|row| gain[row]);
            add_outer(simd, rows, &self.entries, &gain, -1.0);
        }
        let columns = transposed::<M, N_COLUMNS>(whitened);
        add_outer(simd, &mut self.information.gram, &columns, whitened, 1.0);
    }

    /// What the rows say of a load that is not known.
    pub fn unknown(&self) -> LoadBelief {
        LoadBelief::of_unknown(&self.information)
    }

    /// What they say of each context's load, and behind them of one that is not known, (contexts + 1,).
    pub fn judge(&self, basis: &ArmBasis, beliefs: &mut [LoadBelief]) {
        pulp::Arch::new().dispatch(Judging {
            stretch: self,
            basis,
            beliefs,
        });
    }
}

/// Hypotheses to be judged, compiled once per instruction set.
struct Judging<'a> {
    stretch: &'a Stretch,
    basis: &'a ArmBasis,
    beliefs: &'a mut [LoadBelief],
}

impl pulp::NullaryFnOnce for Judging<'_> {
    type Output = ();

    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn call(self) {
        let Stretch {
            information,
            of_loads,
            ..
        } = self.stretch;
        let loads = self.basis.loads.iter().zip(of_loads);
        for ((load, coupled), belief) in loads.zip(self.beliefs.iter_mut()) {
            *belief = match load {
                None => LoadBelief::of_none(information),
                Some(load) => LoadBelief::of_known(information, &coupled.prior(load)),
            };
        }
        if let Some(belief) = self.beliefs.last_mut() {
            *belief = LoadBelief::of_unknown(information);
        }
    }
}

/// Rows to be taken, compiled once per instruction set.
struct Taking<'a, const M: usize> {
    stretch: &'a mut Stretch,
    basis: &'a ArmBasis,
    rows: [&'a JointRow; M],
}

impl<const M: usize> pulp::WithSimd for Taking<'_, M> {
    type Output = ();

    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self {
            stretch,
            basis,
            rows,
        } = self;
        stretch.spread_rows(simd, &rows);
        let root = stretch.root(&rows);
        let whitened = stretch.whitened(simd, &rows, &root);
        stretch.solve_gain(&root);
        stretch.learn(simd, &whitened);
        for (load, coupled) in basis.loads.iter().zip(&mut stretch.of_loads) {
            if let Some(load) = load {
                coupled.learn(simd, load, &stretch.entries, &whitened);
            }
        }
        for (k, row) in rows.iter().enumerate() {
            stretch.information.log_vars += row.log_var + 2.0 * root[k][k].ln() + TAU.ln();
        }
    }
}

/// The first N columns of a few rows as rows.
#[inline(always)]
#[allow(clippy::inline_always, reason = "compiled once per instruction set")]
fn transposed<const M: usize, const N: usize>(rows: &[[f64; WIDTH]; M]) -> [[f64; BLOCK]; N] {
    let mut columns = [[0.0; BLOCK]; N];
    for (row, of_row) in rows.iter().enumerate() {
        for (column, value) in columns.iter_mut().zip(of_row) {
            column[row] = *value;
        }
    }
    columns
}

impl Coupled {
    #[inline(always)]
    #[allow(clippy::inline_always, reason = "compiled once per instruction set")]
    fn learn<S: Simd, const M: usize>(
        &mut self,
        simd: S,
        load: &KnownLoad,
        gain: &[[f64; BLOCK]],
        whitened: &[[f64; WIDTH]; M],
    ) {
        let seen = combine::<S, M, WIDTH>(simd, &load.coupling, gain); // (C Γ)ᵀ
        let columns = transposed::<M, N_PARAMETERS>(&seen);
        add_outer(simd, &mut self.spread, &columns, &seen, -1.0);
        add_outer(simd, &mut self.response, &columns, whitened, 1.0);
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
