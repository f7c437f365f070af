//! A model and the name of its file, which every message about it begins with; what is in it is the library's.

use std::ops::Deref;
use std::path::Path;

use faer::MatRef;
use torque_model::{
    JointPrediction, LoadDescription, RobotModel, TorqueError, carry_attached, carry_described,
};

use crate::columns::{Naming, StateColumns};
use crate::context::columns_error;
use crate::error::CliError;
use crate::joints::Joints;
use crate::messages;
use crate::payload_file::PayloadFile;
use crate::robot::Robot;

/// A model, and the file that it was read from.
pub struct ModelFile {
    /// Path.
    pub file: String,
    model: RobotModel,
}

impl Deref for ModelFile {
    type Target = RobotModel;

    fn deref(&self) -> &RobotModel {
        &self.model
    }
}

impl ModelFile {
    /// Reads a model of whatever kind.
    ///
    /// # Errors
    /// A file that cannot be read, or is not a whole, unaltered model of a version known here.
    pub fn load(path: &Path) -> Result<Self, CliError> {
        let file = path.display().to_string();
        let bytes = std::fs::read(path).map_err(CliError::io("read", file.clone()))?;
        match RobotModel::from_bytes(&bytes) {
            Ok(model) => Ok(Self { file, model }),
            Err(cause) => Err(CliError::ModelFile { file, cause }),
        }
    }

    /// The model, for a command that needs one of several contexts.
    ///
    /// # Errors
    /// A model of one context.
    pub fn of_several(self) -> Result<Self, CliError> {
        if self.contexts().is_empty() {
            return Err(CliError::Usage(format!(
                "{} is a model of one context; one of several is needed: `torque-gp fit --model mgp`",
                self.file
            )));
        }
        Ok(self)
    }

    /// The model as it is, or with the context of a payload file: [`ModelFile::carrying`].
    ///
    /// # Errors
    /// As there.
    pub fn with_payload(self, payload: Option<&Path>) -> Result<(Self, Option<usize>), CliError> {
        let Some(payload) = payload else {
            return Ok((self, None));
        };
        let (model, number) = self.carrying(payload)?;
        Ok((model, Some(number)))
    }

    /// The model of the robot carrying the load of a payload file, and the number of the context in which it does.
    ///
    /// The context has the name of the file.
    /// # Errors
    /// A file that is no payload, a link that the robot does not have, a model that does not know what a load changes.
    fn carrying(self, payload: &Path) -> Result<(Self, usize), CliError> {
        let load = PayloadFile::read(payload)?;
        let name = payload.display().to_string();
        let carried = match (self.rigid_body(), &self.parts().robot) {
            (Some(_), Some(source)) => {
                let robot = Robot::of_source(source, &self.file)?;
                carry_attached(&self.model, &name, &load.attached(&robot)?)
            }
            _ => carry_described(&self.model, &name, &LoadDescription::from(&load.payload)),
        };
        let model = carried.map_err(|cause| {
            let hint = "learn with `torque-gp fit --model mgp --payloads DIR` or `--model rbd`";
            CliError::Usage(format!("{name}: {}: {cause}; {hint}", self.file))
        })?;
        let number = model.contexts().len() - 1;
        let file = self.file;
        Ok((Self { file, model }, number))
    }

    /// The joints, for reading a table of their states.
    pub fn joints(&self) -> Joints {
        let joints = Joints::by_name("model", self.joint_names().to_vec());
        joints.with_continuous(self.continuous())
    }

    /// Indices of the joints that have a model, ascending.
    pub fn learned_joints(&self) -> Vec<usize> {
        self.learned().iter().map(|(idx, _)| *idx).collect()
    }

    /// Says in which order numbered columns of a file were taken, where the model knows its joints by other names.
    pub fn note_order(&self, file: &str, columns: &StateColumns) {
        let names = self.joint_names();
        if columns.naming == Naming::Numbered && !are_numbered(names) {
            messages::note(format!(
                "{file}: joints 1 to {} are taken to be the model's {}",
                names.len(),
                names.join(", ")
            ));
        }
    }

    /// Predictions at states of a file that are all finite, each in the context of its number.
    ///
    /// # Errors
    /// States that are so large that the model overflows, with their row; `n_before` rows came before these.
    /// # Panics
    /// If there is not one number per row.
    pub fn predict_rows(
        &self,
        contexts: &[usize],
        x: MatRef<'_, f64>,
        file: &str,
        n_before: usize,
    ) -> Result<Vec<JointPrediction>, CliError> {
        self.model
            .predict_rows(contexts, x)
            .map_err(|error| match error {
                TorqueError::NotFinite { row, joint_idx } => {
                    let (row, name) = (n_before + row + 1, &self.joint_names()[joint_idx]);
                    let reason = format!(
                        "row {row}: the state is so large that the torque of `{name}` is not a finite number"
                    );
                    columns_error(file, reason)
                }
                other => CliError::of_data(file)(other),
            })
    }
}

/// Whether joints are called `joint1`, `joint2`, …, as those of numbered columns are.
pub fn are_numbered(names: &[String]) -> bool {
    let is_numbered = |(idx, name): (usize, &String)| *name == format!("joint{}", idx + 1);
    names.iter().enumerate().all(is_numbered)
}
