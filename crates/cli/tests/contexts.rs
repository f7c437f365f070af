//! Models of several contexts: `fit`, `predict`, `evaluate` and `inspect` of a pendulum under three loads.

use std::fmt::Write;

use faer::Mat;
use serde_json::Value;
use torque_model::{JointPrediction, RobotModel};

use crate::command::{Folder, column};

const CONTEXTS: [&str; 3] = ["c1", "c2", "c7"];

/// Rows of a pendulum of 1, 2 and 4 kg with friction, `count` of each context, in turn.
fn rows(first: usize, count: usize) -> String {
    let mut text = "context,q1,qd1,qdd1,tau1\n".to_owned();
    for row in 0..count {
        for (idx, context) in CONTEXTS.iter().enumerate() {
            let phase = (3 * (first + row) + idx) as f64;
            let (q, qd, qdd) = (
                (0.7 * phase).sin(),
                2.0 * (1.1 * phase).cos(),
                (1.9 * phase).sin(),
            );
            let mass = f64::from(1 << idx);
            let torque = mass * (0.4 * qdd + 2.0 * q.cos()) + 0.5 * qd + 0.3 * qd.signum();
            writeln!(text, "{context},{q:?},{qd:?},{qdd:?},{torque:?}").unwrap();
        }
    }
    text
}

/// A folder with `runs.csv` of `count` rows of each context and `test.csv` of 20 others.
fn folder(count: usize) -> Folder {
    let folder = Folder::new();
    folder.write("runs.csv", rows(0, count));
    folder.write("test.csv", rows(50, 20));
    folder
}

fn states(text: &str) -> Mat<f64> {
    let columns = ["q1", "qd1", "qdd1"].map(|name| column(text, name));
    Mat::from_fn(columns[0].len(), 3, |row, col| columns[col][row])
}

fn load(folder: &Folder) -> RobotModel {
    RobotModel::from_bytes(&std::fs::read(folder.path("model.tgp")).unwrap()).unwrap()
}

/// The predictions of the one joint in a context.
fn predicted(model: &RobotModel, context: &str, x: &Mat<f64>) -> JointPrediction {
    let context = model.number_of(context).unwrap();
    model.predict(context, x.as_ref()).unwrap().remove(0)
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

const FIT: &str = "fit --data runs.csv --starts chapter --output model.tgp --model";
const PREDICT: &str = "predict --model model.tgp --input test.csv --tau-prefix m --output y.csv";

#[test]
fn a_rank_is_chosen_and_every_context_predicted_as_the_library_does() {
    let folder = folder(12);
    let report = folder.run(&format!("{FIT} mgp --rank bic"));
    for text in [
        "joint1 learned",
        "mGP-",
        "BIC by rank: 1 ",
        "model.tgp written",
    ] {
        assert!(report.contains(text), "{text}: {report}");
    }
    let (model, test) = (load(&folder), folder.read("test.csv"));
    folder.run(PREDICT);
    let (by_column, x) = (folder.read("y.csv"), states(&test));
    for (idx, context) in CONTEXTS.iter().enumerate() {
        folder.run(&format!("{PREDICT} --context {context}"));
        let by_name = column(&folder.read("y.csv"), "m1");
        let expected = predicted(&model, context, &x);
        assert_eq!(by_name, expected.mean);
        let of_context =
            |values: &[f64]| -> Vec<f64> { values.iter().skip(idx).step_by(3).copied().collect() };
        assert_eq!(
            of_context(&column(&by_column, "m1")),
            of_context(&expected.mean)
        );
    }
    let observed = stdout(
        &folder,
        &format!("{} --observed", PREDICT.replace("y.csv", "-")),
    );
    let (observed, latent) = (column(&observed, "m1_std"), column(&by_column, "m1_std"));
    assert!(observed.iter().zip(&latent).all(|(o, l)| o > l));
}

#[test]
fn a_long_fit_says_what_it_is_at() {
    let fit = |count| folder(count).run(&format!("{FIT} igp"));
    assert!(fit(171).contains("note: joint1, 513 samples: iGP …"));
    assert!(!fit(12).contains("iGP …"));
}

#[test]
fn evaluation_is_by_context_and_on_average() {
    let folder = folder(12);
    folder.run(&format!("{FIT} mgp --rank 2"));
    folder.run(PREDICT);
    let (y, test) = (folder.read("y.csv"), folder.read("test.csv"));
    let errors: Vec<f64> = (column(&y, "m1").iter().zip(column(&test, "tau1")))
        .map(|(m, t)| m - t)
        .collect();
    let all = json(&folder, "evaluate --model model.tgp --data test.csv");
    assert_eq!(all["n_samples"], 60);
    let mut sum = 0.0;
    for (idx, context) in CONTEXTS.iter().enumerate() {
        let of_context = &all["contexts"][idx];
        assert_eq!(
            (&of_context["context"], &of_context["n_samples"]),
            (&(*context).into(), &20.into())
        );
        let rmse = of_context["joints"][0]["rmse"].as_f64().unwrap();
        let squares: f64 = errors.iter().skip(idx).step_by(3).map(|e| e * e).sum();
        assert!((rmse - (squares / 20.0).sqrt()).abs() <= 1e-10, "{rmse}");
        sum += of_context["joints"][0]["nmse"].as_f64().unwrap();
        let alone = format!("evaluate --model model.tgp --data test.csv --context {context}");
        let alone = json(&folder, &alone);
        assert_eq!(alone["contexts"].as_array().unwrap().len(), 1);
        assert_eq!(alone["contexts"][0]["context"], *context);
        let alone = alone["average"][0]["rmse"].as_f64().unwrap();
        assert!((alone - rmse).abs() <= 1e-10, "{alone} {rmse}");
    }
    let average = all["average"][0]["nmse"].as_f64().unwrap();
    assert!((average - sum / 3.0).abs() <= 1e-15, "{average} {sum}");
    assert!(average < 0.05, "{average}");
    let table = stdout(&folder, "evaluate --model model.tgp --data test.csv");
    assert!(table.starts_with("context   joint  samples"), "{table}");
    assert!(
        table.lines().last().unwrap().starts_with("average  joint1"),
        "{table}"
    );
}

#[test]
fn a_log_of_one_context_without_the_column_is_judged_in_the_one_asked_for() {
    let folder = folder(12);
    folder.run(&format!("{FIT} mgp --rank 2"));
    folder.write("named.csv", of_context("c2"));
    folder.write(
        "log.csv",
        of_context("c2").replace("c2,", "").replace("context,", ""),
    );
    let judged = |arguments: &str| json(&folder, &format!("evaluate --model {arguments}"));
    let named = judged("model.tgp --data named.csv");
    assert_eq!(judged("model.tgp --data log.csv --context c2"), named);
    let other = judged("model.tgp --data log.csv --context c7");
    let nmse = |found: &Value| found["average"][0]["nmse"].as_f64().unwrap();
    assert!(nmse(&other) > 10.0 * nmse(&named), "{other}");
    assert_eq!(
        folder.refusal("evaluate --model model.tgp --data log.csv"),
        "log.csv: there is no column `context`; choose one of model.tgp for all rows with --context NAME: `c1`, `c2`, `c7`"
    );

    folder.run("fit --data runs.csv --model lr --context c2 --output one.tgp");
    let own = judged("one.tgp --data log.csv --context c2");
    assert_eq!(own, judged("one.tgp --data named.csv"));
    assert_eq!(
        folder.refusal("evaluate --model one.tgp --data log.csv --context c7"),
        "log.csv: --context c7: there is no column `context`"
    );
}

/// The rows of `test.csv` of one context.
fn of_context(name: &str) -> String {
    let all = rows(50, 20);
    let mut lines = all.lines();
    let header = lines.next().unwrap();
    let of_context = lines.filter(|line| line.starts_with(&format!("{name},")));
    let lines: Vec<&str> = std::iter::once(header).chain(of_context).collect();
    lines.join("\n") + "\n"
}

#[test]
fn hyperparameters_shown_by_inspect_have_the_likelihood_of_the_fit() {
    let folder = folder(10);
    folder.run(&format!("{FIT} mgp --rank 2 --method dense --chapter"));
    let inspected = json(&folder, "inspect model.tgp");
    assert_eq!(inspected["kind"], "several contexts");
    assert_eq!(inspected["contexts"][2]["context"], "c7");
    assert_eq!(inspected["contexts"][2]["n_samples"], 10);
    let joint = &inspected["joints"][0];
    assert_eq!(joint["model"], "mGP-2");
    folder.write(
        "h.toml",
        toml::to_string(&joint["hyperparameters"]).unwrap(),
    );
    let likelihood = json(
        &folder,
        "likelihood --data runs.csv --joint 1 --hyperparameters h.toml --method dense",
    );
    let found = likelihood["log_marginal_likelihood"].as_f64().unwrap();
    let expected = joint["fit"]["log_marginal_likelihood"].as_f64().unwrap();
    assert!((found - expected).abs() <= 1e-6, "{found} {expected}");

    let k = |row: usize, col: usize| joint["k_task"][row][col].as_f64().unwrap();
    let correlation = joint["correlations"][0][2].as_f64().unwrap();
    let expected = k(0, 2) / (k(0, 0) * k(2, 2)).sqrt();
    assert!((correlation - expected).abs() <= 1e-14 && k(0, 2).to_bits() == k(2, 0).to_bits());
    let text = stdout(&folder, "inspect model.tgp");
    for part in [
        "model of several contexts, by torque-gp",
        "contexts  c1 (10), c2 (10), c7 (10) (samples)",
        "\njoint1: mGP-2\n",
        "\ntask_factor 3,2 ",
        "\nlength_scales 3 ",
        "\ncorrelation ",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

#[test]
fn inspect_describes_models_of_one_context() {
    let folder = folder(12);
    for (model, name) in [("lrc", "LRc"), ("gpc", "GPc")] {
        folder.run(&format!("{FIT} {model} --context c2"));
        let inspected = json(&folder, "inspect model.tgp");
        assert_eq!(inspected["kind"], "one context");
        assert_eq!(inspected["context"], "c2");
        let joint = &inspected["joints"][0];
        assert_eq!(joint["model"], name);
        assert_eq!(joint["hyperparameters"].is_object(), model == "gpc");
        let text = stdout(&folder, "inspect model.tgp");
        assert!(text.contains(&format!("joint1: {name}\n")), "{text}");
    }
    folder.write("other.tgp", "mass = 1.0\n");
    let message = folder.refusal("inspect other.tgp");
    assert!(
        message.starts_with("other.tgp: not a model file"),
        "{message}"
    );
}

#[test]
fn the_pooled_model_does_not_tell_contexts_apart_and_the_independent_one_does() {
    let folder = folder(12);
    folder.run(&format!("{FIT} pgp"));
    let x = states(&folder.read("test.csv"));
    let predict = |model: &RobotModel, context| predicted(model, context, &x);
    let pooled = load(&folder);
    assert_eq!(predict(&pooled, "c1"), predict(&pooled, "c7"));
    folder.run(&format!("{FIT} igp"));
    let independent = load(&folder);
    assert!(predict(&independent, "c1") != predict(&independent, "c7"));
    assert_eq!(independent.learned()[0].1.name(), "iGP");
}

#[test]
fn any_number_of_threads_writes_the_same_file() {
    let folder = folder(6);
    let bytes = |threads: usize| {
        folder.run(&format!("{FIT} mgp --criterion hq --threads {threads}"));
        std::fs::read(folder.path("model.tgp")).unwrap()
    };
    assert!(bytes(1) == bytes(2));
}

#[test]
fn fits_that_are_refused() {
    let folder = folder(4);
    let only: String = rows(0, 4).replace("c2,", "c1,").replace("c7,", "c1,");
    folder.write("one.csv", only);
    folder.write("unnamed.csv", rows(0, 4).replacen("context", "load", 1));
    folder.write("gap.csv", rows(0, 4).replacen("c2,", " ,", 1));
    let fit = |data: &str, rest: &str| format!("fit --data {data} --output m.tgp --model {rest}");
    for (command, expected) in [
        (
            fit("one.csv", "mgp"),
            "one.csv: all rows are of one context (`c1`); --model mgp is for two or more: use --model gpc",
        ),
        (
            fit("unnamed.csv", "igp"),
            "unnamed.csv: there is no column `context`, which says each row's context",
        ),
        (
            fit("gap.csv", "pgp"),
            "gap.csv: row 2, column `context`: the field is empty",
        ),
        (
            fit("runs.csv", "mgp --rank 4"),
            "--rank 4: the rank must be 1 to 3, the number of contexts in runs.csv",
        ),
        (
            fit("runs.csv", "mgp --context c2"),
            "--context c2: --model mgp learns all contexts of the data together; leave --context out, or use --model gpc",
        ),
        (
            fit("runs.csv", "igp --rank 2"),
            "--rank goes with --model mgp, not igp",
        ),
        (
            fit("runs.csv", "gpc --context c1 --criterion aic"),
            "--criterion goes with --model mgp, not gpc",
        ),
        (
            fit("runs.csv", "mgp --rank 2 --criterion aic"),
            "--criterion chooses a rank, but --rank 2 gives one",
        ),
    ] {
        assert_eq!(folder.refusal(&command), expected);
    }
    let message = folder.refuse(&fit("runs.csv", "mgp --rank 0"));
    assert!(
        message.contains("a rank is a number from 1, or bic"),
        "{message}"
    );
}

#[test]
fn contexts_that_a_model_does_not_have() {
    let folder = folder(6);
    folder.run(&format!("{FIT} mgp --rank 1"));
    let known = "`c1`, `c2`, `c7`";
    for command in [PREDICT, "evaluate --model model.tgp --data test.csv"] {
        assert_eq!(
            folder.refusal(&format!("{command} --context c9")),
            format!("--context c9: model.tgp does not have it; it has {known}")
        );
    }
    folder.write("test.csv", rows(50, 2).replacen("c7,", "c9,", 1));
    for command in [PREDICT, "evaluate --model model.tgp --data test.csv"] {
        assert_eq!(
            folder.refusal(command),
            format!(
                "test.csv: row 3, column `context`: `c9` is not a context of model.tgp, which has {known}"
            )
        );
    }
    folder.write("test.csv", rows(50, 2).replacen("context", "load", 1));
    assert_eq!(
        folder.refusal(PREDICT),
        format!(
            "test.csv: there is no column `context`; choose one of model.tgp for all rows with --context NAME: {known}"
        )
    );
    folder.run("fit --data runs.csv --model lr --context c2 --output model.tgp");
    assert_eq!(
        folder.refusal(&format!("{PREDICT} --context c2")),
        "--context c2: model.tgp is a model of one context, `c2`; leave --context out"
    );
}

/// The finite mean predictions of a model of `runs.csv` at `test.csv`.
fn predictions(folder: &Folder, model: &str) -> Vec<f64> {
    folder.run(&format!("{FIT} {model}"));
    folder.run(PREDICT);
    let means = column(&folder.read("y.csv"), "m1");
    assert!(means.iter().all(|mean| mean.is_finite()), "{means:?}");
    means
}

const MODELS: [&str; 4] = ["igp", "pgp", "mgp --rank 1", "mgp --rank bic"];

#[test]
fn a_context_with_one_sample_is_predicted_from_the_others() {
    let folder = folder(8);
    let is_kept = |(row, line): &(usize, &str)| *row <= 3 || !line.starts_with("c7,");
    let text = rows(0, 8);
    let kept = text.lines().enumerate().filter(is_kept);
    let lines: Vec<&str> = kept.map(|(_, line)| line).collect();
    folder.write("runs.csv", lines.join("\n") + "\n");
    for model in MODELS {
        let warning = folder.run(&format!("{FIT} {model}"));
        let expected =
            "warning: runs.csv: context `c7` has one row: it is predicted from the other contexts";
        assert!(warning.contains(expected), "{warning}");
        predictions(&folder, model);
    }
}

#[test]
fn identical_inputs_and_constant_torques_have_an_answer() {
    let folder = folder(8);
    let text = rows(0, 8);
    let change = |keep: fn(&[&str]) -> String| -> String {
        let line = |line: &str| keep(&line.split(',').collect::<Vec<_>>()) + "\n";
        let mut lines = text.lines();
        format!("{}\n", lines.next().unwrap()) + &lines.map(line).collect::<String>()
    };
    folder.write(
        "runs.csv",
        change(|f| format!("{},0.5,1.0,-0.5,{}", f[0], f[4])),
    );
    folder.write(
        "test.csv",
        change(|f| format!("{},0.5,1.0,-0.5,{}", f[0], f[4])),
    );
    for model in MODELS {
        // Nothing but a constant can be known there.
        let means = predictions(&folder, model);
        assert!(
            means.iter().all(|mean| mean.abs() < 15.0),
            "{model}: {means:?}"
        );
    }
    folder.write(
        "runs.csv",
        change(|f| format!("{},{},{},{},2.5", f[0], f[1], f[2], f[3])),
    );
    for model in MODELS {
        let means = predictions(&folder, model);
        let warning = folder.run(&format!("{FIT} {model}"));
        let expected = "the torque of `joint1` is 2.5 N·m in every row";
        assert!(warning.contains(expected), "{warning}");
        assert!(
            means.iter().all(|mean| (mean - 2.5).abs() < 0.3),
            "{model}: {means:?}"
        );
    }
}
