//! `context` and `adapt`: which load of a pendulum it is, and one more load.

use std::fmt::Write;

use faer::Mat;
use mtgp::context::{ContextPrior, JointTorques, chi_squared_upper_tail, context_evidence};
use serde_json::Value;
use torque_model::RobotModel;

use crate::command::{Folder, column};

/// Rows of a pendulum of a mass with friction, with a column `t` every 10 ms.
fn rows(context: &str, mass: f64, first: usize, count: usize) -> String {
    let mut text = "context,t,q1,qd1,qdd1,tau1\n".to_owned();
    for row in first..first + count {
        let phase = row as f64;
        let (q, qd, qdd) = (
            (0.7 * phase).sin(),
            2.0 * (1.1 * phase).cos(),
            (1.9 * phase).sin(),
        );
        let torque = mass * (0.4 * qdd + 2.0 * q.cos()) + 0.5 * qd + 0.3 * qd.signum();
        let time = 0.01 * (row - first) as f64;
        writeln!(text, "{context},{time},{q:?},{qd:?},{qdd:?},{torque:?}").unwrap();
    }
    text
}

/// The second text without its header below the first.
fn joined(first: &str, second: &str) -> String {
    first.to_owned() + second.split_once('\n').unwrap().1
}

/// A folder with a model of 1, 2 and 4 kg, `log.csv` of 2 kg and `new.csv` of 3 kg.
fn folder() -> Folder {
    let folder = Folder::new();
    let [one, two, four] = [("c1", 1.0), ("c2", 2.0), ("c4", 4.0)];
    let data = [one, two, four].map(|(name, mass)| rows(name, mass, 0, 12));
    folder.write("runs.csv", joined(&joined(&data[0], &data[1]), &data[2]));
    folder.run("fit --data runs.csv --model mgp --rank 2 --starts chapter --output model.tgp");
    folder.write("log.csv", rows("whatever", 2.0, 40, 15));
    folder.write("new.csv", rows("c3", 3.0, 40, 10));
    folder.write("test.csv", rows("c3", 3.0, 80, 20));
    folder
}

fn stdout(folder: &Folder, arguments: &str) -> String {
    let output = folder.command(arguments).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments}: {message}");
    String::from_utf8(output.stdout).unwrap()
}

fn json(folder: &Folder, arguments: &str) -> Value {
    serde_json::from_str(&stdout(folder, &format!("{arguments} --json"))).unwrap()
}

fn states(text: &str) -> Mat<f64> {
    let columns = ["q1", "qd1", "qdd1"].map(|name| column(text, name));
    Mat::from_fn(columns[0].len(), 3, |row, col| columns[col][row])
}

const CONTEXT: &str = "context --model model.tgp --data log.csv";
const ADAPT: &str = "adapt --model model.tgp --data new.csv --context c3 --output more.tgp";

#[test]
fn the_total_is_that_of_the_library_and_its_last_row_the_same_with_a_long_window() {
    let folder = folder();
    let bytes = std::fs::read(folder.path("model.tgp")).unwrap();
    let model = RobotModel::from_bytes(&bytes).unwrap();
    let log = folder.read("log.csv");
    let torques = column(&log, "tau1");
    let joint = JointTorques {
        model: &model.learned()[0].1.tasks().unwrap().posterior,
        torques: &torques,
    };
    let evidence = context_evidence(&[joint], states(&log).as_ref()).unwrap();
    // 15 rows in 0.14 s count as one.
    let evidence = evidence.of_correlated(15.0);
    let prior = ContextPrior::from_weights(&[1.0, 2.0, 0.0]).unwrap();
    let posterior = evidence.posterior(&prior).unwrap().probabilities();

    let found = json(
        &folder,
        &format!("{CONTEXT} --prior c2=2,c1=1 --window 20 --level 0"),
    );
    assert_eq!(found["answer"], "c2");
    assert_eq!(
        (&found["n_rows"], &found["n_in_total"]),
        (&15.into(), &15.into())
    );
    let rows = found["rows"].as_array().unwrap();
    assert_eq!(rows.len(), 15);
    for (idx, context) in ["c1", "c2", "c4"].iter().enumerate() {
        let of_context = &found["contexts"][idx];
        assert_eq!(of_context["context"], *context);
        let number = |key: &str| of_context[key].as_f64().unwrap();
        let p_value = chi_squared_upper_tail(1.0 / 15.0 * evidence.squares()[idx], 1);
        for (key, expected) in [
            ("log_density", evidence.log_densities()[idx]),
            ("probability", posterior[idx]),
            ("p_value", p_value),
        ] {
            // The library that reads JSON may be off by a unit in the last place.
            let error = (number(key) - expected).abs();
            assert!(
                error <= 2.0 * f64::EPSILON * expected.abs(),
                "{key}: {error}"
            );
        }
        // The window holds all rows and no context changes: eq. (21) by another way.
        let last = rows[14]["probabilities"][idx].as_f64().unwrap();
        assert!((last - posterior[idx]).abs() <= 1e-9, "{last}");
    }
    let table = stdout(&folder, &format!("{CONTEXT} --level 0 --rows 5"));
    let header: Vec<&str> = table.lines().next().unwrap().split_whitespace().collect();
    assert_eq!(
        header,
        ["context", "log", "density", "probability", "p-value"]
    );
    assert!(table.contains("\nin total (5 of 15 rows): c2\n"), "{table}");
}

#[test]
fn changes_of_load_are_followed_and_impossible_torques_are_of_none_of_these() {
    let folder = folder();
    let (first, second) = (rows("a", 1.0, 40, 12), rows("b", 4.0, 52, 12));
    folder.write("log.csv", joined(&first, &second));
    folder.run(&format!(
        "{CONTEXT} --switching 5 --interval 0.01 --window 0 --noise 0.1 --output y.csv"
    ));
    let lines: Vec<String> = folder.read("y.csv").lines().map(str::to_owned).collect();
    assert_eq!(lines[0], "most_probable,p_c1,p_c2,p_c4");
    assert!(lines[12].starts_with("c1,"), "{}", lines[12]);
    assert!(lines[24].starts_with("c4,"), "{}", lines[24]);
    for line in &lines[1..] {
        let numbers = line
            .split(',')
            .skip(1)
            .map(|field| field.parse::<f64>().unwrap());
        assert!((numbers.sum::<f64>() - 1.0).abs() <= 1e-12, "{line}");
    }

    folder.write("log.csv", rows("x", 40.0, 40, 15));
    let found = json(&folder, CONTEXT);
    assert_eq!(found["answer"], Value::Null);
    assert!(stdout(&folder, CONTEXT).contains("none of these"));
}

#[test]
fn a_row_alone_keeps_the_old_contexts_to_the_bit_and_an_adapted_model_predicts_the_new_one() {
    let folder = folder();
    folder.run(&format!("{ADAPT} --row-only"));
    let predict = |model: &str, context: &str| {
        folder.run(&format!(
            "predict --model {model} --context {context} --input test.csv --tau-prefix m --output y.csv"
        ));
        folder.read("y.csv")
    };
    for context in ["c1", "c2", "c4"] {
        assert_eq!(predict("model.tgp", context), predict("more.tgp", context));
    }
    let of_row_alone = predict("more.tgp", "c3");

    let report = folder.run(ADAPT);
    for text in [
        "joint   RMSE (N·m)",
        "more.tgp written, with the contexts `c1`, `c2`, `c4`, `c3`",
    ] {
        assert!(report.contains(text), "{text}: {report}");
    }
    // Another process reads the file, and says what the library says of the same samples.
    let bytes = std::fs::read(folder.path("more.tgp")).unwrap();
    let library = RobotModel::from_bytes(&bytes).unwrap();
    let x = states(&folder.read("test.csv"));
    let number = library.number_of("c3").unwrap();
    let expected = &library.predict(number, x.as_ref()).unwrap()[0].mean;
    let found = predict("more.tgp", "c3");
    assert_eq!(&column(&found, "m1"), expected);
    assert_ne!(found, of_row_alone);
    let nmse = |context: &str| {
        let found = json(
            &folder,
            &format!("evaluate --model {context}.tgp --data test.csv"),
        );
        found["average"][0]["nmse"].as_f64().unwrap()
    };
    folder.write("nearest.csv", folder.read("test.csv").replace("c3,", "c2,"));
    std::fs::copy(folder.path("more.tgp"), folder.path("adapted.tgp")).unwrap();
    let adapted = nmse("adapted");
    assert!(adapted < 0.05, "{adapted}");
    let nearest = json(&folder, "evaluate --model model.tgp --data nearest.csv");
    let nearest = nearest["average"][0]["nmse"].as_f64().unwrap();
    assert!(adapted < 0.3 * nearest, "{adapted} {nearest}");

    // It is a model like any other: it tells the new load from the others, and takes one more.
    folder.write("log.csv", rows("x", 3.0, 60, 15));
    let found = json(&folder, &CONTEXT.replace("model.tgp", "more.tgp --level 0"));
    assert_eq!(found["answer"], "c3");
    folder.write("five.csv", rows("c5", 5.0, 30, 8));
    folder.run("adapt --model more.tgp --data five.csv --context c5 --output more.tgp");
    let inspected = json(&folder, "inspect more.tgp");
    assert_eq!(inspected["contexts"].as_array().unwrap().len(), 5);
    assert_eq!(inspected["contexts"][4]["n_samples"], 8);
}

#[test]
fn held_out_torques_say_how_far_those_of_a_known_load_may_be() {
    let folder = folder();
    folder.write("log.csv", rows("whatever", 2.0, 40, 5));
    // 50 rows each of two known loads: twenty stretches of five.
    let held_out = [("c1", 1.0), ("c2", 2.0)].map(|(name, mass)| rows(name, mass, 100, 50));
    folder.write("held.csv", joined(&held_out[0], &held_out[1]));
    let with = format!("{CONTEXT} --held-out held.csv");
    let trusting = json(&folder, CONTEXT);
    let found = json(&folder, &with);
    assert_eq!(found["answer"], "c2");
    let p_value = found["contexts"][1]["p_value"].as_f64().unwrap();
    // A rank among twenty: a whole number of parts of 21.
    let rank = p_value * 21.0;
    assert!((rank - rank.round()).abs() <= 1e-9 && rank >= 1.0, "{rank}");
    assert_ne!(found["contexts"], trusting["contexts"]);

    folder.write("log.csv", rows("x", 40.0, 40, 5));
    assert_eq!(json(&folder, &with)["answer"], Value::Null);
    let few = folder.refusal(&format!("{with} --level 0.04"));
    let expected = "held.csv: 20 trials of 5 rows of one context: their smallest p-value is 0.048, not below --level 0.04";
    assert_eq!(few, expected);
    folder.write("held.csv", rows("c9", 1.0, 0, 20));
    let other = folder.refusal(&with);
    assert!(
        other.contains("`c9` is not a context of model.tgp"),
        "{other}"
    );
}

#[test]
fn one_row_is_enough_with_a_warning() {
    let folder = folder();
    folder.write("new.csv", rows("c3", 3.0, 40, 1));
    let report = folder.run(ADAPT);
    let expected = "warning: new.csv: 1 rows for a model of rank 2: the known contexts say what they leave open";
    assert!(report.contains(expected), "{report}");
}

/// A folder with files that are spoilt in one way each.
fn folder_with_spoilt_files() -> Folder {
    let folder = folder();
    let three = || rows("c3", 3.0, 40, 3);
    folder.write("none.csv", rows("c3", 3.0, 0, 0));
    folder.write("spoilt.csv", three().replacen("c3,0.01,", "c3,0.01,NaN", 1));
    folder.write("other.csv", three().replacen("qd1", "qd2", 1));
    folder.write("still.csv", three().replace(",0.02,", ",0.01,"));
    folder.write("back.csv", three().replace(",0.02,", ",0.005,"));
    folder.write("timeless.csv", three().replacen(",t,", ",s,", 1));
    folder.run("fit --data runs.csv --model lr --context c2 --output lr.tgp");
    folder
}

/// Commands of which each is refused with its message.
fn check(folder: &Folder, command: &str, cases: &[(&str, &str)]) {
    for (rest, expected) in cases {
        let found = folder.refusal(&format!("{command} {rest}"));
        assert_eq!(found, *expected, "{rest}");
    }
    let spoilt = folder.refusal(&format!("{command} --data spoilt.csv"));
    let place = "spoilt.csv: row 2 (line 3), column `q1` (joint1, rad or m): `NaN";
    assert!(spoilt.starts_with(place), "{spoilt}");
    let other = folder.refusal(&format!("{command} --data other.csv"));
    assert!(
        other.starts_with("other.csv: ") && other.contains("qd1"),
        "{other}"
    );
}

#[test]
fn requests_for_a_context_that_are_refused() {
    let folder = folder_with_spoilt_files();
    let cases = [
        (
            "--data none.csv",
            "none.csv: there is a header but no row below it",
        ),
        (
            "--data log.csv --prior c1=1,c9=1",
            "--prior c9: model.tgp does not have it; it has `c1`, `c2`, `c4`",
        ),
        (
            "--data log.csv --prior c1=1,c1=2",
            "--prior: `c1` appears twice",
        ),
        (
            "--data log.csv --prior c1=0",
            "--prior: no weight is above zero",
        ),
        (
            "--data timeless.csv --switching 1",
            "timeless.csv: --switching: there is no column `t` with the rows' times in seconds; say --interval SECONDS",
        ),
        (
            "--data back.csv --switching 1",
            "back.csv: row 3, column `t`: time does not go on",
        ),
        (
            "--data still.csv",
            "still.csv: row 3 (line 4), column `t` (time, s): rows of context `c3`: time 0.01 s does not come after 0.01 s",
        ),
    ];
    check(&folder, "context --model model.tgp", &cases);
    for wrong in [
        "--switching -1",
        "--noise x",
        "--level 2",
        "--rows 0",
        "--prior c1",
        "--interval 0.1",
    ] {
        folder.refuse(&format!("{CONTEXT} {wrong}"));
    }
    assert_eq!(
        folder.refusal("context --model lr.tgp --data log.csv"),
        "lr.tgp is a model of one context; one of several is needed: `torque-gp fit --model mgp`"
    );
}

#[test]
fn requests_to_adapt_that_are_refused() {
    let folder = folder_with_spoilt_files();
    let cases = [
        (
            "--data none.csv",
            "none.csv: there is a header but no row below it",
        ),
        (
            "--data runs.csv",
            "runs.csv: --context c3: no row has it in column `context`; there are `c1`, `c2`, `c4`",
        ),
    ];
    let command = "adapt --model model.tgp --context c3 --output m.tgp";
    check(&folder, command, &cases);
    assert_eq!(
        folder.refusal("adapt --model model.tgp --data new.csv --context c2 --output m.tgp"),
        "--context c2: model.tgp has it already; it has `c1`, `c2`, `c4`"
    );
    assert_eq!(
        folder.refusal("adapt --model lr.tgp --data new.csv --context c3 --output m.tgp"),
        "lr.tgp is a model of one context; one of several is needed: `torque-gp fit --model mgp`"
    );
    let message = folder.refusal(&ADAPT.replace("more.tgp", "new.csv"));
    assert!(message.contains("is the input new.csv"), "{message}");
}
