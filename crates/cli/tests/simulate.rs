//! `torque-gp simulate`: the library's numbers, in files that `inverse-dynamics` reads back.

use puma_dyn::Scenario;

use crate::command::{Folder, column, fixture};

#[test]
fn a_run_is_the_librarys_digit_for_digit() {
    let folder = Folder::new();
    let said = folder.run("simulate --load c3 --path p2 --speed s4 --output data.csv");
    assert!(
        said.contains("warning: path p2: joint 1 moves over ") && !said.contains("path p1"),
        "{said}"
    );
    let text = folder.read("data.csv");
    assert!(
        text.starts_with("context,run,t,q1,q2,q3,q4,q5,q6,qd1,"),
        "{}",
        &text[..80]
    );
    assert!(text.lines().nth(1).unwrap().starts_with("c3,p2_s4,0.0,"));

    let scenario = Scenario::reference();
    let trajectory = scenario.trajectory(1, 3).unwrap();
    let torques = scenario.torques(&trajectory, 2);
    let same = |name: &str, expected: &mut dyn Iterator<Item = f64>| {
        let found: Vec<u64> = column(&text, name).into_iter().map(f64::to_bits).collect();
        let expected: Vec<u64> = expected.map(f64::to_bits).collect();
        assert_eq!(found.len(), 4000);
        assert!(found == expected, "{name}");
    };
    same("t", &mut trajectory.time.iter().copied());
    for joint in 1..=6 {
        for (position, quantity) in ["q", "qd", "qdd"].iter().enumerate() {
            let first = 6 * position + joint - 1;
            same(
                &format!("{quantity}{joint}"),
                &mut trajectory.states.iter().skip(first).step_by(18).copied(),
            );
        }
        same(
            &format!("tau{joint}"),
            &mut torques.iter().skip(joint - 1).step_by(6).copied(),
        );
    }
}

#[test]
fn inverse_dynamics_of_a_run_with_its_load_gives_its_torques_back() {
    let folder = Folder::new();
    folder.run("simulate --load c3 --path p2 --speed s4 --output data.csv");
    let load = "mass = 0.6\nsize = [0.191, 0.049, 0.13]\ncentre = [0.04, 0.027, 0.103]\nrpy = [1.058, -0.702, 2.681]\n";
    folder.write("c3.toml", load);
    folder.run("inverse-dynamics --robot puma560 --payload c3.toml --tau-prefix again --input data.csv --output torques.csv");
    let text = folder.read("torques.csv");
    assert!(text.starts_with("context,run,t,tau1,tau2,tau3,tau4,tau5,tau6,again1,"));
    for joint in 1..=6 {
        let (tau, again) = (
            column(&text, &format!("tau{joint}")),
            column(&text, &format!("again{joint}")),
        );
        for (row, (tau, again)) in tau.iter().zip(&again).enumerate() {
            assert!(
                (tau - again).abs() <= 1e-13,
                "row {row}, joint {joint}: {tau} {again}"
            );
        }
    }
}

/// The reference scenario with few samples and loads, so that everything fits a test.
fn short_scenario() -> String {
    let text = std::fs::read_to_string(fixture("scenario.toml")).unwrap();
    let end = text.find("[[load]]\nname = \"c3\"").unwrap();
    text[..end].replace("samples = 4000", "samples = 8")
}

#[test]
fn all_runs_of_a_scenario_are_one_file_each() {
    let folder = Folder::new();
    folder.write("short.toml", short_scenario());
    std::fs::create_dir(folder.path("data")).unwrap();
    let said = folder.run("simulate --scenario short.toml --all data");
    assert!(said.contains("note: 32 files written to data"), "{said}");
    assert_eq!(std::fs::read_dir(folder.path("data")).unwrap().count(), 32);

    folder.run("simulate --scenario short.toml --load c2 --path p4 --speed s1 --output one.csv");
    assert_eq!(folder.read("data/c2_p4_s1.csv"), folder.read("one.csv"));
    assert_eq!(folder.read("one.csv").lines().count(), 9);
}

#[test]
fn standard_output_holds_the_table_only() {
    let folder = Folder::new();
    folder.write("short.toml", short_scenario());
    let run = "simulate --scenario short.toml --load c1 --path p1 --speed s1 --output -";
    let output = folder.command(run).output().unwrap();
    assert!(output.status.success());
    let text = String::from_utf8(output.stdout).unwrap();
    assert_eq!(column(&text, "t").len(), 8);
}

#[test]
fn faults_are_named() {
    let folder = Folder::new();
    folder.write("short.toml", short_scenario());
    folder.write(
        "broken.toml",
        short_scenario().replace("half_width", "half_widht"),
    );
    folder.write("far.toml", short_scenario().replace("0.65]", "1.65]"));
    let one = "simulate --load c1 --path p1 --speed s1 --output data.csv";
    for (run, message) in [
        (
            one.replace("c1", "c16"),
            "no load is named `c16`; known: c1, c2, ",
        ),
        (
            one.replace("p1", "p0"),
            "no path is named `p0`; known: p1, p2, p3, p4",
        ),
        (
            one.replace("s1", "s5"),
            "no speed is named `s5`; known: s1, s2, s3, s4",
        ),
        (
            one.replace("data.csv", "data.txt"),
            "the format of data.txt is not clear",
        ),
        (
            one.replace("data.csv", "nowhere/data.csv"),
            "the directory nowhere does not exist",
        ),
        (
            format!("{one} --scenario none.toml"),
            "cannot read none.toml: ",
        ),
        (
            format!("{one} --scenario broken.toml"),
            "broken.toml: scenario: line 39: unknown field `half_widht`",
        ),
        (
            "simulate --scenario far.toml --load c1 --path p4 --speed s1 --output data.csv"
                .to_owned(),
            "(path p4, sample 0)",
        ),
        (
            one.replace("data.csv", "short.toml --format csv --scenario short.toml"),
            "is the input short.toml",
        ),
        (
            "simulate --all nowhere".to_owned(),
            "--all nowhere: the directory does not exist",
        ),
    ] {
        let said = folder.refusal(&run);
        assert!(said.contains(message), "{run}: {said}");
    }
    let said = folder.refuse("simulate --load c1 --path p1 --output data.csv");
    assert!(said.contains("--speed <NAME>"), "{said}");
    let said = folder.refuse("simulate --load c1 --path p1 --speed s1");
    assert!(said.contains("--output <FILE>|--all <DIR>"), "{said}");
}

#[cfg(not(feature = "parquet"))]
#[test]
fn parquet_without_the_feature_says_how_to_build_it() {
    let folder = Folder::new();
    for run in [
        "simulate --load c1 --path p1 --speed s1 --output data.parquet",
        "simulate --load c1 --path p1 --speed s1 --output data.csv --format parquet",
        "simulate --all . --format parquet",
    ] {
        let said = folder.refusal(run);
        assert!(
            said.contains("cargo install --path crates/cli --features parquet"),
            "{said}"
        );
    }
}

#[cfg(feature = "parquet")]
#[test]
fn parquet_holds_the_same_table() {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::RowAccessor;

    let folder = Folder::new();
    folder.write("short.toml", short_scenario());
    let run = "simulate --scenario short.toml --load c2 --path p3 --speed s2 --output";
    folder.run(&format!("{run} data.csv"));
    folder.run(&format!("{run} data.parquet"));
    let text = folder.read("data.csv");
    let header: Vec<&str> = text.lines().next().unwrap().split(',').collect();

    let reader =
        SerializedFileReader::new(std::fs::File::open(folder.path("data.parquet")).unwrap())
            .unwrap();
    let rows: Vec<_> = reader
        .get_row_iter(None)
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(rows.len(), 8);
    for row in &rows {
        let names: Vec<&String> = row.get_column_iter().map(|(name, _)| name).collect();
        assert_eq!(names, header);
        assert_eq!(
            (
                row.get_string(0).unwrap().as_str(),
                row.get_string(1).unwrap().as_str()
            ),
            ("c2", "p3_s2")
        );
    }
    for (idx, name) in header.iter().enumerate().skip(2) {
        let found: Vec<u64> = rows
            .iter()
            .map(|row| row.get_double(idx).unwrap().to_bits())
            .collect();
        let expected: Vec<u64> = column(&text, name).into_iter().map(f64::to_bits).collect();
        assert_eq!(found, expected, "{name}");
    }
}

#[test]
fn noise_is_that_of_the_seed_and_nothing_else_changes() {
    let folder = Folder::new();
    let run = "simulate --load c3 --path p2 --speed s4";
    folder.run(&format!("{run} --output clean.csv"));
    let noisy = "--noise 1,2,0.5,0.1,0.1,0 --correlation 0.05";
    folder.run(&format!("{run} {noisy} --seed 7 --output noisy.csv"));
    folder.run(&format!("{run} {noisy} --seed 7 --output again.csv"));
    folder.run(&format!("{run} {noisy} --seed 8 --output other.csv"));
    let (clean, noisy) = (folder.read("clean.csv"), folder.read("noisy.csv"));
    assert_eq!(noisy, folder.read("again.csv"));
    assert_ne!(noisy, folder.read("other.csv"));
    let states = |text: &str| -> Vec<String> {
        let lines = text.lines();
        lines
            .map(|line| line.split(',').take(21).collect::<Vec<_>>().join(","))
            .collect()
    };
    assert_eq!(states(&clean), states(&noisy));
    for (joint, std) in (1..).zip([1.0, 2.0, 0.5, 0.1, 0.1, 0.0]) {
        let of = |text| column(text, &format!("tau{joint}"));
        let noise: Vec<f64> = of(&noisy)
            .iter()
            .zip(of(&clean))
            .map(|(a, b)| a - b)
            .collect();
        let mean_square = noise.iter().map(|e| e * e).sum::<f64>() / 4000.0;
        // 4000 samples of 1.25 ms are 5 s, some 50 independent draws: 4 √(2/50) of the variance.
        assert!(
            (mean_square - std * std).abs() <= 0.8 * std * std,
            "{joint}: {mean_square}"
        );
        let steps = noise
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).powi(2))
            .sum::<f64>()
            / 3999.0;
        // 2 s² (1 − exp(−1.25/50)) = 0.049 s²; white noise has 2 s².
        assert!(steps <= 0.06 * std * std, "{joint}: {steps}");
    }
}

#[test]
fn noise_that_there_is_not_is_refused() {
    let folder = Folder::new();
    let run = "simulate --load c1 --path p1 --speed s1 --output data.csv";
    for (options, message) in [
        (
            "--noise 1,2",
            "--noise has 2 standard deviations; one is needed, or 6",
        ),
        (
            "--noise -1",
            "standard deviation is -1, must be zero or positive",
        ),
        (
            "--noise 1 --correlation -2",
            "correlation time is -2, must be zero or positive",
        ),
    ] {
        let said = folder.refusal(&format!("{run} {options}"));
        assert!(said.contains(message), "{said}");
    }
    let said = folder.refuse(&format!("{run} --seed 3"));
    assert!(said.contains("--noise"), "{said}");
}

#[test]
fn a_sidecar_of_the_arm_is_in_the_torques_as_inverse_dynamics_has_it() {
    let folder = Folder::new();
    folder.write("short.toml", short_scenario());
    let friction =
        "[joint.joint2]\nhysteresis = [{ length = 1e-3, torque = 3 }]\nload_viscous = 0.02\n";
    folder.write("friction.toml", friction);
    folder.run("simulate --scenario short.toml --sidecar friction.toml --load c1 --path p2 --speed s4 --output a.csv");

    let mut sidecar = std::fs::read_to_string(fixture("puma560.toml")).unwrap();
    let (header, keys) = friction.split_once('\n').unwrap();
    sidecar = sidecar.replace(header, &format!("{header}\n{keys}"));
    folder.write("arm.toml", sidecar);
    folder.write("arm.urdf", std::fs::read(fixture("puma560.urdf")).unwrap());
    let scenario = std::fs::read_to_string(fixture("scenario.toml")).unwrap();
    let first = &scenario[scenario.find("[[load]]").unwrap()..];
    let lines = first
        .lines()
        .skip(1)
        .take_while(|line| !line.starts_with("[["));
    let load: Vec<&str> = lines.filter(|line| !line.starts_with("name")).collect();
    folder.write("load.toml", load.join("\n"));
    let urdf = "inverse-dynamics --robot arm.urdf --sidecar arm.toml --payload load.toml";
    folder.run(&format!(
        "{urdf} --tau-prefix again --input a.csv --output b.csv"
    ));
    let text = folder.read("b.csv");
    for joint in 1..=6 {
        let [tau, again] = ["tau", "again"].map(|name| column(&text, &format!("{name}{joint}")));
        for (tau, again) in tau.iter().zip(&again) {
            // The URDF states angles in fewer digits than the table.
            assert!((tau - again).abs() < 1e-9, "joint {joint}: {tau} {again}");
        }
    }
}
