//! Predictions have the same bits on any number of threads, and an error names the first row.

use faer::Mat;
use gp_core::Method;
use torque_model::{JointPrediction, RobotModel, TorqueError};

use crate::multi_task_models::{inputs, model};
use crate::rigid_body_models::{rigid_body, states};
use crate::torque_models::{N_JOINTS, all_kinds, low_rank, uniform_inputs};

fn on_threads<T: Send>(n: usize, work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n).build();
    pool.unwrap().install(work)
}

fn bits(predictions: &[JointPrediction]) -> Vec<u64> {
    let values = predictions.iter().flat_map(|p| p.mean.iter().chain(&p.var));
    values.map(|value| value.to_bits()).collect()
}

#[test]
fn one_two_and_four_threads_predict_the_same_bits_whatever_the_kind() {
    let uniform = uniform_inputs(5, 300, 3 * N_JOINTS);
    let cases: [(RobotModel, Mat<f64>); 5] = [
        (all_kinds(40), uniform.clone()),
        (low_rank(200), uniform),
        (model(60, false), inputs(5, 300)),
        (rigid_body(40, Method::Dense), states(5, 300)),
        (rigid_body(150, Method::Certified), states(5, 300)),
    ];
    for (model, x) in cases {
        let n_contexts = model.contexts().len().max(1);
        let contexts: Vec<usize> = (0..x.nrows()).map(|row| row % n_contexts).collect();
        // A fresh clone each time, so that the predictor is made on that many threads, too.
        let predict = |n: usize| {
            let model = RobotModel::from_bytes(&model.to_bytes()).unwrap();
            on_threads(n, || model.predict_rows(&contexts, x.as_ref()).unwrap())
        };
        let one = bits(&predict(1));
        assert_eq!(one, bits(&predict(2)));
        assert_eq!(one, bits(&predict(4)));
    }
}

#[test]
fn the_first_row_that_overflows_is_named_on_any_number_of_threads() {
    let model = all_kinds(20);
    let mut x = uniform_inputs(5, 500, 3 * N_JOINTS);
    for row in [70, 130, 400] {
        x[(row, 0)] = 1e200;
    }
    for n in [1, 2, 4] {
        let error = on_threads(n, || model.predict(0, x.as_ref()).unwrap_err());
        let expected = TorqueError::NotFinite {
            row: 70,
            joint_idx: 0,
        };
        assert_eq!(error, expected);
    }
}
