//! A cell: one model of one joint under one load, fitted to n samples; and the record of its result.

use std::fmt;

use serde::{Deserialize, Serialize};

use crate::error::BenchError;
use crate::fit_summary::FitSummary;
use crate::rigid_body::{RigidBodyForm, RigidBodyKind, Terms};

/// The four models that section 3.4 compares, and three with the prior that section 3.2 names.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum ModelKind {
    /// LR¬c: Bayesian linear regression without the sgn terms.
    #[serde(rename = "LR")]
    LrSmooth,
    /// LRc: the same with the sgn terms, eq. (9).
    #[serde(rename = "LRc")]
    LrCoulomb,
    /// GP¬c: Gaussian process with the covariance of eq. (5).
    #[serde(rename = "GP")]
    GpSmooth,
    /// GPc: the same with the Coulomb term, eq. (7).
    #[serde(rename = "GPc")]
    GpCoulomb,
    /// rbd+gp: linear in the parameters of a rigid-body model, with a prior, each joint by itself, and a process on what
    /// that leaves; not the chapter's experiment.
    #[serde(rename = "rbd+gp")]
    RigidBodyAndProcess,
    /// rbd as the command learns it: all joints share their parameters, and friction terms are chosen.
    #[serde(rename = "rbd-shared")]
    SharedParameters,
    /// The same with signs for friction, as the arm is simulated.
    #[serde(rename = "rbd-shared-signs")]
    SharedParametersSigns,
}

impl ModelKind {
    /// The chapter's four, in the order of fig. 7's rows, and the three of section 3.2.
    pub const ALL: [Self; 7] = [
        Self::LrSmooth,
        Self::LrCoulomb,
        Self::GpSmooth,
        Self::GpCoulomb,
        Self::RigidBodyAndProcess,
        Self::SharedParameters,
        Self::SharedParametersSigns,
    ];

    /// Name in files: LR, LRc, GP, GPc, rbd+gp, rbd-shared, rbd-shared-signs.
    pub fn name(self) -> &'static str {
        match self {
            Self::LrSmooth => "LR",
            Self::LrCoulomb => "LRc",
            Self::GpSmooth => "GP",
            Self::GpCoulomb => "GPc",
            Self::RigidBodyAndProcess => RigidBodyForm::WithProcess.name(),
            Self::SharedParameters => Terms::Chosen.name(),
            Self::SharedParametersSigns => Terms::Signs.name(),
        }
    }

    /// Name in tables and pictures, as the chapter writes it (its overbar becomes ¬).
    pub fn label(self) -> &'static str {
        match self {
            Self::LrSmooth => "LR¬c",
            Self::GpSmooth => "GP¬c",
            Self::LrCoulomb | Self::GpCoulomb => self.name(),
            Self::RigidBodyAndProcess => "rbd+gp (ours)",
            Self::SharedParameters => "rbd shared (ours)",
            Self::SharedParametersSigns => "rbd shared, signs (ours)",
        }
    }

    /// Whether a process is fitted.
    pub fn is_gp(self) -> bool {
        matches!(
            self,
            Self::GpSmooth | Self::GpCoulomb | Self::RigidBodyAndProcess
        )
    }

    /// How a model with the prior of section 3.2 is learned; none of the chapter's experiment.
    pub fn rigid_body(self) -> Option<RigidBodyKind> {
        use RigidBodyKind::{OfJoint, OfRobot};
        match self {
            Self::RigidBodyAndProcess => Some(OfJoint(RigidBodyForm::WithProcess)),
            Self::SharedParameters => Some(OfRobot(Terms::Chosen)),
            Self::SharedParametersSigns => Some(OfRobot(Terms::Signs)),
            Self::LrSmooth | Self::LrCoulomb | Self::GpSmooth | Self::GpCoulomb => None,
        }
    }
}

impl std::str::FromStr for ModelKind {
    type Err = BenchError;

    fn from_str(name: &str) -> Result<Self, BenchError> {
        Self::ALL
            .into_iter()
            .find(|model| model.name() == name || model.label() == name)
            .ok_or_else(|| BenchError::UnknownName {
                what: "model",
                name: name.to_string(),
                known: Self::ALL.map(Self::name).join(", "),
            })
    }
}

/// Test sets of table 3.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum TestSet {
    /// The undrawn samples of the two trained trajectories.
    Interp,
    /// Every sample of the load that was not trained on.
    Extrap,
}

impl TestSet {
    /// Both, in the order of table 3.
    pub const ALL: [Self; 2] = [Self::Interp, Self::Extrap];

    /// interp or extrap.
    pub fn name(self) -> &'static str {
        match self {
            Self::Interp => "interp",
            Self::Extrap => "extrap",
        }
    }
}

/// What is fitted; the unit of work and of resumption.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Cell {
    /// Seed of the experiment: cells of experiments with the same seed are the same cells.
    pub seed: String,
    /// Load c1..c15, from 1.
    pub load: usize,
    /// Joint, from 1.
    pub joint: usize,
    /// Model.
    pub model: ModelKind,
    /// Training samples.
    pub n: usize,
}

impl fmt::Display for Cell {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let model = self.model.label();
        write!(
            f,
            "joint {}, load c{}, {model}, n = {}",
            self.joint, self.load, self.n
        )
    }
}

/// Result of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CellRecord {
    /// nMSE on the interp set.
    pub nmse_interp: f64,
    /// nMSE on the extrap set.
    pub nmse_extrap: f64,
    /// Wall-clock seconds of the fit; not reproducible.
    pub seconds_fit: f64,
    /// Wall-clock seconds of the 60,000 predictions; not reproducible.
    pub seconds_predict: f64,
    /// The cell.
    pub cell: Cell,
    /// The optimiser's report; none for models in closed form.
    pub fit: Option<FitSummary>,
}

impl CellRecord {
    /// nMSE on a set.
    pub fn nmse(&self, set: TestSet) -> f64 {
        match set {
            TestSet::Interp => self.nmse_interp,
            TestSet::Extrap => self.nmse_extrap,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_are_known_by_name_and_by_label() {
        for model in ModelKind::ALL {
            assert_eq!(model.name().parse::<ModelKind>().unwrap(), model);
            assert_eq!(model.label().parse::<ModelKind>().unwrap(), model);
        }
        let error = "GPx".parse::<ModelKind>().unwrap_err().to_string();
        assert_eq!(
            error,
            "unknown model \"GPx\"; known: LR, LRc, GP, GPc, rbd+gp, rbd-shared, rbd-shared-signs"
        );
    }
}
