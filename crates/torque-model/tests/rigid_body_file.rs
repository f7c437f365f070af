//! Files of models that know a robot's parameters: what goes in comes out.

use gp_core::Method;
use torque_model::{ModelFileKind, ModelParts, RobotModel};

use crate::damaged_file::{every_truncation_is_named, flipped_bytes_are_refused};
use crate::rigid_body_models::{rigid_body, small_rigid_body, states};

#[test]
fn a_loaded_model_is_the_model_and_predicts_bit_for_bit_the_same() {
    for model in [
        rigid_body(40, Method::Dense),
        rigid_body(150, Method::Certified),
    ] {
        let bytes = model.to_bytes();
        let loaded = RobotModel::from_bytes(&bytes).unwrap();
        let x = states(6, 60);
        assert_eq!(
            loaded.predict(0, x.as_ref()).unwrap(),
            model.predict(0, x.as_ref()).unwrap()
        );
        assert_eq!(loaded.to_bytes(), bytes);
        assert_eq!(ModelFileKind::of(&bytes), Ok(ModelFileKind::RigidBody));
        assert_eq!(loaded.parts().robot, model.parts().robot);
        for ((idx, one), (other_idx, other)) in model.learned().iter().zip(loaded.learned()) {
            assert_eq!(
                (idx, one.name(), one.spread(), one.summary()),
                (other_idx, other.name(), other.spread(), other.summary())
            );
        }
    }
}

#[test]
fn truncated_and_flipped_files_are_refused() {
    let bytes = small_rigid_body().to_bytes();
    every_truncation_is_named(&bytes, RobotModel::from_bytes);
    flipped_bytes_are_refused(bytes, 2_000, RobotModel::from_bytes);
}

#[test]
fn a_robot_and_models_that_do_not_go_together_are_refused() {
    let refused = |change: fn(&mut ModelParts)| {
        let mut parts = small_rigid_body().into_parts();
        change(&mut parts);
        RobotModel::new(parts).unwrap_err().to_string()
    };
    let message = refused(|parts| parts.robot = None);
    assert!(message.contains("a robot goes with models"), "{message}");
    // Else a file would predict by another robot than the model that it was written from.
    let message = refused(|parts| {
        let on_the_moon = Some([0.0, 0.0, -1.62]);
        parts.robot.as_mut().unwrap().gravity = on_the_moon;
    });
    let expected = "inconsistent model: joint 2's model is of another robot than the one described";
    assert_eq!(message, expected);
    let message = refused(|parts| parts.contexts.push("c1".to_owned()));
    assert!(message.contains("ranges of 0 contexts"), "{message}");
}
