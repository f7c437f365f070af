//! A unit: all models of one joint at one size, fitted to the same samples; and the record of its result.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::model::MultiModel;
use crate::cell::TestSet;
use crate::fit_summary::FitSummary;
use crate::store::{Finished, MANY_MEASURED_BY, RIGID_BODY_MEASURED_BY, Work};

/// What is fitted in one go, since the mGPs start where iGP and pGP end; the unit of resumption.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Unit {
    /// Seed of the subsets.
    pub seed: String,
    /// Seed of the training and test sets.
    pub split_seed: String,
    /// Which draw of the subsets, from 0.
    pub repeat: usize,
    /// Joint, from 1.
    pub joint: usize,
    /// Contexts c1..c`n_contexts`.
    pub n_contexts: usize,
    /// Training samples of all contexts together.
    pub n_total: usize,
    /// Models.
    pub models: Vec<MultiModel>,
}

impl Unit {
    /// Training samples of each context.
    pub fn n_each(&self) -> usize {
        self.n_total / self.n_contexts
    }

    /// Whether its models are those with the prior of section 3.2, and not the chapter's.
    pub fn is_rigid_body(&self) -> bool {
        self.models.iter().any(|model| model.rigid_body().is_some())
    }

    /// Whether its models share parameters among the joints.
    fn is_of_robot(&self) -> bool {
        let is = |model: &MultiModel| matches!(model, MultiModel::Shared(_));
        self.models.iter().any(is)
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (joint, n, m) = (self.joint, self.n_total, self.n_contexts);
        write!(f, "joint {joint}, {m} contexts, n = {n}")?;
        if self.is_rigid_body() {
            f.write_str(", rigid body")?;
        }
        if self.is_of_robot() {
            f.write_str(" of all joints")?;
        }
        match self.repeat {
            0 => Ok(()),
            repeat => write!(f, ", draw {}", repeat + 1),
        }
    }
}

impl Work for Unit {
    type Record = UnitRecord;

    fn key(&self) -> String {
        let models: Vec<String> = self.models.iter().map(ToString::to_string).collect();
        format!(
            "format 1; measured by {}; seed {}; split seed {}; repeat {}; contexts {}; joint {}; n {}; models {}",
            if self.is_rigid_body() {
                RIGID_BODY_MEASURED_BY
            } else {
                MANY_MEASURED_BY
            },
            self.seed,
            self.split_seed,
            self.repeat,
            self.n_contexts,
            self.joint,
            self.n_total,
            models.join(" ")
        )
    }

    fn cost(&self) -> impl Ord {
        (!self.is_rigid_body(), self.n_total)
    }
}

/// nMSE of one context.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct ContextScore {
    /// Context c1, c2, …, from 1.
    pub context: usize,
    /// nMSE on its interp set.
    pub interp: f64,
    /// nMSE on its extrap set.
    pub extrap: f64,
}

impl ContextScore {
    /// nMSE on a set.
    pub fn nmse(&self, set: TestSet) -> f64 {
        match set {
            TestSet::Interp => self.interp,
            TestSet::Extrap => self.extrap,
        }
    }
}

/// Result of one model.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ModelRecord {
    /// The model.
    pub model: MultiModel,
    /// Natural log of eq. (8) at the end, summed over all data; none of a model in closed form.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub log_marginal_likelihood: Option<f64>,
    /// Wall-clock seconds of the fit; not reproducible.
    pub seconds_fit: f64,
    /// Wall-clock seconds of the predictions for all contexts; not reproducible.
    pub seconds_predict: f64,
    /// Λ row by row, one row a context; empty unless the model is mGP-r.
    pub task_factor: Vec<Vec<f64>>,
    /// nMSE of every context, ascending.
    pub scores: Vec<ContextScore>,
    /// The optimiser's reports: one a context for sGP, none of a model in closed form, else one.
    pub fits: Vec<FitSummary>,
}

impl ModelRecord {
    /// nMSEs of the contexts on a set, ascending in the context.
    pub fn nmses(&self, set: TestSet) -> Vec<f64> {
        self.scores.iter().map(|score| score.nmse(set)).collect()
    }
}

/// Result of a unit.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct UnitRecord {
    /// The unit.
    pub unit: Unit,
    /// Its models, in their order.
    pub models: Vec<ModelRecord>,
}

impl UnitRecord {
    /// Result of a model, if it was among the unit's.
    pub fn of(&self, model: MultiModel) -> Option<&ModelRecord> {
        self.models.iter().find(|record| record.model == model)
    }
}

impl Finished for UnitRecord {
    type Work = Unit;

    fn work(&self) -> &Unit {
        &self.unit
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::fit_summary::tests::summary;
    use crate::store::Store;

    /// Unit of joint `joint` at `n_total` samples of 14 contexts, of which [`model_record`] scores two.
    pub(crate) fn unit(joint: usize, n_total: usize) -> Unit {
        Unit {
            seed: "many".into(),
            split_seed: "one".into(),
            repeat: 0,
            joint,
            n_contexts: 14,
            n_total,
            models: ["sGP", "iGP", "pGP", "mGP-2", "mGP-4"]
                .map(|name| name.parse().unwrap())
                .to_vec(),
        }
    }

    /// Record with made-up numbers: `interp` in the first context, three times as much in the second,
    /// ten times as much on extrap.
    pub(crate) fn model_record(
        model: MultiModel,
        log_marginal_likelihood: f64,
        interp: f64,
    ) -> ModelRecord {
        let score = |context, interp: f64| ContextScore {
            context,
            interp,
            extrap: 10.0 * interp,
        };
        ModelRecord {
            model,
            log_marginal_likelihood: Some(log_marginal_likelihood),
            seconds_fit: 1.5,
            seconds_predict: 0.25,
            task_factor: Vec::new(),
            scores: vec![score(1, interp), score(2, 3.0 * interp)],
            fits: vec![FitSummary {
                log_marginal_likelihood,
                start: "iGP".into(),
                ..summary()
            }],
        }
    }

    /// Record of a unit: (log likelihood, interp) of each of its models.
    pub(crate) fn unit_record(unit: Unit, values: &[(f64, f64)]) -> UnitRecord {
        let models = unit.models.iter().zip(values);
        let models = models.map(|(&model, &(log, interp))| model_record(model, log, interp));
        UnitRecord {
            models: models.collect(),
            unit,
        }
    }

    #[test]
    fn a_saved_unit_comes_back_bit_for_bit_and_other_models_are_another_file() {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        let values = [
            (-10.0, 0.1 + 0.2),
            (-9.0, 1e-7),
            (-8.0, 1e-3),
            (-7.0, 1e-4),
            (-6.0, 1e-5),
        ];
        let mut record = unit_record(unit(3, 280), &values);
        record.models[3].task_factor = vec![vec![1.0 / 3.0], vec![0.5, -2.0]];
        store.save(&record).unwrap();
        assert_eq!(store.load(&record.unit), Some(record.clone()));
        let mut other = record.unit;
        other.models.pop();
        assert_eq!(store.load(&other), None);
    }
}
