//! Whether chains agree and how much their draws are worth: split R̂ and effective sample size.

use super::normal::normal_quantile;

/// R̂ and effective sample sizes of one quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ChainSummary {
    /// Split R̂, rank-normalised, the larger of that of the values and of their distances from the
    /// median; near 1 where the chains agree.
    pub r_hat: f64,
    /// Effective sample size of the ranks, for statements about the middle.
    pub bulk_size: f64,
    /// Effective sample size of the values, for their mean.
    pub mean_size: f64,
}

impl ChainSummary {
    /// Of the draws of several chains.
    ///
    /// # Panics
    /// If there is no chain, or they are not all of one length of at least 4.
    /// # Source
    /// Vehtari, Gelman, Simpson, Carpenter & Bürkner 2021, "Rank-normalization, folding, and
    /// localization: an improved R̂".
    pub fn of(chains: &[Vec<f64>]) -> Self {
        let halves = split(chains);
        let ranks = rank_normalised(&halves);
        let median = median(&halves);
        let folded: Vec<Vec<f64>> = (halves.iter())
            .map(|half| half.iter().map(|value| (value - median).abs()).collect())
            .collect();
        Self {
            r_hat: r_hat(&ranks).max(r_hat(&rank_normalised(&folded))),
            bulk_size: size(&ranks),
            mean_size: size(&halves),
        }
    }
}

/// Split R̂ of the values as they are.
///
/// ```text
/// R̂² = ((N − 1) W/N + B/N) / W      W: mean variance within the half chains, B/N: variance of their means
/// ```
/// # Panics
/// As for [`ChainSummary::of`].
/// # Source
/// Gelman et al. 2013, *Bayesian Data Analysis*, 3rd ed., sec. 11.4.
pub fn split_r_hat(chains: &[Vec<f64>]) -> f64 {
    r_hat(&split(chains))
}

/// The first and the second half of every chain; the middle draw of an odd number is left out.
fn split(chains: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = chains.first().map_or(0, Vec::len);
    assert!(
        n >= 4 && chains.iter().all(|chain| chain.len() == n),
        "chains of one length of at least 4"
    );
    let half = n / 2;
    (chains.iter())
        .flat_map(|chain| [chain[..half].to_vec(), chain[n - half..].to_vec()])
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Of divisor n − 1.
fn variance(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    squares / (values.len() as f64 - 1.0)
}

/// Mean variance within the chains, and the estimate of the variance from all of them.
fn variances(chains: &[Vec<f64>]) -> (f64, f64) {
    let n = chains[0].len() as f64;
    let within = mean(&chains.iter().map(|c| variance(c)).collect::<Vec<_>>());
    let means: Vec<f64> = chains.iter().map(|c| mean(c)).collect();
    (within, within * (n - 1.0) / n + variance(&means))
}

/// 1 for a quantity that never changes; infinite if only the chains differ.
fn r_hat(chains: &[Vec<f64>]) -> f64 {
    let (within, total) = variances(chains);
    if total <= 0.0 {
        return 1.0;
    }
    (total / within).sqrt()
}

/// Independent draws that would tell the mean as well, by Geyer's initial monotone sequence.
///
/// ```text
/// S / (1 + 2 Σ_t ρ_t)
/// ```
/// # Source
/// Vehtari et al. 2021, sec. 3.2; Geyer 1992.
fn size(chains: &[Vec<f64>]) -> f64 {
    let (m, n) = (chains.len() as f64, chains[0].len());
    let (within, total) = variances(chains);
    if total <= 0.0 {
        return m * n as f64;
    }
    let rho = |lag: usize| {
        let of_chains: Vec<f64> = chains.iter().map(|c| autocovariance(c, lag)).collect();
        1.0 - (within - mean(&of_chains)) / total
    };
    // Sums of neighbouring pairs are positive and decreasing for a reversible chain.
    let mut sum = -1.0;
    let mut last = f64::INFINITY;
    for lag in (0..n - 1).step_by(2) {
        let first = if lag == 0 { 1.0 } else { rho(lag) };
        let pair = first + rho(lag + 1);
        if pair <= 0.0 {
            break;
        }
        last = last.min(pair);
        sum += 2.0 * last;
    }
    let draws = m * n as f64;
    // Antithetic chains are trusted up to a point.
    draws / sum.max(1.0 / draws.log10())
}

/// Of divisor n − 1 at lag 0 as at the others, so that ρ_0 = 1.
fn autocovariance(values: &[f64], lag: usize) -> f64 {
    let mean = mean(values);
    let products = values.iter().zip(&values[lag..]);
    let sum: f64 = products.map(|(a, b)| (a - mean) * (b - mean)).sum();
    sum / (values.len() as f64 - 1.0)
}

/// Φ⁻¹((rank − 3/8)/(S + 1/4)) of every value among all; equal values share their mean rank.
fn rank_normalised(chains: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let n = chains[0].len();
    let values = chains.concat();
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut scores = vec![0.0; values.len()];
    let mut first = 0;
    while first < order.len() {
        let same = |place: &&usize| values[**place].total_cmp(&values[order[first]]).is_eq();
        let count = order[first..].iter().take_while(same).count();
        let rank = first as f64 + 0.5 * (count as f64 + 1.0);
        let score = normal_quantile((rank - 0.375) / (values.len() as f64 + 0.25));
        for &idx in &order[first..first + count] {
            scores[idx] = score;
        }
        first += count;
    }
    scores.chunks(n).map(<[f64]>::to_vec).collect()
}

fn median(chains: &[Vec<f64>]) -> f64 {
    let mut values = chains.concat();
    values.sort_by(f64::total_cmp);
    let middle = values.len() / 2;
    0.5 * (values[middle] + values[(values.len() - 1) / 2])
}
