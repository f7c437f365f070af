//! The models that section 4.6 compares, by name.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

use crate::error::BenchError;
use crate::rigid_body::{RigidBodyForm, RigidBodyKind, Terms};

/// A model of one joint's torques in all contexts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum MultiModel {
    /// A GPc of its own for each context.
    Single,
    /// K^ρ = I: independent contexts that share hyperparameters.
    Independent,
    /// K^ρ = 11ᵀ: one function for all contexts.
    Pooled,
    /// K^ρ = ΛΛᵀ of a given rank.
    Transfer {
        /// Columns of Λ.
        rank: usize,
    },
    /// rbd+gp: parameters of a rigid-body model with a prior, ten of them for each load, each joint by itself, and a
    /// process on what they leave; not the chapter's.
    RigidBodyAndProcess,
    /// rbd as the command learns it: all joints share the parameters of links and loads.
    Shared(Terms),
}

impl MultiModel {
    /// The rank of mGP-r; none for the other models.
    pub fn rank(self) -> Option<usize> {
        match self {
            Self::Transfer { rank } => Some(rank),
            _ => None,
        }
    }

    /// How a model with the prior of section 3.2 is learned; none of the chapter's experiment.
    pub fn rigid_body(self) -> Option<RigidBodyKind> {
        match self {
            Self::RigidBodyAndProcess => Some(RigidBodyKind::OfJoint(RigidBodyForm::WithProcess)),
            Self::Shared(terms) => Some(RigidBodyKind::OfRobot(terms)),
            Self::Single | Self::Independent | Self::Pooled | Self::Transfer { .. } => None,
        }
    }
}

impl fmt::Display for MultiModel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Single => f.write_str("sGP"),
            Self::Independent => f.write_str("iGP"),
            Self::Pooled => f.write_str("pGP"),
            Self::Transfer { rank } => write!(f, "mGP-{rank}"),
            Self::RigidBodyAndProcess => f.write_str(RigidBodyForm::WithProcess.name()),
            Self::Shared(terms) => f.write_str(terms.name()),
        }
    }
}

impl FromStr for MultiModel {
    type Err = BenchError;

    fn from_str(name: &str) -> Result<Self, BenchError> {
        let rank = |digits: &str| digits.parse().ok().filter(|&rank| rank > 0);
        if let Some(terms) = Terms::ALL.into_iter().find(|terms| terms.name() == name) {
            return Ok(Self::Shared(terms));
        }
        match name {
            "sGP" => Ok(Self::Single),
            "iGP" => Ok(Self::Independent),
            "pGP" => Ok(Self::Pooled),
            "rbd+gp" => Ok(Self::RigidBodyAndProcess),
            _ => name
                .strip_prefix("mGP-")
                .and_then(rank)
                .map(|rank| Self::Transfer { rank })
                .ok_or_else(|| BenchError::UnknownName {
                    what: "model",
                    name: name.to_string(),
                    known: "sGP, iGP, pGP, rbd+gp, rbd-shared, rbd-shared-signs, mGP-1, mGP-2, …"
                        .to_string(),
                }),
        }
    }
}

impl TryFrom<String> for MultiModel {
    type Error = BenchError;

    fn try_from(name: String) -> Result<Self, BenchError> {
        name.parse()
    }
}

impl From<MultiModel> for String {
    fn from(model: MultiModel) -> Self {
        model.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back_and_rank_zero_is_none() {
        let models = [
            MultiModel::Single,
            MultiModel::Independent,
            MultiModel::Pooled,
            MultiModel::Transfer { rank: 10 },
            MultiModel::RigidBodyAndProcess,
            MultiModel::Shared(Terms::Chosen),
            MultiModel::Shared(Terms::Signs),
        ];
        for model in models {
            assert_eq!(model.to_string().parse::<MultiModel>().unwrap(), model);
        }
        for name in ["mGP-0", "mGP-", "mGP", "GPc"] {
            assert!(name.parse::<MultiModel>().is_err(), "{name}");
        }
    }
}
