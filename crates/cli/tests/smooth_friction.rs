//! Friction that is smooth, remembers and grows with the load: from a sidecar into torques, row by row.

use puma_dyn::dynamics::{drive_parameters, full_regressor, inertial_parameters};
use puma_dyn::{Context, Effects, Model, Sidecar, Workspace, parse_urdf};

use crate::command::{Folder, column, fixture};

/// Two joints of the PUMA 560; the others have no smooth friction.
const SMOOTH: &str = "
[joint.joint2]
offset = 0.4
tanh = [{ width = 0.05, torque = 3.0 }]
hysteresis = [{ length = 2e-3, torque = 5.0 }]
load_hysteresis = [{ length = 2e-3, coefficient = 0.06 }]
load_viscous = 0.03

[joint.joint5]
hysteresis = [{ length = 1e-3, torque = 0.2 }, { length = 0.05, torque = -0.1 }]
";

const STEP: f64 = 0.004;
const N_ROWS: usize = 60;

/// A motion that turns back, sample by sample: (q, qd, qdd).
fn motion(run: usize, sample: usize) -> [f64; 18] {
    let t = STEP * sample as f64;
    std::array::from_fn(|idx| {
        let (derivative, joint) = (idx / 6, idx % 6);
        let omega = 9.0 + joint as f64 + 3.0 * run as f64;
        let phase = omega * t + 0.7 * joint as f64;
        let size = 0.2 + 0.05 * joint as f64;
        match derivative {
            0 => size * phase.sin() - 0.3,
            1 => size * omega * phase.cos(),
            _ => -size * omega * omega * phase.sin(),
        }
    })
}

/// Both runs, with labels, times that start anew, and states.
fn log() -> String {
    let names = ["q", "qd", "qdd"].map(|name| (1..=6).map(|j| format!("{name}{j}")).collect());
    let names: Vec<String> = names
        .into_iter()
        .flat_map(|names: Vec<String>| names)
        .collect();
    let mut lines = vec![format!("run,t,{}", names.join(","))];
    for run in 0..2 {
        for sample in 0..N_ROWS {
            let state = motion(run, sample).map(|value| format!("{value:?}"));
            let t = STEP * sample as f64;
            lines.push(format!("r{run},{t:?},{}", state.join(",")));
        }
    }
    lines.join("\n") + "\n"
}

fn folder() -> Folder {
    let folder = Folder::new();
    let read = |name: &str| std::fs::read_to_string(fixture(name)).unwrap();
    folder.write("arm.urdf", read("puma560.urdf"));
    // The tables of joints 2 and 5 are there already: their new keys go below their headers.
    let mut sidecar = read("puma560.toml");
    for table in SMOOTH.split("\n\n") {
        let (header, keys) = table.trim().split_once('\n').unwrap();
        assert!(sidecar.contains(header));
        sidecar = sidecar.replace(header, &format!("{header}\n{keys}"));
    }
    folder.write("arm.toml", sidecar);
    folder.write("log.csv", log());
    folder
}

fn model(folder: &Folder) -> Model {
    let sidecar = Sidecar::parse("arm.toml", &folder.read("arm.toml")).unwrap();
    let loaded = parse_urdf("arm.urdf", &folder.read("arm.urdf"), Some(&sidecar)).unwrap();
    loaded.model
}

/// Y π with the drives' four parameters, and without them, which is τ^rb.
fn linear_torques(model: &Model, x: &[f64; 18]) -> [[f64; 6]; 2] {
    let mut y = vec![0.0; 6 * 84];
    let mut workspace = Workspace::new(model);
    full_regressor(model, &mut workspace, &x[..6], &x[6..12], &x[12..], &mut y);
    let mut parameters = inertial_parameters(model, &Context::empty());
    parameters.extend(drive_parameters(model, Effects::ALL));
    [84, 60].map(|n| {
        std::array::from_fn(|joint| {
            let row = &y[84 * joint..][..n];
            row.iter().zip(&parameters).map(|(y, p)| y * p).sum()
        })
    })
}

/// z after each sample, by the travel of its step at the sample's speed.
fn remembered(run: usize, joint: usize, length: f64) -> Vec<f64> {
    let mut z = 0.0;
    let of_sample = |sample: usize| {
        let qd = motion(run, sample)[6 + joint];
        if sample > 0 {
            let kept = (-qd.abs() * STEP / length).exp();
            z = qd.signum() * (1.0 - kept) + z * kept;
        }
        z
    };
    (0..N_ROWS).map(of_sample).collect()
}

#[test]
fn torques_are_those_of_the_regressor_and_friction_worked_by_hand() {
    let folder = folder();
    folder.run("inverse-dynamics --robot arm.urdf --sidecar arm.toml --terms --input log.csv --output tau.csv");
    let (text, model) = (folder.read("tau.csv"), model(&folder));
    let columns: Vec<Vec<f64>> = (1..=6).map(|j| column(&text, &format!("tau{j}"))).collect();
    let mut largest = 0.0_f64;
    for run in 0..2 {
        let z2 = remembered(run, 1, 2e-3);
        let [near, far] = [1e-3, 0.05].map(|length| remembered(run, 4, length));
        for sample in 0..N_ROWS {
            let x = motion(run, sample);
            let [mut expected, rigid] = linear_torques(&model, &x);
            let (qd, load, z) = (x[7], rigid[1].abs(), z2[sample]);
            let smooth = 0.4 + 3.0 * (qd / 0.05).tanh() + 5.0 * z;
            expected[1] += smooth + load * (0.06 * z + 0.03 * qd);
            expected[4] += 0.2 * near[sample] - 0.1 * far[sample];
            for (joint, expected) in expected.iter().enumerate() {
                let found = columns[joint][run * N_ROWS + sample];
                // Sums of some hundred products of up to a few hundred N·m.
                let tolerance = 1e3 * f64::EPSILON * (100.0 + expected.abs());
                assert!(
                    (found - expected).abs() < tolerance,
                    "run {run}, sample {sample}, joint {joint}: {found} {expected}"
                );
            }
            largest = largest.max((5.0 * z + load * 0.06 * z).abs());
        }
    }
    assert!(largest > 5.0, "memory was hardly used: {largest}");
}

#[test]
fn the_terms_of_a_torque_add_up_to_it() {
    let folder = folder();
    folder.run("inverse-dynamics --robot arm.urdf --sidecar arm.toml --terms --input log.csv --output tau.csv");
    let text = folder.read("tau.csv");
    let terms = [
        "inertia", "coriolis", "gravity", "payload", "friction", "rotor",
    ];
    let terms = terms.map(|term| column(&text, &format!("tau2_{term}")));
    for (row, tau) in column(&text, "tau2").iter().enumerate() {
        let sum: f64 = terms.iter().map(|term| term[row]).sum();
        assert!(
            (sum - tau).abs() < 1e-12 * (100.0 + tau.abs()),
            "{row}: {sum} {tau}"
        );
    }
}

#[test]
fn memory_without_time_is_refused_and_so_is_time_that_stands() {
    let folder = folder();
    let arguments =
        "inverse-dynamics --robot arm.urdf --sidecar arm.toml --input bad.csv --output tau.csv";
    folder.write("bad.csv", log().replacen("run,t,", "run,time,", 1));
    let message = folder.refusal(arguments);
    let expected =
        "bad.csv: there is no column `t` (s): the sidecar states friction with hysteresis";
    assert!(message.starts_with(expected), "{message}");
    folder.run(&format!("{arguments} --friction none"));
    std::fs::remove_file(folder.path("tau.csv")).unwrap();

    folder.write("bad.csv", log().replacen("r0,0.012,", "r0,0.008,", 1));
    let message = folder.refusal(arguments);
    let expected =
        "bad.csv: row 4 (line 5), column `t` (time, s): 0.008 s does not come after 0.008 s";
    assert!(message.starts_with(expected), "{message}");
}

#[test]
fn without_labels_a_run_ends_where_time_falls() {
    let folder = folder();
    let arguments = "inverse-dynamics --robot arm.urdf --sidecar arm.toml";
    folder.run(&format!("{arguments} --input log.csv --output with.csv"));
    folder.write("plain.csv", log().replacen("run,t,", "part,t,", 1));
    folder.run(&format!(
        "{arguments} --input plain.csv --output without.csv"
    ));
    let (with, without) = (folder.read("with.csv"), folder.read("without.csv"));
    assert_eq!(column(&with, "tau2"), column(&without, "tau2"));
}
