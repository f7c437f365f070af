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
