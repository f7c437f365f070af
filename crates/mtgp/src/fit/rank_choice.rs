//! The rank of the task matrix by an information criterion, eq. (19).
//!
//! ```text
//! BIC(r) = −2 Σ_i log L_ir + k(r) log n        k(r) = Σ_i d_i + ½ ℓ r (2m + 1 − r) + ℓ
//! AIC(r) = −2 Σ_i log L_ir + 2 k(r)
//! HQ(r)  = −2 Σ_i log L_ir + 2 k(r) log log n
//! ```
//! d_i counts the hyperparameters of joint i's covariance without its σ_i, which are
//! the last ℓ; n counts the observations of all joints and tasks.
//! The count is the chapter's: that (c K^ρ, c^x/c) is one model for every c takes
//! nothing off it, and would take the same off every rank.

use crate::error::{MtgpError, require_count};
use crate::prior::TaskFactor;

/// What a further hyperparameter has to earn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Criterion {
    /// Bayesian: ½ log n nats each. The chapter's.
    #[default]
    Bic,
    /// Akaike: 1 nat each.
    Aic,
    /// Hannan–Quinn: log log n nats each.
    HannanQuinn,
}

impl Criterion {
    /// The value of the criterion: the least is best.
    ///
    /// ```text
    /// −2 log L + k · (log n | 2 | 2 log log n)
    /// ```
    /// `log_marginal` in nats, summed over all data; `n_observations` n of at least 3,
    /// as log log n is negative below e.
    /// # Source
    /// Eq. (19); Schwarz 1978; Akaike 1974; Hannan & Quinn 1979.
    pub fn value(self, log_marginal: f64, n_params: usize, n_observations: usize) -> f64 {
        let n = n_observations as f64;
        let price = match self {
            Self::Bic => n.ln(),
            Self::Aic => 2.0,
            Self::HannanQuinn => 2.0 * n.ln().ln(),
        };
        -2.0 * log_marginal + price * n_params as f64
    }
}

/// What the joints of a robot contribute to eq. (19) besides their likelihoods.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RankCounts {
    /// m.
    pub n_tasks: usize,
    /// d_i per joint: hyperparameters of c_i^x, without σ_i.
    pub n_input_params: Vec<usize>,
    /// Σ_γ n_i^γ per joint: its observations in all tasks.
    pub n_observations: Vec<usize>,
}

impl RankCounts {
    /// Σ_i d_i + ½ ℓ r (2m + 1 − r) + ℓ.
    ///
    /// # Panics
    /// If `rank` is above the number of tasks.
    /// # Source
    /// Eq. (19).
    pub fn n_params(&self, rank: usize) -> usize {
        (0..self.n_input_params.len())
            .map(|joint| self.n_params_of_joint(joint, rank))
            .sum()
    }

    /// Σ_i d_i + ½ r (2m + 1 − r) + ℓ, for one Λ of all joints.
    ///
    /// # Panics
    /// If `rank` is above the number of tasks.
    /// # Source
    /// Eq. (19) for the first extension of sec. 5.
    pub fn n_params_shared(&self, rank: usize) -> usize {
        let n_joints = self.n_input_params.len();
        let of_inputs: usize = self.n_input_params.iter().sum();
        of_inputs + TaskFactor::count(self.n_tasks, rank) + n_joints
    }

    /// d_i + ½ r (2m + 1 − r) + 1.
    ///
    /// # Panics
    /// If `rank` is above the number of tasks, or there is no such joint.
    pub fn n_params_of_joint(&self, joint: usize, rank: usize) -> usize {
        self.n_input_params[joint] + TaskFactor::count(self.n_tasks, rank) + 1
    }
}

/// One rank with the highest log marginal likelihood found for every joint.
#[derive(Debug, Clone, PartialEq)]
pub struct RankCandidate {
    /// r.
    pub rank: usize,
    /// log L_ir per joint, natural log.
    pub log_marginals: Vec<f64>,
}

/// The rank with the least value of a criterion.
#[derive(Debug, Clone, PartialEq)]
pub struct RankChoice {
    /// The rank chosen; the lower one of equals.
    pub rank: usize,
    /// The criterion used.
    pub criterion: Criterion,
    /// (r, value) for every candidate, in the order given.
    pub values: Vec<(usize, f64)>,
}

/// Chooses one rank for all joints.
///
/// # Errors
/// [`MtgpError::CountMismatch`] without candidates or joints, or for counts or likelihoods
/// that are not one per joint; [`MtgpError::BadRank`] for a rank of 0 or above m;
/// [`MtgpError::NonFinite`] for a likelihood that is not finite.
/// # Source
/// Eq. (19). One rank for all joints: sec. 4.3.2.
pub fn choose_rank(
    candidates: &[RankCandidate],
    counts: &RankCounts,
    criterion: Criterion,
) -> Result<RankChoice, MtgpError> {
    require_usable(candidates, counts)?;
    let n_observations = counts.n_observations.iter().sum();
    Ok(least(candidates, criterion, |candidate| {
        let log_marginal = candidate.log_marginals.iter().sum();
        criterion.value(
            log_marginal,
            counts.n_params(candidate.rank),
            n_observations,
        )
    }))
}

/// The candidate with the least value; of equal values the lower rank.
fn least(
    candidates: &[RankCandidate],
    criterion: Criterion,
    value_of: impl Fn(&RankCandidate) -> f64,
) -> RankChoice {
    let values: Vec<(usize, f64)> = (candidates.iter())
        .map(|candidate| (candidate.rank, value_of(candidate)))
        .collect();
    let better = |best: (usize, f64), next: (usize, f64)| {
        let is_better = next.1.total_cmp(&best.1).then(next.0.cmp(&best.0)).is_lt();
        if is_better { next } else { best }
    };
    let (rank, _) = values
        .iter()
        .copied()
        .fold((usize::MAX, f64::INFINITY), better);
    RankChoice {
        rank,
        criterion,
        values,
    }
}

fn require_usable(candidates: &[RankCandidate], counts: &RankCounts) -> Result<(), MtgpError> {
    let (n_joints, n_tasks) = (counts.n_input_params.len(), counts.n_tasks);
    require_count(
        "numbers of observations",
        counts.n_observations.len(),
        n_joints,
    )?;
    if candidates.is_empty() || n_joints == 0 {
        let found = candidates.len().min(n_joints);
        return require_count("ranks and joints to choose from", found, 1);
    }
    for RankCandidate {
        rank,
        log_marginals,
    } in candidates
    {
        let rank = *rank;
        if rank == 0 || rank > n_tasks {
            return Err(MtgpError::BadRank { rank, n_tasks });
        }
        require_count(
            "log marginal likelihoods of a rank",
            log_marginals.len(),
            n_joints,
        )?;
        if let Some(joint) = log_marginals.iter().position(|value| !value.is_finite()) {
            return Err(MtgpError::NonFinite {
                what: "log marginal likelihood (rank by joint)",
                row: rank,
                column: joint,
                value: log_marginals[joint],
            });
        }
    }
    Ok(())
}
