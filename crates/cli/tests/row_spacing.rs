//! Rows of a log that are close in time: which are learned from, and what is said of it.

use std::fmt::Write;

use serde_json::Value;

use crate::command::Folder;

/// Rows of a pendulum that swings, every 0.05 s, of a mass in kg.
fn log(context: &str, mass: f64, count: usize) -> String {
    let mut text = "context,t,q1,qd1,qdd1,tau1\n".to_owned();
    for row in 0..count {
        let t = 0.05 * row as f64;
        let (q, qd, qdd) = (
            (0.9 * t).sin() + 0.4 * (2.1 * t).cos(),
            0.9 * (0.9 * t).cos() - 0.84 * (2.1 * t).sin(),
            -0.81 * (0.9 * t).sin() - 1.764 * (2.1 * t).cos(),
        );
        let torque = mass * (0.4 * qdd + 2.0 * q.cos()) + 0.5 * qd + 0.3 * qd.signum();
        writeln!(text, "{context},{t:.2},{q:?},{qd:?},{qdd:?},{torque:?}").unwrap();
    }
    text
}

fn n_samples(folder: &Folder, model: &str) -> Value {
    let command = format!("inspect {model} --json");
    let output = folder.command(&command).output().unwrap();
    let inspected: Value = serde_json::from_slice(&output.stdout).unwrap();
    inspected["n_samples"].clone()
}

#[test]
fn processes_learn_from_rows_that_are_apart() {
    let folder = Folder::new();
    folder.write("log.csv", log("a", 1.0, 300));
    let fit = "fit --data log.csv --starts chapter --method dense --output";
    let said = folder.run(&format!("{fit} thin.tgp"));
    // Every sixth row.
    let note = "note: log.csv: 50 of 300 rows are learned from, 0.3 s apart or more in each run: closer ones share what \
                is not modelled; --all-rows takes all\n";
    assert!(said.contains(note), "{said}");
    assert_eq!(n_samples(&folder, "thin.tgp"), 50);

    let said = folder.run(&format!("{fit} all.tgp --all-rows"));
    assert!(!said.contains("apart"), "{said}");
    assert_eq!(n_samples(&folder, "all.tgp"), 300);
    let said = folder.run(&format!("{fit} chapter.tgp --chapter"));
    assert!(!said.contains("apart"), "{said}");
    assert_eq!(n_samples(&folder, "chapter.tgp"), 300);

    // What is written is what those rows alone give.
    let text = folder.read("log.csv");
    let (header, rows) = text.split_once('\n').unwrap();
    let sixth: Vec<&str> = rows.lines().step_by(6).collect();
    folder.write("sixth.csv", format!("{header}\n{}\n", sixth.join("\n")));
    let said =
        folder.run("fit --data sixth.csv --starts chapter --method dense --output sixth.tgp");
    assert!(!said.contains("apart"), "{said}");
    let torques = |model: &str| {
        folder.run(&format!(
            "predict --model {model} --input log.csv --tau-prefix m --output y.csv"
        ));
        folder.read("y.csv")
    };
    assert_eq!(torques("sixth.tgp"), torques("thin.tgp"));
}

#[test]
fn too_few_rows_that_are_apart_are_said_to_be_so() {
    let folder = Folder::new();
    folder.write("log.csv", log("a", 1.0, 100));
    let said = folder.run("fit --data log.csv --starts chapter --method dense --output m.tgp");
    let expected = "warning: log.csv: 17 of 100 rows are 0.3 s apart or more, and it takes 30 to learn from them alone: \
                    all are taken for independent";
    assert!(said.contains(expected), "{said}");
    assert_eq!(n_samples(&folder, "m.tgp"), 100);
}

#[test]
fn rows_that_follow_each_other_without_times_are_warned_of_and_others_are_not() {
    let folder = Folder::new();
    let timeless = log("a", 1.0, 100).replacen(",t,", ",s,", 1);
    folder.write("log.csv", &timeless);
    let warning = "warning: log.csv: rows seem to be 5.00e-2 s apart, by their positions and speeds: all 100 are taken for \
                   independent";
    for model in ["gpc", "lr"] {
        let fit = format!("fit --data log.csv --model {model} --starts chapter --output m.tgp");
        let said = folder.run(&fit);
        assert!(
            said.contains(warning) && said.contains("add a column `t`"),
            "{said}"
        );
    }
    // In any other order they are states, and no motion.
    let mut rows: Vec<&str> = timeless.lines().skip(1).collect();
    rows.sort_by_key(|row| {
        row.bytes()
            .rev()
            .map(u64::from)
            .fold(7, |a, b| (31 * a + b) % 997)
    });
    let header = timeless.lines().next().unwrap();
    folder.write("log.csv", format!("{header}\n{}\n", rows.join("\n")));
    for model in ["gpc", "lr"] {
        let fit = format!("fit --data log.csv --model {model} --starts chapter --output m.tgp");
        let said = folder.run(&fit);
        assert!(!said.contains("warning"), "{said}");
    }
}

#[test]
fn linear_models_and_new_rows_say_how_they_count() {
    let folder = Folder::new();
    folder.write("log.csv", log("a", 1.0, 100));
    let fit = "fit --data log.csv --model lr --output m.tgp";
    let note = "note: log.csv: rows are closer than 0.3 s: they count by the correlation of what lr leaves";
    assert!(folder.run(fit).contains(note));
    assert!(!folder.run(&format!("{fit} --all-rows")).contains("count"));
    assert!(!folder.run(&format!("{fit} --chapter")).contains("count"));

    let other = log("b", 3.0, 100);
    let both = log("a", 1.0, 100) + other.split_once('\n').unwrap().1;
    folder.write("both.csv", both);
    folder.run(
        "fit --data both.csv --model mgp --rank 1 --starts chapter --all-rows --output two.tgp",
    );
    folder.write("new.csv", log("c", 2.0, 31));
    // 31 rows of 0.05 s: 31/6.
    let note = "note: new.csv: rows are closer than 0.3 s: 31 of them count as 5.2\n";
    for command in [
        "adapt --model two.tgp --data new.csv --context c --output three.tgp",
        "context --model two.tgp --data new.csv",
    ] {
        let said = folder.run(command);
        assert!(said.contains(note), "{command}: {said}");
    }
}

#[test]
fn rbd_has_its_own_way_to_count_rows() {
    let refused = Folder::new();
    refused.write("log.csv", log("a", 1.0, 5));
    let message =
        refused.refusal("fit --data log.csv --model rbd --robot puma560 --all-rows --output m.tgp");
    let expected =
        "--all-rows goes with all models but rbd, which counts rows by their correlation, not rbd";
    assert!(message.contains(expected), "{message}");
}
