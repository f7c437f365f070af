//! The predictor of a control loop against the model it is made from.

use faer::Mat;
use gp_core::{GpError, LinearForm, Method};
use kernels::TorqueForm;
use mtgp::MtgpError;
use torque_model::{JointModel, RobotModel, TorqueError};

use crate::continuous_joints;
use crate::multi_task_models::{self, inputs};
use crate::rigid_body_models::{self, rigid_body, states};
use crate::rounding::bounds;
use crate::torque_models::{
    N_JOINTS, all_kinds, curve, linear, low_rank, parts, process, torques, uniform_inputs,
};

fn state(x: &Mat<f64>, row: usize) -> Vec<f64> {
    x.row(row).iter().copied().collect()
}

/// A model of every kind, by either path, with states to ask it for.
fn of_all_kinds() -> Vec<(RobotModel, Mat<f64>)> {
    let x = uniform_inputs(3, 40, 3 * N_JOINTS);
    let mut all = vec![
        (all_kinds(61), x.clone()),
        (low_rank(200), x),
        (multi_task_models::model(60, false), inputs(6, 40)),
        (multi_task_models::model(200, true), inputs(6, 40)),
        (rigid_body(30, Method::Dense), states(6, 40)),
        (rigid_body(150, Method::Dense), states(6, 40)),
        (rigid_body(150, Method::Certified), states(6, 40)),
    ];
    all.extend(continuous_joints::of_all_kinds());
    all
}

#[test]
fn a_call_of_the_loop_says_to_the_bit_what_the_model_says_of_many_rows() {
    for (model, x) in of_all_kinds() {
        let predictor = model.predictor();
        let n = predictor.n_learned();
        let (mut mean, mut var) = (vec![0.0; n], vec![0.0; n]);
        let mut scratch = predictor.scratch();
        for context in 0..predictor.n_contexts() {
            let expected = model.predict(context, x.as_ref()).unwrap();
            for row in 0..x.nrows() {
                let x = state(&x, row);
                let result = predictor.predict_into(context, &mut scratch, &x, &mut mean, &mut var);
                assert_eq!(result, Ok(()));
                for (place, joint) in expected.iter().enumerate() {
                    assert_eq!(mean[place].to_bits(), joint.mean[row].to_bits());
                    assert_eq!(var[place].to_bits(), joint.var[row].to_bits());
                    assert_eq!(joint.noise_var[0], predictor.noise_vars()[place]);
                }
            }
        }
    }
}

/// Largest differences of mean and variance from the batch, as parts of their bounds, over rows and contexts.
fn largest_errors(model: &RobotModel, x: &Mat<f64>) -> (f64, f64) {
    let mut largest = (0.0_f64, 0.0_f64);
    for context in 0..model.contexts().len().max(1) {
        let found = model.predict(context, x.as_ref()).unwrap();
        for (place, (found, (_, of_joint))) in found.iter().zip(model.learned()).enumerate() {
            let batch = model.predict_joint(place, context, x.as_ref()).unwrap();
            for row in 0..x.nrows() {
                let (m, v) = (batch.mean[row], batch.var[row]);
                let (of_mean, of_var) = bounds(of_joint, context, &state(x, row), m, v);
                largest.0 = largest.0.max((found.mean[row] - m).abs() / of_mean);
                largest.1 = largest.1.max((found.var[row] - v).abs() / of_var);
            }
        }
    }
    largest
}

#[test]
fn the_predictor_equals_the_batch_within_rounding_whatever_the_kind() {
    for (model, x) in of_all_kinds() {
        let (mean, var) = largest_errors(&model, &x);
        let kind = model.learned()[0].1.name();
        assert!(mean <= 1.0 && var <= 1.0, "{kind}: {mean} {var}");
    }
}

#[test]
fn predictor_equals_the_model_within_rounding() {
    // Orders on both sides of every multiple of the solver's panel and of the lanes.
    for n in [1, 2, 5, 8, 12, 61, 150] {
        let x = uniform_inputs(n as u64, 50, 3 * N_JOINTS);
        let (mean, var) = largest_errors(&all_kinds(n), &x);
        assert!(mean <= 1.0 && var <= 1.0, "{n}: {mean} {var}");
    }
}

#[test]
fn predictor_on_pivots_equals_the_model_within_rounding() {
    let model = low_rank(400);
    for (_, joint) in model.learned() {
        let JointModel::Process(process) = joint else {
            unreachable!()
        };
        let rank = process.posterior.rank();
        assert!((5..200).contains(&rank), "{rank}");
    }
    // On the curve, between its samples, and far from it.
    for x in [curve(400), uniform_inputs(3, 100, 3 * N_JOINTS)] {
        let (mean, var) = largest_errors(&model, &x);
        assert!(mean <= 1.0 && var <= 1.0, "{mean} {var}");
    }
}

#[test]
fn a_joint_at_rest_has_no_friction() {
    let model = all_kinds(30);
    let predictor = model.predictor();
    let mut scratch = predictor.scratch();
    let (mut at_rest, mut moving, mut var) = ([0.0; N_JOINTS], [0.0; N_JOINTS], [0.0; N_JOINTS]);
    let mut x = [0.3; 3 * N_JOINTS];
    for (velocity, mean) in [(0.0, &mut at_rest), (1e-12, &mut moving)] {
        x[N_JOINTS..2 * N_JOINTS].fill(velocity);
        predictor
            .predict_into(0, &mut scratch, &x, mean, &mut var)
            .unwrap();
    }
    // Without signs nothing jumps; with them friction does.
    for (joint, jumps) in [false, true, false, true].into_iter().enumerate() {
        let jump = (moving[joint] - at_rest[joint]).abs();
        assert_eq!(jump > 1e-3, jumps, "{joint}: {jump}");
    }
}

#[test]
fn states_that_are_not_finite_leave_nan_and_an_error() {
    for (model, _) in of_all_kinds() {
        let predictor = model.predictor();
        let mut scratch = predictor.scratch();
        let (d, n) = (3 * model.n_joints(), predictor.n_learned());
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for bad in 0..d {
                let mut x = vec![0.1; d];
                x[bad] = value;
                let (mut mean, mut var) = (vec![1.0; n], vec![1.0; n]);
                let result = predictor.predict_into(0, &mut scratch, &x, &mut mean, &mut var);
                let Err(TorqueError::Gp(GpError::NonFiniteInput { row: 0, column, .. })) = result
                else {
                    panic!("{result:?}");
                };
                assert_eq!(column, bad);
                assert!(mean.iter().chain(&var).all(|value| value.is_nan()));
            }
        }
    }
}

#[test]
fn states_of_any_size_never_panic_and_an_overflow_is_an_error_of_a_joint() {
    for (model, _) in of_all_kinds() {
        let predictor = model.predictor();
        let mut scratch = predictor.scratch();
        let (d, n) = (3 * model.n_joints(), predictor.n_learned());
        let (mut mean, mut var) = (vec![0.0; n], vec![0.0; n]);
        for size in [f64::MAX, -f64::MAX, 1e200, -1e160] {
            let x = vec![size; d];
            let result = predictor.predict_into(0, &mut scratch, &x, &mut mean, &mut var);
            let Err(TorqueError::NotFinite { row: 0, joint_idx }) = result else {
                panic!("{size}: {result:?}");
            };
            assert_eq!(joint_idx, predictor.joint_indices()[0]);
            assert!(mean.iter().chain(&var).all(|value| value.is_nan()));
        }
        // A call after an overflow is not touched by it.
        for size in [5e-324, -0.0, 0.1] {
            let x = vec![size; d];
            let result = predictor.predict_into(0, &mut scratch, &x, &mut mean, &mut var);
            assert_eq!(result, Ok(()));
            assert!(mean.iter().all(|mean| mean.is_finite()));
            // At rest nothing of a rigid body may be uncertain about a vertical axis.
            let is_certain =
                |var: &f64| *var == 0.0 && size.abs() < 0.1 && model.parts().robot.is_some();
            assert!(
                var.iter().all(|var| *var > 0.0 || is_certain(var)),
                "{size}: {var:?}"
            );
        }
    }
}

#[test]
fn a_context_that_there_is_not_is_an_error_of_the_batch() {
    let model = multi_task_models::model(12, false);
    let x = inputs(5, 3);
    let error = model.predict(3, x.as_ref()).unwrap_err();
    let unknown = MtgpError::UnknownTask {
        row: 0,
        task: 3,
        n_tasks: 3,
    };
    assert_eq!(error, TorqueError::Mtgp(unknown));
    let narrow = model.predict(0, x.subcols(0, 4)).unwrap_err();
    let expected = GpError::WrongCovariates {
        found: 4,
        expected: 6,
    };
    assert_eq!(narrow, TorqueError::Gp(expected));
}

/// Where data are precise, a prior of hundreds is subtracted to leave millionths.
#[test]
fn the_variance_of_a_rigid_body_is_never_negative_or_zero() {
    let (robot, x) = (rigid_body_models::puma(), states(4, 400));
    let form = torque_model::learn::RigidBodyForm::Alone;
    let joint = rigid_body_models::joint_model(&robot, 1, form, &x, Method::Dense);
    let model = rigid_body_models::model(&robot, vec![(1, joint)], &x);
    let found = model.predict(0, x.as_ref()).unwrap();
    assert!(found[0].var.iter().all(|var| *var > 0.0));
}

#[test]
fn a_predictor_of_some_joints_says_which() {
    let x = uniform_inputs(5, 20, 3 * N_JOINTS);
    let learned = vec![
        (1, linear(&x, 1, LinearForm::Coulomb)),
        (3, process(&x, 3, TorqueForm::Coulomb, Method::Automatic)),
    ];
    let model = RobotModel::new(parts(&x, learned)).unwrap();
    let predictor = model.predictor();
    assert_eq!(predictor.joint_indices(), [1, 3]);
    assert_eq!(predictor.noise_vars(), [1e-4, 0.05 * 0.05]);

    let (mut mean, mut var) = ([0.0; 2], [0.0; 2]);
    let mut scratch = predictor.scratch();
    let first = state(&x, 0);
    predictor
        .predict_into(0, &mut scratch, &first, &mut mean, &mut var)
        .unwrap();
    // At a training point the process is within a few noise deviations of its target.
    assert!((mean[1] - torques(&x, 3)[0]).abs() < 4.0 * 0.05, "{mean:?}");
}
