//! `fixtures/puma560.urdf` and its sidecar are the robot of the built-in table.

use proptest::prelude::*;
use puma_dyn::{
    Context, Effects, Friction, Loaded, Model, Payload, Warning, Workspace, load_urdf, puma560,
    rnea,
};

use crate::fixture;

fn from_files() -> Loaded {
    let sidecar = fixture::path("puma560.toml");
    load_urdf(&fixture::path("puma560.urdf"), Some(&sidecar)).expect("the fixture is valid")
}

fn torques(model: &Model, payload: &Payload, effects: Effects, x: &[f64]) -> Vec<f64> {
    let hand = model.frame_idx(puma560::LAST_LINK).expect("link6");
    let context = Context::new([model.attach(hand, payload).expect("it moves")]);
    let mut tau = vec![0.0; 6];
    let (q, qd, qdd) = (&x[..6], &x[6..12], &x[12..]);
    rnea(
        model,
        &mut Workspace::new(model),
        effects,
        &context,
        q,
        qd,
        qdd,
        &mut tau,
    );
    tau
}

fn state() -> impl Strategy<Value = Vec<f64>> {
    let ranges = [3.2, 3.0, 10.0];
    let ranges = ranges.into_iter().flat_map(|r| vec![-r..r; 6]);
    ranges.collect::<Vec<_>>()
}

proptest! {
    #[test]
    fn the_files_and_the_table_give_the_same_torques(x in state(), mass in 0.0..10.0) {
        let (files, table) = (from_files().model, puma560::model());
        let payload = Payload::cuboid(mass, [0.1, 0.2, 0.3], [0.05, -0.02, 0.2], [0.3, -0.4, 1.0]);
        let payload = payload.expect("a cuboid");
        for friction in [Friction::Modern, Friction::Toolbox2008] {
            let effects = Effects { friction, rotor_inertia: true };
            let ours = torques(&files, &payload, effects, &x);
            let expected = torques(&table, &payload, effects, &x);
            let scale = expected.iter().fold(1.0, |s: f64, t| s.max(t.abs()));
            for (ours, expected) in ours.iter().zip(&expected) {
                prop_assert!((ours - expected).abs() <= 1e-12 * scale, "{ours} {expected}");
            }
        }
    }
}

#[test]
fn the_files_name_the_links_that_no_rigid_body_has_and_the_convention() {
    let loaded = from_files();
    let named: Vec<&str> = loaded
        .warnings
        .iter()
        .map(|warning| match warning {
            Warning::Unphysical(doubt) => doubt.link.as_str(),
            other => panic!("{other}"),
        })
        .collect();
    assert_eq!(named, ["link1", "link3"]);
    assert_eq!(loaded.friction, Some(Friction::Modern));
    assert_eq!(loaded.model.joint_names(), puma560::model().joint_names());
    let error = loaded.strict().expect_err("links 1 and 3").to_string();
    assert!(
        error.contains("link1") && error.contains("link3"),
        "{error}"
    );
}

#[test]
fn the_files_state_the_drives_of_the_table() {
    let (files, table) = (from_files().description, puma560::description());
    for (file, table) in files.joints.iter().zip(&table.joints) {
        assert_eq!(file.drive, table.drive, "{}", table.name);
    }
}
