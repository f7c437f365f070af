//! A call of the predictor allocates nothing.

use allocation_counter::measure;

use crate::torque_models::{N_JOINTS, all_kinds};

#[test]
fn the_counter_counts() {
    let report = measure(|| drop(std::hint::black_box(vec![0.0; 6])));
    assert_eq!(report.count_total, 1);
}

#[test]
fn predicting_one_state_allocates_nothing_whatever_the_state() {
    let predictor = all_kinds(120).predictor();
    let mut scratch = predictor.scratch();
    let (mut mean, mut var) = ([0.0; N_JOINTS], [0.0; N_JOINTS]);
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
