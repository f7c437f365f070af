//! `likelihood` of several contexts against the 50-digit values of `fixtures/mtgp`, and what it refuses of them.

use std::fmt::Write;

use serde_json::Value;

use crate::command::{Folder, fixture};

/// One value of `likelihood.csv`.
struct Expected {
    name: String,
    place: (usize, usize),
    theta: f64,
    value: f64,
}

fn expected(case: &str) -> Vec<Expected> {
    let mut reader = csv::Reader::from_path(fixture("mtgp/likelihood.csv")).unwrap();
    let records = reader.records().map(Result::unwrap);
    let of_case = records.filter(|record| &record[0] == case);
    let index = |text: &str| text.parse().unwrap_or(0);
    of_case
        .map(|record| Expected {
            name: record[1].replace("task_noise", "noise"),
            place: (index(&record[2]), index(&record[3])),
            theta: record[4].parse().unwrap_or(f64::NAN),
            value: record[5].parse().unwrap(),
        })
        .collect()
}

/// Λ by rows: full ones, or without what is above the diagonal.
fn factor_rows(rows: &[Expected], is_full: bool) -> String {
    let entries: Vec<_> = rows
        .iter()
        .filter(|row| row.name == "task_factor")
        .collect();
    let rank = entries.iter().map(|entry| entry.place.1).max().unwrap() + 1;
    let mut factor = vec![Vec::new(); 5];
    for entry in entries {
        factor[entry.place.0].push(entry.theta);
    }
    if is_full {
        for row in &mut factor {
            row.resize(rank, 0.0);
        }
    }
    format!("{factor:?}")
}

fn toml(case: &str, is_full: bool) -> String {
    let rows = expected(case);
    let values = |name: &str| -> Vec<f64> {
        let of_name = rows.iter().filter(|row| row.name == name);
        of_name.map(|row| row.theta).collect()
    };
    let mut text = String::new();
    for name in ["bias_std", "signal_std"] {
        writeln!(text, "{name} = {:?}", values(name)[0]).unwrap();
    }
    for name in ["linear_std", "length_scales", "coulomb_std"] {
        writeln!(text, "{name} = {:?}", values(name)).unwrap();
    }
    let noise = values("noise_std");
    let noise = if noise.len() > 1 {
        format!("{noise:?}")
    } else {
        format!("{:?}", noise[0])
    };
    writeln!(text, "noise_std = {noise}").unwrap();
    writeln!(text, "contexts = [\"c0\", \"c1\", \"c2\", \"c3\", \"c4\"]").unwrap();
    writeln!(text, "task_factor = {}", factor_rows(&rows, is_full)).unwrap();
    text
}

/// A folder with the case's `data.csv` and `h.toml`.
fn folder(case: &str, is_full: bool) -> Folder {
    let folder = Folder::new();
    let inputs = std::fs::read_to_string(fixture(&format!("mtgp/inputs_{case}.csv"))).unwrap();
    let mut lines = inputs.lines();
    let header = lines.next().unwrap().replace("task", "context") + "au2\n";
    let rows = lines.map(|line| format!("c{line}\n"));
    folder.write("data.csv", header + &rows.collect::<String>());
    folder.write("h.toml", toml(case, is_full));
    folder
}

const COMMAND: &str = "likelihood --data data.csv --joint 2 --hyperparameters h.toml";

fn json(folder: &Folder, method: &str) -> Value {
    let command = format!("{COMMAND} --json --method {method}");
    let output = folder.command(&command).output().unwrap();
    let message = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{message}");
    serde_json::from_slice(&output.stdout).unwrap()
}

fn derivative(json: &Value, row: &Expected) -> f64 {
    let entry = &json["gradient"][&row.name];
    let of_list = &entry[row.place.0];
    let found = [entry, of_list, &of_list[row.place.1]];
    found.into_iter().find_map(Value::as_f64).unwrap()
}

#[test]
fn value_and_gradient_equal_extended_precision() {
    for (case, is_full) in [
        ("five", true),
        ("five", false),
        ("noises", true),
        ("curve", false),
    ] {
        let json = json(&folder(case, is_full), "dense");
        let rows = expected(case);
        let value = json["log_marginal_likelihood"].as_f64().unwrap();
        assert!(
            (value / rows[0].value - 1.0).abs() <= 1e-8,
            "{case}: {value}"
        );
        for row in &rows[1..] {
            let found = derivative(&json, row);
            let error = (found / row.value - 1.0).abs();
            assert!(
                error <= 1e-6,
                "{case} {} {:?}: {error:e}",
                row.name,
                row.place
            );
        }
        assert_eq!(json["method"], "dense");
        assert!(json["gradient"]["contexts"].is_null());
    }
}

#[test]
fn the_gradient_of_the_task_factor_has_a_row_for_each_context() {
    let json = json(&folder("five", false), "automatic");
    let rows = json["gradient"]["task_factor"].as_array().unwrap();
    let lengths: Vec<usize> = rows
        .iter()
        .map(|row| row.as_array().unwrap().len())
        .collect();
    assert_eq!(lengths, [3; 5]);
    assert_eq!(
        (&rows[0][1], &rows[0][2], &rows[1][2]),
        (&0.0.into(), &0.0.into(), &0.0.into())
    );
}

#[test]
fn certified_values_lie_within_their_bound() {
    for case in ["five", "noises", "curve"] {
        let json = json(&folder(case, true), "certified");
        let value = json["log_marginal_likelihood"].as_f64().unwrap();
        let bound = json["error_bound"].as_f64().unwrap();
        let error = (value - expected(case)[0].value).abs();
        let limit = bound + 1e-12 * value.abs();
        assert!(
            error <= limit && bound <= 1e-2,
            "{case}: {error:e}, bound {bound:e}"
        );
        assert_eq!(json["method"], "certified");
    }
}

#[test]
fn without_json_the_free_entries_have_numbers() {
    let folder = folder("noises", true);
    let output = folder.command(COMMAND).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    for name in ["\ntask_factor 1,1 ", "\ntask_factor 5,3 ", "\nnoise_std 5 "] {
        assert!(text.contains(name), "{name}: {text}");
    }
    assert!(!text.contains("task_factor 1,2"), "{text}");
}

/// The message for a hyperparameter file in which `from` is replaced.
fn refusal(case: &str, from: &str, to: &str) -> String {
    let folder = folder(case, true);
    let text = toml(case, true);
    assert!(text.contains(from), "{from}: {text}");
    folder.write("h.toml", text.replacen(from, to, 1));
    folder.refusal(COMMAND)
}

#[test]
fn task_factors_that_are_refused() {
    for (from, to, expected) in [
        (
            "[1.1, 0.0, 0.0]",
            "[1.1, 0.5, 0.0]",
            "`task_factor` row 1, column 2 is 0.5, which is above the diagonal and must be zero",
        ),
        (
            "[1.1, 0.0, 0.0]",
            "[nan, 0.0, 0.0]",
            "`task_factor` row 1, column 1 is NaN, but must be finite",
        ),
        (
            "[1.1, 0.0, 0.0]",
            "[]",
            "`task_factor` row 1 has 0 entries; 1 are needed",
        ),
        (
            "[0.3, -0.8, 0.2]",
            "[0.3, -0.8]",
            "`task_factor` row 4 has 2 entries; 3 are needed",
        ),
        (
            "[1.1, 0.0, 0.0]",
            "[1.1, 0, 0, 0, 0, 0]",
            "`task_factor` has rank 6, its number of columns, which must be 1 to 5, the number of contexts",
        ),
        (
            "[1.1, 0.0, 0.0],",
            "",
            "`task_factor` has 4 rows; 5 are needed, one for each of `contexts`",
        ),
        (
            "\"c3\"",
            "\"c1\"",
            "`contexts` entry 4 is `c1` again; each context has one row of `task_factor`",
        ),
        (
            "task_factor",
            "#",
            "`contexts` needs `task_factor`, a row for each",
        ),
        (
            "contexts",
            "#",
            "`task_factor` needs `contexts`, the name of each row",
        ),
    ] {
        assert_eq!(refusal("five", from, to), format!("h.toml: {expected}"));
    }
    assert_eq!(
        refusal("noises", "noise_std = [", "noise_std = [1.0, "),
        "h.toml: `noise_std` has 6 entries; 5 are needed, one for each of `contexts`, or a number for all"
    );
    let noise = refusal("noises", "noise_std = [", "noise_std = [-");
    assert!(
        noise.starts_with("h.toml: `noise_std` entry 1 is -"),
        "{noise}"
    );
}

#[test]
fn contexts_that_do_not_match_the_data() {
    let folder = folder("five", true);
    let (data, text) = (folder.read("data.csv"), folder.read("h.toml"));
    let strange = data.replacen("\nc3,", "\nc9,", 1);
    let row = 1 + data[..data.find("\nc3,").unwrap()].matches('\n').count();
    folder.write("data.csv", strange);
    assert_eq!(
        folder.refusal(COMMAND),
        format!(
            "data.csv: row {row}, column `context`: `c9` is not a context of h.toml, which has `c0`, `c1`, `c2`, `c3`, `c4`"
        )
    );
    folder.write("data.csv", data.replace("\nc3,", "\nc2,"));
    assert_eq!(
        folder.refusal(COMMAND),
        "h.toml: `contexts`: `c3` has no row in data.csv; leave it and its row of `task_factor` out"
    );
    folder.write("data.csv", data.replacen("context", "load", 1));
    assert_eq!(
        folder.refusal(COMMAND),
        "data.csv: there is no column `context`, which says each row's context"
    );
    folder.write("data.csv", &data);
    assert_eq!(
        folder.refusal(&format!("{COMMAND} --context c1")),
        "--context c1: h.toml has `contexts`, so that rows of all of them are taken"
    );
    let of_one = text.split("contexts").next().unwrap();
    folder.write("h.toml", of_one);
    let several = folder.refusal(COMMAND);
    assert!(several.contains("a second context"), "{several}");
}
