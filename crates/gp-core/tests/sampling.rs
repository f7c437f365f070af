//! Sec. 5: chains against densities whose moments are known, and their diagnostics against theory.

use faer::mat;
use gp_core::sampling::{
    Chain, ChainOptions, ChainSummary, HyperPosterior, HyperPrior, Laplace, LogDensity,
    normal_quantile, sample_chain, sample_chains, split_r_hat,
};
use gp_core::{GpError, LikelihoodOptions, LogMarginal};
use kernels::LinearArd;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const OPTIONS: ChainOptions = ChainOptions {
    n_warmup: 300,
    n_draws: 2000,
    max_depth: 6,
    target_acceptance: 0.8,
};

/// A function of one draw.
type Quantity = fn(&[f64]) -> f64;

fn columns(chains: &[Chain], of: impl Fn(&[f64]) -> f64) -> Vec<Vec<f64>> {
    let values = |chain: &Chain| {
        let row = |i: usize| chain.draws.row(i).iter().copied().collect::<Vec<f64>>();
        (0..chain.draws.nrows()).map(|i| of(&row(i))).collect()
    };
    chains.iter().map(values).collect()
}

/// The mean over all draws, and its standard error.
fn mean_and_error(chains: &[Vec<f64>]) -> (f64, f64) {
    let values = chains.concat();
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let var = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
    (mean, (var / ChainSummary::of(chains).mean_size).sqrt())
}

/// z = log g with g of a gamma distribution of shape a.
struct LogGamma(f64);

impl LogDensity for LogGamma {
    fn dimension(&self) -> usize {
        1
    }

    fn evaluate(&mut self, z: &[f64], gradient: &mut [f64]) -> Result<f64, GpError> {
        gradient[0] = self.0 - z[0].exp();
        Ok(self.0 * z[0] - z[0].exp())
    }
}

#[test]
fn moments_of_a_skewed_density_are_found() {
    let chain = |k| sample_chain(&mut LogGamma(3.0), &[0.5], &OPTIONS, 1, k).unwrap();
    let chains: Vec<Chain> = (0..4).map(chain).collect();
    // E g = a, E g² = a(a + 1), E log g = ψ(3) = 3/2 − γ.
    let cases: [(Quantity, f64); 3] = [
        (|z| z[0].exp(), 3.0),
        (|z| (2.0 * z[0]).exp(), 12.0),
        (|z| z[0], 1.5 - 0.577_215_664_901_532_9),
    ];
    for (of, expected) in cases {
        let values = columns(&chains, of);
        let (mean, error) = mean_and_error(&values);
        assert!((mean - expected).abs() < 4.0 * error, "{mean} ± {error}");
        assert!(error < 0.05 * expected, "{error}");
        assert!(ChainSummary::of(&values).r_hat < 1.01);
    }
    assert!(chains.iter().all(|chain| chain.n_divergences == 0));
}

#[test]
fn draws_repeat_and_chains_differ() {
    let short = ChainOptions {
        n_warmup: 20,
        n_draws: 30,
        ..OPTIONS
    };
    let chain = |seed, k| sample_chain(&mut LogGamma(3.0), &[0.5], &short, seed, k).unwrap();
    assert_eq!(chain(1, 0), chain(1, 0));
    assert_ne!(chain(1, 0).draws, chain(1, 1).draws);
    assert_ne!(chain(1, 0).draws, chain(2, 0).draws);
}

#[test]
fn a_start_without_a_density_is_refused() {
    let error = sample_chain(&mut Nowhere, &[0.0], &OPTIONS, 1, 0).unwrap_err();
    let expected = GpError::NoUsableStart {
        n_starts: 1,
        reason: Some(Box::new(GpError::NonFiniteLikelihood { n_samples: 1 })),
    };
    assert_eq!(error, expected);
}

struct Nowhere;

impl LogDensity for Nowhere {
    fn dimension(&self) -> usize {
        1
    }

    fn evaluate(&mut self, _: &[f64], _: &mut [f64]) -> Result<f64, GpError> {
        Err(GpError::NonFiniteLikelihood { n_samples: 1 })
    }
}

/// A weight u and σ of five torques of one covariate.
fn toy<'a>(
    x: &'a faer::Mat<f64>,
    targets: &'a [f64],
) -> HyperPosterior<LinearArd, LogMarginal<'a>> {
    let covariance = LinearArd::new(vec![1.0]).unwrap();
    let prior = HyperPrior::about(&covariance, 0.5).unwrap();
    let likelihood = LogMarginal::new(x.as_ref(), targets, LikelihoodOptions::dense());
    HyperPosterior::new(covariance, likelihood, prior)
}

const TARGETS: [f64; 5] = [1.3, -2.4, 0.2, 2.9, -0.7];

#[test]
fn gradient_of_the_posterior_is_its_central_difference() {
    let x = mat![[1.0], [-2.0], [0.5], [2.5], [-1.0]];
    let mut posterior = toy(&x, &TARGETS);
    for z in [[-4.0_f64, -1.0_f64], [-3.0, 0.5], [-5.0, -3.0]] {
        let mut gradient = [0.0; 2];
        let value = posterior.evaluate(&z, &mut gradient).unwrap();
        // Of K + σ²I: 1 + u² Σx²/σ² with u = 100/(1 + e^−z₀) and σ² = 10⁻⁴ + e^z₁.
        let u = 100.0 / (1.0 + (-z[0]).exp());
        let condition = 1.0 + u * u * 12.5 / (1e-4 + z[1].exp());
        for idx in 0..2 {
            let step = f64::EPSILON.cbrt();
            let mut at = |shift: f64| {
                let mut moved = z;
                moved[idx] += shift;
                posterior.evaluate(&moved, &mut [0.0; 2]).unwrap()
            };
            let difference = (at(step) - at(-step)) / (2.0 * step);
            // Derivatives by coordinates that enter as exponentials are all of the size of the value.
            let size = condition * f64::EPSILON / step + step * step;
            let tolerance = size * (10.0 + value.abs());
            let error = (gradient[idx] - difference).abs();
            assert!(error < tolerance, "{error:e} {tolerance:e}");
        }
    }
}

/// Means over chains are the expected ones within four of their errors, and the chains agree.
fn assert_means(chains: &[Chain], cases: &[(Quantity, f64)]) {
    for &(of, expected) in cases {
        let values = columns(chains, of);
        let (mean, error) = mean_and_error(&values);
        assert!(
            (mean - expected).abs() < 4.0 * error,
            "{mean} ± {error}, {expected}"
        );
        assert!(ChainSummary::of(&values).r_hat < 1.02);
    }
}

#[test]
fn posterior_of_two_hyperparameters_is_that_of_quadrature() {
    let x = mat![[1.0], [-2.0], [0.5], [2.5], [-1.0]];
    let mut posterior = toy(&x, &TARGETS);
    // u is about 1: logit(1/100) ≈ −4.6; a grid of ±6 posterior widths and more.
    let grid =
        |low: f64, high: f64| (0..200).map(move |i| low + (high - low) * f64::from(i) / 199.0);
    let mut sums = [0.0; 5];
    for z0 in grid(-12.0, 4.0) {
        for z1 in grid(-18.0, 12.0) {
            let value = posterior.evaluate(&[z0, z1], &mut [0.0; 2]).unwrap();
            let weight = (value + 10.0).exp();
            for (sum, power) in sums.iter_mut().zip([1.0, z0, z1, z0 * z0, z1 * z1]) {
                *sum += weight * power;
            }
        }
    }

    let start = posterior.prior().start(&[1.0, 0.3]);
    let chains: Vec<Chain> = (0..4)
        .map(|k| sample_chain(&mut toy(&x, &TARGETS), &start, &OPTIONS, 7, k).unwrap())
        .collect();
    let cases: [(Quantity, f64); 4] = [
        (|z| z[0], sums[1] / sums[0]),
        (|z| z[1], sums[2] / sums[0]),
        (|z| z[0] * z[0], sums[3] / sums[0]),
        (|z| z[1] * z[1], sums[4] / sums[0]),
    ];
    assert_means(&chains, &cases);
}

/// x_t = φ x_{t−1} + √(1 − φ²) ε, stationary from the beginning.
fn autoregressive(seed: u64, phi: f64, n: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = || normal_quantile(0.5 * f64::EPSILON + rng.random::<f64>());
    let mut x = normal();
    let mut next = || {
        x = phi * x + (1.0 - phi * phi).sqrt() * normal();
        x
    };
    (0..n).map(|_| next()).collect()
}

#[test]
fn effective_size_of_autoregressive_chains_is_the_known_one() {
    for phi in [-0.3, 0.0, 0.5, 0.9] {
        let chains: Vec<Vec<f64>> = (0..4).map(|k| autoregressive(k, phi, 20_000)).collect();
        // 1 + 2 Σ φᵗ = (1 + φ)/(1 − φ)
        let expected = 80_000.0 * (1.0 - phi) / (1.0 + phi);
        let summary = ChainSummary::of(&chains);
        let found = summary.mean_size;
        assert!(
            (found / expected - 1.0).abs() < 0.1,
            "{phi}: {found} {expected}"
        );
        assert!((summary.bulk_size / expected - 1.0).abs() < 0.1);
        assert!(summary.r_hat < 1.01);
    }
}

#[test]
fn chains_that_disagree_are_found_out() {
    let mut chains: Vec<Vec<f64>> = (0..4).map(|k| autoregressive(k, 0.0, 1000)).collect();
    // One of four chains is off by 2: B/N = (2²·3/16)·8/7 of 8 halves, so R̂² ≈ 1 + 6/7.
    for value in &mut chains[3] {
        *value += 2.0;
    }
    let found = split_r_hat(&chains);
    assert!(
        (found - (1.0_f64 + 6.0 / 7.0).sqrt()).abs() < 0.05,
        "{found}"
    );
    assert!(ChainSummary::of(&chains).r_hat > 1.2);

    // Another width, the same mean: only the folded ranks see it.
    let mut chains: Vec<Vec<f64>> = (0..4).map(|k| autoregressive(k, 0.0, 1000)).collect();
    for value in &mut chains[3] {
        *value *= 5.0;
    }
    assert!(split_r_hat(&chains) < 1.02);
    assert!(ChainSummary::of(&chains).r_hat > 1.1);

    // A chain that drifts is found out by its halves.
    let drift: Vec<f64> = (0..1000).map(|i| f64::from(i) / 100.0).collect();
    assert!(split_r_hat(&[drift]) > 1.5);
}

#[test]
fn chains_in_the_coordinates_of_the_maximum_draw_from_the_same_posterior() {
    let x = mat![[1.0], [-2.0], [0.5], [2.5], [-1.0]];
    let mut posterior = toy(&x, &TARGETS);
    let laplace = Laplace::climb(&mut posterior, &[-3.0, 0.5]).unwrap();

    // A maximum: no neighbour is higher, and the slope is small beside that of the prior.
    let mut gradient = [0.0; 2];
    let highest = posterior.evaluate(laplace.mode(), &mut gradient).unwrap();
    assert!((highest - laplace.log_density()).abs() < 1e-12);
    assert!(
        gradient.iter().all(|slope| slope.abs() < 0.05),
        "{gradient:?}"
    );

    let mut sums = [0.0; 3];
    for i in 0..200 {
        for j in 0..200 {
            let z = [
                -12.0 + 16.0 * f64::from(i) / 199.0,
                -18.0 + 30.0 * f64::from(j) / 199.0,
            ];
            let weight = (posterior.evaluate(&z, &mut [0.0; 2]).unwrap() - highest).exp();
            for (sum, power) in sums.iter_mut().zip([1.0, z[0], z[1]]) {
                *sum += weight * power;
            }
        }
    }
    let sample = || sample_chains(|| toy(&x, &TARGETS), &laplace, &OPTIONS, 4, 7).unwrap();
    let chains = sample();
    let cases: [(Quantity, f64); 2] =
        [(|z| z[0], sums[1] / sums[0]), (|z| z[1], sums[2] / sums[0])];
    assert_means(&chains, &cases);
    assert_eq!(chains, sample());
    let alone = rayon::ThreadPoolBuilder::new().num_threads(1).build();
    assert_eq!(chains, alone.unwrap().install(sample));
}

#[test]
fn information_is_that_of_data_and_prior() {
    let x = mat![[1.0], [-2.0], [0.5], [2.5], [-1.0]];
    let posterior = toy(&x, &TARGETS);
    let z = [-4.0_f64, -1.0_f64];
    // C = u² xxᵀ + σ²I has the eigenvalues u²|x|² + σ² once and σ² four times.
    let (u, noise_var) = (100.0 / (1.0 + 4.0_f64.exp()), 1e-4 + (-1.0_f64).exp());
    let signal = 2.0 * u * u * 12.5 * (1.0 - u / 100.0); // ∂/∂z₀ of u²|x|²
    let noise = (-1.0_f64).exp();
    let largest = u * u * 12.5 + noise_var;
    let expected = [
        0.5 * (signal / largest).powi(2) + 0.25, // prior: standard deviation 2
        0.5 * signal * noise / (largest * largest),
        0.5 * (noise / largest).powi(2) + 2.0 * (noise / noise_var).powi(2) + 1.0 / 16.0,
    ];
    let information = posterior.information(&z).unwrap();
    for (place, expected) in [(0, 0), (1, 0), (1, 1)].into_iter().zip(expected) {
        // Central differences of step 10⁻⁴: an error of some 10⁻⁸.
        let error = (information[place] - expected).abs();
        assert!(
            error < 1e-6 * expected.abs().max(1.0),
            "{place:?} {error:e}"
        );
    }
}

/// A normal density about a point.
struct Normal {
    centre: Vec<f64>,
    precision: faer::Mat<f64>,
}

impl Normal {
    /// Every two neighbours have the correlation ρ: a stationary autoregressive sequence.
    ///
    /// Its precision has (1 + ρ²)/(1 − ρ²) on the diagonal, 1/(1 − ρ²) at both ends, −ρ/(1 − ρ²) beside it.
    fn sequence(d: usize, rho: f64) -> Self {
        let entry = |row: usize, col: usize| match row.abs_diff(col) {
            0 if row == 0 || row == d - 1 => 1.0,
            0 => 1.0 + rho * rho,
            1 => -rho,
            _ => 0.0,
        };
        let scale = 1.0 / (1.0 - rho * rho);
        Self {
            centre: vec![3.0; d],
            precision: faer::Mat::from_fn(d, d, |row, col| scale * entry(row, col)),
        }
    }
}

impl LogDensity for Normal {
    fn dimension(&self) -> usize {
        self.centre.len()
    }

    fn evaluate(&mut self, z: &[f64], gradient: &mut [f64]) -> Result<f64, GpError> {
        let d = z.len();
        let mut value = 0.0;
        for row in 0..d {
            gradient[row] = -(0..d)
                .map(|col| self.precision[(row, col)] * (z[col] - self.centre[col]))
                .sum::<f64>();
            value += 0.5 * gradient[row] * (z[row] - self.centre[row]);
        }
        Ok(value)
    }
}

#[test]
fn correlations_of_0_999_are_learned_while_the_chains_warm_up() {
    let density = || Normal::sequence(20, 0.999);
    let start = Laplace::about(vec![3.0; 20], faer::Mat::identity(20, 20).as_ref()).unwrap();
    let options = ChainOptions {
        n_warmup: 400,
        n_draws: 500,
        ..OPTIONS
    };
    let chains = sample_chains(density, &start, &options, 4, 3).unwrap();
    let cases: [(Quantity, f64); 4] = [
        (|z| z[0], 3.0),
        (|z| (z[0] - 3.0).powi(2), 1.0),
        (|z| (z[0] - 3.0) * (z[1] - 3.0), 0.999),
        (|z| (z[0] - z[19]).powi(2), 2.0 - 2.0 * 0.999_f64.powi(19)),
    ];
    assert_means(&chains, &cases);
    for chain in &chains {
        // In the coordinates of the start, trajectories of 2⁶ steps would not reach the other end.
        assert_eq!((chain.n_divergences, chain.n_longest), (0, 0));
        assert!(chain.n_evaluations < 20 * 900, "{}", chain.n_evaluations);
    }
}

/// Neal's funnel (2003, "Slice sampling", sec. 8), less deep: v and three x.
struct Funnel;

impl LogDensity for Funnel {
    fn dimension(&self) -> usize {
        4
    }

    /// v ~ N(0, 1), x_i ~ N(0, eᵛ).
    fn evaluate(&mut self, z: &[f64], gradient: &mut [f64]) -> Result<f64, GpError> {
        let squares: f64 = z[1..].iter().map(|x| x * x).sum();
        let precision = (-z[0]).exp();
        gradient[0] = -z[0] - 1.5 + 0.5 * precision * squares;
        for (slope, x) in gradient[1..].iter_mut().zip(&z[1..]) {
            *slope = -precision * x;
        }
        Ok(-0.5 * z[0] * z[0] - 1.5 * z[0] - 0.5 * precision * squares)
    }
}

#[test]
fn both_ends_of_a_funnel_are_visited() {
    let start = Laplace::about(vec![0.0; 4], faer::Mat::identity(4, 4).as_ref()).unwrap();
    let options = ChainOptions {
        target_acceptance: 0.95,
        ..OPTIONS
    };
    let chains = sample_chains(|| Funnel, &start, &options, 4, 5).unwrap();
    // E x² = E eᵛ = e^½.
    let cases: [(Quantity, f64); 3] = [
        (|z| z[0], 0.0),
        (|z| z[0] * z[0], 1.0),
        (|z| z[1] * z[1] * (-z[0]).exp(), 1.0),
    ];
    assert_means(&chains, &cases);
    let lowest = columns(&chains, |z| z[0]).concat();
    assert!(lowest.iter().copied().fold(0.0, f64::min) < -2.5);
}
