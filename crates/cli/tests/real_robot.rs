//! A log of several loads with runs and times: learned, adapted, recognised, exported.

use crate::command::{Folder, column};

const FIXTURES: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../fixtures/torque-model/real_robot"
);

/// A folder with the model of three loads.
fn folder() -> Folder {
    let folder = Folder::new();
    let said = folder.run(&format!(
        "fit --data {FIXTURES}/c_train.csv --model rbd --robot {FIXTURES}/planar2.urdf --bare free --output arm.tgp"
    ));
    assert!(said.contains("nMSE of what was left out"), "{said}");
    folder
}

fn json(folder: &Folder, arguments: &str) -> serde_json::Value {
    let output = folder.command(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments}");
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn loads_are_learned_together_and_predicted_each() {
    let folder = folder();
    let score = json(
        &folder,
        &format!("evaluate --model arm.tgp --data {FIXTURES}/c_test.csv --context A --json"),
    );
    assert_eq!(score["rows"], 20);
    for joint in score["joints"].as_array().unwrap() {
        // Noise alone, of 0.15 and 0.08 N·m at its least, is a few thousandths of the torques' variance.
        assert!(joint["nmse"].as_f64().unwrap() < 0.05, "{score}");
    }
    // Without times or states nothing says how friction was before.
    folder.write(
        "bare.csv",
        "q_j1,q_j2,qd_j1,qd_j2,qdd_j1,qdd_j2\n0,0,0,0,0,0\n",
    );
    let refused =
        folder.refusal("predict --model arm.tgp --context A --input bare.csv --output out.csv");
    assert!(refused.contains("a column t (s) is needed"), "{refused}");
    let refused = folder.refusal(&format!(
        "fit --data {FIXTURES}/c_train.csv --model rbd --robot {FIXTURES}/planar2.urdf --bare fre --output other.tgp"
    ));
    assert!(refused.contains("--bare fre"), "{refused}");
}

#[test]
fn a_description_that_nothing_can_better_is_said_to_be_so() {
    let folder = Folder::new();
    folder.run(&format!(
        "inverse-dynamics --robot {FIXTURES}/planar2.urdf --friction none --no-rotor-inertia --keep-states \
         --tau-prefix exact --input {FIXTURES}/c_train.csv --output exact.csv"
    ));
    let fit = format!("--model rbd --robot {FIXTURES}/planar2.urdf --bare free --output arm.tgp");
    let said = folder.run(&format!("fit --data exact.csv --tau-prefix exact {fit}"));
    for joint in ["j1", "j2"] {
        let note = format!(
            "note: {joint}: what was left out is predicted worse than by the links as described"
        );
        assert!(said.contains(&note), "{said}");
    }
    // Loads and friction that nothing describes.
    let said = folder.run(&format!("fit --data {FIXTURES}/c_train.csv {fit}"));
    assert!(!said.contains("worse"), "{said}");
}

#[test]
fn a_stretch_is_recognised_and_a_new_load_weighed() {
    let folder = folder();
    let stretch = format!("context --model arm.tgp --data {FIXTURES}/c_stretch.csv --json");
    let which = json(&folder, &stretch);
    assert_eq!(which["answer"], "B");
    let known = which["contexts"].as_array().unwrap().iter();
    let total: f64 = known.map(|of| of["probability"].as_f64().unwrap()).sum();
    let unknown = which["unknown"]["probability"].as_f64().unwrap();
    assert!((total + unknown - 1.0).abs() < 1e-12, "{which}");

    let said = folder.run(&format!(
        "adapt --model arm.tgp --data {FIXTURES}/c_new_load.csv --context C --output more.tgp"
    ));
    assert!(said.contains("m cx"), "{said}");
    let parts = json(&folder, "inspect more.tgp --json");
    let loads = parts["parameters"]["loads"].as_array().unwrap();
    let new = loads.iter().find(|load| load["name"] == "C").unwrap();
    // 0.9 kg in truth.
    let (mass, std) = (&new["values"][0], new["std"][0].as_f64().unwrap());
    let error = (mass.as_f64().unwrap() - 0.9).abs();
    assert!(error < 3.0 * std && std < 0.5, "{error} {std}");
}

#[test]
fn what_is_exported_has_the_torques_that_are_predicted() {
    let folder = folder();
    let said = folder.run(
        "export --model arm.tgp --urdf identified.urdf --sidecar motors.toml --payload-of A a.toml",
    );
    assert!(!said.contains("wrong sign"), "{said}");
    assert!(
        said.contains("a.toml: what was learned of `A` is not that of a body"),
        "{said}"
    );
    let test = format!("{FIXTURES}/c_test.csv");
    for (context, payload) in [("free", ""), ("A", "--payload a.toml")] {
        folder.run(&format!(
            "predict --model arm.tgp --context {context} --input {test} --tau-prefix model --output model.csv"
        ));
        folder.run(&format!(
            "inverse-dynamics --robot identified.urdf --sidecar motors.toml {payload} --input {test} \
             --tau-prefix exported --output exported.csv"
        ));
        for joint in 1..=2 {
            let of = |name: &str| column(&folder.read("model.csv"), name);
            let (predicted, std) = (
                of(&format!("model{joint}")),
                of(&format!("model{joint}_std")),
            );
            let exported = column(&folder.read("exported.csv"), &format!("exported{joint}"));
            for ((a, b), std) in predicted.iter().zip(&exported).zip(&std) {
                // What is exact without a load is within what is known of it where it had to become a body.
                let bound = if payload.is_empty() { 1e-9 } else { 2.0 * std };
                assert!(
                    (a - b).abs() < bound,
                    "{context}, joint {joint}: {a} {b} {std}"
                );
            }
        }
    }
    let refused = folder.refusal("export --model arm.tgp --payload-of free free.toml");
    assert!(refused.contains("`free` carries nothing"), "{refused}");
    let refused = folder.refusal("export --model arm.tgp --payload-of D d.toml");
    assert!(refused.contains("does not have it"), "{refused}");
}

#[test]
fn outputs_of_an_export_are_files_of_their_own() {
    let folder = folder();
    folder.write("old.urdf", "old");
    for (options, expected) in [
        (
            "--urdf a.x --sidecar ./a.x",
            "--urdf and --sidecar are both ./a.x",
        ),
        (
            "--sidecar a.x --payload-of A a.x",
            "--sidecar and --payload-of are both a.x",
        ),
        ("--urdf arm.tgp", "--urdf arm.tgp is the input arm.tgp"),
        (
            "--payload-of A arm.tgp",
            "--payload-of arm.tgp is the input arm.tgp",
        ),
        (
            "--urdf old.urdf --sidecar none/a.toml",
            "the directory none does not exist",
        ),
        ("--urdf old.urdf --payload-of D d.toml", "does not have it"),
    ] {
        let refused = folder.refusal(&format!("export --model arm.tgp {options}"));
        assert!(refused.contains(expected), "{options}: {refused}");
        assert!(!refused.contains("note:"), "{options}: {refused}");
        assert_eq!(folder.read("old.urdf"), "old", "{options}");
    }
    let said = folder.run("export --model arm.tgp --sidecar motors.toml");
    assert!(
        said.contains("viscous friction stands in the URDF"),
        "{said}"
    );
}

#[test]
fn a_load_is_followed_row_after_row() {
    let folder = folder();
    let command =
        format!("context --model arm.tgp --data {FIXTURES}/c_stretch.csv --online --json");
    let all = json(&folder, &format!("{command} --output which.csv"));
    assert_eq!(all["answer"], "B");
    assert_eq!((&all["n_rows"], &all["changes"]), (&30.into(), &0.into()));
    let rows = all["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 30);
    let number = |value: &serde_json::Value| value.as_f64().unwrap();
    let last = &rows[29];
    let known = last["probabilities"].as_array().unwrap().iter();
    let total = known.map(number).sum::<f64>() + number(&last["unknown"]);
    assert!((total - 1.0).abs() < 1e-12, "{last}");
    // It has not been seen yet what is carried: as likely as a new load's prior says.
    assert!(
        (number(&rows[0]["mass_std"]) - 3.0).abs() < 1e-9,
        "{}",
        rows[0]
    );
    let parts = json(&folder, "inspect arm.tgp --json");
    let loads = parts["parameters"]["loads"].as_array().unwrap();
    let learned = loads.iter().find(|load| load["name"] == "B").unwrap();
    let (mass, std) = (number(&last["mass"]), number(&last["mass_std"]));
    assert!(
        (mass - number(&learned["values"][0])).abs() < 3.0 * std,
        "{mass} {std}"
    );
    assert!(std < 0.5, "{std}");
    let written = column(&folder.read("which.csv"), "mass");
    assert!((written[29] - mass).abs() < f64::EPSILON * mass);

    assert!(number(&last["since"]).abs() < 1e-12, "{last}");

    let some = json(&folder, &format!("{command} --every 0.5"));
    let times: Vec<f64> = (some["rows"].as_array().unwrap().iter())
        .map(|row| number(&row["t"]))
        .collect();
    assert_eq!(times.len(), 4, "{times:?}");
    folder.write(
        "bare.csv",
        "q_j1,q_j2,qd_j1,qd_j2,qdd_j1,qdd_j2,tau_j1,tau_j2\n0,0,0,0,0,0,1,1\n0,0,0,0,0,0,1,1\n",
    );
    let refused = folder.refusal("context --model arm.tgp --data bare.csv --online");
    assert!(refused.contains("there is no column `t`"), "{refused}");
    let refused = folder.refuse("context --model arm.tgp --data bare.csv --every 2");
    assert!(refused.contains("--online"), "{refused}");
}
