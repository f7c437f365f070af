//! Learning joint torques under several loads together: mGP, and iGP and pGP to compare with.

use std::str::FromStr;

use gp_core::{GpError, Posterior, TrainingRanges};
use gp_core::search::FitReport;
use kernels::Covariance;
use mtgp::{Criterion, ModelParts, MtgpError, MultiTaskCovariance, MultiTaskModel, MultiTaskOptions, RankSelection, Stacked, StageOne, TaskFit, TaskProcess, choose_rank, fit_independent, fit_pooled};
use mtgp::fit::{RankCandidate, RankCounts, fit_ranks_telling};

use crate::commands::fit::report::{self, Line};
use crate::commands::fit::side_by_side::{Learned, learn_all, tell_stage};
use crate::commands::fit::{Args, ModelArg, StartsArg, check, provenance};
use crate::context::columns_error;
use crate::context_column::ContextColumn;
use crate::error::CliError;
use crate::messages;
use crate::samples::{DataColumns, JointTorques, Samples};
use crate::table::Table;

/// Ranks that a criterion chooses from, where there are more contexts than that. Source: sec. 4.6.
const RANKS: [usize; 6] = [2, 4, 5, 6, 8, 10];

/// Contexts up to which all ranks are tried.
const FEW_CONTEXTS: usize = 5;

/// How the rank of K^ρ is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RankArg {
    /// By the criterion.
    Bic,
    /// Given.
    Given(usize),
}

impl FromStr for RankArg {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match (text, text.parse()) {
            ("bic", _) => Ok(Self::Bic),
            (_, Ok(rank)) if rank > 0 => Ok(Self::Given(rank)),
            _ => Err("a rank is a number from 1, or bic to choose one".to_owned()),
        }
    }
}

/// What every joint is learned from.
struct Learner<'a> {
    args: &'a Args,
    file: &'a str,
    samples: &'a Samples,
    data: Stacked,
    joint_names: &'a [String],
}

/// One joint at one rank: its hyperparameters and how they were found, without what depends on the data.
struct Candidate {
    covariance: MultiTaskCovariance,
    noise_std: f64,
    report: FitReport,
}

/// The processes of the learned joints, each with the index of its joint.
type JointProcesses = Vec<(usize, TaskProcess)>;

impl From<&TaskFit> for Candidate {
    fn from(fit: &TaskFit) -> Self {
        Self {
            covariance: fit.covariance().clone(),
            noise_std: fit.noise_std(),
            report: fit.report.clone(),
        }
    }
}

/// Reads the rows of all contexts and learns from them; returns the bytes of the model file.
///
/// # Errors
/// Anything wrong with the options or the data, or a joint that cannot be learned.
pub fn learn(
    args: &Args,
    table: Table,
    columns: &DataColumns,
    data_sha256: [u8; 32],
) -> Result<Vec<u8>, CliError> {
    let file = table.file().to_owned();
    if let Some(context) = &args.data.context {
        return Err(CliError::Usage(format!(
            "--context {context}: --model {} learns all contexts of the data together; leave --context out, or use --model gpc",
            args.model.name()
        )));
    }
    let mut contexts = ContextColumn::of_any(&file, &table.column_names())?;
    let samples = columns.read_all(table, &mut contexts)?;
    require_several(args, &file, contexts.names())?;
    check(&file, &samples, columns)?;
    let unusable = |cause: MtgpError| columns_error(&file, cause.to_string());
    let data = Stacked::new(
        samples.x.as_ref(),
        contexts.numbers(),
        contexts.names().len(),
    );
    let learner = Learner {
        args,
        file: &file,
        samples: &samples,
        data: data.map_err(unusable)?,
        joint_names: &columns.joints.names,
    };
    learner.warn_of_single_samples(contexts.names());
    let (learned, selection) = learner.learn_all()?;
    let context_ranges = learner.context_ranges().map_err(|e| unusable(e.into()))?;
    let model = MultiTaskModel::new(ModelParts {
        joint_names: columns.joints.names.clone(),
        contexts: contexts.names().to_vec(),
        learned,
        ranges: TrainingRanges::of(samples.x.as_ref()).map_err(|e| unusable(e.into()))?,
        context_ranges,
        selection,
        provenance: provenance(data_sha256, None, ""),
    });
    Ok(model.map_err(|e| unusable(e.into()))?.to_bytes())
}

/// Refuses data of one context, and a rank that its contexts cannot have.
fn require_several(args: &Args, file: &str, contexts: &[String]) -> Result<(), CliError> {
    let n_contexts = contexts.len();
    if let [only] = contexts {
        let model = args.model.name();
        let reason = format!(
            "all rows are of one context (`{only}`); --model {model} is for two or more: use --model gpc"
        );
        return Err(columns_error(file, reason));
    }
    match args.rank {
        Some(RankArg::Given(rank)) if rank > n_contexts => Err(CliError::Usage(format!(
            "--rank {rank}: the rank must be 1 to {n_contexts}, the number of contexts in {file}"
        ))),
        _ => Ok(()),
    }
}

impl Learner<'_> {
    fn warn_of_single_samples(&self, contexts: &[String]) {
        for (context, count) in contexts.iter().zip(self.data.counts()) {
            if *count == 1 {
                messages::warning(format!(
                    "{}: context `{context}` has one row: it is predicted from the other contexts",
                    self.file
                ));
            }
        }
    }

    /// Learns all joints at all ranks, then chooses.
    fn learn_all(&self) -> Result<(JointProcesses, Option<RankSelection>), CliError> {
        let (jobs, names) = (&self.samples.torques, self.joint_names);
        let candidates = |job: &JointTorques| self.candidates(job);
        let fits = learn_all(jobs, names, self.file, self.args.threads, candidates)?;
        let (chosen, selection) = self
            .choose(&fits)
            .map_err(|cause| columns_error(self.file, format!("no rank can be chosen: {cause}")))?;
        let mut learned = Vec::new();
        for (fit, job) in fits.iter().zip(jobs) {
            let process = self.process(&fit.model[chosen], job);
            let process = process.map_err(|cause| CliError::Joint {
                file: self.file.to_owned(),
                joint: names[fit.joint_idx].clone(),
                cause: Box::new(cause),
            })?;
            learned.push((fit.joint_idx, process));
        }
        let lines = fits.iter().zip(&learned).map(|(fit, (_, process))| Line {
            joint: &names[fit.joint_idx],
            model: process.name(),
            n_samples: fit.n_samples,
            summary: Some(&process.summary),
            noise_std: process.noise_var().sqrt(),
            seconds: fit.seconds,
        });
        messages::report(report::table(&lines.collect::<Vec<_>>()));
        if let Some(RankSelection { criterion, values }) = &selection {
            let values: Vec<String> = values
                .iter()
                .map(|(rank, value)| format!("{rank} {value:.1}"))
                .collect();
            messages::note(format!("{criterion} by rank: {}", values.join(", ")));
        }
        Ok((learned, selection))
    }

    /// One joint's fits, by ascending rank.
    fn candidates(&self, job: &JointTorques) -> Result<Vec<Candidate>, MtgpError> {
        let (data, options) = (&self.data, self.options());
        let targets = data.stack(&job.values);
        let joint = &self.joint_names[job.joint_idx];
        let n_samples = targets.len();
        match self.args.model {
            ModelArg::Igp => {
                tell_stage(joint, n_samples, "iGP");
                return Ok(vec![(&fit_independent(data, &targets, &options)?).into()]);
            }
            ModelArg::Pgp => {
                tell_stage(joint, n_samples, "pGP");
                return Ok(vec![(&fit_pooled(data, &targets, &options)?).into()]);
            }
            _ => {}
        }
        tell_stage(joint, n_samples, "pGP and iGP, to set out from");
        let stage_one = StageOne::new(data, &targets, &options)?;
        let ranks = self.ranks();
        let names: Vec<String> = ranks.iter().map(ToString::to_string).collect();
        let mut tell = |n_searched: usize| {
            let stage = format!("rank {}, searched on {n_searched}", names.join(", "));
            tell_stage(joint, n_samples, stage);
        };
        let fits = fit_ranks_telling(data, &targets, &ranks, &stage_one, &options, &mut tell)?;
        Ok(fits.iter().map(Into::into).collect())
    }

    /// Ranks to try, ascending.
    fn ranks(&self) -> Vec<usize> {
        let n_contexts = self.data.n_tasks();
        match self.args.rank {
            Some(RankArg::Given(rank)) => vec![rank],
            _ if n_contexts <= FEW_CONTEXTS => (1..=n_contexts).collect(),
            _ => RANKS
                .into_iter()
                .filter(|rank| *rank <= n_contexts)
                .collect(),
        }
    }

    fn options(&self) -> MultiTaskOptions {
        let mut options = match self.args.starts {
            StartsArg::Chapter => MultiTaskOptions::chapter(),
            StartsArg::Several => MultiTaskOptions::several(),
        };
        options.likelihood.method = self.args.method.method();
        options
    }

    /// Index of the candidate to keep, the same for all joints, and how it was chosen.
    fn choose(
        &self,
        fits: &[Learned<Vec<Candidate>>],
    ) -> Result<(usize, Option<RankSelection>), MtgpError> {
        if fits.iter().all(|fit| fit.model.len() == 1) {
            return Ok((0, None));
        }
        let ranks = self.ranks();
        let log_marginals = |idx: usize| {
            let of_joint = |fit: &Learned<Vec<Candidate>>| fit.model[idx].report.log_marginal;
            fits.iter().map(of_joint).collect()
        };
        let candidates: Vec<RankCandidate> = (ranks.iter().enumerate())
            .map(|(idx, rank)| RankCandidate {
                rank: *rank,
                log_marginals: log_marginals(idx),
            })
            .collect();
        let counts = RankCounts {
            n_tasks: self.data.n_tasks(),
            n_input_params: (fits.iter())
                .map(|fit| fit.model[0].covariance.input().n_params())
                .collect(),
            n_observations: fits.iter().map(|fit| fit.n_samples).collect(),
        };
        let criterion = self.args.criterion.unwrap_or_default().criterion();
        let choice = choose_rank(&candidates, &counts, criterion)?;
        let chosen = ranks.iter().position(|rank| *rank == choice.rank);
        let selection = RankSelection {
            criterion: criterion_name(criterion).to_owned(),
            values: choice.values,
        };
        Ok((chosen.unwrap_or_default(), Some(selection)))
    }

    fn process(&self, candidate: &Candidate, job: &JointTorques) -> Result<TaskProcess, MtgpError> {
        let posterior = Posterior::new(
            candidate.covariance.clone(),
            candidate.noise_std,
            self.data.inputs(),
            &self.data.stack(&job.values),
            self.options().likelihood,
        )?;
        Ok(TaskProcess::new(posterior, &candidate.report))
    }

    /// Ranges of the covariates in each context.
    fn context_ranges(&self) -> Result<Vec<TrainingRanges>, GpError> {
        let mut first = 0;
        let of_context = |&count: &usize| {
            let rows = self.data.covariates().subrows(first, count);
            first += count;
            TrainingRanges::of(rows)
        };
        self.data.counts().iter().map(of_context).collect()
    }
}

fn criterion_name(criterion: Criterion) -> &'static str {
    match criterion {
        Criterion::Bic => "BIC",
        Criterion::Aic => "AIC",
        Criterion::HannanQuinn => "HQ",
    }
}
