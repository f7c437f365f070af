//! The load followed tick by tick is the load learned from all rows at once.

use std::sync::Arc;

use torque_model::learn::SharedParameters;
use torque_model::rigid_body::{FitSettings, OnlineLoad, OnlineSettings, TermSet};
use torque_model::{Provenance, Robot, RobotModel, RobotSource, Samples, TorqueError};

use crate::shared_parameters::{FOLDER, samples};
use crate::torque_models;

/// Travel at the beginning of a run that does not count, rad.
const WAY: f64 = 0.006;

fn model(terms: TermSet, bare: &[&str]) -> RobotModel {
    let urdf = std::fs::read_to_string(format!("{FOLDER}/planar2.urdf")).unwrap();
    let source = RobotSource {
        urdf: Some(urdf),
        sidecar: None,
        gravity: None,
    };
    let learner = SharedParameters {
        robot: Robot::new(source, "planar2.urdf").unwrap(),
        terms: Some(terms),
        settings: FitSettings {
            bare: bare.iter().map(|name| (*name).to_owned()).collect(),
            ..FitSettings::default()
        },
    };
    let mut samples = samples("c_train.csv");
    samples.joint_names = learner.robot.model.joint_names().to_vec();
    RobotModel::learn(&samples, &learner, Provenance::new("test", b"")).unwrap()
}

/// A stretch of one load, in which the rows count that a loop would count.
fn stretch(model: &RobotModel) -> Samples {
    let mut stretch = samples("c_stretch.csv");
    stretch.contexts.clear();
    stretch.context_of.clear();
    stretch.timeline.run_of.clear();
    stretch.timeline.run_names.clear();
    stretch.joint_names = model.joint_names().to_vec();
    let mut way = [0.0; 2];
    let step = stretch.timeline.t[1] - stretch.timeline.t[0];
    for row in 0..stretch.n_rows() {
        for (joint, way) in way.iter_mut().enumerate() {
            let speed = stretch.x[(row, 2 + joint)].abs();
            *way += if speed >= 0.01 { speed * step } else { 0.0 };
            stretch.timeline.used.push(*way >= WAY);
        }
    }
    stretch
}

/// States and torques of each row.
fn ticks(model: &RobotModel, samples: &Samples) -> Vec<(Vec<f64>, Vec<f64>)> {
    let states = model.states_of(samples).unwrap();
    let of_row = |row: usize| {
        let x = states.row(row).iter().copied().collect();
        (x, samples.torques.iter().map(|of| of.values[row]).collect())
    };
    (0..samples.n_rows()).map(of_row).collect()
}

fn step_of(samples: &Samples) -> f64 {
    samples.timeline.t[1] - samples.timeline.t[0]
}

fn followed(model: &RobotModel, samples: &Samples) -> OnlineLoad {
    let mut online = model.online_load(OnlineSettings::one_load()).unwrap();
    for (x, torques) in ticks(model, samples) {
        online.update(&x, &torques, step_of(samples)).unwrap();
    }
    online
}

/// Largest differences: of log evidences, and of a load's ten means and their standard deviations, in the latter.
fn differences(terms: TermSet, bare: &[&str]) -> (Vec<f64>, f64, f64) {
    let model = model(terms, bare);
    let samples = stretch(&model);
    let online = followed(&model, &samples);
    let posterior = Arc::clone(model.rigid_body().unwrap());
    let batch = posterior.load_evidence(&samples).unwrap();
    let of_batch = batch.of_contexts.iter().copied().chain([batch.of_unknown]);
    let of_evidence = online.log_evidences().zip(of_batch).map(|(a, b)| a - b);

    let grown = posterior.with_context("new").unwrap();
    let context = grown.n_contexts() - 1;
    let given = grown.given(context, &samples).unwrap();
    let load = given.unknowns().load(given.load_of(context).unwrap());
    let (mean, std) = (&given.mean()[load.clone()], &given.std()[load]);
    let estimate = online.load();
    let (mut of_mean, mut of_std) = (0.0_f64, 0.0_f64);
    for k in 0..10 {
        of_mean = of_mean.max((estimate.mean[k] - mean[k]).abs() / std[k]);
        of_std = of_std.max((estimate.std[k] / std[k] - 1.0).abs());
    }
    (of_evidence.collect(), of_mean, of_std)
}

#[test]
fn ticks_give_the_evidence_and_the_load_of_all_rows_at_once() {
    for (terms, bare) in [(TermSet::Minimal, &["free"][..]), (TermSet::Tanh, &[])] {
        let (of_evidence, of_mean, of_std) = differences(terms, bare);
        // Evidences of a thousand nats by two algorithms, at a condition of 5e6.
        let largest = of_evidence
            .iter()
            .fold(0.0, |most: f64, of| most.max(of.abs()));
        assert!(largest < 1e-9, "{terms:?}: {of_evidence:?}");
        assert!(of_mean < 1e-9 && of_std < 1e-9, "{of_mean} {of_std}");
    }
}

#[test]
fn friction_of_the_load_is_linear_in_it() {
    // The batch takes friction from the load found at last, ticks from its derivative: the same to a tenth of an
    // error bar. A, B and the unknown load, of which B is in the hand.
    let (of_evidence, of_mean, of_std) = differences(TermSet::Full, &["free"]);
    assert!(
        of_evidence[2].abs() < 0.2 && of_evidence[3].abs() < 0.2,
        "{of_evidence:?}"
    );
    assert!(of_mean < 0.1 && of_std < 0.1, "{of_mean} {of_std}");
}

#[test]
fn a_tick_allocates_nothing_even_where_the_load_changes() {
    let model = model(TermSet::Full, &["free"]);
    let samples = stretch(&model);
    let ticks = ticks(&model, &samples);
    let settings = OnlineSettings {
        windows: [0.2, 0.5],
        ..OnlineSettings::default()
    };
    let mut online = model.online_load(settings).unwrap();
    let mut masses = 0.0;
    let report = allocation_counter::measure(|| {
        for round in 0..4 {
            for (x, torques) in &ticks {
                let mut torques = [torques[0], torques[1]];
                // Another load every other round.
                torques[0] -= f64::from(round % 2) * 20.0;
                assert_eq!(online.update(x, &torques, 0.05), Ok(()));
                masses += online.load().mean[0] + online.probabilities()[0];
            }
        }
        online.restart();
    });
    assert_eq!(report.count_total, 0, "{report:?}");
    assert!(online.n_changes() > 1 && masses.is_finite());
    assert!(online.seconds_since_change().abs() < 1e-12);
}

#[test]
fn what_was_expected_is_what_the_predictor_says_of_a_known_load() {
    let model = model(TermSet::Full, &["free"]);
    let samples = stretch(&model);
    let ticks = ticks(&model, &samples);
    let mut online = model.online_load(OnlineSettings::one_load()).unwrap();
    let predictor = model.predictor();
    let mut scratch = predictor.scratch();
    let (mut mean, mut var) = ([0.0; 2], [0.0; 2]);
    // B's own torques without noise leave its load and the arm as they are.
    for (x, _) in &ticks {
        (predictor.predict_into(2, &mut scratch, x, &mut mean, &mut var)).unwrap();
        online.update(x, &mean, 0.05).unwrap();
    }
    assert!(
        online.probabilities()[2] > 0.9,
        "{:?}",
        online.probabilities()
    );
    for (found, expected) in online.predicted().iter().zip(mean) {
        // Ten kilograms and metres: a ten thousandth of them.
        assert!((found - expected).abs() < 1e-3, "{found} {expected}");
    }
}

#[test]
fn numbers_that_cannot_be_are_refused_and_leave_no_trace() {
    let model = model(TermSet::Full, &["free"]);
    let ticks = ticks(&model, &stretch(&model));
    let mut online = model.online_load(OnlineSettings::default()).unwrap();
    let (x, torques) = &ticks[20];
    online.update(x, torques, 0.05).unwrap();
    let before: Vec<f64> = online.log_evidences().collect();
    let mut message = |x: &[f64], torques: &[f64], step: f64| {
        online.update(x, torques, step).unwrap_err().to_string()
    };
    let mut broken = x.clone();
    broken[4] = f64::NAN;
    assert_eq!(message(&broken, torques, 0.05), "covariate 4 is NaN");
    assert_eq!(
        message(x, &[1.0, f64::INFINITY], 0.05),
        "the torque of joint 1 is inf N·m"
    );
    assert_eq!(message(x, torques, 0.0), "a step of 0 s");
    let overflow = online.update(&[1e200; 10], torques, 0.05).unwrap_err();
    assert!(
        matches!(overflow, TorqueError::NotFinite { .. }),
        "{overflow}"
    );
    assert_eq!(online.log_evidences().collect::<Vec<f64>>(), before);

    let settings = OnlineSettings {
        forgetting: Some(-1.0),
        ..OnlineSettings::default()
    };
    let error = model.online_load(settings).unwrap_err();
    assert!(
        error.to_string().contains("forgetting, s, is -1"),
        "{error}"
    );
    let process = torque_models::all_kinds(60);
    let other = process.online_load(OnlineSettings::default()).unwrap_err();
    assert!(matches!(other, TorqueError::OtherKind { .. }));
}
