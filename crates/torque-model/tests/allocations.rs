//! A call of the predictor allocates nothing.

use allocation_counter::measure;
use gp_core::Method;
use torque_model::RobotModel;

use crate::continuous_joints;
use crate::multi_task_models;
use crate::rigid_body_models::rigid_body;
use crate::torque_models::{all_kinds, low_rank};

#[test]
fn the_counter_counts() {
    let report = measure(|| drop(std::hint::black_box(vec![0.0; 6])));
    assert_eq!(report.count_total, 1);
}

#[test]
fn predicting_one_state_allocates_nothing_whatever_the_state_or_the_kind() {
    for model in [
        all_kinds(120),
        low_rank(400),
        multi_task_models::model(200, false),
        multi_task_models::model(60, true),
        rigid_body(60, Method::Dense),
        rigid_body(150, Method::Certified),
    ] {
        no_allocation(&model);
    }
    for (model, _) in continuous_joints::of_all_kinds() {
        no_allocation(&model);
    }
}

fn no_allocation(model: &RobotModel) {
    let predictor = model.predictor();
    let mut scratch = predictor.scratch();
    let n_learned = predictor.n_learned();
    let (mut mean, mut var) = (vec![0.0; n_learned], vec![0.0; n_learned]);
    let mut x = vec![0.0; 3 * model.n_joints()];
    let report = measure(|| {
        for (count, value) in [0.1, -1.0, 1e200, f64::NAN, 0.3].into_iter().enumerate() {
            x.fill(value);
            let context = count % predictor.n_contexts();
            let result = predictor.predict_into(context, &mut scratch, &x, &mut mean, &mut var);
            assert_eq!(result.is_ok(), value.abs() < 1e100);
            assert!(predictor.ranges().outside(&x).count() <= x.len());
        }
    });
    assert_eq!(report.count_total, 0, "{report:?}");
}
