//! `sample`: draws that repeat, and refusals.

use crate::command::{Folder, column};

/// One joint, eight rows of a pendulum with friction.
const DATA: &str = "q1,qd1,qdd1,tau1\n-1.2,0.0,3.0,-1.3\n-0.7,1.9,-1.5,-6.7\n-0.3,1.0,-1.5,-9.0\n0.0,-1.4,3.0,-9.2\n\
0.4,-1.8,-1.6,-12.1\n0.8,0.4,-1.4,-6.7\n1.1,2.0,3.0,-0.2\n1.5,0.6,-1.6,-0.6\n";

const SHORT: &str =
    "sample --data train.csv --joint 1 --chains 2 --warmup 30 --draws 20 --max-depth 4";

#[test]
fn draws_repeat_with_their_seed_and_have_every_hyperparameter() {
    let folder = Folder::new();
    folder.write("train.csv", DATA);
    let report = folder.run(&format!("{SHORT} --output a.csv"));
    assert!(report.contains("length_scales[2]"), "{report}");
    assert!(
        report.contains("warning: the chains are too short"),
        "{report}"
    );
    folder.run(&format!("{SHORT} --output b.csv"));
    folder.run(&format!("{SHORT} --seed 1 --output c.csv"));
    let (a, b, c) = (
        folder.read("a.csv"),
        folder.read("b.csv"),
        folder.read("c.csv"),
    );
    assert_eq!(a, b);
    assert_ne!(a, c);

    assert_eq!(a.lines().count(), 41);
    let header = "chain,draw,bias_std,linear_std[0],linear_std[1],linear_std[2],signal_std,\
                  length_scales[0],length_scales[1],length_scales[2],coulomb_std[0],noise_std";
    assert_eq!(a.lines().next(), Some(header));
    // The bounds of fits: 2·10⁻⁴ of the torques' standard deviation, and twice it.
    let torques = column(DATA, "tau1");
    let mean = torques.iter().sum::<f64>() / 8.0;
    let std = (torques.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / 8.0).sqrt();
    let weights = column(&a, "linear_std[1]");
    assert!(weights.iter().all(|u| (0.0..2.0 * std).contains(u)));
    let noise = column(&a, "noise_std");
    assert!(noise.iter().all(|sigma| *sigma >= 1.999e-4 * std));
    assert!(column(&a, "chain")[39] > 1.5);
}

#[test]
fn torques_of_another_unit_have_draws_of_that_unit() {
    let folder = Folder::new();
    folder.write("train.csv", DATA);
    let unit = 2.0_f64.powi(-10);
    let scaled = DATA.lines().map(|line| {
        let (state, torque) = line.rsplit_once(',').unwrap();
        match torque.parse::<f64>() {
            Ok(torque) => format!("{state},{:?}", unit * torque),
            Err(_) => line.to_owned(),
        }
    });
    folder.write("scaled.csv", scaled.collect::<Vec<_>>().join("\n"));
    folder.run(&format!("{SHORT} --output a.csv"));
    let of_scaled = SHORT.replace("train", "scaled");
    folder.run(&format!("{of_scaled} --output b.csv"));
    let (a, b) = (folder.read("a.csv"), folder.read("b.csv"));
    for (name, factor) in [
        ("noise_std", unit),
        ("signal_std", unit),
        ("length_scales[1]", 1.0),
    ] {
        // A power of two: the chains are the same to the bit.
        let expected: Vec<f64> = column(&a, name).iter().map(|v| factor * v).collect();
        assert_eq!(column(&b, name), expected, "{name}");
    }
}

#[test]
fn what_cannot_be_sampled_is_refused_without_an_output() {
    let folder = Folder::new();
    folder.write("train.csv", DATA);
    folder.write("one.csv", "q1,qd1,qdd1,tau1\n1,2,3,4\n");
    let refused = |arguments: &str| folder.refusal(arguments);
    assert_eq!(
        refused("sample --data one.csv --joint 1 --output draws.csv"),
        "one.csv: joint `joint1`: 1 samples given, at least 2 needed"
    );
    assert_eq!(
        refused("sample --data train.csv --joint 2 --output draws.csv"),
        "--joint 2: the data has no such joint; it has joint1 (or by number: 1 to 1)"
    );
    let same = refused("sample --data train.csv --joint 1 --output train.csv");
    assert!(same.contains("it would be overwritten"), "{same}");
    let none = folder.refuse(&format!("{SHORT} --chains 0 --output draws.csv"));
    assert!(none.contains("--chains"), "{none}");
    folder.write("bad.csv", DATA.replace("-9.2", "x"));
    let bad = refused("sample --data bad.csv --joint 1 --output draws.csv");
    assert!(
        bad.contains("row 4 (line 5)") && bad.contains("`tau1`"),
        "{bad}"
    );
}
