//! A call of the predictor allocates nothing.

use allocation_counter::measure;
use gp_core::TorqueModel;

use crate::torque_models::{N_JOINTS, all_kinds, low_rank};

#[test]
fn the_counter_counts() {
    let report = measure(|| drop(std::hint::black_box(vec![0.0; 6])));
    assert_eq!(report.count_total, 1);
}

#[test]
fn predicting_one_state_allocates_nothing_whatever_the_state() {
    for model in [all_kinds(120), low_rank(400)] {
        no_allocation(&model);
    }
}

fn no_allocation(model: &TorqueModel) {
    let predictor = model.predictor();
    let mut scratch = predictor.scratch();
    let n_learned = predictor.n_learned();
    let (mut mean, mut var) = (vec![0.0; n_learned], vec![0.0; n_learned]);
    let report = measure(|| {
        for value in [0.1, -1.0, 1e200, f64::NAN] {
            let x = [value; 3 * N_JOINTS];
            let result = predictor.predict_into(&mut scratch, &x, &mut mean, &mut var);
            assert_eq!(result.is_ok(), value.is_finite());
            assert!(predictor.ranges().outside(&x).count() <= 3 * N_JOINTS);
        }
    });
    assert_eq!(report.count_total, 0, "{report:?}");
}
