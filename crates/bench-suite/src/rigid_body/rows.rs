//! Rows of the regressor at states.

use std::sync::OnceLock;

use faer::{Mat, MatRef};
use puma_dyn::dynamics::{N_DRIVE_PARAMETERS, N_PARAMETERS, full_regressor, parameters_of_joint};
use puma_dyn::{Model, Scenario, Workspace};

use crate::dataset::{DataSet, N_JOINTS};
use crate::split::N_ROWS;

/// States with what a rigid-body model makes of them, for one joint.
#[derive(Debug, Clone)]
pub struct States {
    /// (n, 3ℓ).
    pub x: Mat<f64>,
    /// Rows of Y in the columns of [`columns`], (n, p).
    pub arm: Mat<f64>,
}

impl States {
    /// At states of the scenario's arm, for a joint, from 1.
    ///
    /// # Shapes
    /// `x` (n, 3ℓ).
    /// # Panics
    /// If the joint does not exist or the states are of another arm.
    pub fn of(joint: usize, x: MatRef<'_, f64>) -> Self {
        Self {
            x: x.to_owned(),
            arm: of_arm(Scenario::reference().model(), joint, x),
        }
    }
}

/// Y at every row of a data set, joint by joint as they are asked for.
///
/// It does not depend on the load: some hundredths of a millisecond a row that all loads share.
pub struct Regressors<'a> {
    data: &'a DataSet,
    of_joint: [OnceLock<Mat<f64>>; N_JOINTS],
}

impl<'a> Regressors<'a> {
    /// Nothing is computed yet.
    pub fn new(data: &'a DataSet) -> Self {
        Self {
            data,
            of_joint: Default::default(),
        }
    }

    /// At rows of the data set, for a joint, from 1.
    ///
    /// # Panics
    /// If there is no such row or joint.
    pub fn states(&self, joint: usize, rows: &[usize]) -> States {
        let all = self.of_joint[joint - 1].get_or_init(|| {
            let rows: Vec<usize> = (0..N_ROWS).collect();
            let model = Scenario::reference();
            of_arm(model.model(), joint, self.data.x(&rows).as_ref())
        });
        States {
            x: self.data.x(rows),
            arm: Mat::from_fn(rows.len(), all.ncols(), |row, col| all[(rows[row], col)]),
        }
    }
}

/// Parameters of (bodies, drives) that the torque of a joint, from 1, depends on: see
/// [`puma_dyn::dynamics::parameters_of_joint`].
pub fn columns(model: &Model, joint: usize) -> Vec<usize> {
    parameters_of_joint(model, joint - 1)
}

/// Rows of Y of a joint, from 1, in its [`columns`], (n, p).
fn of_arm(model: &Model, joint: usize, x: MatRef<'_, f64>) -> Mat<f64> {
    let n = model.n_joints();
    let n_parameters = n * (N_PARAMETERS + N_DRIVE_PARAMETERS);
    let columns = columns(model, joint);
    let mut workspace = Workspace::new(model);
    let mut matrix = vec![0.0; n * n_parameters];
    let mut regressor = Mat::zeros(x.nrows(), columns.len());
    for row in 0..x.nrows() {
        let state: Vec<f64> = x.row(row).iter().copied().collect();
        let (q, rates) = state.split_at(n);
        let (qd, qdd) = rates.split_at(n);
        full_regressor(model, &mut workspace, q, qd, qdd, &mut matrix);
        let of_joint = &matrix[(joint - 1) * n_parameters..joint * n_parameters];
        for (place, column) in columns.iter().enumerate() {
            regressor[(row, place)] = of_joint[*column];
        }
    }
    regressor
}

/// The rows of a joint, from 1, with a column for each parameter of (bodies, drives), (n, 14 ℓ).
pub fn of_all_parameters(joint: usize, arm: &Mat<f64>) -> Mat<f64> {
    let n_parameters = N_JOINTS * (N_PARAMETERS + N_DRIVE_PARAMETERS);
    let mut all = Mat::zeros(arm.nrows(), n_parameters);
    for (place, column) in columns(Scenario::reference().model(), joint)
        .into_iter()
        .enumerate()
    {
        let into = all.col_as_slice_mut(column);
        into.copy_from_slice(arm.col_as_slice(place));
    }
    all
}

/// The first of the last link's ten columns.
pub fn last_link(arm: &Mat<f64>) -> usize {
    arm.ncols() - N_DRIVE_PARAMETERS - N_PARAMETERS
}

/// The same followed by ten columns per load, of which only those of the sample's own are not zero.
///
/// # Shapes
/// `arm` (n, p), as [`States`] have it; `loads` (n,), from 0; (n, p + 10 `n_loads`).
/// # Panics
/// If there is not one load per row.
pub fn with_loads(arm: &Mat<f64>, loads: &[usize], n_loads: usize) -> Mat<f64> {
    assert_eq!(arm.nrows(), loads.len());
    let (p, last) = (arm.ncols(), last_link(arm));
    Mat::from_fn(loads.len(), p + N_PARAMETERS * n_loads, |row, col| {
        if col < p {
            return arm[(row, col)];
        }
        let (load, parameter) = ((col - p) / N_PARAMETERS, (col - p) % N_PARAMETERS);
        if load == loads[row] {
            arm[(row, last + parameter)]
        } else {
            0.0
        }
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use puma_dyn::dynamics::{drive_parameters, inertial_parameters};
    use puma_dyn::{Context, Effects};

    use super::*;

    #[test]
    fn regressor_and_parameters_of_arm_and_load_are_the_simulated_torques() {
        let scenario = Scenario::reference();
        let data = DataSet::simulate(&BTreeSet::from([1, 15])).unwrap();
        let rows: Vec<usize> = (0..64_000).step_by(9_001).collect();
        let model = scenario.model();
        let empty = inertial_parameters(model, &Context::empty());
        let mut of_arm = empty.clone();
        of_arm.extend(drive_parameters(model, Effects::ALL));
        for (place, load) in [(0, 1), (1, 15)] {
            let frame = model.frame_idx(puma_dyn::puma560::LAST_LINK).unwrap();
            let attached = model.attach(frame, scenario.payload(load - 1)).unwrap();
            let loaded = inertial_parameters(model, &Context::from(attached));
            for joint in 1..=6 {
                let used = columns(model, joint);
                let mut pi: Vec<f64> = used.iter().map(|&column| of_arm[column]).collect();
                pi.extend([0.0; 2 * N_PARAMETERS]);
                for k in 0..N_PARAMETERS {
                    pi[used.len() + N_PARAMETERS * place + k] = loaded[50 + k] - empty[50 + k];
                }
                let arm = States::of(joint, data.x(&rows).as_ref()).arm;
                let y = with_loads(&arm, &vec![place; rows.len()], 2);
                for (row, torque) in data.torques(load, joint, &rows).iter().enumerate() {
                    let sum: f64 = (0..pi.len()).map(|col| y[(row, col)] * pi[col]).sum();
                    // A few hundred products, none above 100 N·m.
                    let tolerance = 1000.0 * f64::EPSILON * 100.0;
                    assert!((sum - torque).abs() < tolerance, "{sum} {torque}");
                }
            }
        }
    }

    #[test]
    fn rows_of_the_data_set_are_those_of_their_states() {
        let data = DataSet::simulate(&BTreeSet::from([1])).unwrap();
        let rows = [63_999, 0, 17];
        let found = Regressors::new(&data).states(3, &rows);
        let expected = States::of(3, data.x(&rows).as_ref());
        assert_eq!((found.x, found.arm), (expected.x, expected.arm));
    }
}
