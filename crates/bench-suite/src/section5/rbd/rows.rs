//! Rows of the regressor at rows of the data set.

use faer::Mat;
use puma_dyn::{N_PARAMETERS, Scenario, Workspace, full_regressor};

use crate::dataset::DataSet;

/// Rows of Y of one joint, from 1, for (bodies, drives), (rows.len(), 14 ℓ).
///
/// # Panics
/// If a row or the joint does not exist.
pub fn of_arm(scenario: &Scenario, data: &DataSet, joint: usize, rows: &[usize]) -> Mat<f64> {
    let model = scenario.model();
    let n = model.n_joints();
    let n_parameters = n * (N_PARAMETERS + puma_dyn::N_DRIVE_PARAMETERS);
    let mut workspace = Workspace::new(model);
    let mut matrix = vec![0.0; n * n_parameters];
    let mut regressor = Mat::zeros(rows.len(), n_parameters);
    let x = data.x(rows);
    for row in 0..rows.len() {
        let state: Vec<f64> = x.row(row).iter().copied().collect();
        let (q, rates) = state.split_at(n);
        let (qd, qdd) = rates.split_at(n);
        full_regressor(model, &mut workspace, q, qd, qdd, &mut matrix);
        let of_joint = &matrix[(joint - 1) * n_parameters..joint * n_parameters];
        for (col, value) in of_joint.iter().enumerate() {
            regressor[(row, col)] = *value;
        }
    }
    regressor
}

/// The same followed by ten columns per load, of which only those of the sample's own are not zero.
///
/// # Shapes
/// `regressor` as [`of_arm`] makes it; `loads` one per row, from 0; (rows, 14 ℓ + 10 `n_loads`).
/// # Panics
/// If there is not one load per row.
pub fn with_loads(regressor: &Mat<f64>, loads: &[usize], n_loads: usize) -> Mat<f64> {
    assert_eq!(regressor.nrows(), loads.len());
    let p = regressor.ncols();
    let n_joints = p / (N_PARAMETERS + puma_dyn::N_DRIVE_PARAMETERS);
    let last = (n_joints - 1) * N_PARAMETERS;
    Mat::from_fn(loads.len(), p + N_PARAMETERS * n_loads, |row, col| {
        if col < p {
            return regressor[(row, col)];
        }
        let (load, parameter) = ((col - p) / N_PARAMETERS, (col - p) % N_PARAMETERS);
        if load == loads[row] {
            regressor[(row, last + parameter)]
        } else {
            0.0
        }
    })
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use puma_dyn::{Context, Effects, drive_parameters, inertial_parameters};

    #[test]
    fn regressor_and_parameters_of_arm_and_load_are_the_simulated_torques() {
        let scenario = Scenario::reference();
        let data = DataSet::simulate(&BTreeSet::from([1, 15])).unwrap();
        let rows: Vec<usize> = (0..64_000).step_by(9_001).collect();
        let model = scenario.model();
        let empty = inertial_parameters(model, &Context::empty());
        for (place, load) in [(0, 1), (1, 15)] {
            let frame = model.frame_idx(puma_dyn::puma560::LAST_LINK).unwrap();
            let attached = model.attach(frame, scenario.payload(load - 1)).unwrap();
            let loaded = inertial_parameters(model, &Context::from(attached));
            let mut pi = empty.clone();
            pi.extend(drive_parameters(model, Effects::ALL));
            pi.extend([0.0; 2 * N_PARAMETERS]);
            for k in 0..N_PARAMETERS {
                pi[84 + N_PARAMETERS * place + k] = loaded[50 + k] - empty[50 + k];
            }
            for joint in 1..=6 {
                let y = of_arm(&scenario, &data, joint, &rows);
                let y = with_loads(&y, &vec![place; rows.len()], 2);
                for (row, torque) in data.torques(load, joint, &rows).iter().enumerate() {
                    let sum: f64 = (0..pi.len()).map(|col| y[(row, col)] * pi[col]).sum();
                    // A few hundred products, none above 100 N·m.
                    let tolerance = 1000.0 * f64::EPSILON * 100.0;
                    assert!((sum - torque).abs() < tolerance, "{sum} {torque}");
                }
            }
        }
    }
}
