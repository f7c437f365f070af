//! Every number of a small arm's fit against those of a program that shares nothing with this one.
//!
//! `fixtures/torque-model/real_robot`: each file says what it holds and how closely it is to be met.

use std::collections::BTreeMap;
use std::sync::Arc;

use faer::Mat;
use kernels::ContinuousJoints;
use puma_dyn::dynamics::inertial_parameters;
use puma_dyn::robot::next_hysteresis;
use puma_dyn::{Context, Model, Workspace, parse_urdf, regressor};

use super::correlation::{RunRows, correlation, correlation_of_run, least_correlation};
use super::fit::{Passes, fit_passes};
use super::log::{Log, moving, used_rows};
use super::{FitSettings, LOAD_STD, ParameterPosterior, TermSet, body_std, states_with_memory};
use crate::samples::{JointTorques, Samples};
use crate::timeline::{HysteresisColumns, Timeline};

const PARAMETERS: [&str; 10] = [
    "m", "mcx", "mcy", "mcz", "Ixx", "Ixy", "Iyy", "Ixz", "Iyz", "Izz",
];
const TERMS: [&str; 13] = [
    "qdd",
    "qd",
    "1",
    "v:0.005",
    "v:0.02",
    "v:0.05",
    "v:0.1",
    "v:0.3",
    "v:1",
    "z:0.0005",
    "z:0.002",
    "tz:0.0005",
    "tv",
];

fn text(name: &str) -> String {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../fixtures/torque-model/real_robot/"
    );
    std::fs::read_to_string(format!("{folder}{name}")).unwrap()
}

/// Rows of a table by the names of its columns.
fn table(name: &str) -> Vec<BTreeMap<String, String>> {
    let text = text(name);
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let fields = |line: &str| {
        let pairs = header.iter().zip(line.split(','));
        pairs
            .map(|(name, field)| ((*name).to_owned(), field.to_owned()))
            .collect()
    };
    lines.map(fields).collect()
}

fn number(row: &BTreeMap<String, String>, column: &str) -> f64 {
    row[column].parse().unwrap()
}

fn close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance,
        "{what}: {found}, not {expected}"
    );
}

fn arm() -> Arc<Model> {
    Arc::new(
        parse_urdf("planar2.urdf", &text("planar2.urdf"), None)
            .unwrap()
            .model,
    )
}

fn described(robot: &Model) -> Vec<f64> {
    inertial_parameters(robot, &Context::empty())
}

/// The samples in a table, with its hysteresis columns where it has them.
fn samples(name: &str) -> Samples {
    let rows = table(name);
    let mut samples = Samples {
        joint_names: vec!["joint1".to_owned(), "joint2".to_owned()],
        contexts: Vec::new(),
        context_of: Vec::new(),
        x: Mat::from_fn(rows.len(), 6, |row, col| {
            number(&rows[row], ["q1", "q2", "qd1", "qd2", "qdd1", "qdd2"][col])
        }),
        torques: (0..2)
            .map(|joint_idx| JointTorques {
                joint_idx,
                values: rows
                    .iter()
                    .map(|row| number(row, ["tau1", "tau2"][joint_idx]))
                    .collect(),
            })
            .collect(),
        timeline: Timeline {
            t: rows.iter().map(|row| number(row, "t")).collect(),
            ..Timeline::default()
        },
        continuous: ContinuousJoints::none(),
    };
    for row in &rows {
        let place = |names: &mut Vec<String>, name: &String| {
            names
                .iter()
                .position(|known| known == name)
                .unwrap_or_else(|| {
                    names.push(name.clone());
                    names.len() - 1
                })
        };
        samples
            .context_of
            .push(place(&mut samples.contexts, &row["context"]));
        samples
            .timeline
            .run_of
            .push(place(&mut samples.timeline.run_names, &row["run"]));
    }
    for (length, columns) in [(5e-4, ["z0.5_1", "z0.5_2"]), (2e-3, ["z2_1", "z2_2"])] {
        if rows[0].contains_key(columns[0]) {
            let z = rows
                .iter()
                .flat_map(|row| columns.map(|column| number(row, column)));
            samples.timeline.hysteresis.push(HysteresisColumns {
                length,
                z: z.collect(),
            });
        }
    }
    samples
}

/// The rows of some runs.
fn runs(all: &Samples, names: &[&str]) -> Samples {
    let is_kept =
        |row: &usize| names.contains(&all.timeline.run_names[all.timeline.run_of[*row]].as_str());
    let rows: Vec<usize> = (0..all.n_rows()).filter(is_kept).collect();
    let mut part = all.rows(&rows);
    let mut contexts: Vec<usize> = part.context_of.clone();
    contexts.dedup();
    part.context_of = (part.context_of.iter())
        .map(|context| contexts.iter().position(|of| of == context).unwrap())
        .collect();
    part.contexts = contexts
        .iter()
        .map(|context| all.contexts[*context].clone())
        .collect();
    part
}

fn settings(bare: &[&str], least_correlation: f64) -> FitSettings {
    FitSettings {
        bare: bare.iter().map(|name| (*name).to_owned()).collect(),
        least_correlation,
        ..FitSettings::default()
    }
}

fn fitted(samples: &Samples, settings: &FitSettings) -> Passes {
    let robot = arm();
    let log = Log::new(samples).unwrap();
    fit_passes(
        &robot,
        &described(&robot),
        &log,
        &[TermSet::Full; 2],
        settings,
    )
    .unwrap()
}

fn golden_fit() -> ParameterPosterior {
    let passes = fitted(&samples("c_train.csv"), &settings(&["free"], 0.1));
    passes.into_last().unwrap()
}

#[test]
fn hysteresis_of_a_run_with_stops_and_uneven_steps() {
    let rows = table("a_hysteresis.csv");
    let (mut short, mut long) = (0.0, 0.0);
    for (before, row) in rows.iter().zip(&rows[1..]) {
        let (step, qd) = (number(row, "t") - number(before, "t"), number(row, "qd"));
        short = next_hysteresis(short, qd, step, 5e-4);
        long = next_hysteresis(long, qd, step, 2e-3);
        close(short, number(row, "z_0.5mrad"), 1e-12, "0.5 mrad");
        close(long, number(row, "z_2mrad"), 1e-12, "2 mrad");
    }
}

#[test]
fn rows_that_count() {
    let rows = table("a_used_rows.csv");
    let column = |name: &str| -> Vec<f64> { rows.iter().map(|row| number(row, name)).collect() };
    let (t, qd) = (column("t"), column("qd"));
    let marks = |values: Vec<bool>| -> Vec<f64> {
        values
            .into_iter()
            .map(|value| f64::from(u8::from(value)))
            .collect()
    };
    let standing: Vec<bool> = moving(&t, &qd)
        .into_iter()
        .map(|is_moving| !is_moving)
        .collect();
    assert_eq!(marks(standing), column("standing"));
    assert_eq!(marks(used_rows(&t, &qd)), column("used"));
}

#[test]
fn rows_per_independent_row() {
    let residuals = table("b_residuals.csv");
    let expected = table("b_correlation.csv");
    let is_of = |row: &&BTreeMap<String, String>, case: &str, run: &str| {
        row["case"] == case && row["run"] == run
    };
    for total in expected.iter().filter(|row| row["run"] == "all") {
        let case = &total["case"];
        let of_runs = expected
            .iter()
            .filter(|row| row["case"] == *case && row["run"] != "all");
        let data: Vec<_> = of_runs
            .map(|row| {
                let rows = residuals.iter().filter(|of| is_of(of, case, &row["run"]));
                let used: Vec<bool> = rows.clone().map(|of| number(of, "used") > 0.5).collect();
                let x = rows
                    .zip(&used)
                    .map(|(of, used)| if *used { number(of, "x") } else { 0.0 });
                (
                    x.collect::<Vec<f64>>(),
                    used,
                    row["step_s"].parse().ok(),
                    number(row, "c"),
                )
            })
            .collect();
        let runs: Vec<RunRows<'_>> = (data.iter())
            .map(|(residuals, used, step, _)| RunRows {
                residuals,
                used,
                step: *step,
            })
            .collect();
        for (run, (.., c)) in runs.iter().zip(&data) {
            close(correlation_of_run(*run), *c, 1e-10 * c, case);
        }
        let steps: Vec<Option<f64>> = runs.iter().map(|run| run.step).collect();
        let c = number(total, "c");
        close(
            correlation(&runs, least_correlation(&steps, 0.3)),
            c,
            1e-10 * c,
            case,
        );
    }
}

#[test]
fn what_is_known_beforehand() {
    let described = described(&arm());
    let std = body_std(&described, false);
    for row in table("c_setup.csv") {
        let parameter = PARAMETERS
            .iter()
            .position(|name| *name == row["index"])
            .unwrap();
        let place = parameter + if row["of"] == "link2" { 10 } else { 0 };
        let found = match row["quantity"].as_str() {
            "pi0" => described[place],
            "pi_std" => std[place],
            _ => LOAD_STD[parameter],
        };
        let value = number(&row, "value");
        close(found, value, 1e-12 * value.abs(), &row["index"]);
    }
}

#[test]
fn what_is_made_of_the_rows_before_a_fit() {
    let (samples, robot) = (samples("c_train.csv"), arm());
    let described = described(&robot);
    let log = Log::new(&samples).unwrap();
    let unknowns = super::Unknowns::new(&robot, TermSet::Full.terms().to_vec());
    let states = states_with_memory(&samples, &unknowns)
        .unwrap()
        .into_owned();
    let mut workspace = Workspace::new(&robot);
    let mut matrix_at = |row: usize| {
        let at = |col: usize| samples.x[(row, col)];
        let mut matrix = vec![0.0; 40];
        let (q, qd, qdd) = ([at(0), at(1)], [at(2), at(3)], [at(4), at(5)]);
        regressor(&robot, &mut workspace, &q, &qd, &qdd, &mut matrix);
        matrix
    };
    let place_of = |row: &BTreeMap<String, String>| {
        let run = log.runs.iter().find(|run| run.name == row["run"]).unwrap();
        let at: usize = row["row"].parse().unwrap();
        (
            run.rows[at],
            run.span.start + at,
            row["joint"].parse::<usize>().unwrap() - 1,
        )
    };
    for row in table("c_rows.csv") {
        let (sample, place, joint) = place_of(&row);
        assert_eq!(log.is_used(place, joint), row["used"] == "1", "{row:?}");
        close(
            states[(sample, 6 + joint)],
            number(&row, "z_0.5mrad"),
            1e-10,
            "z",
        );
        close(
            states[(sample, 8 + joint)],
            number(&row, "z_2mrad"),
            1e-10,
            "z",
        );
        let y = &matrix_at(sample)[20 * joint..20 * (joint + 1)];
        let tau: f64 = y.iter().zip(&described).map(|(y, pi)| y * pi).sum();
        close(tau, number(&row, "tau_urdf"), 1e-10, "torque");
    }
    for row in table("c_regressor.csv") {
        let (sample, _, joint) = place_of(&row);
        let parameter = PARAMETERS
            .iter()
            .position(|name| *name == row["parameter"])
            .unwrap();
        let place = parameter + if row["link"] == "link2" { 10 } else { 0 };
        close(
            matrix_at(sample)[20 * joint + place],
            number(&row, "value"),
            1e-10,
            "regressor",
        );
    }
}

/// The unknown that a line of a table is about.
fn unknown(posterior: &ParameterPosterior, row: &BTreeMap<String, String>) -> usize {
    let unknowns = posterior.unknowns();
    let parameter = || {
        PARAMETERS
            .iter()
            .position(|name| *name == row["index"])
            .unwrap()
    };
    match row["quantity"].as_str() {
        "pi" => parameter() + if row["of"] == "link2" { 10 } else { 0 },
        "psi" => {
            let context = posterior
                .parts()
                .contexts
                .iter()
                .position(|of| *of == row["of"]);
            unknowns
                .load(posterior.load_of(context.unwrap()).unwrap())
                .start
                + parameter()
        }
        _ => {
            let joint = usize::from(row["of"] == "joint2");
            let term = TERMS.iter().position(|name| *name == row["index"]).unwrap();
            unknowns.friction(joint).start + term
        }
    }
}

#[test]
fn each_of_the_five_passes() {
    let passes = fitted(&samples("c_train.csv"), &settings(&["free"], 0.1)).posteriors;
    assert_eq!(passes.len(), 5);
    for row in table("c_passes.csv") {
        let posterior = &passes[row["pass"].parse::<usize>().unwrap() - 1];
        let (value, parts) = (number(&row, "value"), posterior.parts());
        let joint = usize::from(row["of"] == "joint2");
        let noise = || parts.joints[joint].as_ref().unwrap().noise;
        let (found, scale) = match row["quantity"].as_str() {
            "sigma" => (noise().std, value),
            "c" => (noise().correlation, value),
            "h" => (
                noise().profile[row["index"][3..].parse::<usize>().unwrap()],
                value,
            ),
            "theta_prior_std" => (parts.prior_std[unknown(posterior, &row)], value),
            _ => {
                let unknown = unknown(posterior, &row);
                let known = if row["quantity"] == "pi" {
                    parts.described[unknown]
                } else {
                    0.0
                };
                (
                    known + posterior.mean()[unknown],
                    value.abs().max(parts.prior_std[unknown]),
                )
            }
        };
        close(found, value, 1e-7 * scale, &format!("{row:?}"));
    }
}

#[test]
fn standard_deviations_of_the_parameters() {
    let posterior = golden_fit();
    let std = posterior.std();
    for row in table("c_posterior_std.csv") {
        let value = number(&row, "value");
        close(
            std[unknown(&posterior, &row)],
            value,
            1e-7 * value,
            &format!("{row:?}"),
        );
    }
}

/// Means and standard deviations of measurements at test states, (n,) of a joint.
fn predicted(posterior: &ParameterPosterior, context: &str, joint: usize) -> Vec<(f64, f64)> {
    let test = samples("c_test.csv");
    let x = states_with_memory(&test, posterior.unknowns())
        .unwrap()
        .into_owned();
    let names = &posterior.parts().contexts;
    let context = names.iter().position(|name| name == context).unwrap();
    let (mean, var) = posterior.predict_joint(joint, context, x.as_ref()).unwrap();
    let noise = posterior.parts().joints[joint].as_ref().unwrap().noise;
    let rows = mean.into_iter().zip(var).enumerate();
    rows.map(|(row, (mean, var))| (mean, (var + noise.var_at(x[(row, 2 + joint)])).sqrt()))
        .collect()
}

fn check_predictions(posterior: &ParameterPosterior, name: &str) {
    for row in table(name) {
        let at: usize = row["row"].parse().unwrap();
        for (joint, (mean, std)) in [("mean1", "std1"), ("mean2", "std2")].iter().enumerate() {
            let found = predicted(posterior, &row["context"], joint)[at];
            close(found.0, number(&row, mean), 1e-7, &format!("{row:?}"));
            close(found.1, number(&row, std), 1e-7, &format!("{row:?}"));
        }
    }
}

#[test]
fn predictions_in_each_context() {
    check_predictions(&golden_fit(), "c_predictions.csv");
}

#[test]
fn evidence_of_known_loads_and_of_an_unknown_one() {
    let evidence = golden_fit()
        .load_evidence(&samples("c_stretch.csv"))
        .unwrap();
    let (probabilities, of_unknown) = evidence.probabilities();
    let expected = table("c_evidence.csv");
    let all = evidence.of_contexts.iter().chain([&evidence.of_unknown]);
    for (row, (log, probability)) in expected
        .iter()
        .zip(all.zip(probabilities.iter().chain([&of_unknown])))
    {
        close(*log, number(row, "log_evidence"), 1e-5, &row["context"]);
        // Logarithms within 1e-5 are probabilities within a part of twice as much.
        let expected = number(row, "probability");
        close(*probability, expected, 2e-5 * expected, &row["context"]);
    }
}

fn adapted() -> Vec<ParameterPosterior> {
    let new = samples("c_new_load.csv");
    let grown = golden_fit().with_context("C").unwrap();
    grown.given_in_steps(grown.n_contexts() - 1, &new).unwrap()
}

#[test]
fn a_new_load_after_each_solution() {
    let steps = adapted();
    assert_eq!(steps.len(), 3);
    for row in table("c_adapt.csv") {
        let posterior = &steps[row["solve"].parse::<usize>().unwrap() - 1];
        let parameter = PARAMETERS
            .iter()
            .position(|name| *name == row["index"])
            .unwrap();
        let load = posterior
            .unknowns()
            .load(posterior.unknowns().n_loads() - 1)
            .start
            + parameter;
        let (place, known) = match row["quantity"].as_str() {
            "pi_link1" => (parameter, posterior.parts().described[parameter]),
            "pi_link2" => (10 + parameter, posterior.parts().described[10 + parameter]),
            _ => (load, 0.0),
        };
        let found = match row["quantity"].as_str() {
            "psi_std" => posterior.std()[place],
            _ => known + posterior.mean()[place],
        };
        let value = number(&row, "value");
        let scale = value.abs().max(posterior.parts().prior_std[place]);
        close(found, value, 1e-7 * scale, &format!("{row:?}"));
    }
    check_predictions(&steps[2], "c_adapt_predictions.csv");
}

#[test]
fn variances_of_low_rank() {
    let (fit, with_new) = (golden_fit(), adapted().pop().unwrap());
    let (train, test) = (samples("c_train.csv"), samples("c_test.csv"));
    for row in &table("c_low_rank.csv") {
        let posterior = if row["context"] == "C" {
            &with_new
        } else {
            &fit
        };
        let context = posterior
            .parts()
            .contexts
            .iter()
            .position(|of| *of == row["context"])
            .unwrap();
        let joint = row["joint"].parse::<usize>().unwrap() - 1;
        let low = posterior.low_rank(joint, context, &train).unwrap();
        assert_eq!(low.unknowns.len().to_string(), row["columns"], "{row:?}");
        assert_eq!(low.directions.nrows().to_string(), row["k"], "{row:?}");
        let x = states_with_memory(&test, posterior.unknowns())
            .unwrap()
            .into_owned();
        let at: usize = row["row"].parse().unwrap();
        let state = x.as_ref().subrows(at, 1);
        let (_, var) = posterior.predict_joint(joint, context, state).unwrap();
        let full = number(row, "variance_full");
        close(var[0], full, 1e-5 * full, &format!("{row:?}"));
        let entries = posterior.row_of(joint, context, state, &low.unknowns);
        let product = linalg::product(low.directions.as_ref(), entries.as_ref());
        let value = number(row, "variance_low_rank");
        close(
            product.col(0).squared_norm_l2(),
            value,
            1e-5 * value,
            &format!("{row:?}"),
        );
    }
}

/// The first forty rows of two runs.
fn short_runs(train: &Samples) -> Samples {
    let part = runs(train, &["f1", "a1"]);
    let (mut seen, mut rows) = (BTreeMap::new(), Vec::new());
    for row in 0..part.n_rows() {
        let count = seen.entry(part.timeline.run_of[row]).or_insert(0);
        *count += 1;
        if *count <= 40 {
            rows.push(row);
        }
    }
    part.rows(&rows)
}

/// The same rows without times, but with the states of hysteresis.
fn timeless(train: &Samples) -> Samples {
    let unknowns = super::Unknowns::new(&arm(), TermSet::Full.terms().to_vec());
    let states = states_with_memory(train, &unknowns).unwrap().into_owned();
    let of_length = |first: usize| -> Vec<f64> {
        (0..train.n_rows())
            .flat_map(|row| [states[(row, first)], states[(row, first + 1)]])
            .collect()
    };
    let mut timeless = train.clone();
    timeless.timeline.hysteresis = vec![
        HysteresisColumns {
            length: 5e-4,
            z: of_length(6),
        },
        HysteresisColumns {
            length: 2e-3,
            z: of_length(8),
        },
    ];
    timeless.timeline.t.clear();
    timeless
}

#[test]
fn fits_at_the_edges() {
    let train = samples("c_train.csv");
    let cases: [(&str, Samples, &[&str]); 6] = [
        ("one run f1", runs(&train, &["f1"]), &["free"]),
        (
            "one run a1, nothing declared bare",
            runs(&train, &["a1"]),
            &[],
        ),
        (
            "a1 b1, nothing declared bare",
            runs(&train, &["a1", "b1"]),
            &[],
        ),
        ("joint 2 never moves (f2)", runs(&train, &["f2"]), &["free"]),
        (
            "short runs (first 40 rows of f1 and a1)",
            short_runs(&train),
            &["free"],
        ),
        ("no time, z given", timeless(&train), &["free"]),
    ];
    let expected = table_of_quoted("c_edges.csv");
    let mut n_checked = 0;
    for (case, samples, bare) in cases {
        let posterior = fitted(&samples, &settings(bare, 0.3)).into_last().unwrap();
        for [_, quantity, of, value] in expected.iter().filter(|row| row[0] == case) {
            let value: f64 = value.parse().unwrap();
            let joint = usize::from(of.ends_with("joint2"));
            let noise = posterior.parts().joints[joint].as_ref().unwrap().noise;
            let found = match quantity.split_once(" in ") {
                None if quantity == "sigma" => noise.std,
                None => noise.correlation,
                Some((what, context)) => {
                    let row: usize = of.split(' ').nth(1).unwrap().parse().unwrap();
                    let (mean, std) = predicted(&posterior, context, joint)[row];
                    if what == "mean" { mean } else { std }
                }
            };
            close(
                found,
                value,
                1e-6 * value.abs(),
                &format!("{case}: {quantity} {of}"),
            );
            n_checked += 1;
        }
    }
    assert_eq!(n_checked, expected.len());
}

/// Rows of four fields, of which the first may hold commas.
fn table_of_quoted(name: &str) -> Vec<[String; 4]> {
    let text = text(name);
    let rows = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    let fields = |line: &str| {
        let mut parts: Vec<&str> = line.rsplitn(4, ',').collect();
        parts.reverse();
        [parts[0], parts[1], parts[2], parts[3]].map(|part| part.trim_matches('"').to_owned())
    };
    rows.map(fields).collect()
}

#[test]
fn friction_is_chosen_whatever_the_runs_are() {
    // The arm has smooth friction, memory, and friction that grows with the load.
    let choose = |samples: &Samples, bare: &[&str]| {
        let fitted = super::fit(&arm(), samples, None, &settings(bare, 0.3));
        fitted.unwrap().choice.unwrap()
    };
    let is_judged = |choice: &super::TermChoice| {
        let mut of_joints = choice.scores.iter().map(|(_, of_joints)| of_joints[0]);
        of_joints.all(|score| score.is_some())
    };
    let train = samples("c_train.csv");
    let of_six_runs = choose(&train, &["free"]);
    assert!(is_judged(&of_six_runs));
    assert!(of_six_runs.kept[0] >= TermSet::Standard, "{of_six_runs:?}");

    // One run for each of six loads: parts of the runs judge.
    let mut each = train.clone();
    each.contexts.clone_from(&train.timeline.run_names);
    each.context_of.clone_from(&train.timeline.run_of);
    assert!(is_judged(&choose(&each, &[])));
}
