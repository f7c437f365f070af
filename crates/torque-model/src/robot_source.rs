//! The robot whose parameters a model knows, by the texts that describe it.

use std::sync::Arc;

use puma_dyn::robot::Loaded;
use puma_dyn::{DynError, Effects, Model, RobotDescription, Sidecar, parse_urdf, puma560};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// What a model file keeps of a robot: enough to make it again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RobotSource {
    /// None for the built-in PUMA 560.
    pub urdf: Option<String>,
    /// The sidecar of the URDF.
    pub sidecar: Option<String>,
    /// Free fall in the axes of the root link, m/s², where it is not the description's.
    pub gravity: Option<[f64; 3]>,
}

impl RobotSource {
    /// The built-in PUMA 560.
    pub fn puma560() -> Self {
        Self {
            urdf: None,
            sidecar: None,
            gravity: None,
        }
    }

    /// The robot; `whose` stands for its files in messages.
    ///
    /// # Errors
    /// A text that is not a robot's.
    pub fn model(&self, whose: &str) -> Result<Model, DynError> {
        let model = match &self.urdf {
            None => puma560::model(),
            Some(urdf) => self.parsed(whose, urdf)?.model,
        };
        Ok(match self.gravity {
            None => model,
            Some(gravity) => model.with_gravity(gravity),
        })
    }

    /// Its links and joints by name; `whose` stands for its files in messages.
    ///
    /// # Errors
    /// A text that is not a robot's.
    pub fn description(&self, whose: &str) -> Result<RobotDescription, DynError> {
        match &self.urdf {
            None => Ok(puma560::description()),
            Some(urdf) => Ok(self.parsed(whose, urdf)?.description),
        }
    }

    fn parsed(&self, whose: &str, urdf: &str) -> Result<Loaded, DynError> {
        let sidecar = self.sidecar.as_deref();
        let sidecar = sidecar
            .map(|text| Sidecar::parse(whose, text))
            .transpose()?;
        parse_urdf(whose, urdf, sidecar.as_ref())
    }

    /// SHA-256 of URDF and sidecar, one after the other; of `puma560` for the built-in robot.
    pub fn sha256(&self) -> [u8; 32] {
        let mut hash = Sha256::new();
        hash.update(self.urdf.as_deref().unwrap_or("puma560"));
        hash.update(self.sidecar.as_deref().unwrap_or_default());
        hash.finalize().into()
    }
}

/// A robot, with what describes it and what of its drives counts.
#[derive(Debug, Clone)]
pub struct Robot {
    /// The texts.
    pub source: RobotSource,
    /// What they describe.
    pub model: Arc<Model>,
    /// The drives' part in the torques.
    pub effects: Effects,
}

impl Robot {
    /// The robot of a description, with all of its drives; `whose` stands for its files in messages.
    ///
    /// # Errors
    /// A text that is not a robot's.
    pub fn new(source: RobotSource, whose: &str) -> Result<Self, DynError> {
        let model = source.model(whose)?;
        Ok(Self {
            source,
            model: Arc::new(model),
            effects: Effects::ALL,
        })
    }
}
