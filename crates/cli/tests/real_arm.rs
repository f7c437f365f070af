//! The recorded motions of a real arm: what docs/REAL_ROBOT.md says of them.

use crate::command::Folder;

const FIXTURES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../fixtures");

/// nMSE of each joint on the motion that is not learned.
fn errors(folder: &Folder, model: &str, options: &str) -> Vec<f64> {
    let data = format!("{FIXTURES}/kinova_gen3");
    folder.run(&format!(
        "fit --data {data}/train.csv --model {model} {options} --output {model}.tgp"
    ));
    let (errors, said) = folder.evaluate(&format!("{model}.tgp"), &format!("{data}/test.csv"));
    let doubt = "outside the range of the training data";
    assert!(said.contains(doubt), "{said}");
    errors
}

#[test]
fn its_description_is_worth_more_than_one_motion() {
    let folder = Folder::new();
    let robot = format!("--robot {FIXTURES}/puma-dyn/gen3.urdf");
    let rigid = errors(&folder, "rbd", &robot);
    assert_eq!(rigid.len(), 7);
    assert!(rigid[..6].iter().all(|nmse| *nmse < 1.0), "{rigid:?}");
    let evident = errors(&folder, "lrc", "");
    assert!(evident.iter().all(|nmse| *nmse > 1.0), "{evident:?}");
    let linear = errors(&folder, "lrc", "--chapter");
    assert!(linear.iter().all(|nmse| *nmse > 1e3), "{linear:?}");
    let process = errors(&folder, "gpc", "--joints 4 --starts chapter");
    assert!(process[0] > rigid[3], "{process:?} {rigid:?}");
}
