//! `torque-gp inverse-dynamics`: golden torques end to end, and every form of input that means the same.

use std::f64::consts::{FRAC_PI_4, PI};

use crate::command::{Folder, column, fixture, state_header, states};

const Q_N: [f64; 6] = [0.0, FRAC_PI_4, PI, 0.0, FRAC_PI_4, 0.0];
const REST: [f64; 6] = [0.0; 6];
const ONES: [f64; 6] = [1.0; 6];

/// Golden torques of the Robotics Toolbox's own tests, in its printed digits (modern friction, gravity 9.81).
const GOLDEN: [([[f64; 6]; 3], &str); 5] = [
    (
        [Q_N, REST, REST],
        "0.0000 31.6399 6.0351 0.0000 0.0283 0.0000",
    ),
    (
        [Q_N, REST, ONES],
        "3.35311 36.0025 7.42596 0.190043 0.203441 0.194133",
    ),
    (
        [Q_N, ONES, ONES],
        "32.4952 60.867 17.7436 1.45452 1.29911 0.713781",
    ),
    (
        [Q_N, ONES, REST],
        "29.1421 56.5044 16.3528 1.26448 1.12392 0.519648",
    ),
    (
        [
            [0.0, FRAC_PI_4, -PI, 1.0, FRAC_PI_4, 0.0],
            [0.0, 1.0, 0.0, 0.0, 2.0, 0.0],
            [0.0, 1.0, 0.0, 0.0, 2.0, 0.0],
        ],
        "-0.9748 59.1306 5.9889 -0.0108 1.8872 0.0001",
    ),
];

fn golden_states() -> String {
    let rows: Vec<[f64; 18]> = GOLDEN
        .iter()
        .map(|(state, _)| state.concat().try_into().unwrap())
        .collect();
    states(&rows)
}

/// Checks the torque columns against printed numbers: half a unit of the last digit.
fn assert_printed(text: &str, tau: impl Fn(usize) -> String, printed: &[&str]) {
    for joint in 1..=6 {
        let found = column(text, &tau(joint));
        assert_eq!(found.len(), printed.len());
        for (row, (found, line)) in found.iter().zip(printed).enumerate() {
            let digits = line.split(' ').nth(joint - 1).unwrap();
            let decimals = i32::try_from(digits.split('.').next_back().unwrap().len()).unwrap();
            let expected: f64 = digits.parse().unwrap();
            let error = (found - expected).abs();
            assert!(
                error <= 0.500_001 * 10_f64.powi(-decimals),
                "row {row}, joint {joint}: {found} {expected}"
            );
        }
    }
}

fn golden_lines() -> Vec<&'static str> {
    GOLDEN.iter().map(|(_, line)| *line).collect()
}

#[test]
fn golden_torques_of_the_built_in_arm() {
    let folder = Folder::new();
    folder.write("states.csv", golden_states());
    let said =
        folder.run("inverse-dynamics --robot puma560 --input states.csv --output torques.csv");
    assert_printed(
        &folder.read("torques.csv"),
        |joint| format!("tau{joint}"),
        &golden_lines(),
    );
    assert_eq!(
        folder.read("torques.csv").lines().next(),
        Some("tau1,tau2,tau3,tau4,tau5,tau6")
    );
    assert!(
        said.contains(
            "note: 5 rows written to torques.csv (modern friction, rotor inertia, no payload)"
        ),
        "{said}"
    );
}

#[test]
fn golden_torques_of_the_arm_from_urdf_and_sidecar_by_joint_name() {
    let folder = Folder::new();
    let mut text = golden_states();
    for quantity in ["qdd", "qd", "q"] {
        for joint in 1..=6 {
            text = text.replacen(
                &format!("{quantity}{joint}"),
                &format!("{quantity}_joint{joint}"),
                1,
            );
        }
    }
    folder.write("states.csv", text);
    let (urdf, sidecar) = (fixture("puma560.urdf"), fixture("puma560.toml"));
    let arm = format!(
        "inverse-dynamics --robot {} --sidecar {}",
        urdf.display(),
        sidecar.display()
    );
    folder.run(&format!("{arm} --input states.csv --output torques.csv"));
    assert_printed(
        &folder.read("torques.csv"),
        |joint| format!("tau_joint{joint}"),
        &golden_lines(),
    );
}

#[test]
fn golden_torques_without_gravity_and_with_the_old_friction() {
    let folder = Folder::new();
    folder.write(
        "states.csv",
        states(&[[Q_N, ONES, ONES].concat().try_into().unwrap()]),
    );
    folder.run(
        "inverse-dynamics --robot puma560 --gravity 0,0,0 --input states.csv --output torques.csv",
    );
    let weightless = ["32.4952 29.2271 11.7085 1.45452 1.27086 0.713781"];
    assert_printed(
        &folder.read("torques.csv"),
        |joint| format!("tau{joint}"),
        &weightless,
    );

    folder.write(
        "states.csv",
        states(&[[Q_N, ONES, REST].concat().try_into().unwrap()]),
    );
    folder.run("inverse-dynamics --robot puma560 --friction toolbox-2008 --input states.csv --output torques.csv");
    let helped = ["-26.2151 47.0956 -1.8802 0.8582 0.7026 0.3066"];
    assert_printed(
        &folder.read("torques.csv"),
        |joint| format!("tau{joint}"),
        &helped,
    );
}

#[test]
fn a_sidecar_beside_the_robot_is_not_read_silently() {
    let folder = Folder::new();
    folder.write("arm.urdf", std::fs::read(fixture("puma560.urdf")).unwrap());
    folder.write("arm.toml", std::fs::read(fixture("puma560.toml")).unwrap());
    folder.write("states.csv", golden_states());
    let said = folder.run("inverse-dynamics --robot arm.urdf --input states.csv --output bare.csv");
    assert!(
        said.contains("note: arm.toml lies beside the robot and was not read"),
        "{said}"
    );
    assert!(
        said.contains("warning: arm.urdf: link `link1` is not physically consistent"),
        "{said}"
    );

    let said = folder.run(
        "inverse-dynamics --robot arm.urdf --sidecar arm.toml --input states.csv --output full.csv",
    );
    assert!(!said.contains("was not read"), "{said}");
    // Without motors the arm is the built-in one without friction and rotors.
    folder.run("inverse-dynamics --robot puma560 --friction none --no-rotor-inertia --input states.csv --output rigid.csv");
    assert_close(&folder.read("bare.csv"), &folder.read("rigid.csv"));
    let difference =
        column(&folder.read("full.csv"), "tau1")[2] - column(&folder.read("bare.csv"), "tau1")[2];
    assert!(difference > 25.0, "{difference}");
}

#[test]
fn a_reader_who_has_gone_is_no_failure() {
    let folder = Folder::new();
    folder.write("arm.urdf", std::fs::read(fixture("puma560.urdf")).unwrap());
    folder.write("states.csv", golden_states());
    // The reading ends are closed before the program starts: neither its warning nor its table can be written.
    let closed = || std::io::pipe().unwrap().1;
    let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_torque-gp"));
    command.args(["inverse-dynamics", "--robot", "arm.urdf"]);
    command.args(["--input", "states.csv", "--output", "-"]);
    command
        .current_dir(folder.path(""))
        .stdout(closed())
        .stderr(closed());
    assert_eq!(command.status().unwrap().code(), Some(0));
}

/// Same header and, to a few roundings, the same torques.
fn assert_close(a: &str, b: &str) {
    assert_eq!(a.lines().next(), b.lines().next());
    for name in a.lines().next().unwrap().split(',') {
        for (x, y) in column(a, name).into_iter().zip(column(b, name)) {
            assert!((x - y).abs() < 1e-12, "{name}: {x} {y}");
        }
    }
}

#[test]
fn the_sidecars_friction_convention_is_the_default_and_the_option_overrides_it() {
    let folder = Folder::new();
    let sidecar = std::fs::read_to_string(fixture("puma560.toml")).unwrap();
    folder.write(
        "old.toml",
        sidecar.replace("\"modern\"", "\"toolbox-2008\""),
    );
    folder.write(
        "states.csv",
        states(&[[Q_N, ONES, REST].concat().try_into().unwrap()]),
    );
    let arm = format!(
        "inverse-dynamics --robot {} --sidecar old.toml --input states.csv",
        fixture("puma560.urdf").display()
    );
    folder.run(&format!("{arm} --output old.csv"));
    assert!((column(&folder.read("old.csv"), "tau1")[0] + 26.2151).abs() < 5e-5);
    folder.run(&format!("{arm} --output modern.csv --friction modern"));
    assert!((column(&folder.read("modern.csv"), "tau1")[0] - 29.1421).abs() < 5e-5);
}

#[test]
fn column_order_blanks_quotes_bom_and_crlf_do_not_change_the_torques() {
    let folder = Folder::new();
    let plain = golden_states();
    folder.write("plain.csv", &plain);
    folder.run("inverse-dynamics --robot puma560 --input plain.csv --output expected.csv");

    let reversed: String = plain
        .lines()
        .map(|line| line.split(',').rev().collect::<Vec<_>>().join(",") + "\n")
        .collect();
    let blanks = plain.replace(',', " , ");
    let quotes = format!(
        "\"{}\"\n",
        plain
            .trim_end()
            .replace(',', "\",\"")
            .replace('\n', "\"\n\"")
    );
    let bom_crlf = format!("\u{feff}{}", plain.replace('\n', "\r\n"));
    let unended = plain.trim_end().to_owned();
    let spaced = plain.replace('\n', "\n\n");
    for (what, text) in [
        ("reversed", reversed),
        ("blanks", blanks),
        ("quotes", quotes),
        ("byte-order mark and CRLF", bom_crlf),
        ("no line end at the end", unended),
        ("empty lines", spaced),
    ] {
        folder.write("states.csv", text);
        folder.run("inverse-dynamics --robot puma560 --input states.csv --output torques.csv");
        assert_eq!(
            folder.read("torques.csv"),
            folder.read("expected.csv"),
            "{what}"
        );
    }
}

#[test]
fn other_columns_are_copied_as_they_are_before_the_torques() {
    let folder = Folder::new();
    let row = vec!["0.1"; 18].join(",");
    let text = format!(
        "t,{},note\n0.10,{row},\"a, \"\"b\"\"\"\n007,{row}, x \n",
        state_header()
    );
    folder.write("states.csv", text);
    folder.run("inverse-dynamics --robot puma560 --input states.csv --output torques.csv");
    let torques = folder.read("torques.csv");
    let lines: Vec<&str> = torques.lines().collect();
    assert_eq!(lines[0], "t,note,tau1,tau2,tau3,tau4,tau5,tau6");
    assert!(
        lines[1].starts_with("0.10,\"a, \"\"b\"\"\",") && lines[2].starts_with("007, x ,"),
        "{torques}"
    );

    folder.run(
        "inverse-dynamics --robot puma560 --keep-states --input states.csv --output torques.csv",
    );
    let expected = format!("t,{},note,tau1,tau2,tau3,tau4,tau5,tau6", state_header());
    assert_eq!(
        folder.read("torques.csv").lines().next(),
        Some(expected.as_str())
    );
}

#[test]
fn terms_are_added_and_sum_to_the_torque() {
    let folder = Folder::new();
    folder.write("states.csv", golden_states());
    folder.write(
        "load.toml",
        "mass = 2.0\ncentre = [0.1, 0, 0.1]\nsize = [0.1, 0.2, 0.3]\n",
    );
    folder.run("inverse-dynamics --robot puma560 --payload load.toml --terms --input states.csv --output torques.csv");
    let text = folder.read("torques.csv");
    for joint in 1..=6 {
        let terms = [
            "inertia", "coriolis", "gravity", "payload", "friction", "rotor",
        ];
        let terms = terms.map(|term| column(&text, &format!("tau{joint}_{term}")));
        for (row, tau) in column(&text, &format!("tau{joint}"))
            .into_iter()
            .enumerate()
        {
            let sum: f64 = terms.iter().map(|term| term[row]).sum();
            assert!(
                (sum - tau).abs() < 1e-12,
                "row {row}, joint {joint}: {sum} {tau}"
            );
        }
    }
    // q̇ = 0 has no Coriolis and no friction torque; the payload weighs.
    assert!(
        column(&text, "tau2_coriolis")[0].abs() < 1e-15
            && column(&text, "tau2_friction")[0].abs() <= 0.0
    );
    assert!(column(&text, "tau2_payload")[0].abs() > 1.0);
}

#[test]
fn standard_input_and_output() {
    let folder = Folder::new();
    let output = folder
        .command("inverse-dynamics --robot puma560 --input - --output -")
        .write_stdin(golden_states())
        .output()
        .unwrap();
    assert!(output.status.success());
    assert_printed(
        &String::from_utf8(output.stdout).unwrap(),
        |joint| format!("tau{joint}"),
        &golden_lines(),
    );
}

#[test]
fn an_old_output_is_replaced_and_only_on_success() {
    let folder = Folder::new();
    folder.write("torques.csv", "old\n");
    folder.write("states.csv", golden_states().replace("0.0", "zero"));
    folder.refuse("inverse-dynamics --robot puma560 --input states.csv --output torques.csv");
    assert_eq!(folder.read("torques.csv"), "old\n");
    folder.write("states.csv", golden_states());
    folder.run("inverse-dynamics --robot puma560 --input states.csv --output torques.csv");
    assert!(folder.read("torques.csv").starts_with("tau1,"));
}

#[test]
fn angles_that_look_like_degrees_are_warned_of() {
    let folder = Folder::new();
    let mut row = [0.0; 18];
    row[1] = -45.0;
    folder.write("states.csv", states(&[row; 3]));
    let said =
        folder.run("inverse-dynamics --robot puma560 --input states.csv --output torques.csv");
    let expected = "warning: column `q2` (joint2): 3 of 3 values are more than a full turn (largest magnitude 45); \
                    angles must be in radians: if these are degrees, multiply q, qd and qdd by π/180";
    assert!(said.contains(expected), "{said}");
    assert!(!said.contains("q1"), "{said}");

    row[1] = 1.0;
    folder.write("states.csv", states(&[row; 3]));
    let said =
        folder.run("inverse-dynamics --robot puma560 --input states.csv --output torques.csv");
    assert!(!said.contains("degrees"), "{said}");
}

/// A turning and a sliding joint with limits.
const SLIDER: &str = r#"<robot name="slider">
  <link name="base"/>
  <link name="arm"><inertial><mass value="2"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <link name="hand"><inertial><mass value="1"/><inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
  <joint name="turn" type="revolute"><parent link="base"/><child link="arm"/><axis xyz="0 0 1"/>
    <limit lower="-1.5" upper="1.5" effort="10" velocity="1"/></joint>
  <joint name="slide" type="prismatic"><parent link="arm"/><child link="hand"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="0.5" effort="10" velocity="1"/></joint>
</robot>"#;

#[test]
fn angles_outside_the_joints_limits_are_warned_of_and_sliding_joints_are_in_metres() {
    let folder = Folder::new();
    folder.write("slider.urdf", SLIDER);
    folder.write(
        "states.csv",
        "q_turn,q_slide,qd_turn,qd_slide,qdd_turn,qdd_slide\n5,9,0,0,0,1\n4,9,0,0,0,1\n",
    );
    let said =
        folder.run("inverse-dynamics --robot slider.urdf --input states.csv --output torques.csv");
    assert!(
        said.contains(
            "`q_turn` (turn): 2 of 2 values are outside the joint's limits -1.5 … 1.5 rad"
        ),
        "{said}"
    );
    assert!(!said.contains("q_slide"), "{said}");
    // 1 kg lifted with 1 m/s² against 9.81 m/s².
    assert!((column(&folder.read("torques.csv"), "tau_slide")[0] - 10.81).abs() < 1e-14);

    folder.write(
        "states.csv",
        "q_turn,q_slide,qd_turn,qd_slide,qdd_turn,qdd_slide\n0,0,0,up,0,0\n",
    );
    let message = folder
        .refusal("inverse-dynamics --robot slider.urdf --input states.csv --output torques.csv");
    assert_eq!(
        message,
        "states.csv: row 1 (line 2), column `qd_slide` (slide, m/s): `up` is not a number"
    );
}

#[test]
fn columns_of_joints_that_the_robot_does_not_have_are_copied_with_a_warning() {
    let folder = Folder::new();
    folder.write("slider.urdf", SLIDER);
    folder.write(
        "states.csv",
        "q_turn,q_slide,qd_turn,qd_slide,qdd_turn,qdd_slide,q_gripper\n0,0,0,0,0,0,0.25\n",
    );
    let said =
        folder.run("inverse-dynamics --robot slider.urdf --input states.csv --output torques.csv");
    assert!(
        said.contains(
            "warning: states.csv: copied, not used, because the robot has no such joint: q_gripper"
        ),
        "{said}"
    );
    assert!(
        folder
            .read("torques.csv")
            .starts_with("q_gripper,tau_turn,tau_slide\n0.25,")
    );
}

#[test]
fn strict_refuses_a_robot_that_no_rigid_bodies_can_form() {
    let folder = Folder::new();
    folder.write("states.csv", golden_states());
    let urdf = fixture("puma560.urdf");
    for robot in ["puma560", urdf.to_str().unwrap()] {
        let message = folder.refusal(&format!(
            "inverse-dynamics --strict --robot {robot} --input states.csv --output torques.csv"
        ));
        assert!(
            message.contains("`link1` is not physically consistent"),
            "{message}"
        );
    }
}
