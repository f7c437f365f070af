//! Joints that turn without end: by option, by a URDF, by positions that fill a turn.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;

use crate::command::Folder;

/// A swivel that turns without end and a slide on it.
const SWIVEL: &str = r#"<robot name="swivel"><link name="base"/>
<joint name="swivel" type="continuous"><parent link="base"/><child link="a"/><axis xyz="0 1 0"/></joint>
<link name="a"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="slide" type="prismatic"><parent link="a"/><child link="b"/><axis xyz="1 0 0"/>
<limit lower="-4" upper="4" effort="1" velocity="1"/></joint>
<link name="b"><inertial><origin xyz="0 0 0"/><mass value="1"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"#;

const HEADER: &str =
    "context,q_swivel,q_slide,qd_swivel,qd_slide,qdd_swivel,qdd_slide,tau_swivel,tau_slide\n";

/// Rows under a load; the swivel goes round once, some turns further, and the slide over its width.
fn rows(context: &str, load: f64, n: u32, seed: f64, turns: f64, width: f64) -> String {
    let mut text = String::new();
    for row in 0..n {
        let phase = f64::from(row) + seed;
        let part = (f64::from(row) + 0.5) / f64::from(n);
        // All around in steps of equal size, in no order.
        let angle = TAU * (17.0 * part).fract() - PI;
        let (slide, qd, sd) = (
            width * phase.sin(),
            (1.3 * phase).cos(),
            (2.1 * phase).sin(),
        );
        let (qdd, sdd) = (2.0 * (0.7 * phase).sin(), (1.9 * phase).cos());
        let mass = 1.0 + load;
        let swivel = (2.0 + mass) * qdd + 9.81 * (1.0 + mass) * angle.cos() + 0.3 * qd.signum();
        let force = mass * (sdd - 9.81 * angle.sin()) + 0.5 * sd;
        let angle = angle + TAU * turns;
        writeln!(
            text,
            "{context},{angle:?},{slide:?},{qd:?},{sd:?},{qdd:?},{sdd:?},{swivel:?},{force:?}"
        )
        .unwrap();
    }
    text
}

fn log(turns: f64, width: f64) -> String {
    HEADER.to_owned() + &rows("a", 0.0, 101, 0.0, turns, width)
}

fn of_two_loads(n: u32, seed: f64, turns: f64) -> String {
    let loads = [("a", 0.0), ("b", 1.5)];
    let rows = loads.map(|(name, load)| rows(name, load, n, seed, turns, 0.3));
    HEADER.to_owned() + &rows.concat()
}

#[test]
fn positions_that_fill_a_turn_are_said_to_and_a_turn_further_is_the_same() {
    let folder = Folder::new();
    folder.write("train.csv", log(0.0, 0.3));
    folder.write("test.csv", log(1.0, 0.3));
    let said = folder.run("fit --data train.csv --output m.tgp");
    let expected = "note: train.csv: the positions of `swivel` fill a turn (";
    assert!(said.contains(expected), "{said}");
    assert!(said.contains("--continuous none if it is not"), "{said}");
    assert!(!said.contains("`slide` fill"), "{said}");
    let (errors, said) = folder.evaluate("m.tgp", "test.csv");
    assert!(errors.iter().all(|nmse| *nmse < 1e-4), "{errors:?}");
    // Neither outside the range nor degrees.
    assert!(!said.contains("warning"), "{said}");
    let said =
        folder.run("predict --model m.tgp --input test.csv --tau-prefix learned --output p.csv");
    assert!(!said.contains("warning"), "{said}");

    let said = folder.run("fit --data train.csv --continuous none --output as_given.tgp");
    assert!(!said.contains("fill a turn"), "{said}");
    let (errors, said) = folder.evaluate("as_given.tgp", "test.csv");
    assert!(errors.iter().all(|nmse| *nmse > 0.1), "{errors:?}");
    assert!(said.contains("outside the range"), "{said}");
}

#[test]
fn a_log_of_several_turns_needs_to_be_told() {
    let folder = Folder::new();
    // Most rows are more than a turn from zero, as degrees would be.
    let further = [0.5, 0.7].map(|seed| rows("a", 0.0, 101, seed, 2.0, 0.3));
    folder.write("train.csv", log(0.0, 0.3) + &further.concat());
    folder.write("test.csv", log(-1.0, 0.3));
    let said = folder.run("fit --data train.csv --model gp --output m.tgp");
    assert!(
        said.contains("turns without end, say --continuous swivel"),
        "{said}"
    );
    for asked in ["swivel", "1"] {
        let fit = format!("fit --data train.csv --continuous {asked} --output told.tgp");
        let said = folder.run(&fit);
        assert!(
            !said.contains("--continuous") && !said.contains("degrees"),
            "{said}"
        );
        let (errors, _) = folder.evaluate("told.tgp", "test.csv");
        assert!(errors.iter().all(|nmse| *nmse < 1e-4), "{errors:?}");
    }
    let output = folder.command("inspect told.tgp --json").output().unwrap();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    for joint in json["joints"].as_array().unwrap() {
        assert_eq!(joint["hyperparameters"]["continuous"][0], "swivel");
        let lengths = joint["hyperparameters"]["length_scales"]
            .as_array()
            .unwrap();
        assert_eq!(lengths.len(), 6);
    }
    let output = folder.command("inspect told.tgp").output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("turning without end: swivel"), "{text}");
}

#[test]
fn a_robot_says_which_joints_turn_and_which_slide() {
    let folder = Folder::new();
    folder.write("robot.urdf", SWIVEL);
    // A slide that fills ±π m: taken for a turn by its positions, not by the robot.
    folder.write("train.csv", log(0.0, PI));
    folder.write("test.csv", log(2.0, PI));
    let said = folder.run("fit --data train.csv --model gp --output m.tgp");
    assert!(said.contains("`slide` fill a turn"), "{said}");
    let said = folder.run("fit --data train.csv --robot robot.urdf --output m.tgp");
    assert!(
        said.contains("`swivel` turn without end (type continuous"),
        "{said}"
    );
    assert!(!said.contains("`slide`"), "{said}");
    let (errors, said) = folder.evaluate("m.tgp", "test.csv");
    assert!(errors.iter().all(|nmse| *nmse < 1e-3), "{errors:?}");
    assert!(!said.contains("warning"), "{said}");

    let fit = "fit --data train.csv --output x.tgp";
    for (arguments, message) in [
        (
            "--robot robot.urdf --continuous swivel,slide",
            "--continuous slide: the robot's joint slide slides (type prismatic)",
        ),
        (
            "--continuous wrist",
            "--continuous wrist: the data has no such joint; it has swivel, slide (or by number: 1 to 2)",
        ),
        (
            "--continuous swivel --model lrc",
            "--continuous goes with gpc, gp, mgp, igp, pgp and rbd+gp, not lrc",
        ),
    ] {
        assert_eq!(folder.refusal(&format!("{fit} {arguments}")), message);
    }
}

#[test]
fn models_of_several_loads_know_a_turn_further_as_well() {
    let folder = Folder::new();
    folder.write("train.csv", of_two_loads(31, 0.0, 0.0));
    folder.write("test.csv", of_two_loads(23, 0.5, 1.0));
    folder.write(
        "log.csv",
        HEADER.to_owned() + &rows("b", 1.5, 20, 0.7, -2.0, 0.3),
    );
    folder.write(
        "new.csv",
        HEADER.to_owned() + &rows("c", 0.8, 20, 0.9, 3.0, 0.3),
    );
    let said = folder.run("fit --data train.csv --model mgp --rank 2 --output m.tgp");
    assert!(said.contains("`swivel` fill a turn"), "{said}");
    let output = folder
        .command("evaluate --model m.tgp --data test.csv --json")
        .output()
        .unwrap();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    for joint in json["average"].as_array().unwrap() {
        assert!(joint["nmse"].as_f64().unwrap() < 1e-2, "{json}");
    }
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(!said.contains("q_swivel"), "{said}");

    let output = folder
        .command("context --model m.tgp --data log.csv --json")
        .output()
        .unwrap();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        json["contexts"][1]["probability"]
            .as_f64()
            .map(|p| p > 0.999),
        Some(true)
    );
    let last = json["rows"].as_array().unwrap().last().unwrap();
    assert_eq!(last["context"], "b");

    let said = folder.run("adapt --model m.tgp --data new.csv --context c --output grown.tgp");
    assert!(!said.contains("q_swivel"), "{said}");
    folder.write(
        "c.csv",
        HEADER.to_owned() + &rows("c", 0.8, 23, 0.2, -1.0, 0.3),
    );
    let output = folder
        .command("evaluate --model grown.tgp --data c.csv --json")
        .output()
        .unwrap();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    for joint in json["average"]
        .as_array()
        .or(json["joints"].as_array())
        .unwrap()
    {
        assert!(joint["nmse"].as_f64().unwrap() < 1e-2, "{json}");
    }
}

#[test]
fn likelihoods_of_what_inspect_says_are_the_same_a_turn_further() {
    let folder = Folder::new();
    folder.write("train.csv", log(0.0, 0.3));
    folder.write("further.csv", log(1.0, 0.3));
    folder.write(
        "h.toml",
        "bias_std = 1.0\nlinear_std = [3.0, 1.0, 1.0, 1.0, 1.0, 1.0]\nsignal_std = 2.0\n\
         length_scales = [1.0, 2.0, 3.0, 3.0, 3.0, 3.0]\ncoulomb_std = [0.5, 0.5]\nnoise_std = 0.1\n\
         continuous = [\"swivel\"]\n",
    );
    let likelihood = |data: &str, hyperparameters: &str| {
        let arguments = format!(
            "likelihood --data {data} --joint 1 --hyperparameters {hyperparameters} --json"
        );
        let output = folder.command(&arguments).output().unwrap();
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        json["log_marginal_likelihood"].as_f64().unwrap()
    };
    let (here, further) = (
        likelihood("train.csv", "h.toml"),
        likelihood("further.csv", "h.toml"),
    );
    assert!(
        (here - further).abs() <= 1e-8 * here.abs(),
        "{here} {further}"
    );
    let text = folder.read("h.toml");
    folder.write(
        "as_given.toml",
        text.replace("continuous = [\"swivel\"]\n", ""),
    );
    assert!((likelihood("further.csv", "as_given.toml") - here).abs() > 1.0);
    folder.write("bad.toml", text.replace("swivel", "wrist"));
    let message =
        folder.refusal("likelihood --data train.csv --joint 1 --hyperparameters bad.toml");
    assert!(
        message.contains("`continuous`: wrist: the data has no such joint"),
        "{message}"
    );
}
