//! Torques in any unit are learned alike, and many rows of one posture are one state.

use std::fmt::Write;

use crate::command::Folder;

/// Rows of a two-jointed pendulum under a load, torques times a factor, with a constant added.
fn rows(context: &str, mass: f64, first: usize, count: usize, factor: f64, offset: f64) -> String {
    let mut text = String::new();
    for row in first..first + count {
        let phase = row as f64;
        let (a, b) = ((0.7 * phase).sin(), (1.3 * phase).sin());
        let (ad, bd) = (2.0 * (1.1 * phase).cos(), (2.3 * phase).sin());
        let (add, bdd) = ((1.9 * phase).sin(), 2.0 * (0.9 * phase).cos());
        let elbow = mass * (0.5 * bdd + 3.0 * (a + b).cos()) + 0.2 * bd;
        let shoulder = elbow + mass * (0.8 * add + 5.0 * a.cos()) + 0.4 * ad + 0.3 * ad.signum();
        let [t1, t2] = [shoulder, elbow].map(|torque| factor * torque + offset);
        let state = format!("{a:?},{b:?},{ad:?},{bd:?},{add:?},{bdd:?}");
        writeln!(text, "{context},{state},{t1:?},{t2:?}").unwrap();
    }
    text
}

const HEADER: &str = "context,q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2\n";

fn file(rows: &[String]) -> String {
    HEADER.to_owned() + &rows.concat()
}

/// Rows of one posture as encoders report it while nothing moves.
fn still(context: &str, count: usize, factor: f64) -> String {
    let mut text = String::new();
    for row in 0..count {
        let shake = |which: f64| 1e-4 * (1.7 * row as f64 + which).sin();
        let (a, b) = (0.4 + shake(0.0), -0.6 + shake(1.0));
        let elbow = 3.0 * 3.0 * (a + b).cos() + 50.0 * shake(2.0);
        let shoulder = elbow + 3.0 * 5.0 * a.cos() + 50.0 * shake(3.0);
        let [t1, t2] = [shoulder, elbow].map(|torque| factor * torque);
        writeln!(text, "{context},{a:?},{b:?},0,0,0,0,{t1:?},{t2:?}").unwrap();
    }
    text
}

/// nMSE of every joint, of each context and on average.
fn errors(folder: &Folder, arguments: &str) -> Vec<f64> {
    let output = folder
        .command(&format!("evaluate {arguments} --json"))
        .output()
        .unwrap();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let joints = json.get("average").unwrap_or(&json["joints"]);
    let joints = joints.as_array().unwrap().iter();
    joints
        .map(|joint| joint["nmse"].as_f64().unwrap())
        .collect()
}

/// A process is equivariant under the scale of its targets, and so are nMSE and coverage.
///
/// `write` writes train.csv and test.csv with torques times a factor.
fn learns_alike(model: &str, factors: &[f64], write: impl Fn(&Folder, f64)) {
    let mut first: Option<Vec<f64>> = None;
    for factor in factors {
        let folder = Folder::new();
        write(&folder, *factor);
        folder.run(&format!(
            "fit --data train.csv --model {model} --output m.tgp"
        ));
        let found = errors(&folder, "--model m.tgp --data test.csv");
        let expected = first.get_or_insert_with(|| found.clone());
        for (found, expected) in found.iter().zip(expected.iter()) {
            // Searches from rounded torques end near each other, not at the same bit.
            assert!(
                (found / expected).ln().abs() < 0.2,
                "{model} × {factor}: {found} {expected}"
            );
        }
    }
}

#[test]
fn a_process_learns_torques_of_any_size_alike() {
    for model in ["gpc", "gp"] {
        learns_alike(model, &[1.0, 1e-4, 1e-2, 1e2, 1e4], |folder, factor| {
            folder.write("train.csv", file(&[rows("a", 1.0, 0, 60, factor, 0.0)]));
            folder.write("test.csv", file(&[rows("a", 1.0, 90, 30, factor, 0.0)]));
        });
    }
}

#[test]
fn models_of_several_loads_learn_torques_of_any_size_alike() {
    for model in ["mgp --rank 2", "igp", "pgp"] {
        learns_alike(model, &[1.0, 1e-4, 1e4], |folder, factor| {
            let of = |first, count| {
                let loads = [("a", 1.0), ("b", 2.0), ("c", 4.0)];
                file(&loads.map(|(name, mass)| rows(name, mass, first, count, factor, 0.0)))
            };
            folder.write("train.csv", of(0, 24));
            folder.write("test.csv", of(90, 20));
        });
    }
}

#[test]
fn the_chapters_bounds_are_for_newton_metres() {
    let folder = Folder::new();
    folder.write("train.csv", file(&[rows("a", 1.0, 0, 60, 1e-4, 0.0)]));
    folder.write("test.csv", file(&[rows("a", 1.0, 90, 30, 1e-4, 0.0)]));
    folder.run("fit --data train.csv --chapter --output m.tgp");
    // σ ≥ 0.01 N·m is ten times these torques: nothing is learned.
    let found = errors(&folder, "--model m.tgp --data test.csv");
    assert!(found.iter().all(|nmse| *nmse > 0.05), "{found:?}");
    let refusal =
        folder.refusal("fit --data train.csv --model rbd --robot puma560 --chapter --output r.tgp");
    assert_eq!(
        refusal,
        "--chapter goes with all models but rbd and rbd+gp, not rbd"
    );
}

#[test]
fn a_large_offset_of_the_torques_is_doubted() {
    let folder = Folder::new();
    folder.write("train.csv", file(&[rows("a", 1.0, 0, 20, 1.0, 1e4)]));
    let said = folder.run("fit --data train.csv --model lrc --output m.tgp");
    let doubted = said
        .lines()
        .filter(|line| line.contains("times their standard deviation"));
    assert_eq!(doubted.count(), 2, "{said}");
    folder.write("train.csv", file(&[rows("a", 1.0, 0, 20, 1.0, 10.0)]));
    let said = folder.run("fit --data train.csv --model lrc --output m.tgp");
    assert!(!said.contains("times their standard deviation"), "{said}");
}

#[test]
fn rows_of_an_arm_at_rest_are_one_state() {
    for factor in [1.0, 1e-3] {
        let folder = Folder::new();
        let loads = [("a", 1.0), ("b", 2.0), ("c", 4.0)];
        let moving = loads.map(|(name, mass)| rows(name, mass, 0, 24, factor, 0.0));
        folder.write("runs.csv", file(&moving));
        folder.write("still.csv", file(&[still("d", 50, factor)]));
        folder.write("moved.csv", file(&[rows("d", 3.0, 40, 10, factor, 0.0)]));
        let few = "50 rows, but only 1 different state for a model of rank 2";
        let said = folder.run("fit --data runs.csv --model mgp --rank 2 --output m.tgp");
        assert!(!said.contains("different state"), "{said}");
        for option in ["", " --row-only"] {
            let adapt = |data: &str| {
                let adapt = "adapt --model m.tgp --context d --output d.tgp";
                folder.run(&format!("{adapt} --data {data}{option}"))
            };
            let said = adapt("still.csv");
            assert!(
                said.contains(&format!("warning: still.csv: {few}")),
                "{said}"
            );
            let said = adapt("moved.csv");
            assert!(!said.contains("different state"), "{said}");
        }
        folder.write(
            "with_still.csv",
            file(&[moving.concat(), still("d", 50, factor)]),
        );
        let said = folder.run("fit --data with_still.csv --model mgp --rank 2 --output e.tgp");
        let context = format!("warning: with_still.csv: context `d`: {few}");
        assert!(said.contains(&context), "{said}");
        assert_eq!(said.matches("different state").count(), 1, "{said}");
        for model in ["pgp", "igp"] {
            let fit = format!("fit --data with_still.csv --model {model} --output e.tgp");
            let said = folder.run(&fit);
            assert!(!said.contains("different state"), "{said}");
        }
        // A new context of independent ones is a mixture of all three.
        folder.run("fit --data runs.csv --model igp --output m.tgp");
        let said = folder.run("adapt --model m.tgp --context d --output d.tgp --data still.csv");
        let few = "50 rows, but only 1 different state for a model of rank 3";
        assert!(said.contains(few), "{said}");
    }
}
