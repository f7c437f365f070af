//! After construction nothing allocates, whatever the arm carries.

use allocation_counter::measure;
use puma_dyn::dynamics::{bias_acceleration, kinetic_energy, potential_energy};
use puma_dyn::{
    Context, Effects, Payload, TorqueTerms, Workspace, aba, crba, jacobian, puma560, regressor,
    rnea, torque_terms,
};

const X: [f64; 6] = [0.1, -0.7, 0.4, 1.3, -0.2, 0.9];

#[test]
fn the_counter_counts() {
    assert_eq!(
        measure(|| drop(std::hint::black_box(vec![0.0; 6]))).count_total,
        1
    );
}

#[test]
fn no_algorithm_allocates_and_neither_does_swapping_a_payload() {
    let model = puma560::model();
    let flange = model.frame_idx(puma560::LAST_LINK).unwrap();
    let load = |mass| {
        let payload = Payload::new(mass, [0.0, 0.0, 0.1], [0.0; 6]).unwrap();
        model.attach(flange, &payload).unwrap()
    };
    let (light, heavy) = (load(0.5), load(2.5));
    let mut context = Context::from(light);
    let mut workspace = Workspace::new(&model);
    let (mut tau, mut qdd, mut matrix, mut y) = ([0.0; 6], [0.0; 6], [0.0; 36], [0.0; 360]);
    let mut terms = TorqueTerms::new(&model);
    let all = Effects::ALL;

    let report = measure(|| {
        let ws = &mut workspace;
        for attached in [heavy, light] {
            context.replace(0, attached);
            rnea(&model, ws, all, &context, &X, &X, &X, &mut tau);
            crba(&model, ws, all, &context, &X, &mut matrix);
            assert!(aba(&model, ws, all, &context, &X, &X, &tau, &mut qdd).is_ok());
            torque_terms(&model, ws, all, &context, &X, &X, &X, &mut terms);
            regressor(&model, ws, &X, &X, &X, &mut y);
            jacobian(&model, flange, &X, &mut matrix);
            bias_acceleration(&model, ws, flange, &X, &X);
            kinetic_energy(&model, ws, all, &context, &X, &X);
            potential_energy(&model, ws, &context, &X);
        }
    });
    assert_eq!(report.count_total, 0, "{report:?}");
}
