//! The recorded motions of a real arm: what docs/REAL_ROBOT.md says of them.

use serde_json::Value;

use crate::command::Folder;

const FIXTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures");

/// nMSE of each joint on the motion that is not learned.
fn errors(folder: &Folder, model: &str, options: &str) -> Vec<f64> {
    let data = format!("{FIXTURES}/kinova_gen3");
    folder.run(&format!(
        "fit --data {data}/train.csv --model {model} {options} --output {model}.tgp"
    ));
    let evaluate = format!("evaluate --model {model}.tgp --data {data}/test.csv --json");
    let output = folder.command(&evaluate).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(
        said.contains("outside the range of the training data"),
        "{said}"
    );
    let json: Value = serde_json::from_slice(&output.stdout).unwrap();
    let joints = json["joints"].as_array().unwrap();
    (joints.iter())
        .map(|joint| joint["nmse"].as_f64().unwrap())
        .collect()
}

#[test]
fn its_description_is_worth_more_than_one_motion() {
    let folder = Folder::new();
    let robot = format!("--robot {FIXTURES}/puma-dyn/gen3.urdf");
    let rigid = errors(&folder, "rbd", &robot);
    assert_eq!(rigid.len(), 7);
    assert!(rigid[..6].iter().all(|nmse| *nmse < 1.0), "{rigid:?}");
    let linear = errors(&folder, "lrc", "");
    assert!(linear.iter().all(|nmse| *nmse > 1e3), "{linear:?}");
    let process = errors(&folder, "gpc", "--joints 4 --starts chapter");
    assert!(process[0] > rigid[3], "{process:?} {rigid:?}");
}
