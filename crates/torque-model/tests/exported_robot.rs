//! The robot that a model writes for other programs: of bodies that there can be, and with the torques that it predicts.

use puma_dyn::dynamics::{N_PARAMETERS, inertial_parameters};
use puma_dyn::{Context, Effects, Workspace, parse_urdf, regressor, rnea};
use torque_model::learn::SharedParameters;
use torque_model::rigid_body::{FitSettings, TermSet, nearest_body};
use torque_model::{Provenance, Robot, RobotModel, RobotSource, Samples};

use crate::simulated_arm::SimulatedArm;

const URDF: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures/puma560.urdf");

fn source() -> RobotSource {
    RobotSource {
        urdf: Some(std::fs::read_to_string(URDF).unwrap()),
        sidecar: None,
        gravity: None,
    }
}

/// Torques of bodies at the states of a log, against those of the model, in its standard deviations: the root of the
/// mean square of all joints.
fn distance(model: &RobotModel, bodies: &[f64], log: &Samples) -> f64 {
    let robot = Robot::new(source(), "puma560.urdf").unwrap().model;
    let learned = model.rigid_body().unwrap().body_parameters(0);
    let change: Vec<f64> = bodies.iter().zip(&learned).map(|(a, b)| a - b).collect();
    let predicted = model.predict(0, log.x.as_ref()).unwrap();
    let (mut workspace, mut y) = (Workspace::new(&robot), vec![0.0; 6 * learned.len()]);
    let mut squares = 0.0;
    for row in 0..log.n_rows() {
        let [q, qd, qdd] = state(log, row);
        regressor(&robot, &mut workspace, &q, &qd, &qdd, &mut y);
        for (of_joint, y) in predicted.iter().zip(y.chunks_exact(learned.len())) {
            let error: f64 = y.iter().zip(&change).map(|(y, pi)| y * pi).sum();
            squares += error.powi(2) / of_joint.var[row];
        }
    }
    (squares / (6 * log.n_rows()) as f64).sqrt()
}

fn state(log: &Samples, row: usize) -> [Vec<f64>; 3] {
    std::array::from_fn(|part| (0..6).map(|joint| log.x[(row, 6 * part + joint)]).collect())
}

/// The table of the PUMA 560 breaks the triangle inequality, and so does what is learned about it.
#[test]
fn links_that_cannot_be_become_bodies_together() {
    let arm = SimulatedArm::as_described(5, &[], 0.1);
    let log = arm.log(0, &[(0, 10.0), (0, 10.0), (0, 10.0)]);
    let learner = SharedParameters {
        terms: Some(TermSet::Signs),
        settings: FitSettings {
            bare: log.contexts.clone(),
            ..FitSettings::default()
        },
        ..SharedParameters::new(Robot::new(source(), "puma560.urdf").unwrap())
    };
    let model = RobotModel::learn(&log, &learner, Provenance::new("test", b"")).unwrap();
    let posterior = model.rigid_body().unwrap();
    let exported = posterior.to_robot(&source()).unwrap();
    assert!(!exported.projected.is_empty());
    let robot = parse_urdf("nearest.urdf", &exported.urdf, None)
        .unwrap()
        .model;
    assert_eq!(robot.physical_warnings(), []);

    // Links that are moved one by one leave their torques, which only all of them together make.
    let learned = posterior.body_parameters(0);
    let one_by_one: Vec<f64> = (learned.chunks_exact(N_PARAMETERS).enumerate())
        .flat_map(|(link, body)| {
            let own: Vec<usize> = (N_PARAMETERS * link..N_PARAMETERS * (link + 1)).collect();
            let body = std::array::from_fn(|k| body[k]);
            nearest_body(&body, posterior.covariance_of(&own))
                .unwrap()
                .0
        })
        .collect();
    let held = arm.log(1, &[(0, 5.0)]);
    let written = inertial_parameters(&robot, &Context::empty());
    let (together, apart) = (
        distance(&model, &written, &held),
        distance(&model, &one_by_one, &held),
    );
    // Found: 0.60 and 1.61.
    assert!(
        together < 1.0 && together < 0.5 * apart,
        "{together} {apart}"
    );
}

/// The model's own rigid part is that of the URDF, where what was learned are bodies.
#[test]
fn a_urdf_has_the_rigid_torques_of_the_model() {
    let model = crate::shared_parameters::model();
    let posterior = model.rigid_body().unwrap();
    let source = model.parts().robot.clone().unwrap();
    let exported = posterior.to_robot(&source).unwrap();
    assert!(exported.projected.is_empty());
    let robot = parse_urdf("identified.urdf", &exported.urdf, None)
        .unwrap()
        .model;
    let learned = posterior.body_parameters(0);
    let (mut workspace, mut y, mut tau) = (
        Workspace::new(&robot),
        vec![0.0; 2 * learned.len()],
        [0.0; 2],
    );
    let samples = crate::shared_parameters::samples("c_test.csv");
    for row in 0..samples.n_rows() {
        let part = |part: usize| [samples.x[(row, 2 * part)], samples.x[(row, 2 * part + 1)]];
        let (q, qd, qdd) = (part(0), part(1), part(2));
        rnea(
            &robot,
            &mut workspace,
            Effects::RIGID_BODY,
            &Context::empty(),
            &q,
            &qd,
            &qdd,
            &mut tau,
        );
        regressor(
            &posterior.parts().robot,
            &mut workspace,
            &q,
            &qd,
            &qdd,
            &mut y,
        );
        for (tau, y) in tau.iter().zip(y.chunks_exact(learned.len())) {
            let of_model: f64 = y.iter().zip(&learned).map(|(y, pi)| y * pi).sum();
            // Twenty products of numbers below 1e2, and the way through a centre and back.
            assert!((tau - of_model).abs() < 1e-10, "{tau} {of_model}");
        }
    }
}
