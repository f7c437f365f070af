//! The learners of one list: each learns what its crate learns, under the name of the chapter.

use faer::Mat;
use gp_core::{FitOptions, Starts};
use kernels::TorqueForm;
use mtgp::fit::MultiTaskOptions;
use torque_model::learn::{
    Learn, Linear, ManyContexts, Ranks, RigidBody, RigidBodyForm, SingleProcess, Tasks,
};
use torque_model::{JointTorques, ModelFileKind, RobotModel, Samples, TorqueError};

use crate::rigid_body_models::{puma, states};
use crate::torque_models::{N_JOINTS, names, provenance, torques, uniform_inputs};

fn options() -> FitOptions {
    FitOptions {
        starts: Starts::Chapter,
        ..FitOptions::several()
    }
}

/// Torques of the joints 1 and 3 of the small robot.
fn samples(n: usize) -> Samples {
    let x = uniform_inputs(5, n, 3 * N_JOINTS);
    let of_joint = |joint_idx: usize| JointTorques {
        joint_idx,
        values: torques(&x, joint_idx),
    };
    Samples::of_one_context(names(), x.clone(), vec![of_joint(1), of_joint(3)]).unwrap()
}

/// The same rows, alternately of two loads.
fn of_two_loads(n: usize) -> Samples {
    Samples {
        contexts: vec!["empty".to_owned(), "brick".to_owned()],
        context_of: (0..n).map(|row| row % 2).collect(),
        ..samples(n)
    }
}

#[test]
fn learners_of_one_load_learn_what_their_crate_learns() {
    let samples = samples(40);
    let (x, t) = (samples.x.as_ref(), &samples.torques[0].values);
    let learn = |learner: &dyn Learn| RobotModel::learn(&samples, learner, provenance()).unwrap();

    let linear = learn(&Linear::coulomb());
    let alone = gp_core::BayesLinear::fit(x, t, gp_core::LinearForm::Coulomb).unwrap();
    let found = linear.predict_joint(0, 0, x).unwrap();
    assert_eq!(found.mean, alone.predict_mean(x).unwrap());

    let process = SingleProcess {
        form: TorqueForm::Smooth,
        options: options(),
    };
    let model = learn(&process);
    let alone = gp_core::fit(x, t, TorqueForm::Smooth, &options()).unwrap();
    let found = model.predict_joint(0, 0, x).unwrap();
    assert_eq!(found, alone.posterior.predict(x).unwrap());
    for (learner, model) in [
        (&Linear::coulomb() as &dyn Learn, &linear),
        (&process, &model),
    ] {
        assert_eq!(model.kind(), ModelFileKind::OneContext);
        let joints: Vec<usize> = model.learned().iter().map(|(idx, _)| *idx).collect();
        assert_eq!(joints, [1, 3]);
        assert!(
            (model.learned().iter()).all(|(_, joint)| joint.name() == learner.name()),
            "{}",
            learner.name()
        );
        assert_eq!(model.ranges(), &samples.ranges().unwrap());
        assert!(model.predict_joint(0, 1, x).is_err(), "one context");
    }
}

#[test]
fn learners_of_many_loads_learn_them_together() {
    let samples = of_two_loads(40);
    for (tasks, name) in [
        (Tasks::Independent, "iGP"),
        (Tasks::Pooled, "pGP"),
        (Tasks::Transfer(Ranks::Given(1)), "mGP-1"),
    ] {
        let options = MultiTaskOptions::chapter();
        let learner = ManyContexts { tasks, options };
        let model = RobotModel::learn(&samples, &learner, provenance()).unwrap();
        assert_eq!(model.kind(), ModelFileKind::ManyContexts);
        assert_eq!(model.contexts(), samples.contexts);
        assert_eq!(model.context_ranges().len(), 2);
        assert!(model.tasks().all(|(_, process)| process.name() == name));
    }
}

#[test]
fn a_robots_parameters_are_learned_with_its_description() {
    let robot = puma();
    let x = states(3, 25);
    let values = (0..25).map(|row| 5.0 * x[(row, 4)].sin()).collect();
    let joint_names = robot.model.joint_names().to_vec();
    let torques = vec![JointTorques {
        joint_idx: 4,
        values,
    }];
    let samples = Samples::of_one_context(joint_names, x, torques).unwrap();
    for form in RigidBodyForm::ALL {
        let learner = RigidBody::new(robot.clone(), form, options());
        let model = RobotModel::learn(&samples, &learner, provenance()).unwrap();
        assert_eq!(model.kind(), ModelFileKind::RigidBody);
        assert_eq!(model.learned()[0].1.name(), form.name());
        let parts = model.parts();
        assert_eq!(parts.robot, Some(robot.source.clone()));
        assert_eq!(parts.provenance.robot_sha256, Some(robot.source.sha256()));
    }
}

#[test]
fn samples_that_a_learner_cannot_use_are_refused() {
    let refused = |samples: &Samples, learner: &dyn Learn| {
        RobotModel::learn(samples, learner, provenance()).unwrap_err()
    };
    let many = ManyContexts {
        tasks: Tasks::Pooled,
        options: MultiTaskOptions::chapter(),
    };
    let error = refused(&samples(10), &many);
    let expected = "pGP learns several contexts, and the samples have one";
    assert_eq!(error.to_string(), expected);
    let error = refused(&of_two_loads(10), &Linear::smooth());
    let expected = "LR¬c learns one context, and the samples have 2";
    assert_eq!(error.to_string(), expected);
    let of_puma = RigidBody::new(puma(), RigidBodyForm::Alone, options());
    let error = refused(&samples(10), &of_puma);
    let expected = "joint shoulder: inconsistent model: samples of 4 joints for a robot of 6";
    assert_eq!(error.to_string(), expected);

    let mut unordered = samples(10);
    unordered.torques.reverse();
    let mut short = samples(10);
    short.torques[0].values.pop();
    let mut unnumbered = of_two_loads(10);
    unnumbered.context_of[3] = 2;
    let mut narrow = samples(10);
    narrow.x = Mat::zeros(10, 5);
    for (bad, what) in [
        (unordered, "do not ascend"),
        (short, "9 torques of joint 1 for 10 states"),
        (unnumbered, "contexts of 10 rows"),
    ] {
        let error = bad.check().unwrap_err();
        assert!(matches!(error, TorqueError::InconsistentModel { .. }));
        assert!(error.to_string().contains(what), "{error}");
    }
    assert!(matches!(narrow.check(), Err(TorqueError::Gp(_))));
}
