//! mGP, iGP and pGP: processes of several contexts together, eqs. (13)–(16), (19) and A.3.

use gp_core::{LikelihoodOptions, Posterior};
use kernels::Covariance;
use mtgp::fit::{
    Criterion, MultiTaskOptions, RankCandidate, RankCounts, StageOne, choose_rank, fit_independent,
    fit_pooled, fit_ranks_telling,
};
use mtgp::{MtgpError, Stacked, TaskFit};

use crate::error::TorqueError;
use crate::fit_summary::FitSummary;
use crate::joint_model::JointModel;
use crate::learn::candidate::{Candidate, TaskCandidate};
use crate::learn::learner::Learn;
use crate::parts::RankSelection;
use crate::process::TaskProcess;
use crate::samples::{JointTorques, Samples};

/// Ranks that a criterion chooses from, where there are more contexts than that. Source: sec. 4.6.
const RANKS: [usize; 6] = [2, 4, 5, 6, 8, 10];

/// Contexts up to which all ranks are tried.
const FEW_CONTEXTS: usize = 5;

/// How the contexts are related.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tasks {
    /// iGP: K^ρ = I.
    Independent,
    /// pGP: K^ρ = 11ᵀ.
    Pooled,
    /// mGP: K^ρ = ΛΛᵀ.
    Transfer(Ranks),
}

/// The rank of K^ρ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ranks {
    /// Given.
    Given(usize),
    /// Chosen by a criterion, the same for all joints.
    Chosen(Criterion),
}

/// Processes of several contexts.
#[derive(Debug, Clone, PartialEq)]
pub struct ManyContexts {
    /// How they are related.
    pub tasks: Tasks,
    /// How the hyperparameters are searched for; which joints are continuous, the samples say.
    pub options: MultiTaskOptions,
}

/// Ranks that a criterion chooses from, ascending: all for up to five contexts, then those of the chapter.
pub fn candidate_ranks(n_contexts: usize) -> Vec<usize> {
    if n_contexts <= FEW_CONTEXTS {
        return (1..=n_contexts).collect();
    }
    let ranks = RANKS.into_iter();
    ranks.filter(|rank| *rank <= n_contexts).collect()
}

impl ManyContexts {
    fn ranks(&self, n_contexts: usize) -> Vec<usize> {
        match self.tasks {
            Tasks::Independent | Tasks::Pooled => Vec::new(),
            Tasks::Transfer(Ranks::Given(rank)) => vec![rank],
            Tasks::Transfer(Ranks::Chosen(_)) => candidate_ranks(n_contexts),
        }
    }

    /// The mGPs of some ranks, in their order.
    fn transfer(
        &self,
        data: &Stacked,
        targets: &[f64],
        options: &MultiTaskOptions,
        tell: &mut dyn FnMut(&str),
    ) -> Result<Vec<TaskFit>, MtgpError> {
        tell("pGP and iGP, to set out from");
        let stage_one = StageOne::new(data, targets, options)?;
        let ranks = self.ranks(data.n_tasks());
        let names: Vec<String> = ranks.iter().map(ToString::to_string).collect();
        let mut tell_part = |n_searched: usize| {
            tell(&format!(
                "rank {}, searched on {n_searched}",
                names.join(", ")
            ));
        };
        fit_ranks_telling(data, targets, &ranks, &stage_one, options, &mut tell_part)
    }
}

impl Learn for ManyContexts {
    fn name(&self) -> String {
        match self.tasks {
            Tasks::Independent => "iGP".to_owned(),
            Tasks::Pooled => "pGP".to_owned(),
            Tasks::Transfer(Ranks::Given(rank)) => format!("mGP-{rank}"),
            Tasks::Transfer(Ranks::Chosen(criterion)) => format!("mGP-{}", name_of(criterion)),
        }
    }

    fn is_of_many_contexts(&self) -> bool {
        true
    }

    fn candidates(
        &self,
        samples: &Samples,
        joint: &JointTorques,
        tell: &mut dyn FnMut(&str),
    ) -> Result<Vec<Candidate>, TorqueError> {
        let options = of_samples(&self.options, samples);
        let data = stacked(samples)?;
        let targets = data.stack(&joint.values);
        let fits = match self.tasks {
            Tasks::Independent => {
                tell("iGP");
                vec![fit_independent(&data, &targets, &options)?]
            }
            Tasks::Pooled => {
                tell("pGP");
                vec![fit_pooled(&data, &targets, &options)?]
            }
            Tasks::Transfer(_) => self.transfer(&data, &targets, &options, tell)?,
        };
        Ok(fits.into_iter().map(Candidate::from).collect())
    }

    fn choose(
        &self,
        samples: &Samples,
        of_joints: &[(&JointTorques, Vec<Candidate>)],
    ) -> Result<(usize, Option<RankSelection>), TorqueError> {
        let Tasks::Transfer(Ranks::Chosen(criterion)) = self.tasks else {
            return Ok((0, None));
        };
        let n_tasks = samples.contexts.len();
        let ranks = self.ranks(n_tasks);
        let task = |candidate: &Candidate| match candidate {
            Candidate::Tasks(task) => Some((**task).clone()),
            Candidate::Model(_) => None,
        };
        let of_joints: Vec<(usize, Vec<TaskCandidate>)> = (of_joints.iter())
            .map(|(joint, all)| (joint.values.len(), all.iter().filter_map(task).collect()))
            .collect();
        let candidates: Vec<RankCandidate> = (ranks.iter().enumerate())
            .map(|(idx, rank)| RankCandidate {
                rank: *rank,
                log_marginals: (of_joints.iter())
                    .map(|(_, all)| all[idx].report.log_marginal)
                    .collect(),
            })
            .collect();
        if candidates.len() == 1 {
            return Ok((0, None));
        }
        let counts = RankCounts {
            n_tasks,
            n_input_params: (of_joints.iter())
                .map(|(_, all)| all[0].covariance.input().n_params())
                .collect(),
            n_observations: of_joints.iter().map(|(n, _)| *n).collect(),
        };
        let choice = choose_rank(&candidates, &counts, criterion)
            .map_err(|cause| TorqueError::Rank { cause })?;
        let chosen = ranks.iter().position(|rank| *rank == choice.rank);
        let selection = RankSelection {
            criterion: name_of(criterion).to_owned(),
            values: choice.values,
        };
        Ok((chosen.unwrap_or_default(), Some(selection)))
    }

    fn finish(
        &self,
        samples: &Samples,
        joint: &JointTorques,
        candidate: Candidate,
    ) -> Result<JointModel, TorqueError> {
        conditioned(samples, joint, candidate, self.options.likelihood)
    }
}

/// The model of hyperparameters that were learned from these samples.
pub(super) fn conditioned(
    samples: &Samples,
    joint: &JointTorques,
    candidate: Candidate,
    likelihood: LikelihoodOptions,
) -> Result<JointModel, TorqueError> {
    let task = match candidate {
        Candidate::Model(model) => return Ok(*model),
        Candidate::Tasks(task) => task,
    };
    let data = stacked(samples)?;
    let posterior = Posterior::new(
        task.covariance,
        task.noise_std,
        data.inputs(),
        &data.stack(&joint.values),
        likelihood,
    )?;
    let summary = FitSummary::of(&task.report);
    Ok(TaskProcess::of_tasks(posterior, summary).into())
}

/// The options of a search on samples, which say what joints are continuous.
pub(super) fn of_samples(options: &MultiTaskOptions, samples: &Samples) -> MultiTaskOptions {
    MultiTaskOptions {
        continuous: samples.continuous.clone(),
        ..options.clone()
    }
}

pub(super) fn stacked(samples: &Samples) -> Result<Stacked, MtgpError> {
    let n_contexts = samples.contexts.len();
    Stacked::new(samples.x.as_ref(), &samples.context_of, n_contexts)
}

fn name_of(criterion: Criterion) -> &'static str {
    match criterion {
        Criterion::Bic => "BIC",
        Criterion::Aic => "AIC",
        Criterion::HannanQuinn => "HQ",
    }
}
