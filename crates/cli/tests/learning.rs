//! `fit`, `predict` and `evaluate`, end to end on the simulated PUMA 560.

use std::f64::consts::PI;

use faer::Mat;
use gp_core::FitOptions;
use kernels::TorqueForm;
use serde_json::Value;
use torque_model::learn::{InOwnUnit, Learn, Linear, SingleProcess};
use torque_model::{JointTorques, Provenance, RobotModel, Samples, Timeline};

use crate::command::{Folder, column};
use crate::puma_samples::{folder, rows};

/// (n, 18) states of a CSV text.
fn states(text: &str) -> Mat<f64> {
    let columns: Vec<Vec<f64>> = ["q", "qd", "qdd"]
        .iter()
        .flat_map(|quantity| (1..=6).map(move |joint| format!("{quantity}{joint}")))
        .map(|name| column(text, &name))
        .collect();
    Mat::from_fn(columns[0].len(), 18, |row, col| columns[col][row])
}

/// Standard output of a command that succeeds.
fn stdout(folder: &Folder, arguments: &str) -> String {
    let output = folder.command(arguments).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    String::from_utf8(output.stdout).unwrap()
}

fn load(folder: &Folder, file: &str) -> RobotModel {
    RobotModel::from_bytes(&std::fs::read(folder.path(file)).unwrap()).unwrap()
}

/// The entry of a joint in the output of `evaluate --json`.
fn score(folder: &Folder, model: &str, joint: &str) -> Value {
    let json = stdout(
        folder,
        &format!("evaluate --model {model} --data test.csv --json"),
    );
    let json: Value = serde_json::from_str(&json).unwrap();
    let joints = json["joints"].as_array().unwrap();
    let of_joint = joints.iter().find(|entry| entry["joint"] == joint);
    of_joint.unwrap().clone()
}

fn assert_close(value: &Value, expected: f64, what: &str) {
    let value = value.as_f64().unwrap();
    // Sums of 200 terms in another order; s² = var + σ² comes from the s written, squared.
    let tolerance = 200.0 * f64::EPSILON * expected.abs();
    assert!(
        (value - expected).abs() <= tolerance,
        "{what}: {value} {expected}"
    );
}

/// The process that `fit` learns.
fn in_own_unit(form: TorqueForm, options: FitOptions) -> InOwnUnit<SingleProcess> {
    InOwnUnit {
        likelihood: options.likelihood,
        learner: SingleProcess { form, options },
    }
}

/// A joint, by its number, learned by the library.
fn learned(train: &str, joint: usize, learner: &dyn Learn) -> RobotModel {
    let names = (1..=6).map(|number| format!("joint{number}")).collect();
    let torques = JointTorques {
        joint_idx: joint - 1,
        values: column(train, &format!("tau{joint}")),
    };
    let samples = Samples::of_one_context(names, states(train), vec![torques]).unwrap();
    let samples = Samples {
        timeline: Timeline {
            t: column(train, "t"),
            ..Timeline::default()
        },
        ..samples
    };
    RobotModel::learn(&samples, learner, Provenance::new("a test", b"")).unwrap()
}

#[test]
fn a_model_predicts_in_another_process_what_the_library_predicts_here() {
    let folder = folder(60);
    let report =
        folder.run("fit --data train.csv --joints 1,3 --starts chapter --output model.tgp");
    for text in [
        "joint1 learned",
        "joint3 learned",
        "GPc",
        "eq. (22)",
        "model.tgp written",
    ] {
        assert!(report.contains(text), "{text}: {report}");
    }
    let predict = "predict --model model.tgp --input test.csv --tau-prefix model";
    folder.run(&format!("{predict} --output latent.csv"));
    folder.run(&format!("{predict} --output observed.csv --observed"));

    let (train, test) = (folder.read("train.csv"), states(&folder.read("test.csv")));
    let (latent, observed) = (folder.read("latent.csv"), folder.read("observed.csv"));
    for joint in [1, 3] {
        let (form, options) = (TorqueForm::Coulomb, FitOptions::chapter());
        let model = learned(&train, joint, &in_own_unit(form, options));
        let prediction = model.predict(0, test.as_ref()).unwrap().remove(0);
        let noise_var = prediction.noise_var[0];
        let with_noise = |noise_var: f64| -> Vec<f64> {
            let vars = prediction.var.iter();
            vars.map(|var| (var + noise_var).sqrt()).collect()
        };
        let (mean, std) = (format!("model{joint}"), format!("model{joint}_std"));
        assert_eq!(column(&latent, &mean), prediction.mean);
        assert_eq!(column(&observed, &mean), prediction.mean);
        assert_eq!(column(&latent, &std), with_noise(0.0));
        assert_eq!(column(&observed, &std), with_noise(noise_var));
    }
    let header = "context,run,t,tau1,tau2,tau3,tau4,tau5,tau6,model1,model1_std,model3,model3_std";
    assert_eq!(latent.lines().next().unwrap(), header);
}

#[test]
fn evaluate_says_what_the_predictions_say() {
    let folder = folder(60);
    folder.run("fit --data train.csv --joints 3 --starts chapter --model gp --output model.tgp");
    folder.run(
        "predict --observed --model model.tgp --input test.csv --output y.csv --tau-prefix model",
    );
    let (y, n) = (folder.read("y.csv"), 200.0);
    let of = |name: &str| column(&y, name);
    let (torques, mean, std) = (of("tau3"), of("model3"), of("model3_std"));
    let errors: Vec<f64> = torques.iter().zip(&mean).map(|(t, m)| t - m).collect();
    let centre = torques.iter().sum::<f64>() / n;
    let var = torques.iter().map(|t| (t - centre).powi(2)).sum::<f64>() / n;
    let mse = errors.iter().map(|e| e * e).sum::<f64>() / n;
    let pairs = || errors.iter().zip(&std);
    let log_density = pairs().map(|(e, s)| -0.5 * (e / s).powi(2) - s.ln() - 0.5 * (2.0 * PI).ln());
    let n_inside = pairs().filter(|(e, s)| e.abs() <= 1.959_963_984_540_054 * **s);

    let score = score(&folder, "model.tgp", "joint3");
    assert_close(&score["nmse"], mse / var, "nmse");
    assert_close(&score["rmse"], mse.sqrt(), "rmse");
    let density = &score["mean_log_predictive_density"];
    assert_close(density, log_density.sum::<f64>() / n, "density");
    assert_close(
        &score["coverage_95"],
        n_inside.count() as f64 / n,
        "coverage",
    );

    let table = stdout(&folder, "evaluate --model model.tgp --data test.csv");
    assert!(table.starts_with("joint   samples"), "{table}");
    assert!(table.contains(&format!("{:.3e}", mse / var)), "{table}");
}

#[test]
fn signs_of_the_speeds_help_a_linear_model() {
    let folder = folder(400);
    folder.run("fit --data train.csv --model lr --output lr.tgp");
    folder.run("fit --data train.csv --model lrc --output lrc.tgp");
    for joint in ["joint1", "joint4", "joint6"] {
        let nmse = |model: &str| score(&folder, model, joint)["nmse"].as_f64().unwrap();
        let (without, with) = (nmse("lr.tgp"), nmse("lrc.tgp"));
        assert!(with < 0.5 * without, "{joint}: LR {without}, LRc {with}");
    }
}

#[test]
fn the_linear_model_is_the_librarys() {
    let folder = folder(50);
    folder.run("fit --data train.csv --model lrc --joints 2 --output model.tgp");
    let model = load(&folder, "model.tgp");
    let train = folder.read("train.csv");
    let linear = learned(&train, 2, &Linear::coulomb().by_evidence_within_runs());
    let test = states(&folder.read("test.csv"));
    let predict = |model: &RobotModel| model.predict(0, test.as_ref()).unwrap();
    assert_eq!(predict(&model), predict(&linear));
    assert_eq!(model.joint_names()[5], "joint6");
    assert_eq!(model.provenance().context, "c3");
    assert_eq!(model.ranges().n_samples(), 50);
}

#[test]
fn any_number_of_threads_writes_the_same_file() {
    let folder = folder(40);
    let fit = "fit --data train.csv --model gp --starts chapter --joints 1,2,3";
    for (threads, file) in [(1, "one.tgp"), (2, "two.tgp"), (5, "five.tgp")] {
        folder.run(&format!("{fit} --threads {threads} --output {file}"));
    }
    let bytes = |file: &str| std::fs::read(folder.path(file)).unwrap();
    assert!(bytes("one.tgp") == bytes("two.tgp") && bytes("two.tgp") == bytes("five.tgp"));
}

#[test]
fn columns_follow_their_names_in_any_order() {
    let folder = folder(50);
    let turned = |text: &str| -> String {
        let line = |line: &str| line.split(',').rev().collect::<Vec<_>>().join(",") + "\n";
        text.lines().map(line).collect()
    };
    folder.write("turned.csv", turned(&folder.read("train.csv")));
    folder.write("test_turned.csv", turned(&folder.read("test.csv")));
    folder.run("fit --data train.csv --model lrc --output a.tgp");
    folder.run("fit --data turned.csv --model lrc --output b.tgp");
    folder.run("predict --model a.tgp --input test.csv --output a.csv --tau-prefix m");
    folder.run("predict --model b.tgp --input test_turned.csv --output b.csv --tau-prefix m");
    let (a, b) = (folder.read("a.csv"), folder.read("b.csv"));
    for joint in 1..=6 {
        let name = format!("m{joint}");
        assert_eq!(column(&a, &name), column(&b, &name));
    }
}

#[test]
fn joints_by_name_keep_the_order_of_the_file() {
    let folder = Folder::new();
    let header = "q_elbow,q_base,qd_base,qd_elbow,qdd_base,qdd_elbow,tau_base,tau_elbow\n";
    let row = |i: i32| {
        let numbers = (0..8).map(|col| format!("{:?}", f64::from((i * 37 + col * 11) % 23) / 5.0));
        numbers.collect::<Vec<_>>().join(",") + "\n"
    };
    let rows: String = (0..30).map(row).collect();
    folder.write("train.csv", header.to_owned() + &rows);
    folder.run("fit --data train.csv --model lr --joints base --output model.tgp");
    let model = load(&folder, "model.tgp");
    assert_eq!(model.joint_names(), ["elbow", "base"]);
    assert_eq!(model.learned()[0].0, 1);

    folder.run("predict --model model.tgp --input train.csv --output y.csv --tau-prefix model");
    let y = folder.read("y.csv");
    assert!(y.starts_with("tau_base,tau_elbow,model_base,model_base_std\n"));
    folder.write("numbered.csv", "q1,q2,qd1,qd2,qdd1,qdd2\n0,0,0,0,0,0\n");
    let note = folder.run("predict --model model.tgp --input numbered.csv --output z.csv");
    let expected = "joints 1 to 2 are taken to be the model's elbow, base";
    assert!(note.contains(expected), "{note}");
}

#[test]
fn states_outside_the_training_data_are_counted_by_column() {
    let folder = folder(50);
    folder.run("fit --data train.csv --model lrc --joints 1 --output model.tgp");
    let predict = "predict --model model.tgp --output y.csv --tau-prefix m --input";
    let known = folder.run(&format!("{predict} train.csv"));
    assert!(!known.contains("outside"), "{known}");

    let train = folder.read("train.csv");
    let mut lines: Vec<String> = train.lines().map(str::to_owned).collect();
    for line in &mut lines[1..=3] {
        let mut fields: Vec<&str> = line.split(',').collect();
        fields[5] = "3.0"; // q3
        *line = fields.join(",");
    }
    folder.write("far.csv", lines.join("\n"));
    let warning = folder.run(&format!("{predict} far.csv"));
    let expected = "far.csv: 3 of 50 rows lie outside the range of the training data, where the model extrapolates (rows by column: `q3` 3)";
    assert!(warning.contains(expected), "{warning}");
    let evaluated = folder.run("evaluate --model model.tgp --data far.csv");
    assert!(evaluated.contains(expected), "{evaluated}");
}

#[test]
fn many_rows_are_predicted_in_blocks_without_a_seam() {
    let folder = folder(50);
    folder.run("fit --data train.csv --model lrc --joints 2 --output model.tgp");
    let all = rows(0, 2500);
    folder.write("all.csv", &all);
    let note =
        folder.run("predict --model model.tgp --input all.csv --output y.csv --tau-prefix m");
    assert!(note.contains("2500 rows written to y.csv"), "{note}");
    let y = folder.read("y.csv");
    let model = load(&folder, "model.tgp");
    let expected = &model.predict(0, states(&all).as_ref()).unwrap()[0];
    assert_eq!(column(&y, "m2"), expected.mean);
    assert_eq!(column(&y, "t"), column(&all, "t"));
}

#[test]
fn equal_torques_are_learned_and_said_to_be_equal() {
    let folder = Folder::new();
    let row = |i: i32| format!("{:?},{:?},0.5,2.5\n", f64::from(i) / 10.0, f64::from(i % 3));
    let data = "q1,qd1,qdd1,tau1\n".to_owned() + &(0..20).map(row).collect::<String>();
    folder.write("train.csv", &data);
    folder.write("test.csv", &data);
    for model in ["lr", "gpc"] {
        let fit = format!("fit --data train.csv --model {model} --output m.tgp");
        let warning = folder.run(&fit);
        let expected = "the torque of `joint1` is 2.5 N·m in every row";
        assert!(warning.contains(expected), "{warning}");
        let score = score(&folder, "m.tgp", "joint1");
        assert!(score["nmse"].is_null(), "{score}");
        assert!(score["rmse"].as_f64().unwrap() < 0.1, "{score}");
    }
    let table = stdout(&folder, "evaluate --model m.tgp --data test.csv");
    assert!(table.contains("undefined"), "{table}");
}

#[test]
fn one_context_of_several_can_be_chosen() {
    let folder = folder(50);
    let train = folder.read("train.csv");
    let other = rows(3, 40).replace("c3,", "c9,");
    let (_, other_rows) = other.split_once('\n').unwrap();
    folder.write("both.csv", train.clone() + other_rows);
    folder.write("c9.csv", &other);
    folder.run("fit --data train.csv --model lrc --output alone.tgp");
    folder.run("fit --data both.csv --model lrc --context c3 --output chosen.tgp");
    let x = states(&train);
    let predict = |file: &str| load(&folder, file).predict(0, x.as_ref()).unwrap();
    assert_eq!(predict("alone.tgp"), predict("chosen.tgp"));
    let warning = folder.run("evaluate --model alone.tgp --data c9.csv");
    let expected = "measured with `c9`, but the model was learned with `c3`";
    assert!(warning.contains(expected), "{warning}");
}
