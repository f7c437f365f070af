//! What stands in the payload of a model file of several contexts, and the checks that turn it back into a model.

use gp_core::{
    ModelFileError, ParamsRecord, PosteriorRecord, ProvenanceRecord, RangesRecord, SummaryRecord,
};
use serde::{Deserialize, Serialize};

use crate::model::multi_task_model::{ModelParts, MultiTaskModel, RankSelection};
use crate::model::task_process::TaskProcess;
use crate::prior::{MultiTaskCovariance, TaskCovariance, TaskFactor, are_rows_of_tasks};

#[derive(Serialize, Deserialize)]
pub(crate) struct MultiTaskRecord {
    joint_names: Vec<String>,
    contexts: Vec<String>,
    ranges: RangesRecord,
    context_ranges: Vec<RangesRecord>,
    provenance: ProvenanceRecord,
    selection: Option<SelectionRecord>,
    learned: Vec<(usize, ProcessRecord)>,
}

#[derive(Serialize, Deserialize)]
struct SelectionRecord {
    criterion: String,
    values: Vec<(usize, f64)>,
}

#[derive(Serialize, Deserialize)]
struct ProcessRecord {
    params: ParamsRecord,
    task: TaskRecord,
    posterior: PosteriorRecord,
    summary: SummaryRecord,
}

/// K^ρ; the number of tasks is that of the contexts.
#[derive(Serialize, Deserialize)]
enum TaskRecord {
    Identity,
    Ones,
    /// The free entries of Λ, row by row.
    Factor {
        rank: usize,
        entries: Vec<f64>,
    },
}

impl MultiTaskRecord {
    pub fn of(model: &MultiTaskModel) -> Self {
        let parts = model.parts();
        let learned = parts.learned.iter();
        Self {
            joint_names: parts.joint_names.clone(),
            contexts: parts.contexts.clone(),
            ranges: RangesRecord::of(&parts.ranges),
            context_ranges: parts.context_ranges.iter().map(RangesRecord::of).collect(),
            provenance: ProvenanceRecord::of(&parts.provenance),
            selection: parts.selection.as_ref().map(|selection| SelectionRecord {
                criterion: selection.criterion.clone(),
                values: selection.values.clone(),
            }),
            learned: learned
                .map(|(idx, process)| (*idx, ProcessRecord::of(process)))
                .collect(),
        }
    }

    /// The model, if every part is one and they fit together.
    ///
    /// # Errors
    /// [`ModelFileError::Malformed`] with what is wrong.
    pub fn into_model(self) -> Result<MultiTaskModel, ModelFileError> {
        let (n_joints, n_tasks) = (self.joint_names.len(), self.contexts.len());
        let learned = self.learned.into_iter();
        let learned: Result<_, ModelFileError> = learned
            .map(|(idx, record)| Ok((idx, record.into_process(n_joints, n_tasks)?)))
            .collect();
        let context_ranges = self.context_ranges.into_iter();
        MultiTaskModel::new(ModelParts {
            joint_names: self.joint_names,
            contexts: self.contexts,
            learned: learned?,
            ranges: self.ranges.into_ranges()?,
            context_ranges: context_ranges
                .map(RangesRecord::into_ranges)
                .collect::<Result<_, _>>()?,
            selection: self.selection.map(|record| RankSelection {
                criterion: record.criterion,
                values: record.values,
            }),
            provenance: self.provenance.into_provenance(),
        })
        .map_err(malformed)
    }
}

impl ProcessRecord {
    fn of(process: &TaskProcess) -> Self {
        Self {
            params: ParamsRecord::of(process.covariance().input()),
            task: TaskRecord::of(process.covariance().task()),
            posterior: PosteriorRecord::of(&process.posterior),
            summary: SummaryRecord::of(&process.summary),
        }
    }

    fn into_process(self, n_joints: usize, n_tasks: usize) -> Result<TaskProcess, ModelFileError> {
        let input = self.params.into_covariance()?;
        if input.n_joints() != n_joints {
            let found = input.n_joints();
            return Err(malformed(format!("a process of {found} joints")));
        }
        let prior = MultiTaskCovariance::new(input, self.task.into_task(n_tasks)?);
        let process = TaskProcess {
            posterior: self.posterior.into_posterior(prior, 3 * n_joints + 1)?,
            summary: self.summary.into_summary()?,
        };
        if !are_rows_of_tasks(process.basis_rows(), n_tasks) {
            return Err(malformed(format!("rows of other than {n_tasks} tasks")));
        }
        Ok(process)
    }
}

impl TaskRecord {
    fn of(task: &TaskCovariance) -> Self {
        match task {
            TaskCovariance::Identity { .. } => Self::Identity,
            TaskCovariance::Ones { .. } => Self::Ones,
            TaskCovariance::Factor(factor) => Self::of_factor(factor),
        }
    }

    fn of_factor(factor: &TaskFactor) -> Self {
        Self::Factor {
            rank: factor.rank(),
            entries: factor.entries(),
        }
    }

    fn into_task(self, n_tasks: usize) -> Result<TaskCovariance, ModelFileError> {
        Ok(match self {
            Self::Identity => TaskCovariance::Identity { n_tasks },
            Self::Ones => TaskCovariance::Ones { n_tasks },
            Self::Factor { rank, entries } => TaskCovariance::Factor(
                TaskFactor::from_entries(n_tasks, rank, &entries).map_err(malformed)?,
            ),
        })
    }
}

fn malformed(error: impl std::fmt::Display) -> ModelFileError {
    let what = error.to_string();
    ModelFileError::Malformed { what }
}
