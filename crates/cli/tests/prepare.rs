//! A log as a recorder wrote it, made into samples.

use std::fmt::Write as _;

use crate::command::Folder;

const RECORDED: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../fixtures/robot-log/gen3_recorded.csv"
);
const ROBOT: &str = concat!(
    env!("CARGO_MANIFEST_DIR"),
    "/../../fixtures/puma-dyn/gen3.urdf"
);

/// Two joints at 100 Hz, as libfranka names them.
fn log() -> String {
    let mut text = "t,q1,q2,dq1,dq2,tau1,tau2\n".to_owned();
    for k in 0..300 {
        let t = 0.01 * f64::from(k);
        let (a, b) = ((3.0 * t).sin(), (2.0 * t).cos());
        let (da, db) = (3.0 * (3.0 * t).cos(), -2.0 * (2.0 * t).sin());
        let _ = writeln!(text, "{t},{a},{b},{da},{db},{},{}", 2.0 * a + da, b);
    }
    text
}

#[test]
fn from_a_recorded_motion_to_a_model() {
    let folder = Folder::new();
    let said = folder.run(&format!(
        "prepare {RECORDED} --effort-unit Nm --time-unit ms --output samples.csv"
    ));
    assert!(said.contains("2294 rows at 1000"), "{said}");
    assert!(said.contains("230 rows written (every 10)"), "{said}");
    let samples = folder.read("samples.csv");
    let header = samples.lines().next().unwrap();
    assert!(
        header.starts_with("run,t,q1,") && header.ends_with(",use_7"),
        "{header}"
    );
    assert!(
        header.contains(",z0.5_1,") && header.contains(",z2_7,"),
        "{header}"
    );
    folder.run(&format!(
        "fit --model rbd --friction-terms tanh --robot {ROBOT} --data samples.csv --output arm.tgp"
    ));
    let (errors, _) = folder.evaluate("arm.tgp", "samples.csv");
    // Learned and judged on one motion: the torques are explained, whatever else.
    assert!(errors.iter().all(|nmse| *nmse < 0.5), "{errors:?}");
}

#[test]
fn a_guess_is_a_mapping_that_can_be_used() {
    let folder = Folder::new();
    folder.write("log.csv", log());
    folder.run("prepare log.csv --guess --output mapping.toml");
    let mapping = folder.read("mapping.toml");
    assert!(mapping.contains("velocity = \"dq{}\""), "{mapping}");
    assert!(mapping.contains("# effort_unit = \"?\""), "{mapping}");
    let refused = folder.refusal("prepare log.csv --mapping mapping.toml --output samples.csv");
    assert!(
        refused.contains("in which unit are the efforts (tau1, tau2)"),
        "{refused}"
    );
    folder.write(
        "mapping.toml",
        mapping.replace("# effort_unit = \"?\"", "effort_unit = \"mNm\""),
    );
    folder.run("prepare log.csv --mapping mapping.toml --context cube --output samples.csv");
    folder.run("prepare log.csv --effort-unit Nm --context cube --output other.csv");
    let tau = |name: &str| -> f64 {
        let text = folder.read(name);
        let mut rows = csv_rows(&text);
        let column = rows[0].iter().position(|name| name == "tau1").unwrap();
        assert_eq!(rows[1][0], "cube");
        rows.swap_remove(150)[column].parse().unwrap()
    };
    assert!((tau("other.csv") / tau("samples.csv") - 1000.0).abs() < 1e-5);
    folder.run("fit --model lrc --data other.csv --output m.tgp");
}

fn csv_rows(text: &str) -> Vec<Vec<String>> {
    let fields = |line: &str| line.split(',').map(str::to_owned).collect();
    text.lines().map(fields).collect()
}

#[test]
fn what_cannot_be_prepared_is_refused_and_leaves_nothing() {
    let folder = Folder::new();
    folder.write("log.csv", log());
    folder.write(
        "other.csv",
        log().replacen("q2,dq1,dq2,tau1,tau2", "q3,dq1,dq3,tau1,tau3", 1),
    );
    folder.write("back.csv", log().replacen("\n0.5,", "\n0.05,", 1));
    folder.write("names.csv", "a,b\n1,2\n");
    std::fs::create_dir(folder.path("empty")).unwrap();
    for (arguments, expected) in [
        ("log.csv --output log.csv", "it would be overwritten"),
        ("log.csv --effort-unit A --output s.csv", "--gain"),
        (
            "log.csv --effort-unit Nm --gain 2 --output s.csv",
            "take no gain",
        ),
        (
            "log.csv --effort-unit furlong --output s.csv",
            "`furlong` is no unit of efforts",
        ),
        (
            "log.csv --effort-unit Nm --cut-off 60 --output s.csv",
            "below half the rate",
        ),
        (
            "log.csv --effort-unit Nm --velocity speed{} --output s.csv",
            "no column `speed1`",
        ),
        (
            "log.csv other.csv --effort-unit Nm --output s.csv",
            "other.csv",
        ),
        (
            "back.csv --effort-unit Nm --output s.csv",
            "time runs backwards",
        ),
        ("names.csv --output s.csv", "--position"),
        ("absent.csv --output s.csv", "cannot read absent.csv"),
        (
            "log.csv --effort-unit Nm --time none --output s.csv",
            "--rate",
        ),
    ] {
        let refused = folder.refusal(&format!("prepare {arguments}"));
        assert!(refused.contains(expected), "{arguments}: {refused}");
    }
}

#[test]
fn a_log_that_was_not_prepared_is_known_as_one() {
    let folder = Folder::new();
    folder.write("log.csv", log());
    let refused = folder.refusal("fit --model lrc --data log.csv --output m.tgp");
    assert!(
        refused.contains("torque-gp prepare") && refused.contains("dq1 as speeds"),
        "{refused}"
    );
    folder.write("bag.db3", b"SQLite format 3\0\x10\n");
    let refused = folder.refusal("fit --model lrc --data bag.db3 --output m.tgp");
    assert!(refused.contains("torque-gp prepare"), "{refused}");
    let blanks: String = log()
        .lines()
        .skip(1)
        .map(|line| line.replace(',', " ") + "\n")
        .collect();
    folder.write("log.txt", blanks);
    let refused = folder.refusal("fit --model lrc --data log.txt --output m.tgp");
    assert!(
        refused.contains("not blanks") && refused.len() < 400,
        "{refused}"
    );
}
