//! Loads that were never carried, by their data sheets.

use faer::Mat;
use mtgp::MultiTaskOptions;
use puma_dyn::{Context, Effects, Model, Payload, Workspace, rnea};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use torque_model::learn::{DescribedContexts, SharedParameters};
use torque_model::rigid_body::{FitSettings, TermSet};
use torque_model::{
    Adapt, JointTorques, LoadDescription, ModelFileKind, Provenance, Robot, RobotModel,
    RobotSource, Samples, TorqueError, adapt, carry_attached, carry_described,
};

const FOLDER: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../fixtures/torque-model/real_robot"
);

/// The arm whose torques are simulated, and a description of it with other masses.
fn arms() -> (Robot, Robot) {
    let text = std::fs::read_to_string(format!("{FOLDER}/planar2.urdf")).unwrap();
    let described = text.replace(r#"mass value="2.0""#, r#"mass value="2.2""#);
    assert_ne!(text, described);
    let [truth, described] = [text, described].map(|urdf| {
        let source = RobotSource {
            urdf: Some(urdf),
            sidecar: None,
            gravity: None,
        };
        Robot::new(source, "planar2.urdf").unwrap()
    });
    (truth, described)
}

fn states(seed: u64, n: usize) -> Mat<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    Mat::from_fn(n, 6, |_, col| {
        [2.0, 2.0, 1.5, 1.5, 4.0, 4.0][col] * rng.random_range(-1.0..1.0)
    })
}

/// Torques of the arm with a load, (n, 2), without noise or friction.
fn torques(robot: &Model, load: &Context, x: &Mat<f64>) -> Mat<f64> {
    let mut workspace = Workspace::new(robot);
    let mut all = Mat::zeros(x.nrows(), 2);
    for row in 0..x.nrows() {
        let state: Vec<f64> = x.row(row).iter().copied().collect();
        let mut tau = [0.0; 2];
        let (q, qd, qdd) = (&state[..2], &state[2..4], &state[4..]);
        rnea(
            robot,
            &mut workspace,
            Effects::ALL,
            load,
            q,
            qd,
            qdd,
            &mut tau,
        );
        all[(row, 0)] = tau[0];
        all[(row, 1)] = tau[1];
    }
    all
}

/// A load of a kilogram or so, in the axes of the last link.
fn payload(mass: f64) -> Payload {
    Payload::new(
        mass,
        [0.25, 0.0, 0.03],
        [0.002, 0.004, 0.003, 0.0, 0.0, 0.0],
    )
    .unwrap()
}

fn carried(robot: &Model, mass: f64) -> Context {
    let link = robot.frame_idx("lower").unwrap();
    robot.attach(link, &payload(mass)).unwrap().into()
}

/// `n` rows of each of some loads, of mass zero for a bare arm.
fn samples(robot: &Robot, loads: &[(&str, f64)], seed: u64, n: usize) -> Samples {
    let x = states(seed, n * loads.len());
    let mut values = [Vec::new(), Vec::new()];
    let mut context_of = Vec::new();
    for (context, (_, mass)) in loads.iter().enumerate() {
        let load = if *mass > 0.0 {
            carried(&robot.model, *mass)
        } else {
            Context::empty()
        };
        let own = x.subrows(context * n, n).to_owned();
        let tau = torques(&robot.model, &load, &own);
        for (joint, values) in values.iter_mut().enumerate() {
            values.extend(tau.col(joint).iter());
        }
        context_of.extend(vec![context; n]);
    }
    let mut joint_idx = 0..2;
    Samples {
        joint_names: robot.model.joint_names().to_vec(),
        contexts: loads.iter().map(|(name, _)| (*name).to_owned()).collect(),
        context_of,
        x,
        torques: values
            .map(|values| JointTorques {
                joint_idx: joint_idx.next().unwrap(),
                values,
            })
            .into(),
        timeline: torque_model::Timeline::default(),
        continuous: torque_model::ContinuousJoints::none(),
    }
}

fn shared(robot: Robot, samples: &Samples) -> RobotModel {
    let learner = SharedParameters {
        robot,
        terms: Some(TermSet::Signs),
        settings: FitSettings {
            bare: vec!["free".to_owned()],
            ..FitSettings::default()
        },
    };
    RobotModel::learn(samples, &learner, Provenance::new("test", b"")).unwrap()
}

/// The largest error of a joint in a context, N·m, and the largest torque.
fn largest_error(model: &RobotModel, context: usize, x: &Mat<f64>, truth: &Mat<f64>) -> (f64, f64) {
    let found = model.predict(context, x.as_ref()).unwrap();
    let mut worst = (0.0_f64, 0.0_f64);
    for (joint, of) in found.iter().enumerate() {
        for row in 0..x.nrows() {
            let true_torque = truth[(row, joint)];
            worst.0 = worst.0.max((of.mean[row] - true_torque).abs());
            worst.1 = worst.1.max(true_torque.abs());
        }
    }
    worst
}

#[test]
fn an_identified_arm_with_a_known_load_has_the_torques_of_rnea() {
    let (truth, described) = arms();
    let train = samples(&truth, &[("free", 0.0), ("A", 0.6)], 1, 300);
    let model = shared(described, &train);
    let load = carried(&truth.model, 1.4);
    let loaded = carry_attached(&model, "new.toml", &load).unwrap();
    assert_eq!(loaded.contexts(), ["new.toml"]);

    let x = states(7, 100);
    let expected = torques(&truth.model, &load, &x);
    let (known, size) = largest_error(&loaded, 0, &x, &expected);
    let bare = torques(&truth.model, &Context::empty(), &x);
    let (identified, _) = largest_error(&model, 0, &x, &bare);
    // The load adds nothing to the arm's own error but rounding.
    assert!(
        known <= identified + 1e-9 * size,
        "{known:e} {identified:e}"
    );
    assert!(known <= 1e-3 * size, "{known:e} {size}");

    // The load is known exactly: the uncertainty is that of the bare arm.
    let of_arm = model.predict(0, x.as_ref()).unwrap();
    let of_loaded = loaded.predict(0, x.as_ref()).unwrap();
    for (arm, loaded) in of_arm.iter().zip(&of_loaded) {
        for (arm, loaded) in arm.var.iter().zip(&loaded.var) {
            assert!((arm / loaded - 1.0).abs() <= 1e-6, "{arm:e} {loaded:e}");
        }
    }

    // Many rows of the same load say the same.
    let mut new = samples(&truth, &[("new", 1.4)], 9, 400);
    new.contexts.clear();
    new.context_of.clear();
    let provenance = Provenance::new("test", b"new");
    let adapted = adapt(&model, "new", &new, Adapt::default(), provenance).unwrap();
    let (learned, _) = largest_error(&adapted, 2, &x, &expected);
    assert!(learned <= 1e-3 * size, "{learned:e} {size}");

    // What is carried is in the file, which is one of a model of one context.
    let read = RobotModel::from_bytes(&loaded.to_bytes()).unwrap();
    assert_eq!(
        read.predict(0, x.as_ref()).unwrap(),
        loaded.predict(0, x.as_ref()).unwrap()
    );
}

#[test]
fn loads_summed_out_leave_the_arm_as_it_was() {
    let (truth, described) = arms();
    let train = samples(&truth, &[("A", 0.6), ("B", 1.1), ("free", 0.0)], 3, 40);
    let model = shared(described, &train);
    let posterior = model.rigid_body().unwrap();
    let nothing = posterior.carrying("nothing", &Context::empty()).unwrap();
    let own: Vec<usize> = (0..nothing.unknowns().len()).collect();
    let (cov, expected) = (nothing.covariance_of(&own), posterior.covariance_of(&own));
    let (mean, of_mean) = (nothing.mean(), posterior.mean());
    for a in 0..own.len() {
        let std = expected[(a, a)].sqrt();
        assert!((mean[a] - of_mean[a]).abs() <= 1e-6 * std.max(1e-9), "{a}");
        for b in 0..own.len() {
            let size = std * expected[(b, b)].sqrt();
            let error = (cov[(a, b)] - expected[(a, b)]).abs();
            assert!(error <= 1e-6 * size + 1e-15, "{a} {b}: {error:e} {size:e}");
        }
    }
}

#[test]
fn a_turn_more_of_a_continuous_joint_is_the_same_to_a_process_of_described_loads() {
    let (truth, _) = arms();
    let loads = [("free", 0.0), ("A", 0.6), ("B", 1.1)];
    let mut train = samples(&truth, &loads, 5, 20);
    train.continuous = torque_model::ContinuousJoints::of([0]);
    let learner = DescribedContexts {
        loads: loads.iter().map(|(_, mass)| described(*mass)).collect(),
        options: MultiTaskOptions::several(),
    };
    let model = RobotModel::learn(&train, &learner, Provenance::new("test", b"")).unwrap();
    assert_eq!(model.continuous(), &train.continuous);
    let x = states(11, 5);
    let turned = Mat::from_fn(x.nrows(), x.ncols(), |row, col| {
        x[(row, col)] + if col == 0 { std::f64::consts::TAU } else { 0.0 }
    });
    let (here, there) = (
        model.predict(1, x.as_ref()).unwrap(),
        model.predict(1, turned.as_ref()).unwrap(),
    );
    for (here, there) in here.iter().zip(&there) {
        for (a, b) in here.mean.iter().zip(&there.mean) {
            assert!((a - b).abs() <= 1e-6 * (1.0 + a.abs()), "{a} {b}");
        }
    }
}

fn described(mass: f64) -> LoadDescription {
    if mass > 0.0 {
        LoadDescription::from(&payload(mass))
    } else {
        LoadDescription::NOTHING
    }
}

#[test]
fn a_process_of_described_loads_predicts_another_and_its_file_does_the_same() {
    let (truth, _) = arms();
    let loads = [("free", 0.0), ("A", 0.6), ("B", 1.1), ("C", 1.8)];
    let train = samples(&truth, &loads, 5, 60);
    let learner = DescribedContexts {
        loads: loads.iter().map(|(_, mass)| described(*mass)).collect(),
        options: MultiTaskOptions::several(),
    };
    let model = RobotModel::learn(&train, &learner, Provenance::new("test", b"")).unwrap();
    assert_eq!(model.kind(), ModelFileKind::ManyContexts);
    assert_eq!(model.learned()[0].1.name(), "mGP(s)");

    let x = states(11, 200);
    let grown = carry_described(&model, "new.toml", &described(1.4)).unwrap();
    // Of the torques with a mass, by the model of a context.
    let squares = |model: &RobotModel, context: usize, mass: f64| -> f64 {
        let expected = torques(&truth.model, &carried(&truth.model, mass), &x);
        let found = model.predict(context, x.as_ref()).unwrap();
        let errors = found.iter().enumerate().flat_map(|(joint, of)| {
            let truth = expected.col(joint).iter();
            of.mean.iter().zip(truth).map(|(m, t)| (m - t).powi(2))
        });
        errors.sum()
    };
    let new = squares(&grown, 4, 1.4);
    // As well as the loads that it was learned from, and much better than the nearest of them.
    let own = squares(&model, 2, 1.1).max(squares(&model, 3, 1.8));
    let nearest = squares(&model, 2, 1.4).min(squares(&model, 3, 1.4));
    assert!(new <= 1.5 * own, "{new:e} {own:e}");
    assert!(new <= 0.25 * nearest, "{new:e} {nearest:e}");
    // The others stay, to the bit.
    for context in 0..4 {
        assert_eq!(
            grown.predict(context, x.as_ref()).unwrap(),
            model.predict(context, x.as_ref()).unwrap()
        );
    }
    let bytes = model.to_bytes();
    let read = RobotModel::from_bytes(&bytes).unwrap();
    assert_eq!(read.to_bytes(), bytes);
    let again = carry_described(&read, "new.toml", &described(1.4)).unwrap();
    assert_eq!(
        again.predict(4, x.as_ref()).unwrap(),
        grown.predict(4, x.as_ref()).unwrap()
    );

    // A further load learned from its torques takes the descriptors' place.
    let mut new = samples(&truth, &[("D", 1.4)], 13, 15);
    new.contexts.clear();
    new.context_of.clear();
    let how = Adapt::default();
    let adapted = adapt(&model, "D", &new, how, Provenance::new("test", b"")).unwrap();
    assert!(squares(&adapted, 4, 1.4) <= 0.25 * nearest);
    let refused = carry_described(&adapted, "new.toml", &described(1.4));
    assert!(matches!(refused, Err(TorqueError::OtherKind { .. })));
    let refused = carry_attached(&model, "new.toml", &Context::empty());
    assert!(matches!(refused, Err(TorqueError::OtherKind { .. })));
}
