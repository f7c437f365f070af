//! What a model file keeps of the robot it was learned with: enough to make the robot again.

use faer::{Mat, MatRef};
use puma_dyn::dynamics::{N_DRIVE_PARAMETERS, N_PARAMETERS, full_regressor};
use puma_dyn::{DynError, Model, Sidecar, Workspace, parse_urdf, puma560};
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

/// Parameters per joint: ten of its body, four of its drive.
const PER_JOINT: usize = N_PARAMETERS + N_DRIVE_PARAMETERS;

/// A robot by the texts that describe it.
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
    /// The robot; `whose` stands for its files in messages.
    ///
    /// # Errors
    /// A text that is not a robot's.
    pub fn model(&self, whose: &str) -> Result<Model, DynError> {
        let model = match &self.urdf {
            None => puma560::model(),
            Some(urdf) => {
                let sidecar = self.sidecar.as_deref();
                let sidecar = sidecar
                    .map(|text| Sidecar::parse(whose, text))
                    .transpose()?;
                parse_urdf(whose, urdf, sidecar.as_ref())?.model
            }
        };
        Ok(match self.gravity {
            None => model,
            Some(gravity) => model.with_gravity(gravity),
        })
    }

    /// SHA-256 of URDF and sidecar, one after the other; of `puma560` for the built-in robot.
    pub fn sha256(&self) -> [u8; 32] {
        let mut hash = Sha256::new();
        hash.update(self.urdf.as_deref().unwrap_or("puma560"));
        hash.update(self.sidecar.as_deref().unwrap_or_default());
        hash.finalize().into()
    }
}

/// Number of columns of Y.
pub fn n_parameters(model: &Model) -> usize {
    PER_JOINT * model.n_joints()
}

/// Rows of Y(x) of each of some joints, (n, 14 ℓ), at the rows of `x`, (n, 3ℓ).
///
/// # Panics
/// If `x` has other columns, or a joint does not exist.
pub fn regressors(model: &Model, joints: &[usize], x: MatRef<'_, f64>) -> Vec<Mat<f64>> {
    let (n_joints, n_parameters) = (model.n_joints(), n_parameters(model));
    let mut workspace = Workspace::new(model);
    let mut matrix = vec![0.0; n_joints * n_parameters];
    let mut of_joints = vec![Mat::zeros(x.nrows(), n_parameters); joints.len()];
    let mut state = vec![0.0; 3 * n_joints];
    for row in 0..x.nrows() {
        for (entry, value) in state.iter_mut().zip(x.row(row).iter()) {
            *entry = *value;
        }
        let (q, rates) = state.split_at(n_joints);
        let (qd, qdd) = rates.split_at(n_joints);
        full_regressor(model, &mut workspace, q, qd, qdd, &mut matrix);
        for (regressor, joint) in of_joints.iter_mut().zip(joints) {
            let of_joint = &matrix[joint * n_parameters..][..n_parameters];
            for (col, value) in of_joint.iter().enumerate() {
                regressor[(row, col)] = *value;
            }
        }
    }
    of_joints
}
