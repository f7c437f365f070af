//! `likelihood` against the 50-digit values of `fixtures/gp-core`.

use std::fmt::Write;

use serde_json::Value;

use crate::command::{Folder, fixture};

/// Rows of `log_marginal.csv` of one case: name, component, θ, value.
fn expected(case: &str) -> Vec<(String, usize, f64, f64)> {
    let mut reader = csv::Reader::from_path(fixture("gp-core/log_marginal.csv")).unwrap();
    let records = reader.records().map(Result::unwrap);
    let rows = records.filter(|record| &record[0] == case).map(|record| {
        let theta = record[3].parse().unwrap_or(f64::NAN);
        let component = record[2].parse().unwrap();
        (
            record[1].to_owned(),
            component,
            theta,
            record[4].parse().unwrap(),
        )
    });
    rows.collect()
}

/// A folder with the case's `data.csv`, its columns in another order, and `h.toml`.
fn folder(case: &str) -> Folder {
    let folder = Folder::new();
    let inputs = std::fs::read_to_string(fixture(&format!("gp-core/inputs_{case}.csv"))).unwrap();
    let turned = inputs.lines().enumerate().map(|(idx, line)| {
        let (states, torque) = line.rsplit_once(',').unwrap();
        let (torque, comment) = if idx == 0 {
            ("tau2", "comment")
        } else {
            (torque, "x")
        };
        format!("{torque},{comment},{states}\n")
    });
    folder.write("data.csv", turned.collect::<String>());
    folder.write("h.toml", toml(case));
    folder
}

fn toml(case: &str) -> String {
    let rows = expected(case);
    let values = |name: &str| -> Vec<f64> {
        let of_name = rows.iter().filter(|row| row.0 == name);
        of_name.map(|row| row.2).collect()
    };
    let mut text = String::new();
    for name in ["bias_std", "signal_std", "noise_std"] {
        writeln!(text, "{name} = {:?}", values(name)[0]).unwrap();
    }
    for name in ["linear_std", "length_scales", "coulomb_std"] {
        let values = values(name);
        if !values.is_empty() {
            writeln!(text, "{name} = {values:?}").unwrap();
        }
    }
    text
}

fn json(folder: &Folder, arguments: &str) -> Value {
    let command = "likelihood --data data.csv --joint 2 --json --hyperparameters";
    let output = folder
        .command(&format!("{command} {arguments}"))
        .output()
        .unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn value(json: &Value) -> f64 {
    json["log_marginal_likelihood"].as_f64().unwrap()
}

fn derivative(json: &Value, name: &str, component: usize) -> f64 {
    let entry = &json["gradient"][name];
    let scalar = entry.as_f64();
    scalar.or_else(|| entry[component].as_f64()).unwrap()
}

/// Relative error of the value, and the largest of the gradient's entries relative to the largest entry.
fn errors(case: &str, json: &Value) -> (f64, f64) {
    let rows = expected(case);
    let derivatives = &rows[1..];
    let largest = derivatives
        .iter()
        .fold(0.0_f64, |l, row| l.max(row.3.abs()));
    let gradient_errors = derivatives.iter().map(|(name, component, _, expected)| {
        (derivative(json, name, *component) - expected).abs() / largest
    });
    let value_error = (value(json) / rows[0].3 - 1.0).abs();
    (value_error, gradient_errors.fold(0.0, f64::max))
}

#[test]
fn dense_likelihood_and_gradient_equal_extended_precision() {
    for case in ["well", "smooth"] {
        let folder = folder(case);
        let json = json(&folder, "h.toml --method dense");
        let (value, gradient) = errors(case, &json);
        assert!(
            value <= 1e-10 && gradient <= 1e-8,
            "{case}: {value:e} {gradient:e}"
        );
        assert_eq!(json["method"], "dense");
        let n_rows = folder.read("data.csv").lines().count() - 1;
        assert_eq!(json["rank"], n_rows, "{case}");
        assert_eq!(json["gradient"]["coulomb_std"].is_array(), case == "well");
    }
}

#[test]
fn certified_likelihood_lies_within_its_bound_of_extended_precision() {
    for case in ["well", "smooth"] {
        let json = json(&folder(case), "h.toml --method certified");
        let bound = json["error_bound"].as_f64().unwrap();
        let error = (value(&json) - expected(case)[0].3).abs();
        // Beyond the bound only the rounding of the sums.
        let limit = bound + 1e-12 * value(&json).abs();
        assert!(
            error <= limit && bound <= 1e-2,
            "{case}: {error:e}, bound {bound:e}"
        );
        assert_eq!(json["method"], "certified");
    }
}

#[test]
fn zero_switches_a_term_off() {
    let folder = folder("well");
    let text = toml("well");
    let kept = text.lines().filter(|line| !line.starts_with("coulomb"));
    let without: String = kept.map(|line| line.to_owned() + "\n").collect();
    folder.write("without.toml", &without);
    folder.write("zero.toml", without + "coulomb_std = [0.0, 0.0]\n");
    for method in ["dense", "certified"] {
        let without = json(&folder, &format!("without.toml --method {method}"));
        let zero = json(&folder, &format!("zero.toml --method {method}"));
        let bound = zero["error_bound"].as_f64().unwrap();
        let tolerance = 1e-12 * value(&without).abs() + bound;
        let difference = (value(&without) - value(&zero)).abs();
        assert!(difference <= tolerance, "{without} {zero}");
        let no_slope = serde_json::json!([0.0, 0.0]);
        assert_eq!(zero["gradient"]["coulomb_std"], no_slope);
        assert!(without["gradient"]["coulomb_std"].is_null());
    }
}

#[test]
fn without_json_there_is_a_table() {
    let folder = folder("well");
    let command = "likelihood --data data.csv --joint joint2 --hyperparameters h.toml";
    let output = folder.command(command).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let start = "log marginal likelihood -32.179731018883";
    assert!(text.starts_with(start), "{text}");
    assert!(text.contains("\nlength_scales 6"), "{text}");
    assert_eq!(text.lines().count(), 3 + 17, "{text}");
}

/// The message for a hyperparameter file in which `from` is replaced.
fn refusal(from: &str, to: &str) -> String {
    let folder = folder("well");
    let text = toml("well");
    assert!(text.contains(from), "{from}: {text}");
    folder.write("h.toml", text.replacen(from, to, 1));
    folder.refusal("likelihood --data data.csv --joint 2 --hyperparameters h.toml")
}

#[test]
fn hyperparameters_that_are_refused() {
    let zero_or_more = "but must be finite and zero or more";
    let positive = "but must be finite and greater than zero";
    let six = "the data needs 6 (one per covariate: q, then qd, then qdd of every joint)";
    for (from, to, expected) in [
        (
            "bias_std = ",
            "bias_std = -",
            format!("`bias_std` is -0.7, {zero_or_more}"),
        ),
        (
            "noise_std = 0.1",
            "noise_std = 0.0",
            format!("`noise_std` is 0, {positive}"),
        ),
        (
            "signal_std = 1.2",
            "signal_std = nan",
            format!("`signal_std` is NaN, {zero_or_more}"),
        ),
        (
            "[1.0, 1.5,",
            "[1.0, 0.0,",
            format!("`length_scales` entry 2 is 0, {positive}"),
        ),
        (
            "[1.0, 1.5,",
            "[1.0, inf,",
            format!("`length_scales` entry 2 is inf, {positive}"),
        ),
        (
            "[0.9, 0.2]",
            "[0.9, -0.2]",
            format!("`coulomb_std` entry 2 is -0.2, {zero_or_more}"),
        ),
        (
            "[0.9, 0.2]",
            "[0.9]",
            "`coulomb_std` has 1 entries; the data needs 2 (one per joint)".to_owned(),
        ),
        (
            "[1.5, 0.4,",
            "[0.4,",
            format!("`linear_std` has 5 entries; {six}"),
        ),
        (
            "[1.0, 1.5,",
            "[1.0, 1.5, 7.0,",
            format!("`length_scales` has 7 entries; {six}"),
        ),
    ] {
        assert_eq!(refusal(from, to), format!("h.toml: {expected}"));
    }
}

#[test]
fn hyperparameter_files_that_cannot_be_read() {
    for (from, to, expected) in [
        ("bias_std", "bias", "unknown field `bias`"),
        ("bias_std = ", "bias_std = x", "h.toml: line 1: "),
        ("signal_std = 1.2", "", "missing field `signal_std`"),
        (
            "noise_std = 0.1",
            "noise_std = \"a\"",
            "h.toml: line 3: invalid type: string",
        ),
    ] {
        let message = refusal(from, to);
        let is_placed = message.starts_with("h.toml: line ");
        assert!(is_placed && message.contains(expected), "{message}");
    }
}

#[test]
fn a_matrix_that_is_not_positive_definite_is_named() {
    let folder = Folder::new();
    folder.write("data.csv", "q1,qd1,qdd1,tau1\n1,1,1,1\n1,1,1,2\n1,1,1,2\n");
    let ones = "linear_std = [1, 1, 1]\nsignal_std = 1\nlength_scales = [1, 1, 1]\n";
    folder.write(
        "h.toml",
        format!("bias_std = 1e9\nnoise_std = 1e-9\n{ones}"),
    );
    let command = "likelihood --data data.csv --joint 1 --hyperparameters h.toml --method dense";
    let message = folder.refusal(command);
    let expected =
        "data.csv: joint `joint1`: covariance matrix of order 3 is not positive definite at pivot ";
    assert!(message.starts_with(expected), "{message}");
}
