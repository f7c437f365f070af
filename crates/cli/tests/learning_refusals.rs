//! What `fit`, `predict` and `evaluate` refuse: one message with its place, status 2, no output file.

use crate::command::{Folder, state_header};
use crate::puma_samples::folder;

const FIT: &str = "fit --data train.csv --model lrc --output model.tgp";

/// One joint, five rows.
const SMALL: &str = "q1,qd1,qdd1,tau1\n0.1,0,1,2\n0.2,1,0,3\n0.3,2,1,1\n0.4,1,1,1\n0.5,-1,2,0\n";

/// The message for training data.
fn message(data: &str, arguments: &str) -> String {
    let folder = Folder::new();
    folder.write("train.csv", data);
    folder.refusal(arguments)
}

#[test]
fn data_without_enough_rows() {
    assert_eq!(
        message("q1,qd1,qdd1,tau1\n1,1,1,1\n", FIT),
        "train.csv: 1 row of data; at least 2 are needed to learn from"
    );
    assert_eq!(
        message("q1,qd1,qdd1,tau1\n", FIT),
        "train.csv: there is a header but no row below it"
    );
}

#[test]
fn data_without_the_columns_needed() {
    let each = "Every joint needs its position q, speed qd and acceleration qdd";
    let log = "Every joint needs its position q, speed qd and acceleration qdd. This looks like a robot's log, qd1 as speeds: \
               `torque-gp prepare` renames its columns, filters, and makes accelerations from the speeds by differentiation";
    let torques = "Torques are needed in N·m; --tau-prefix says how their columns begin";
    let states =
        "States are needed as q1..qN, qd1..qdN, qdd1..qddN, or q_<joint>, qd_<joint>, qdd_<joint>";
    for (header, missing, hint) in [
        ("q1,qd1,qdd1,torque1", "column: tau1", torques),
        ("q1,qd1,tau1,x", "column: qdd1", log),
        ("q1,qd1,qdd1,tau2", "columns: q2, qd2, qdd2", each),
        (
            "q_a,qd_a,tau_a,qdd",
            "column: qdd_a",
            &log.replace("qd1", "qd_a"),
        ),
        ("a,b,c,d", "columns: q1…, qd1…, qdd1…", states),
    ] {
        let data = format!("{header}\n1,2,3,4\n2,3,4,5\n");
        let found = header.replace(',', ", ");
        let expected = format!("train.csv: missing {missing}; found: {found}. {hint}");
        assert_eq!(message(&data, FIT), expected);
    }
}

#[test]
fn headers_that_are_ambiguous_or_absurd() {
    let from_zero = message("q0,qd0,qdd0,tau0\n1,2,3,4\n", FIT);
    let expected = "train.csv: column `q0`: joints are numbered from 1, as q1, qd1, qdd1";
    assert_eq!(from_zero, expected);
    let far = message("q1,qd1,qdd1,tau1,q99999999\n1,2,3,4,5\n", FIT);
    assert!(far.len() < 400 && far.contains("qdd5, …; found: "), "{far}");
    let semicolons = message("q1;qd1;qdd1;tau1\n1;2;3;4\n", FIT);
    let hint = "separate the columns by commas, not semicolons";
    assert!(semicolons.ends_with(hint), "{semicolons}");
    let both = message("q1,qd1,qdd1,tau1,q_a,qd_a,qdd_a\n1,2,3,4,5,6,7\n", FIT);
    let hint = "states are given both by number (q1, …) and by joint name (q_a, …)";
    assert!(both.contains(hint), "{both}");
}

#[test]
fn fields_that_are_not_finite_numbers() {
    for (from, to, expected) in [
        (
            "0.3,2",
            "0.3,x",
            "row 3 (line 4), column `qd1` (joint1, rad/s or m/s): `x` is not a number",
        ),
        (
            "1,2\n",
            "1,nan\n",
            "row 1 (line 2), column `tau1` (joint1, N·m, or N if it slides): NaN is not a finite number",
        ),
        (
            "0.4,1,1,1",
            "0.4,1,,1",
            "row 4 (line 5), column `qdd1` (joint1, rad/s² or m/s²): the field is empty",
        ),
        ("0.5,", "", "row 5 (line 6) has 3 fields, the header has 4"),
    ] {
        let data = SMALL.replacen(from, to, 1);
        assert_eq!(message(&data, FIT), format!("train.csv: {expected}"));
    }
}

#[test]
fn contexts_are_not_mixed() {
    let data = "context,q1,qd1,qdd1,tau1\nc1,0,0,0,1\nc1,1,1,0,2\nc2,1,2,3,4\n";
    assert_eq!(
        message(data, FIT),
        "train.csv: row 3, column `context`: a second context (`c1`, `c2`); a model is for one: choose with --context NAME"
    );
    assert_eq!(
        message(data, &format!("{FIT} --context c3")),
        "train.csv: --context c3: no row has it in column `context`; there are `c1`, `c2`"
    );
    assert_eq!(
        message(data, &format!("{FIT} --context c2")),
        "train.csv: 1 row of data; at least 2 are needed to learn from"
    );
    assert_eq!(
        message(SMALL, &format!("{FIT} --context c2")),
        "train.csv: --context c2: there is no column `context`"
    );
}

#[test]
fn joints_that_are_not_there() {
    for joint in ["2", "0", "elbow", "-1"] {
        let message = message(SMALL, &format!("{FIT} --joints=1,{joint}"));
        let expected = "the data has no such joint; it has joint1 (or by number: 1 to 1)";
        assert_eq!(message, format!("--joints {joint}: {expected}"));
    }
    let data = "q1,q2,qd1,qd2,qdd1,qdd2,tau2\n1,2,3,4,5,6,7\n2,2,3,4,5,6,8\n";
    let message = message(data, &format!("{FIT} --joints 1"));
    let expected = "train.csv: missing column: tau1; found: ";
    assert!(message.starts_with(expected), "{message}");
}

#[test]
fn degrees_are_doubted() {
    let folder = Folder::new();
    let data = "q1,qd1,qdd1,tau1\n90,1,0,1\n45,2,1,3\n60,1,2,2\n";
    folder.write("train.csv", data);
    let warning = folder.run(FIT);
    let expected =
        "warning: train.csv: column `q1` (joint1): 3 of 3 values are more than a full turn";
    assert!(warning.contains(expected), "{warning}");
}

#[test]
fn paths_that_cannot_be_used() {
    for (arguments, expected) in [
        (
            "fit --data train.csv --output nowhere/model.tgp",
            "the directory nowhere does not exist",
        ),
        (
            "fit --data train.csv --output train.csv",
            "it would be overwritten",
        ),
        (
            "fit --data absent.csv --output model.tgp",
            "cannot read absent.csv: ",
        ),
    ] {
        let message = message(SMALL, arguments);
        assert!(message.contains(expected), "{message}");
    }
    let folder = Folder::new();
    folder.write("train.csv", SMALL);
    let threads = folder.refuse(&format!("{FIT} --threads 0"));
    assert!(threads.contains("--threads"), "{threads}");
    let model = folder.refuse("fit --data train.csv --model gpx --output m.tgp");
    assert!(model.contains("gpc"), "{model}");
}

#[test]
fn model_files_that_are_none() {
    let folder = folder(40);
    folder.run("fit --data train.csv --model lrc --joints 1 --output model.tgp");
    let whole = std::fs::read(folder.path("model.tgp")).unwrap();
    let mut altered = whole.clone();
    altered[whole.len() / 2] ^= 1;
    folder.write("altered.tgp", altered);
    folder.write("short.tgp", &whole[..whole.len() - 1]);
    folder.write("empty.tgp", "");
    folder.write("text.tgp", "mass = 1.0\n");
    for (file, expected) in [
        (
            "altered.tgp",
            "altered.tgp: model file was altered after it was written: its checksum does not match",
        ),
        ("short.tgp", "short.tgp: model file is truncated: "),
        ("empty.tgp", "empty.tgp: "),
        ("text.tgp", "text.tgp: not a model file"),
        ("absent.tgp", "cannot read absent.tgp: "),
    ] {
        let message = folder.refusal(&format!(
            "predict --model {file} --input test.csv --output y.csv"
        ));
        assert!(message.starts_with(expected), "{message}");
        let of_evaluate = folder.refusal(&format!("evaluate --model {file} --data test.csv"));
        assert_eq!(of_evaluate, message);
    }
}

#[test]
fn data_that_does_not_fit_the_model() {
    let folder = folder(40);
    folder.run("fit --data train.csv --model lrc --joints 1,4 --output model.tgp");
    folder.write("small.csv", SMALL);
    let predict = "predict --model model.tgp --output y.csv --input";
    let message = folder.refusal(&format!("{predict} small.csv"));
    let is_placed = message.starts_with("small.csv: missing columns: q2, q3, ");
    assert!(
        is_placed && message.contains("The model has 6 joints"),
        "{message}"
    );
    let message = folder.refusal(&format!("{predict} test.csv"));
    let expected = "test.csv: already has the result's columns tau1, tau4; ";
    assert!(message.starts_with(expected), "{message}");

    folder.write(
        "no_tau.csv",
        folder.read("test.csv").replacen("tau4", "force4", 1),
    );
    let message = folder.refusal("evaluate --model model.tgp --data no_tau.csv");
    let expected = "no_tau.csv: missing column: tau4; found: ";
    assert!(message.starts_with(expected), "{message}");
    let both = folder.refuse(&format!("{predict} test.csv --latent --observed"));
    assert!(both.contains("cannot be used with"), "{both}");
}

#[test]
fn states_at_which_the_model_overflows_are_named_by_row() {
    let folder = folder(40);
    folder.run("fit --data train.csv --model lrc --joints 1,4 --output model.tgp");
    // In the second block of rows.
    let mut lines = vec![["0.5"; 18].join(","); 1500];
    lines.push(["1e200"; 18].join(","));
    folder.write(
        "huge.csv",
        format!("{}\n{}\n", state_header(), lines.join("\n")),
    );
    let message = folder.refusal("predict --model model.tgp --input huge.csv --output y.csv");
    let expected = "huge.csv: row 1501: the state is so large that the torque of `joint1` is not a finite number";
    assert_eq!(message, expected);
}
