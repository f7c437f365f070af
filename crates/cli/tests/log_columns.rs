//! What the command says of the optional columns of a log: `run`, `t`, `z<δ>_<joint>`, `use_<joint>`.

use std::fmt::Write;

use crate::command::Folder;

const FIT: &str = "fit --data log.csv --model lrc --output model.tgp";

/// A log of one joint with further columns, a row for each text of their fields.
fn log(header: &str, fields: &[&str]) -> String {
    let mut text = format!("{header},q1,qd1,qdd1,tau1\n");
    for (idx, fields) in fields.iter().enumerate() {
        let x = f64::from(u32::try_from(idx).unwrap());
        let (q, qd, qdd) = (0.1 * x, x.sin(), x.cos());
        let tau = 2.0 * qdd + qd;
        writeln!(text, "{fields},{q},{qd},{qdd},{tau}").unwrap();
    }
    text
}

fn folder(header: &str, fields: &[&str]) -> Folder {
    let folder = Folder::new();
    folder.write("log.csv", log(header, fields));
    folder
}

#[test]
fn logs_that_are_in_order_are_read() {
    for (header, fields) in [
        ("t", ["0", "1", "2", "0", "1"]), // a fall begins a run
        ("run,t", ["a,0", "b,0", "a,1", "b,2", "a,1.5"]),
        (
            "context,run,t",
            ["c,a,0", "c,a,1", "c,b,0", "c,b,1", "c,b,2"],
        ),
        (
            "z0.5_1,use_1",
            ["1.0000000009,1", "-1,0", "0,1.0", "0.5,0", "1,1"],
        ),
        (
            "z2_joint1,use_joint1",
            ["1,1", "-1,0", "0,1", "0.5,0", "1,1"],
        ),
        ("z_1,z1_elbow,used", ["x,y,z"; 5]), // of no joint
    ] {
        folder(header, &fields).run(FIT);
    }
}

#[test]
fn fields_that_are_refused_are_named() {
    for (header, fields, expected) in [
        (
            "run",
            ["a", " ", "a"],
            "row 2 (line 3), column `run`: the field is empty",
        ),
        (
            "t",
            ["0", "x", "1"],
            "row 2 (line 3), column `t` (time, s): `x` is not a number",
        ),
        (
            "t",
            ["0", "1", "1"],
            "row 3 (line 4), column `t` (time, s): time 1 s does not come after 1 s",
        ),
        (
            "run,t",
            ["a,0", "b,0", "a,-0.5"],
            "row 3 (line 4), column `t` (time, s): run `a`: time -0.5 s does not come after 0 s",
        ),
        (
            "context,run,t",
            ["c,a,0", "c,a,2", "c,a,2"],
            "row 3 (line 4), column `t` (time, s): run `a` of context `c`: time 2 s does not come after 2 s",
        ),
        (
            "z0.5_1",
            ["0", "1.000001", "0"],
            "row 2 (line 3), column `z0.5_1` (joint1, from −1 to 1): 1.000001 is not within −1 and 1",
        ),
        (
            "use_1",
            ["0", "1", "2"],
            "row 3 (line 4), column `use_1` (joint1, 0 or 1): `2` is neither 0 nor 1",
        ),
        (
            "z0_1",
            ["0"; 3],
            "column `z0_1`: a hysteresis length of 0 mrad; it must be above zero",
        ),
        (
            "z2_1,z2.0_1",
            ["0,0"; 3],
            "columns z2_… and z2.0_… hold hysteresis states of the same length",
        ),
    ] {
        let said = folder(header, &fields).refusal(FIT);
        assert_eq!(said, format!("log.csv: {expected}"));
    }
}

#[test]
fn columns_of_some_joints_only_are_refused() {
    for quantity in ["z0.5", "use"] {
        let header = format!("q1,q2,qd1,qd2,qdd1,qdd2,tau1,{quantity}_1\n");
        let folder = Folder::new();
        folder.write(
            "log.csv",
            format!("{header}1,2,3,4,5,6,7,1\n2,1,3,5,4,6,7,1\n"),
        );
        let said = folder.refusal(FIT);
        let expected = format!("log.csv: missing column: {quantity}_2; found: ");
        assert!(said.starts_with(&expected), "{said}");
    }
}

#[test]
fn columns_of_no_complete_joint_are_ignored_with_a_warning() {
    let text = log("q_cmd1,qd_cmd1", &["0,x"; 5]);
    let named = text.replace(",q1,qd1,qdd1,tau1", ",q_hinge,qd_hinge,qdd_hinge,tau_hinge");
    for text in [text, named.replace("cmd1", "cmd_hinge")] {
        let folder = Folder::new();
        folder.write("log.csv", text);
        let said = folder.run(FIT);
        let expected = "columns that belong to no complete joint are ignored: q_cmd";
        assert!(said.contains(expected), "{said}");
    }
    // A torque without its joint's acceleration is rather a mistake.
    let folder = Folder::new();
    folder.write(
        "log.csv",
        named
            .replace("_cmd1", "_elbow")
            .replace("\n0,x", "\n0,1")
            .replace("q_elbow,qd_elbow", "q_elbow,tau_elbow"),
    );
    let said = folder.refusal(FIT);
    assert!(
        said.starts_with("log.csv: missing columns: qd_elbow, qdd_elbow; "),
        "{said}"
    );
}

#[test]
fn options_of_the_robots_parameters_go_with_them_alone() {
    let folder = folder("context", &["c"; 5]);
    for option in ["--bare c", "--friction-terms signs"] {
        let said = folder.refusal(&format!("{FIT} {option}"));
        let name = option.split(' ').next().unwrap();
        assert_eq!(said, format!("{name} goes with --model rbd, not lrc"));
    }
}

#[test]
fn evaluate_says_the_number_of_rows_twice() {
    let folder = folder("t", &["0", "1", "2", "0", "1"]);
    folder.run(FIT);
    let evaluate = folder.command("evaluate --model model.tgp --data log.csv --json");
    let json = { evaluate }.output().unwrap().stdout;
    let json: serde_json::Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(
        (json["rows"].as_u64(), json["n_samples"].as_u64()),
        (Some(5), Some(5))
    );
}
