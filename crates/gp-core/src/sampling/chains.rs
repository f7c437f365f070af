//! Several chains that find their coordinates together.

use faer::Mat;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;

use super::frame::{Frame, Framed};
use super::laplace::Laplace;
use super::log_density::LogDensity;
use super::normal::normal_quantile;
use super::nuts::{Chain, ChainOptions, sample_chain};
use crate::error::GpError;

/// Parts of the warm-up, in eighths: each but the last ends with a new frame.
const STAGES: [usize; 3] = [1, 2, 4];

/// Of a stage's draws, one in so many goes before its step size is known, and is not looked at.
const UNUSED_ONE_IN: usize = 3;

/// Fewest draws of a chain that make a stage.
const SHORTEST_STAGE: usize = 6;

/// Times that a start without a density is drawn nearer to the maximum by half.
const RETREATS: usize = 20;

/// Keeps the streams of starts apart from those of chains.
const START_STREAM: u64 = 0x5354_4152_5453;

/// Chains from a posterior's maximum, in coordinates that all of them learn from together.
///
/// Each sets out from its own draw of the normal density of `laplace`, half as far away as often as
/// it takes for the density to have a value there.
/// The first coordinates are those of `laplace`; after an eighth, three eighths and seven eighths of
/// the warm-up they are renewed from the draws of all chains and the gradients there.
/// The last eighth adapts the step size only.
/// The draws are those of the density whatever the coordinates are; they set the price.
/// # Shapes
/// `density` makes a density for every chain and stage, always the same one.
/// # Errors
/// As for [`sample_chain`].
/// # Panics
/// If the density is of another dimension than `laplace`.
/// # Source
/// Hoffman & Gelman 2014; Carpenter et al. 2017, sec. 3.3 of "Stan", for a warm-up in stages.
pub fn sample_chains<D: LogDensity>(
    density: impl Fn() -> D + Sync,
    laplace: &Laplace,
    options: &ChainOptions,
    n_chains: u64,
    seed: u64,
) -> Result<Vec<Chain>, GpError> {
    let mut together = Together::set_out(density, laplace.frame(), n_chains, seed);
    let mut n_used = 0;
    for (stage, eighths) in (1..).zip(STAGES) {
        let length = options.n_warmup * eighths / 8;
        if length < SHORTEST_STAGE {
            continue;
        }
        n_used += length;
        let of_stage = ChainOptions {
            n_warmup: length / UNUSED_ONE_IN,
            n_draws: length - length / UNUSED_ONE_IN,
            ..*options
        };
        // Every stage has random numbers of its own.
        let chains = together.run(&of_stage, seed ^ (stage << 48))?;
        together.learn(&chains);
    }
    let of_draws = ChainOptions {
        n_warmup: options.n_warmup - n_used,
        ..*options
    };
    let chains = together.run(&of_draws, seed)?;
    let finished = chains.into_iter().zip(&together.n_evaluations);
    let finished = finished.map(|(chain, n_evaluations)| Chain {
        n_evaluations: n_evaluations + chain.n_evaluations,
        ..in_outer_coordinates(chain, &together.frame)
    });
    Ok(finished.collect())
}

/// Where the chains are, and the coordinates that they share.
struct Together<F> {
    density: F,
    frame: Frame,
    /// z of every chain.
    positions: Vec<Vec<f64>>,
    /// Of every chain before the last run.
    n_evaluations: Vec<usize>,
}

impl<D: LogDensity, F: Fn() -> D + Sync> Together<F> {
    fn set_out(density: F, frame: Frame, n_chains: u64, seed: u64) -> Self {
        let starts = (0..n_chains).map(|chain| start(&mut density(), &frame, seed, chain));
        let positions: Vec<Vec<f64>> = starts.collect();
        Self {
            n_evaluations: vec![0; positions.len()],
            positions,
            density,
            frame,
        }
    }

    /// Goes on with every chain; the draws are of y.
    fn run(&self, options: &ChainOptions, seed: u64) -> Result<Vec<Chain>, GpError> {
        let chain = |(idx, z): (usize, &Vec<f64>)| {
            let mut framed = Framed {
                density: &mut (self.density)(),
                frame: &self.frame,
            };
            sample_chain(&mut framed, &self.frame.inner(z), options, seed, idx as u64)
        };
        self.positions.par_iter().enumerate().map(chain).collect()
    }

    /// Takes the last draws for positions, and coordinates from all of them.
    fn learn(&mut self, chains: &[Chain]) {
        let parts: Vec<Mat<f64>> = (chains.par_iter())
            .map(|chain| gradients(&mut (self.density)(), &self.frame, chain))
            .collect();
        for (idx, chain) in chains.iter().enumerate() {
            let y = row(&chain.draws, chain.draws.nrows() - 1);
            self.positions[idx] = self.frame.outer(&y);
            self.n_evaluations[idx] += chain.n_evaluations + chain.draws.nrows();
        }
        let draws = stacked(chains.iter().map(|chain| &chain.draws));
        let gradients = stacked(parts.iter());
        self.frame = self.frame.refined(draws.as_ref(), gradients.as_ref());
    }
}

/// A draw of the normal density with the frame's width, or one nearer to its centre.
fn start(density: &mut impl LogDensity, frame: &Frame, seed: u64, chain: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ START_STREAM);
    rng.set_stream(chain);
    let d = density.dimension();
    let mut y: Vec<f64> = (0..d).map(|_| normal(&mut rng)).collect();
    let mut gradient = vec![0.0; d];
    for _ in 0..RETREATS {
        if density.evaluate(&frame.outer(&y), &mut gradient).is_ok() {
            break;
        }
        for y in &mut y {
            *y *= 0.5;
        }
    }
    frame.outer(&y)
}

/// A standard normal number.
fn normal(rng: &mut ChaCha8Rng) -> f64 {
    // 53 bits in the middles of their intervals: never 0 or 1.
    let uniform = ((rng.next_u64() >> 11) as f64 + 0.5) / (1_u64 << 53) as f64;
    normal_quantile(uniform)
}

/// Gradients by y at the draws of a chain, (n, d); NaN where there is none.
fn gradients(density: &mut impl LogDensity, frame: &Frame, chain: &Chain) -> Mat<f64> {
    let (n, d) = (chain.draws.nrows(), chain.draws.ncols());
    let mut framed = Framed { density, frame };
    let mut gradients = Mat::full(n, d, f64::NAN);
    let mut gradient = vec![0.0; d];
    for idx in 0..n {
        if framed
            .evaluate(&row(&chain.draws, idx), &mut gradient)
            .is_ok()
        {
            for (col, slope) in gradient.iter().enumerate() {
                gradients[(idx, col)] = *slope;
            }
        }
    }
    gradients
}

fn in_outer_coordinates(mut chain: Chain, frame: &Frame) -> Chain {
    for idx in 0..chain.draws.nrows() {
        let z = frame.outer(&row(&chain.draws, idx));
        for (col, z) in z.into_iter().enumerate() {
            chain.draws[(idx, col)] = z;
        }
    }
    chain
}

fn row(matrix: &Mat<f64>, idx: usize) -> Vec<f64> {
    matrix.row(idx).iter().copied().collect()
}

/// The rows of all matrices, one after another.
fn stacked<'a>(parts: impl Iterator<Item = &'a Mat<f64>>) -> Mat<f64> {
    let rows: Vec<Vec<f64>> = parts
        .flat_map(|part| (0..part.nrows()).map(move |idx| row(part, idx)))
        .collect();
    let d = rows.first().map_or(0, Vec::len);
    Mat::from_fn(rows.len(), d, |idx, col| rows[idx][col])
}
