//! Joints that turn without end: a turn further, everything that is asked of a process has the same answer.

use std::f64::consts::{PI, TAU};

use faer::Mat;
use gp_core::FitOptions;
use kernels::{ContinuousJoints, TorqueForm};
use mtgp::MultiTaskOptions;
use mtgp::context::{ContextPrior, ContextTracker, ContextTransition, context_evidence};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use torque_model::learn::{
    InOwnUnit, Learn, ManyContexts, Ranks, RigidBody, RigidBodyForm, SingleProcess, Tasks,
};
use torque_model::{
    Adapt, JointTorques, ModelFileError, RobotModel, Samples, adapt, different_states,
    joints_of_one_turn,
};

use crate::rigid_body_models;
use crate::rounding::bounds;
use crate::torque_models::{all_kinds, provenance};

const N_JOINTS: usize = 2;

/// Turns that a log may be off by.
const TURNS: [f64; 2] = [1.0, -3.0];

/// Torques of an arm in a plane whose first joint turns without end, with a load at its end.
fn torques(x: &[f64], load: f64) -> [f64; N_JOINTS] {
    let &[q1, q2, qd1, qd2, qdd1, qdd2] = x else {
        unreachable!("two joints")
    };
    let (mass, coupling) = (1.0 + load, (1.0 + load) * q2.cos());
    let elbow = mass * qdd2
        + (mass + coupling) * qdd1
        + mass * qd1 * qd1 * q2.sin()
        + 4.0 * mass * (q1 + q2).cos()
        + 0.2 * qd2;
    let shoulder = elbow
        + (2.0 + coupling) * qdd1
        + 9.0 * mass * q1.cos()
        + 0.4 * qd1
        + if qd1 > 0.0 { 0.3 } else { -0.3 };
    [shoulder, elbow]
}

/// States whose first joint is anywhere on the circle, as an encoder writes it.
fn states(seed: u64, n: usize) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let widths = [PI, 1.0, 2.0, 2.0, 3.0, 3.0];
    Mat::from_fn(n, 3 * N_JOINTS, |_, col| {
        widths[col] * rng.random_range(-1.0..1.0)
    })
}

/// The same with the first joint some turns further.
fn turned(x: &Mat<f64>, turns: f64) -> Mat<f64> {
    Mat::from_fn(x.nrows(), x.ncols(), |row, col| {
        x[(row, col)] + if col == 0 { TAU * turns } else { 0.0 }
    })
}

/// Samples under some loads, the rows of each one after the other.
fn samples(seed: u64, n: usize, loads: &[f64], continuous: &ContinuousJoints) -> Samples {
    let x = states(seed, n * loads.len());
    let of_row = |row: usize| {
        let state: Vec<f64> = x.row(row).iter().copied().collect();
        torques(&state, loads[row / n])
    };
    let of_joint = |joint_idx: usize| JointTorques {
        joint_idx,
        values: (0..x.nrows()).map(|row| of_row(row)[joint_idx]).collect(),
    };
    let torques = vec![of_joint(0), of_joint(1)];
    let names = ["swivel", "elbow"].map(str::to_owned).to_vec();
    let one = Samples::of_one_context(names, x, torques).unwrap();
    let several = loads.len() > 1;
    Samples {
        contexts: if several {
            (0..loads.len()).map(|of| format!("c{of}")).collect()
        } else {
            Vec::new()
        },
        context_of: if several {
            (0..n * loads.len()).map(|row| row / n).collect()
        } else {
            Vec::new()
        },
        continuous: continuous.clone(),
        ..one
    }
}

fn first() -> ContinuousJoints {
    ContinuousJoints::of([0])
}

fn single(form: TorqueForm) -> impl Learn {
    let options = FitOptions::several();
    let likelihood = options.likelihood;
    InOwnUnit {
        learner: SingleProcess { form, options },
        likelihood,
    }
}

fn learn(samples: &Samples, learner: &dyn Learn) -> RobotModel {
    RobotModel::learn(samples, learner, provenance()).unwrap()
}

/// A model of two loads, mGP of rank 2.
fn of_two_loads() -> RobotModel {
    let options = MultiTaskOptions {
        max_evaluations: 60,
        ..MultiTaskOptions::chapter()
    };
    let learner = ManyContexts {
        tasks: Tasks::Transfer(Ranks::Given(2)),
        options,
    };
    learn(&samples(2, 40, &[0.0, 1.5], &first()), &learner)
}

/// rbd+gp of the PUMA, whose last joint is taken to turn without end.
fn informed() -> RobotModel {
    let x = rigid_body_models::states(4, 40);
    let values = (0..40).map(|row| 0.05 * (2.0 * x[(row, 5)]).sin() + x[(row, 11)]);
    let torques = vec![JointTorques {
        joint_idx: 5,
        values: values.collect(),
    }];
    let robot = rigid_body_models::puma();
    let names = robot.model.joint_names().to_vec();
    let samples = Samples {
        continuous: ContinuousJoints::of([5]),
        ..Samples::of_one_context(names, x, torques).unwrap()
    };
    let options = FitOptions {
        max_evaluations: 20,
        ..FitOptions::chapter()
    };
    let learner = RigidBody::new(robot, RigidBodyForm::WithProcess, options);
    learn(&samples, &learner)
}

/// Models of every kind with a process, with states to ask them for.
pub fn of_all_kinds() -> Vec<(RobotModel, Mat<f64>)> {
    let one = samples(1, 60, &[0.0], &first());
    vec![
        (learn(&one, &single(TorqueForm::Coulomb)), states(7, 20)),
        (learn(&one, &single(TorqueForm::Smooth)), states(7, 20)),
        (of_two_loads(), states(7, 20)),
        (informed(), rigid_body_models::states(7, 20)),
    ]
}

/// Mean squared error as a part of the variance, of each joint, at states some turns further.
fn errors(model: &RobotModel, turns: f64) -> Vec<f64> {
    let test = samples(9, 100, &[0.0], &ContinuousJoints::none());
    let x = turned(&test.x, turns);
    let predictions = model.predict(0, x.as_ref()).unwrap();
    let pairs = predictions.iter().zip(&test.torques);
    pairs
        .map(|(prediction, truth)| {
            let n = truth.values.len() as f64;
            let mean = truth.values.iter().sum::<f64>() / n;
            let (mut error, mut spread) = (0.0, 0.0);
            for (found, value) in prediction.mean.iter().zip(&truth.values) {
                error += (found - value).powi(2);
                spread += (value - mean).powi(2);
            }
            error / spread
        })
        .collect()
}

#[test]
fn the_same_arm_has_the_same_torques_a_turn_further() {
    for form in [TorqueForm::Coulomb, TorqueForm::Smooth] {
        let found = samples(1, 200, &[0.0], &first());
        assert_eq!(joints_of_one_turn(found.x.as_ref(), N_JOINTS), first());
        let turning = learn(&found, &single(form));
        for turns in [0.0, 1.0, -3.0] {
            let errors = errors(&turning, turns);
            assert!(
                errors.iter().all(|nmse| *nmse < 1e-2),
                "{form:?} {errors:?}"
            );
        }
        // What the states as they are would have said.
        let as_given = samples(1, 200, &[0.0], &ContinuousJoints::none());
        let errors = errors(&learn(&as_given, &single(form)), 1.0);
        assert!(errors.iter().all(|nmse| *nmse > 0.3), "{form:?} {errors:?}");
    }
}

/// Mean and variance differ by twice the rounding of one prediction: cosine and sine are known to 2π ε a turn, which
/// is within the bounds of rounding for each entry of the covariance.
#[test]
fn predictions_of_every_kind_are_periodic_to_rounding() {
    for (model, x) in of_all_kinds() {
        let joint = model.continuous().indices()[0];
        for context in 0..model.contexts().len().max(1) {
            let before = model.predict(context, x.as_ref()).unwrap();
            for turns in TURNS {
                let further = Mat::from_fn(x.nrows(), x.ncols(), |row, col| {
                    x[(row, col)] + if col == joint { TAU * turns } else { 0.0 }
                });
                let after = model.predict(context, further.as_ref()).unwrap();
                for ((before, after), (_, of_joint)) in
                    before.iter().zip(&after).zip(model.learned())
                {
                    for row in 0..x.nrows() {
                        let state: Vec<f64> = further.row(row).iter().copied().collect();
                        let (m, v) = (before.mean[row], before.var[row]);
                        let (of_mean, of_var) = bounds(of_joint, context, &state, m, v);
                        let mean = (after.mean[row] - m).abs();
                        let var = (after.var[row] - v).abs();
                        let name = of_joint.name();
                        assert!(mean <= 2.0 * of_mean, "{name}: {mean} {of_mean}");
                        assert!(var <= 2.0 * of_var, "{name}: {var} {of_var}");
                    }
                }
            }
        }
    }
}

#[test]
fn another_load_is_learned_from_a_log_some_turns_further() {
    let model = of_two_loads();
    let new = samples(5, 30, &[0.7], &ContinuousJoints::none());
    let grown = |turns: f64| {
        let further = Samples {
            x: turned(&new.x, turns),
            ..new.clone()
        };
        adapt(&model, "new", &further, Adapt::default(), provenance()).unwrap()
    };
    let x = states(8, 20);
    let of = |model: RobotModel| model.predict(2, x.as_ref()).unwrap();
    let here = of(grown(0.0));
    for turns in TURNS {
        for (a, b) in of(grown(turns)).iter().zip(&here) {
            for (a, b) in a.mean.iter().zip(&b.mean) {
                // A search magnifies rounding; torques are of some 20 N·m.
                assert!((a - b).abs() <= 1e-6 * 20.0, "{a} {b}");
            }
        }
    }
    // The load is learned, at a turn further as well.
    let truth = samples(8, 20, &[0.7], &ContinuousJoints::none());
    let further = turned(&truth.x, 2.0);
    let found = grown(0.0).predict(2, further.as_ref()).unwrap();
    for (found, truth) in found.iter().zip(&truth.torques) {
        let pairs = || found.mean.iter().zip(&truth.values);
        let error: f64 = pairs().map(|(found, value)| (found - value).powi(2)).sum();
        let size: f64 = truth.values.iter().map(|value| value.powi(2)).sum();
        assert!(error < 0.1 * size, "{error} {size}");
    }
}

#[test]
fn a_context_is_recognised_some_turns_further() {
    let model = of_two_loads();
    let data = samples(6, 12, &[1.5], &ContinuousJoints::none());
    let processes: Vec<_> = model.tasks().map(|(_, of)| of).collect();
    let joints: Vec<_> = (processes.iter().zip(&data.torques))
        .map(|(process, torques)| mtgp::context::JointTorques {
            model: &process.posterior,
            torques: &torques.values,
        })
        .collect();
    let in_total = |x: &Mat<f64>| {
        let evidence = context_evidence(&joints, x.as_ref()).unwrap();
        evidence.log_densities().to_vec()
    };
    let row_after_row = |x: &Mat<f64>| {
        let prior = ContextPrior::uniform(2).unwrap();
        let posteriors = processes.iter().map(|process| &process.posterior);
        let chain = ContextTransition::none(2);
        let mut tracker = ContextTracker::new(posteriors, 10, &prior, chain).unwrap();
        let mut log_probabilities = Vec::new();
        for row in 0..x.nrows() {
            let state: Vec<f64> = x.row(row).iter().copied().collect();
            let torques = data.torques.iter().map(|of| Some(of.values[row]));
            let torques: Vec<_> = torques.collect();
            log_probabilities = tracker.step(&state, &torques).unwrap().to_vec();
        }
        log_probabilities
    };
    let total = in_total(&data.x);
    assert!(total[1] > total[0] + 10.0, "{total:?}");
    let last = row_after_row(&data.x);
    assert!(last[1] > -1e-3, "{last:?}");
    for turns in TURNS {
        let further = turned(&data.x, turns);
        for (a, b) in in_total(&further).iter().zip(&total) {
            // 24 torques, whose squared errors in standard deviations rounding changes by some 10⁻¹⁰.
            assert!((a - b).abs() <= 1e-8 * b.abs(), "{a} {b}");
        }
        for (a, b) in row_after_row(&further).iter().zip(&last) {
            assert!((a - b).abs() <= 1e-8 * total[0].abs(), "{a} {b}");
        }
    }
}

#[test]
fn states_of_one_place_on_the_circle_are_one_state() {
    let model = of_two_loads();
    let (_, process) = model.tasks().next().unwrap();
    let one = states(3, 1);
    let rows = Mat::from_fn(30, one.ncols(), |row, col| {
        one[(0, col)] + if col == 0 { TAU * row as f64 } else { 0.0 }
    });
    assert_eq!(different_states(process, rows.as_ref(), 9), Ok(1));
    assert!(different_states(process, states(3, 30).as_ref(), 9).unwrap() > 5);
}

#[test]
fn ranges_of_a_continuous_joint_are_those_on_the_circle() {
    let narrow = |continuous: &ContinuousJoints| {
        let of = samples(1, 60, &[0.0], continuous);
        let x = Mat::from_fn(60, 6, |row, col| {
            of.x[(row, col)] * [0.3, 1.0][usize::from(col > 0)]
        });
        let of = Samples { x, ..of };
        learn(&of, &single(TorqueForm::Coulomb))
    };
    let (turning, as_given) = (narrow(&first()), narrow(&ContinuousJoints::none()));
    let outside = |model: &RobotModel, q: f64| {
        let state = [q, 0.0, 0.0, 0.0, 0.0, 0.0];
        model.ranges().outside(&state).collect::<Vec<_>>()
    };
    for turns in TURNS {
        assert!(outside(&turning, 0.1 + TAU * turns).is_empty());
        assert_eq!(outside(&turning, 2.0 + TAU * turns), [0]);
        assert_eq!(outside(&as_given, 0.1 + TAU * turns), [0]);
        let edge = turning.ranges().min()[0] + TAU * turns;
        assert!(outside(&turning, edge).is_empty());
    }
    assert_eq!(outside(&turning, f64::NAN), [0]);
    // Positions all around: none is outside, also in a small gap.
    let around = learn(
        &samples(1, 60, &[0.0], &first()),
        &single(TorqueForm::Smooth),
    );
    assert!((0..63).all(|step| outside(&around, 0.1 * f64::from(step)).is_empty()));
}

#[test]
fn a_file_holds_the_continuous_joints_and_other_files_are_as_they_were() {
    for (model, x) in of_all_kinds() {
        let bytes = model.to_bytes();
        // Version 1, the kind above it, and 256 for the list.
        assert_eq!((bytes[8], bytes[11]), (1, 1), "{:?}", &bytes[8..12]);
        let loaded = RobotModel::from_bytes(&bytes).unwrap();
        assert_eq!(loaded.kind(), model.kind());
        assert_eq!(loaded.continuous(), model.continuous());
        assert!(loaded.to_bytes() == bytes);
        let of = |model: &RobotModel| model.predict(0, x.as_ref()).unwrap();
        assert_eq!(of(&loaded), of(&model));
    }
    assert_eq!(all_kinds(12).to_bytes()[11], 0);
}

#[test]
fn a_forged_list_of_continuous_joints_is_refused() {
    let model = learn(
        &samples(1, 20, &[0.0], &first()),
        &single(TorqueForm::Smooth),
    );
    let bytes = model.to_bytes();
    // The payload begins with the list: its length and the joint, eight bytes each.
    let list = |numbers: &[u64]| -> Vec<u8> {
        let entries = numbers.iter().flat_map(|number| number.to_le_bytes());
        let length = (numbers.len() as u64).to_le_bytes();
        length.into_iter().chain(entries).collect()
    };
    assert_eq!(bytes[52..68], list(&[0]));
    for (numbers, expected) in [
        (vec![], "continuous joints []"),
        (vec![1, 0], "continuous joints [1, 0]"),
        (vec![0, 7], "continuous joints has 2 entries, expected 8"),
        (
            vec![u64::from(u32::MAX) << 20],
            "continuous joints has 2 entries",
        ),
    ] {
        let payload: Vec<u8> = list(&numbers)
            .into_iter()
            .chain(bytes[68..].to_vec())
            .collect();
        let word = u32::from_le_bytes(bytes[8..12].try_into().unwrap());
        let error = RobotModel::from_bytes(&crate::forged_files::framed(word, &payload));
        let Err(ModelFileError::Malformed { what }) = error else {
            panic!("{numbers:?}: {:?}", error.err())
        };
        assert!(what.starts_with(expected), "{what}");
    }
}
