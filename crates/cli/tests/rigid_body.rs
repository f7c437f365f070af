//! `fit --model rbd` and `rbd+gp`: a robot's description as prior, and the model that holds the robot.

use std::fmt::Write;

use crate::command::{Folder, column};
use crate::puma_samples::folder;

/// A pendulum of one joint, described without friction, and a load that nobody knows.
const PENDULUM: &str = r#"<robot name="pendulum"><link name="base"/>
<link name="rod"><inertial><origin xyz="0.5 0 0"/><mass value="2"/>
<inertia ixx="0" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
<joint name="hinge" type="continuous"><parent link="base"/><child link="rod"/><axis xyz="0 1 0"/></joint></robot>"#;

/// States and torques of that pendulum with `load` kg at 0.8 m, friction 0.3 sgn q̇ + 0.1 q̇.
///
/// τ = I q̈ − g Σ m r cos q + friction about an axis that points to the left of a rod along x.
fn pendulum_rows(load: f64) -> String {
    let mut text = "q_hinge,qd_hinge,qdd_hinge,tau_hinge\n".to_owned();
    for row in 0..40 {
        let phase = 0.37 * f64::from(row);
        let (q, qd, qdd) = (
            2.0 * phase.sin(),
            3.0 * (1.3 * phase).cos(),
            8.0 * (0.7 * phase + 0.2).sin(),
        );
        let inertia = 0.1 + 2.0 * 0.25 + load * 0.64;
        let gravity = -9.81 * (2.0 * 0.5 + load * 0.8) * q.cos();
        let friction = 0.3 * qd.signum() + 0.1 * qd;
        let tau = inertia * qdd + gravity + friction;
        writeln!(text, "{q},{qd},{qdd},{tau}").unwrap();
    }
    text
}

/// nMSE of every joint of `test.csv`, in order.
fn errors(folder: &Folder, model: &str) -> Vec<f64> {
    folder.evaluate(model, "test.csv").0
}

#[test]
fn a_load_and_friction_that_the_description_lacks_are_learned() {
    let folder = Folder::new();
    folder.write("arm.urdf", PENDULUM);
    let rows = pendulum_rows(1.5);
    let (train, test) = rows.split_at(rows.match_indices('\n').nth(20).unwrap().0 + 1);
    folder.write("train.csv", train);
    folder.write(
        "test.csv",
        format!("{}{test}", rows.split_inclusive('\n').next().unwrap()),
    );
    let said = folder.run("fit --data train.csv --model rbd --robot arm.urdf --output model.tgp");
    assert!(said.contains("nMSE of what was left out"), "{said}");
    // The model is exact: at these speeds smooth friction is that of the signs.
    folder.run(
        "predict --model model.tgp --input test.csv --tau-prefix model --output predicted.csv",
    );
    let predicted = column(&folder.read("predicted.csv"), "model_hinge");
    let measured = column(&folder.read("test.csv"), "tau_hinge");
    for (a, b) in predicted.iter().zip(&measured) {
        assert!((a - b).abs() < 0.03, "{a} {b}");
    }
    let refused = folder.refusal(
        "fit --data train.csv --model rbd --robot arm.urdf --friction none --output stiff.tgp",
    );
    assert!(refused.contains("--friction-terms"), "{refused}");
}

#[test]
fn a_loaded_puma_on_another_path_is_predicted_far_better_with_its_description() {
    let folder = folder(40);
    folder.run("simulate --load c3 --path p1 --speed s2 --output test.csv");
    folder.run("fit --data train.csv --model lrc --joints 2,6 --output lrc.tgp");
    folder.run("fit --data train.csv --model rbd --robot puma560 --joints 2,6 --output rbd.tgp");
    let (linear, rigid) = (errors(&folder, "lrc.tgp"), errors(&folder, "rbd.tgp"));
    for (rigid, linear) in rigid.iter().zip(&linear) {
        assert!(*rigid < 0.1 * linear, "{rigid:e} {linear:e}");
    }
}

#[test]
fn the_file_holds_the_robot_and_refuses_to_be_spoilt() {
    let folder = Folder::new();
    folder.write("arm.urdf", PENDULUM);
    folder.write("train.csv", pendulum_rows(0.0));
    folder.run("fit --data train.csv --model rbd+gp --robot arm.urdf --gravity 0,0,-9.81 --output model.tgp");
    let predict = "predict --model model.tgp --input train.csv --tau-prefix model --output";
    folder.run(&format!("{predict} before.csv"));
    std::fs::remove_file(folder.path("arm.urdf")).unwrap();
    folder.run(&format!("{predict} after.csv"));
    assert_eq!(folder.read("before.csv"), folder.read("after.csv"));

    let text = folder.command("inspect model.tgp").output().unwrap().stdout;
    let text = String::from_utf8(text).unwrap();
    for part in ["rigid-body prior", "hinge: rbd+gp", "times"] {
        assert!(text.contains(part), "{part}: {text}");
    }

    let bytes = std::fs::read(folder.path("model.tgp")).unwrap();
    let mut altered = bytes.clone();
    altered[bytes.len() / 2] ^= 1;
    folder.write("altered.tgp", altered);
    folder.write("short.tgp", &bytes[..bytes.len() - 1]);
    for (file, reason) in [("altered.tgp", "altered"), ("short.tgp", "truncated")] {
        let message = folder.refusal(&format!(
            "predict --model {file} --input train.csv --output out.csv"
        ));
        assert!(
            message.contains(file) && message.contains(reason),
            "{message}"
        );
    }
}

#[test]
fn what_does_not_go_together() {
    let folder = folder(40);
    let fit = "fit --data train.csv --output model.tgp --model";
    for (arguments, message) in [
        (
            "rbd",
            "--model rbd needs the robot whose parameters it learns: --robot FILE.urdf or puma560",
        ),
        (
            "lrc --robot puma560",
            "--robot goes with --model rbd and rbd+gp, and with gpc, gp, mgp, igp and pgp for its continuous joints, not lrc",
        ),
        (
            "rbd --robot puma560 --rank 2",
            "--rank goes with --model mgp, not rbd",
        ),
        (
            "rbd --robot none.urdf",
            "--robot none.urdf: there is no such file, and the only built-in robot is puma560",
        ),
    ] {
        assert_eq!(folder.refusal(&format!("{fit} {arguments}")), message);
    }
    folder.write("arm.urdf", PENDULUM);
    let other = folder.refusal(&format!("{fit} rbd --robot arm.urdf"));
    assert!(other.starts_with("train.csv: "), "{other}");
    let alone = folder
        .command(&format!("{fit} gpc --friction none"))
        .output()
        .unwrap();
    let alone = String::from_utf8(alone.stderr).unwrap();
    assert!(alone.contains("--robot"), "{alone}");

    folder.run(&format!("{fit} rbd+gp --robot puma560"));
    for command in [
        "context --model model.tgp --data test.csv",
        "adapt --model model.tgp --data test.csv --context c9 --output grown.tgp",
    ] {
        let message = folder.refusal(command);
        assert!(message.contains("is a model of one context"), "{message}");
    }
}
