//! Everything a user can get wrong: one message with its place, status 2, no output file.

use crate::command::{Folder, fixture, state_header, states};

const RUN: &str = "inverse-dynamics --robot puma560 --input states.csv --output torques.csv";

/// The message for a state file.
fn message(text: impl AsRef<[u8]>) -> String {
    let folder = Folder::new();
    folder.write("states.csv", text);
    folder.refusal(RUN)
}

/// A state file of three rows of ones, with one field replaced.
fn with_field(row: usize, column: usize, field: &str) -> String {
    let mut lines: Vec<Vec<String>> = vec![vec!["1.0".to_owned(); 18]; 3];
    field.clone_into(&mut lines[row - 1][column - 1]);
    let lines = lines.iter().map(|line| line.join(","));
    std::iter::once(state_header())
        .chain(lines)
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn fields_that_are_not_finite_numbers() {
    for (field, problem) in [
        ("abc", "`abc` is not a number"),
        ("1.0.0", "`1.0.0` is not a number"),
        ("", "the field is empty"),
        ("  ", "the field is empty"),
        ("nan", "NaN is not a finite number"),
        ("-inf", "-inf is not a finite number"),
        ("1e999", "inf is not a finite number"),
    ] {
        let expected =
            format!("states.csv: row 2 (line 3), column `qd2` (joint2, rad/s): {problem}");
        assert_eq!(message(with_field(2, 8, field)), expected);
    }
    assert!(message(with_field(3, 1, "x")).contains("row 3 (line 4), column `q1` (joint1, rad)"));
    assert!(
        message(with_field(1, 18, "x")).contains("row 1 (line 2), column `qdd6` (joint6, rad/s²)")
    );
}

#[test]
fn rows_that_are_too_short_or_too_long() {
    assert_eq!(
        message(with_field(2, 18, "1,2")),
        "states.csv: row 2 (line 3) has 19 fields, the header has 18"
    );
    let short = with_field(3, 18, "").trim_end_matches(',').to_owned();
    assert_eq!(
        message(short),
        "states.csv: row 3 (line 4) has 17 fields, the header has 18"
    );
}

#[test]
fn files_without_rows_or_header() {
    assert!(message("").starts_with("states.csv: the file is empty"));
    assert!(message("\n\n").starts_with("states.csv: the file is empty"));
    assert!(message("\u{feff}").starts_with("states.csv: the file is empty"));
    assert_eq!(
        message(state_header()),
        "states.csv: there is a header but no row below it"
    );
    assert_eq!(
        message(state_header() + "\n\n"),
        "states.csv: there is a header but no row below it"
    );
    let headless = states(&[[0.5; 18]]).lines().skip(1).collect::<String>();
    assert!(message(headless).starts_with("states.csv: line 1 holds numbers, not column names"));
}

#[test]
fn missing_columns_are_all_listed_with_what_was_found() {
    let text = states(&[[0.5; 18]])
        .replacen("qd5,", "velocity,", 1)
        .replacen("qdd6", "qdd_6", 1);
    let message = message(text);
    assert!(
        message.starts_with("states.csv: missing columns: qd5, qdd6; found: q1, q2, "),
        "{message}"
    );
    assert!(
        message.contains("velocity")
            && message.contains("The robot has 6 joints (joint1, joint2, "),
        "{message}"
    );
}

#[test]
fn other_separators_are_recognised() {
    let text = states(&[[0.5; 18]]);
    assert!(
        message(text.replace(',', ";")).ends_with("separate the columns by commas, not semicolons")
    );
    assert!(message(text.replace(',', "\t")).ends_with("separate the columns by commas, not tabs"));
}

#[test]
fn a_column_that_appears_twice() {
    let text = states(&[[0.5; 18]]).replacen("qd5", "q3", 1);
    assert_eq!(
        message(text),
        "states.csv: column `q3` appears twice, as column 3 and column 11"
    );
}

#[test]
fn states_by_number_and_by_name_at_once() {
    let text = states(&[[0.5; 18]]).replacen("qd5", "qd_joint5", 1);
    let expected = "states.csv: states are given both by number (q1, …) and by joint name (qd_joint5, …); keep one of the two";
    assert_eq!(message(text), expected);
}

#[test]
fn a_file_of_another_robot() {
    let folder = Folder::new();
    let seven: Vec<String> = ["q", "qd", "qdd"]
        .iter()
        .flat_map(|x| (1..=7).map(move |j| format!("{x}{j}")))
        .collect();
    folder.write(
        "states.csv",
        format!("{}\n{}\n", seven.join(","), ["0"; 21].join(",")),
    );
    let message = folder.refusal(RUN);
    assert!(
        message.contains("the robot has only 6 joints (joint1, ")
            && message.contains("there is also: q7, qd7, qdd7"),
        "{message}"
    );

    folder.write("states.csv", states(&[[0.5; 18]]));
    let gen3 = fixture("puma-dyn/gen3.urdf");
    let message = folder.refusal(&RUN.replace("puma560", gen3.to_str().unwrap()));
    assert!(
        message.contains("missing columns: q7, qd7, qdd7;")
            && message.contains("The robot has 7 joints ("),
        "{message}"
    );

    let named = states(&[[0.5; 18]]);
    let named = ["qdd", "qd", "q"].iter().fold(named, |text, x| {
        (1..=6).fold(text, |text, j| {
            text.replacen(&format!("{x}{j}"), &format!("{x}_elbow{j}"), 1)
        })
    });
    folder.write("states.csv", named);
    let message = folder.refusal(RUN);
    assert!(
        message.contains("missing columns: q_joint1, ")
            && message.contains("columns of no joint of it: q_elbow1, "),
        "{message}"
    );
}

#[test]
fn text_that_is_not_utf8() {
    let mut bytes = with_field(2, 3, "1.0").into_bytes();
    let at = bytes.iter().rposition(|&byte| byte == b'\n').unwrap();
    bytes[at + 1] = 0xff;
    assert_eq!(message(bytes), "states.csv: line 4: the text is not UTF-8");
}

#[test]
fn paths_that_cannot_be_read_or_written() {
    let folder = Folder::new();
    let said = folder.refusal(RUN);
    assert!(
        said.starts_with("cannot read states.csv: No such file"),
        "{said}"
    );

    folder.write("states.csv", states(&[[0.5; 18]]));
    let said = folder.refusal(&RUN.replace("torques.csv", "nowhere/torques.csv"));
    assert_eq!(
        said,
        "cannot write nowhere/torques.csv: the directory nowhere does not exist"
    );

    std::fs::create_dir(folder.path("folder")).unwrap();
    let said = folder.refusal(&RUN.replace("torques.csv", "folder"));
    assert_eq!(said, "cannot write folder: it is a directory");
    let said = folder.refusal(&RUN.replace("states.csv", "folder"));
    assert_eq!(said, "cannot read folder: it is a directory");

    let said = folder.refusal(&RUN.replace("puma560", "arm.urdf"));
    assert_eq!(
        said,
        "--robot arm.urdf: there is no such file, and the only built-in robot is puma560"
    );
    let said = folder.refusal(&format!("{RUN} --payload load.toml"));
    assert!(said.starts_with("cannot read load.toml: "), "{said}");
}

#[test]
fn an_output_that_is_an_input() {
    let folder = Folder::new();
    folder.write("states.csv", states(&[[0.5; 18]]));
    folder.write(
        "load.toml",
        "mass = 1.0\ncentre = [0, 0, 0]\nsize = [0.1, 0.1, 0.1]\n",
    );
    for (run, input) in [
        (RUN.replace("torques.csv", "states.csv"), "states.csv"),
        (RUN.replace("torques.csv", "./states.csv"), "states.csv"),
        (
            format!(
                "{} --payload load.toml",
                RUN.replace("torques.csv", "load.toml")
            ),
            "load.toml",
        ),
    ] {
        let said = folder.refusal(&run);
        assert!(
            said.contains(&format!("is the input {input}: it would be overwritten")),
            "{said}"
        );
    }
}

#[test]
fn a_torque_column_in_the_input_needs_another_name_for_the_result() {
    let folder = Folder::new();
    folder.write("states.csv", states(&[[0.5; 18]]).replace('\n', ",tau1\n"));
    let said = folder.refusal(RUN);
    assert!(
        said.starts_with("states.csv: already has the result's columns tau1; "),
        "{said}"
    );
    assert!(said.contains("--tau-prefix model_tau"), "{said}");
}

#[test]
fn options_that_do_not_fit_together() {
    let folder = Folder::new();
    folder.write("states.csv", states(&[[0.5; 18]]));
    folder.write("motors.toml", "");
    let said = folder.refusal(&format!("{RUN} --sidecar motors.toml"));
    assert!(said.contains("--sidecar goes with a URDF file"), "{said}");
    let said = folder.refusal(&RUN.replace("torques.csv", "torques.parquet"));
    assert!(said.contains("inverse-dynamics writes CSV"), "{said}");
    for wrong in [
        "--friction dry",
        "--gravity 0,0",
        "--gravity 0,0,nan",
        "--unknown",
    ] {
        let said = folder.refuse(&format!("{RUN} {wrong}"));
        assert!(
            said.starts_with("error: ") && said.contains(wrong.split(' ').next().unwrap()),
            "{said}"
        );
    }
}

#[test]
fn a_robot_file_that_is_refused_names_the_file() {
    let folder = Folder::new();
    folder.write("states.csv", states(&[[0.5; 18]]));
    folder.write(
        "arm.urdf",
        "<robot name='x'>\n<link name='a'/><link name='b'/></robot>",
    );
    let said = folder.refusal(&RUN.replace("puma560", "arm.urdf"));
    assert!(
        said.contains("arm.urdf") && said.contains("2 root links"),
        "{said}"
    );
    folder.write("motors.toml", "[joint.nose]\nviscous_joint = 1\n");
    let arm = fixture("puma560.urdf");
    let said = folder.refusal(&format!(
        "{} --sidecar motors.toml",
        RUN.replace("puma560", arm.to_str().unwrap())
    ));
    assert!(
        said.contains("motors.toml") && said.contains("nose"),
        "{said}"
    );
}
