//! `torque-gp control`: the loop closes with every feed-forward, and bad input is refused by name.

use serde_json::Value;

use crate::command::{Folder, column, fixture};

const LOAD: &str = "mass = 0.6\nsize = [0.191, 0.049, 0.13]\ncentre = [0.04, 0.027, 0.103]\nrpy = [1.058, -0.702, 2.681]\n";
const CONTROL: &str =
    "control --robot puma560 --payload c3.toml --reference short.csv --bandwidth 8";

const PENDULUM: &str = r#"<robot name="pendulum">
  <link name="base"/>
  <link name="rod">
    <inertial>
      <origin xyz="0.5 0 0"/>
      <mass value="2"/>
      <inertia ixx="0" ixy="0" ixz="0" iyy="0.25" iyz="0" izz="0.25"/>
    </inertial>
  </link>
  <joint name="hinge" type="continuous">
    <parent link="base"/>
    <child link="rod"/>
    <axis xyz="0 1 0"/>
  </joint>
</robot>
"#;

/// A folder with a run of a load, its first second, and the load.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.run("simulate --load c3 --path p2 --speed s4 --output run.csv");
    let text = folder.read("run.csv");
    let short: Vec<&str> = text.lines().take(801).collect();
    folder.write("short.csv", short.join("\n") + "\n");
    folder.write("c3.toml", LOAD);
    folder
}

/// RMS errors of the joints, rad.
fn errors(folder: &Folder, arguments: &str) -> Vec<f64> {
    let output = folder
        .command(&format!("{arguments} --json"))
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let summary: Value = serde_json::from_slice(&output.stdout).unwrap();
    let joints = summary["joints"].as_array().unwrap().iter();
    joints
        .map(|joint| joint["rms_error"].as_f64().unwrap())
        .collect()
}

#[test]
fn the_better_the_feed_forward_the_smaller_the_error() {
    let folder = folder();
    folder.run("simulate --load c3 --path p2 --speed s3 --output slower.csv");
    folder.run("fit --data slower.csv --model lrc --output lrc.tgp");
    let slower = folder.read("slower.csv");
    let rows: Vec<&str> = slower.lines().step_by(40).collect();
    folder.write("some.csv", rows.join("\n") + "\n");
    folder.run("fit --data some.csv --model rbd --robot puma560 --output rbd.tgp");
    let rms = |source: &str| {
        let errors = errors(&folder, &format!("{CONTROL} --feed-forward {source}"));
        assert_eq!(errors.len(), 6);
        errors.iter().map(|error| error * error).sum::<f64>().sqrt()
    };
    let [none, gravity, learned, exact] = ["none", "gravity", "lrc.tgp", "exact"].map(rms);
    assert!(
        exact < 0.1 * learned && learned < gravity && gravity < none,
        "{exact:e} {learned:e} {gravity:e} {none:e}"
    );
    // Parameters from 100 samples are nearly those that the robot has.
    let rigid_body = rms("rbd.tgp");
    assert!(
        rigid_body < 0.1 * learned,
        "{rigid_body:e} {learned:e} {exact:e}"
    );
    // The model knows the context that it was learned from, and no other.
    folder.run(&format!("{CONTROL} --feed-forward rbd.tgp --context c3"));
    let refused = folder.refusal(&format!("{CONTROL} --feed-forward rbd.tgp --context c4"));
    assert!(refused.contains("does not have it; it has"), "{refused}");
}

#[test]
fn the_output_holds_every_tick_and_the_law_of_the_controller() {
    let folder = folder();
    let gains = "--kp 200,300,100,20,20,20 --kd 40,60,20,4,4,4";
    let control = CONTROL.replace("--bandwidth 8", gains);
    folder.run(&format!(
        "{control} --feed-forward gravity --rate 500 --output ticks.csv"
    ));
    let text = folder.read("ticks.csv");
    assert!(
        text.starts_with("t,q1,q2,q3,q4,q5,q6,qd1,"),
        "{}",
        &text[..40]
    );
    let time = column(&text, "t");
    assert!(
        (time[1] - 2e-3).abs() < 1e-15 && time.len() == 499,
        "{}",
        time.len()
    );

    // At the rows of the reference the desired speeds are its own: every fifth row, 6.25 ms, is never a
    // tick of 2 ms but at 25 ms.
    let run = folder.read("short.csv");
    for joint in 1..=6 {
        let of = |name: &str| column(&text, &format!("{name}{joint}"));
        let (tau, forward, error, qd) = (of("tau"), of("tau_ff"), of("error"), of("qd"));
        let desired = column(&run, &format!("qd{joint}"));
        let (kp, kd) =
            [(200.0, 40.0), (300.0, 60.0), (100.0, 20.0), (20.0, 4.0)][(joint - 1).min(3)];
        for tick in (0..499).step_by(25) {
            let rate = desired[tick / 25 * 40] - qd[tick];
            let law = forward[tick] + kp * error[tick] + kd * rate;
            assert!(
                (tau[tick] - law).abs() < 1e-9,
                "joint {joint}: {} {law}",
                tau[tick]
            );
        }
    }
}

#[test]
fn a_pendulum_of_ones_own_rises_in_the_least_jerky_way() {
    let folder = Folder::new();
    folder.write("pendulum.urdf", PENDULUM);
    let motion = "t,q_hinge,qd_hinge,qdd_hinge\n0,0,0,0\n1,-1,0,0\n";
    folder.write("motion.csv", motion);
    let control = "control --robot pendulum.urdf --reference motion.csv --kp 50 --kd 10";
    folder.run(&format!(
        "{control} --feed-forward exact --output ticks.csv"
    ));
    let text = folder.read("ticks.csv");
    let (time, q) = (column(&text, "t"), column(&text, "q_hinge"));
    for (t, q) in time.iter().zip(q) {
        // The polynomial of degree five from rest to rest; the hold of a tick leaves some 1e-4 rad.
        let expected = -(10.0 * t.powi(3) - 15.0 * t.powi(4) + 6.0 * t.powi(5));
        assert!((q - expected).abs() < 1e-3, "{t}: {q} {expected}");
    }
}

#[test]
fn a_model_of_several_loads_is_asked_for_one() {
    let folder = Folder::new();
    folder.write("pendulum.urdf", PENDULUM);
    folder.write(
        "motion.csv",
        "t,q_hinge,qd_hinge,qdd_hinge\n0,0,0,0\n1,1,0,0\n",
    );
    let header = "context,q_hinge,qd_hinge,qdd_hinge,tau_hinge".to_owned();
    let row = |row: u32| {
        let (angle, load) = (f64::from(row) / 8.0 - 1.0, f64::from(1 + row % 2));
        let context = if row.is_multiple_of(2) { "one" } else { "two" };
        let torque = -9.81 * load * angle.cos();
        format!("{context},{angle},0.1,0.2,{torque}")
    };
    let lines: Vec<String> = std::iter::once(header).chain((0..24).map(row)).collect();
    let runs = lines.join("\n");
    folder.write("runs.csv", runs);
    folder.run("fit --data runs.csv --model mgp --rank 1 --output loads.tgp");
    let control = "control --robot pendulum.urdf --reference motion.csv --kp 50 --kd 10 --feed-forward loads.tgp";
    errors(&folder, &format!("{control} --context one"));
    let said = folder.refusal(control);
    assert!(
        said.contains("choose one with --context NAME: one, two"),
        "{said}"
    );
    let said = folder.refusal(&format!("{control} --context three"));
    assert!(
        said.contains("--context three: loads.tgp does not have it"),
        "{said}"
    );
    let said = folder.refusal(&format!("{control} --context one").replace("loads.tgp", "none"));
    assert!(said.contains("--context one is for model files"), "{said}");

    // A torque that there is none for stops the run with its cause.
    let far = "t,q_hinge,qd_hinge,qdd_hinge\n0,0,0,1e300\n1,1,0,0\n";
    folder.write("motion.csv", far);
    let said = folder.refusal(&format!("{control} --context one"));
    let cause = "loads.tgp: the desired state is so large that the torque of `hinge` is not a finite number";
    assert!(said.contains(cause), "{said}");
}

/// Each command is refused with its message.
fn refuse_all(folder: &Folder, cases: &[(String, &str)]) {
    for (arguments, message) in cases {
        let said = folder.refusal(arguments);
        assert!(said.contains(message), "{arguments}: {said}");
    }
}

#[test]
fn faults_of_the_reference_are_named() {
    let folder = folder();
    let short = folder.read("short.csv");
    let lines: Vec<&str> = short.lines().collect();
    folder.write("header.csv", lines[0]);
    folder.write("empty.csv", "");
    folder.write("one.csv", lines[..2].join("\n"));
    folder.write(
        "twice.csv",
        [lines[0], lines[1], lines[2], lines[2]].join("\n"),
    );
    folder.write("untimed.csv", short.replacen(",t,", ",time,", 1));
    let spoilt = lines[2].replacen("0.00125", "NaN", 1);
    folder.write("nan.csv", [lines[0], lines[1], &spoilt].join("\n"));
    folder.write(
        "pendulum.csv",
        "t,q_hinge,qd_hinge,qdd_hinge\n0,0,0,0\n1,1,0,0\n",
    );
    let time = lines[0].split(',').position(|name| name == "t").unwrap();
    let in_nanoseconds = |line: &&str| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(seconds) = fields[time].parse::<f64>() {
            fields[time] = (1e9 * seconds).to_string();
        }
        fields.join(",")
    };
    let rows: Vec<String> = lines.iter().map(in_nanoseconds).collect();
    folder.write("nanoseconds.csv", rows.join("\n"));
    let of = |file: &str| format!("{CONTROL} --feed-forward exact").replace("short.csv", file);
    refuse_all(
        &folder,
        &[
            (of("empty.csv"), "empty.csv: the file is empty"),
            (
                of("header.csv"),
                "header.csv: there is a header but no row below it",
            ),
            (
                of("one.csv"),
                "one.csv: reference motion: 1 samples of 6 joints",
            ),
            (
                of("twice.csv"),
                "sample 2 is at 0.00125 s and sample 3 at 0.00125 s",
            ),
            (of("untimed.csv"), "untimed.csv: there is no column `t`"),
            (of("nanoseconds.csv"), "times are in s, not ms or ns"),
            (
                of("nan.csv"),
                "nan.csv: row 2 (line 3), column `t` (time, s): NaN is not a finite",
            ),
            (of("none.csv"), "cannot read none.csv"),
            (of("pendulum.csv"), "columns of no joint of it: q_hinge"),
        ],
    );
}

#[test]
fn faults_of_the_feed_forward_are_named() {
    let folder = folder();
    let data = "q_hinge,qd_hinge,qdd_hinge,tau_hinge\n0,0,0,1\n1,0,0,2\n2,1,0,2\n";
    folder.write("pendulum.csv", data);
    folder.run("fit --data pendulum.csv --model lrc --output pendulum.tgp");
    let of = |source: &str| format!("{CONTROL} --feed-forward {source}");
    refuse_all(
        &folder,
        &[
            (
                of("pendulum.tgp"),
                "pendulum.tgp is a model of the joints hinge; the robot has joint1, joint2",
            ),
            (of("short.csv"), "short.csv: "),
            (
                of("nowhere.tgp"),
                "there is no such model file; beside files there are none, gravity",
            ),
            (
                of("pendulum.tgp --output pendulum.tgp"),
                "is the input pendulum.tgp",
            ),
        ],
    );
}

#[test]
fn faults_of_gains_and_rates_are_named() {
    let folder = folder();
    let exact = format!("{CONTROL} --feed-forward exact");
    let gains = |gains: &str| exact.replace("--bandwidth 8", gains);
    let more = |option: &str| format!("{exact} {option}");
    refuse_all(
        &folder,
        &[
            (
                gains("--kp 1,2 --kd 1,2"),
                "--kp has 2 gains, the robot has 6 joints: joint1, ",
            ),
            (
                gains("--bandwidth=-8"),
                "--bandwidth -8: a number that is not negative",
            ),
            (
                gains("--kp 1,1,1,1,1,1 --kd=1,1,-1,1,1,1"),
                "gain of joint `3`: damping is -1",
            ),
            (
                gains("--kp 1e9,1e9,1e9,1e9,1e9,1e9 --kd 1,1,1,1,1,1") + " --output ticks.csv",
                "the simulation stops at ",
            ),
            (more("--rate 0"), "--rate 0: ticks per second"),
            (more("--steps 0"), "--steps 0"),
            (more("--output short.csv"), "is the input short.csv"),
            (
                more("--output -"),
                "--output -: standard output has the summary",
            ),
            (
                more("--friction toolbox-2008"),
                "joint `joint1`: its Coulomb friction goes from",
            ),
        ],
    );
}

#[test]
fn friction_that_remembers_is_in_the_robot_and_in_its_exact_torques() {
    let folder = folder();
    let read = |name: &str| std::fs::read_to_string(fixture(name)).unwrap();
    folder.write("arm.urdf", read("puma560.urdf"));
    folder.write("plain.toml", read("puma560.toml"));
    let keys = "[joint.joint2]\nhysteresis = [{ length = 2e-3, torque = 20 }]\nload_viscous = 0.05";
    folder.write(
        "arm.toml",
        read("puma560.toml").replace("[joint.joint2]", keys),
    );
    let control =
        "control --robot arm.urdf --payload c3.toml --reference short.csv --bandwidth 8 --sidecar";
    let rms = |rest: &str| errors(&folder, &format!("{control} {rest}"))[1];
    let plain = rms("plain.toml --feed-forward gravity");
    let gravity = rms("arm.toml --feed-forward gravity");
    let exact = rms("arm.toml --feed-forward exact");
    assert!(
        gravity > 1.3 * plain && exact < 0.02 * gravity,
        "{plain} {gravity} {exact}"
    );
}
