//! The normal equations of all joints together, summed over rows panel by panel.
//!
//! ```text
//! H = Σ_j A_jᵀ W_j A_j,   b = Σ_j A_jᵀ W_j ỹ_j,   W = diag 1/(c σ² h²)
//! ```
//! Rows are summed in bins of equal weight, so that weights can change without another look at them.

use faer::{ColRef, Mat, MatRef};
use linalg::{add_inner_product, product};

use crate::rigid_body::design::{JointPanel, gathered};
use crate::rigid_body::noise::{JointNoise, N_BINS, bin_of};
use crate::rigid_body::unknowns::Unknowns;

/// H and b.
#[derive(Debug, Clone)]
pub(crate) struct NormalEquations {
    /// (p, p), symmetric.
    pub h: Mat<f64>,
    /// (p,).
    pub b: Vec<f64>,
}

/// Sums over a joint's rows in one bin of speed and one context.
#[derive(Debug, Clone)]
struct Sums {
    count: usize,
    /// AᵀA, (p_j, p_j).
    gram: Mat<f64>,
    /// Aᵀỹ, (p_j,).
    moment: Mat<f64>,
}

/// Sums over a joint's rows, in each context and bin.
#[derive(Debug, Clone)]
pub(crate) struct JointSums {
    of_context: Vec<Vec<Option<Sums>>>,
}

impl JointSums {
    /// Of no row yet.
    pub fn new(n_contexts: usize) -> Self {
        Self {
            of_context: vec![vec![None; N_BINS]; n_contexts],
        }
    }

    /// Adds rows of a context; `rigid` makes the terms that grow with the load, zero without.
    pub fn add(
        &mut self,
        unknowns: &Unknowns,
        context: usize,
        panel: &JointPanel,
        rigid: Option<&[f64]>,
    ) {
        let mut rows_of = vec![Vec::new(); N_BINS];
        for (row, qd) in panel.qd.iter().enumerate() {
            rows_of[bin_of(*qd)].push(row);
        }
        let bins = self.of_context[context].iter_mut().zip(&rows_of);
        for (sums, rows) in bins.filter(|(_, rows)| !rows.is_empty()) {
            let block = gathered(unknowns, panel.columns.as_ref(), rows, rigid);
            let targets: Vec<f64> = rows.iter().map(|row| panel.targets[*row]).collect();
            let p = block.ncols();
            let sums = sums.get_or_insert_with(|| Sums {
                count: 0,
                gram: Mat::zeros(p, p),
                moment: Mat::zeros(p, 1),
            });
            sums.count += rows.len();
            add_inner_product(&mut sums.gram, 1.0, block.as_ref());
            sums.moment += product(block.transpose(), ColRef::from_slice(&targets).as_mat());
        }
    }

    /// Root mean squares of the columns of φ, (terms,); zeros of no row.
    pub fn friction_rms(&self, unknowns: &Unknowns) -> Vec<f64> {
        let n_terms = unknowns.terms().len();
        let (mut squares, mut count) = (vec![0.0; n_terms], 0);
        for sums in self.of_context.iter().flatten().flatten() {
            let first = sums.gram.ncols() - n_terms;
            count += sums.count;
            for (k, square) in squares.iter_mut().enumerate() {
                *square += sums.gram[(first + k, first + k)];
            }
        }
        let count = count.max(1) as f64;
        squares
            .iter()
            .map(|square| (square / count).sqrt())
            .collect()
    }

    /// A context's sums with the weights of a noise.
    fn weighted(&self, context: usize, noise: &JointNoise) -> Option<(Mat<f64>, Mat<f64>)> {
        let mut total: Option<(Mat<f64>, Mat<f64>)> = None;
        for (sums, h) in self.of_context[context].iter().zip(noise.profile) {
            let Some(sums) = sums else { continue };
            let weight = 1.0 / (noise.correlation * (noise.std * h).powi(2));
            let (gram, moment) = (
                faer::Scale(weight) * &sums.gram,
                faer::Scale(weight) * &sums.moment,
            );
            total = Some(match total {
                None => (gram, moment),
                Some((grams, moments)) => (grams + gram, moments + moment),
            });
        }
        total
    }
}

impl NormalEquations {
    /// Without a row.
    pub fn empty(unknowns: &Unknowns) -> Self {
        let p = unknowns.len();
        Self {
            h: Mat::zeros(p, p),
            b: vec![0.0; p],
        }
    }

    /// The same with unknowns behind the last one that no row has seen.
    #[must_use]
    pub fn grown(&self, unknowns: &Unknowns) -> Self {
        let (old, p) = (self.b.len(), unknowns.len());
        let entry = |row: usize, col: usize| {
            if row < old && col < old {
                self.h[(row, col)]
            } else {
                0.0
            }
        };
        let mut b = self.b.clone();
        b.resize(p, 0.0);
        Self {
            h: Mat::from_fn(p, p, entry),
            b,
        }
    }

    /// Adds a joint's rows of all contexts, each with its load.
    pub fn add(
        &mut self,
        unknowns: &Unknowns,
        joint: usize,
        sums: &JointSums,
        loads: &[Option<usize>],
        noise: &JointNoise,
    ) {
        for (context, load) in loads.iter().enumerate() {
            if let Some((gram, moment)) = sums.weighted(context, noise) {
                self.add_block(unknowns, joint, *load, gram.as_ref(), moment.as_ref());
            }
        }
    }

    /// Adds AᵀWA and AᵀWỹ of a joint's own columns, (p_j, p_j) and (p_j, 1), of rows with a load.
    pub fn add_block(
        &mut self,
        unknowns: &Unknowns,
        joint: usize,
        load: Option<usize>,
        gram: MatRef<'_, f64>,
        moment: MatRef<'_, f64>,
    ) {
        let places = places(unknowns, joint, load);
        for (own_col, cols) in places.iter().enumerate() {
            for col in cols.iter().flatten() {
                self.b[*col] += moment[(own_col, 0)];
                for (own_row, rows) in places.iter().enumerate() {
                    for row in rows.iter().flatten() {
                        self.h[(*row, *col)] += gram[(own_row, own_col)];
                    }
                }
            }
        }
    }
}

/// Unknowns that each of a joint's own columns multiplies: one, and the load's for the body that carries it.
fn places(unknowns: &Unknowns, joint: usize, load: Option<usize>) -> Vec<[Option<usize>; 2]> {
    let own = unknowns.own(joint).into_iter();
    let mut places: Vec<[Option<usize>; 2]> = own.map(|unknown| [Some(unknown), None]).collect();
    if let (Some(load), Some(carrier)) = (load, unknowns.carrier_of(joint)) {
        for (place, unknown) in places[carrier].iter_mut().zip(unknowns.load(load)) {
            place[1] = Some(unknown);
        }
    }
    places
}
