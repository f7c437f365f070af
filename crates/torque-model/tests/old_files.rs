//! Model files of every kind that were written before the models had a crate of their own.

use std::path::PathBuf;

use faer::Mat;
use torque_model::{JointModel, ModelFileKind, RobotModel};

fn read(name: &str) -> (Vec<u8>, RobotModel) {
    let mut path = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    path.extend(["../../fixtures/torque-model", name]);
    let bytes = std::fs::read(path).unwrap();
    let model = RobotModel::from_bytes(&bytes).unwrap();
    (bytes, model)
}

/// A file, its kind, and its joints with the names of their models.
type Case = (
    &'static str,
    ModelFileKind,
    &'static [(usize, &'static str)],
);

#[test]
fn an_old_file_of_any_kind_is_read_and_written_again_to_the_byte() {
    use ModelFileKind::{ManyContexts, OneContext, RigidBody};
    let cases: [Case; 7] = [
        (
            "one_context_linear.tgp",
            OneContext,
            &[(1, "LRc"), (2, "LRc")],
        ),
        ("one_context.tgp", OneContext, &[(2, "GPc"), (4, "GPc")]),
        ("one_context_pivots.tgp", OneContext, &[(1, "GPc")]),
        (
            "many_contexts.tgp",
            ManyContexts,
            &[(1, "mGP-3"), (3, "mGP-3")],
        ),
        ("many_contexts_independent.tgp", ManyContexts, &[(2, "iGP")]),
        ("rigid_body.tgp", RigidBody, &[(2, "rbd")]),
        ("rigid_body_and_process.tgp", RigidBody, &[(5, "rbd+gp")]),
    ];
    for (name, kind, joints) in cases {
        let (bytes, model) = read(name);
        assert_eq!(model.kind(), kind, "{name}");
        assert_eq!(ModelFileKind::of(&bytes), Ok(kind), "{name}");
        let of_joint = |(idx, model): &(usize, JointModel)| (*idx, model.name());
        let found: Vec<(usize, String)> = model.learned().iter().map(of_joint).collect();
        let expected = joints.iter().map(|(idx, name)| (*idx, (*name).to_owned()));
        assert_eq!(found, expected.collect::<Vec<_>>(), "{name}");
        assert!(model.to_bytes() == bytes, "{name}: other bytes");
        assert!(model.provenance().program.starts_with("torque-gp"));
    }
}

#[test]
fn an_old_file_predicts_at_the_middle_of_its_training_data_with_less_than_the_prior_variance() {
    for name in [
        "one_context.tgp",
        "many_contexts.tgp",
        "rigid_body.tgp",
        "rigid_body_and_process.tgp",
    ] {
        let (_, model) = read(name);
        let (min, max) = (model.ranges().min(), model.ranges().max());
        let x = Mat::from_fn(1, min.len(), |_, col| 0.5 * (min[col] + max[col]));
        for joint in model.predict(0, x.as_ref()).unwrap() {
            let (mean, var) = (joint.mean[0], joint.var[0]);
            assert!(mean.abs() < 60.0, "{name}: {mean}");
            assert!(var > 0.0 && var < 25.0, "{name}: {var}");
        }
    }
}
