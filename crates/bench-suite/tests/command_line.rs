//! `bench-suite` as it is typed.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn bench_suite(arguments: &[&str], output: &Path) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bench-suite"));
    command.args(arguments);
    if arguments.first() == Some(&"reproduce-paper") {
        command.arg("--output").arg(output);
    }
    command
        .output()
        .expect("the program was built with this test")
}

/// Some experiments of one joint at one size, on one thread.
fn small<'a>(only: &'a str, loads: &'a str) -> [&'a str; 11] {
    [
        "reproduce-paper",
        "--only",
        only,
        "--loads",
        loads,
        "--joints",
        "1",
        "--sizes",
        "20",
        "--threads",
        "1",
    ]
}

#[test]
fn wrong_requests_are_refused_with_status_2_and_leave_nothing() {
    let refused = |arguments, message| assert_refused("reproduce-paper", arguments, message);
    refused(
        "--only fig70",
        "unknown experiment \"fig70\"; known: fig02, table1, fig03",
    );
    refused("--joints 7", "not a whole number from 1 to 6");
    refused("--loads c16", "not one of c1 to c15");
    refused("--sizes 4001", "not a whole number from 1 to 4000");
    refused(
        "--only fig10 --totals 281",
        "n = 281 is not a multiple of the 14 contexts",
    );
    refused("--repeats 0", "not a whole number from 1 to 100");
    refused("--profile huge", "[possible values: smoke, full]");
    refused("--shard 9/8", "not I/N with whole numbers 1 <= I <= N");
    refused("--seed a+b", "not letters, digits, `-`, `_` and `.`");
    refused("--threads 2000", "not a whole number from 0 to 1024");
    refused("--from cache", "[possible values: results, fits, scratch]");
    assert_refused("reproduce", "", "unrecognized subcommand");
}

#[test]
fn flags_that_would_change_nothing_are_refused_too() {
    let refused = |arguments, message| assert_refused("reproduce-paper", arguments, message);
    refused(
        "--only fig10 --sizes 20",
        "--sizes would change nothing: it concerns table3, fig07, fig08, and none of these is chosen",
    );
    refused(
        "--only table3 --repeats 2",
        "--repeats would change nothing: it concerns fig10, fig11,",
    );
    refused(
        "--only fig02,table1 --seed 7",
        "--seed would change nothing: it concerns table3, fig07, fig08, fig10, fig11,",
    );
}

/// Runs a request, which ends with status 2, a message and no file.
fn assert_refused(command: &str, arguments: &str, message: &str) {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let arguments: Vec<&str> = std::iter::once(command)
        .chain(arguments.split_whitespace())
        .collect();
    let output = bench_suite(&arguments, &dir.path().join("results"));
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
    assert!(stderr.contains(message), "{arguments:?}: {stderr}");
    assert!(!dir.path().join("results").exists(), "{arguments:?}");
}

#[test]
fn a_small_reproduction_writes_its_report_and_the_next_one_recomputes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let small = small("table3,fig07,fig08", "c4");
    let first = bench_suite(&small, dir.path());
    let stderr = String::from_utf8(first.stderr).unwrap();
    assert!(first.status.success(), "{stderr}");
    assert!(
        stderr.contains("7 cells to compute, 0 finished before"),
        "{stderr}"
    );
    let stdout = String::from_utf8(first.stdout).unwrap();
    assert!(
        stdout.contains("joint  model                     set      n = 20  published"),
        "{stdout}"
    );

    let second = bench_suite(&small, dir.path());
    assert!(second.status.success());
    assert!(second.stderr.is_empty(), "nothing was to be computed");

    let reports = reports(dir.path());
    assert_eq!(reports.len(), 2);
    for name in [
        "table3.csv",
        "averages.csv",
        "cells.csv",
        "fig07.svg",
        "fig07.png",
    ] {
        let read = |report: &Path| std::fs::read(report.join(name)).unwrap();
        assert!(!read(&reports[0]).is_empty());
        assert_eq!(read(&reports[0]), read(&reports[1]), "{name}");
    }
}

#[test]
fn stored_results_are_drawn_without_computing_and_what_is_missing_is_said() {
    let dir = tempfile::tempdir().unwrap();
    let request = |loads, from| {
        let arguments = [&small("table3", loads)[..], &["--from", from]].concat();
        let output = bench_suite(&arguments, dir.path());
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (
            output.status.code(),
            text(&output.stdout),
            text(&output.stderr),
        )
    };
    let (status, _, stderr) = request("c4", "results");
    assert_eq!(status, Some(1), "{stderr}");
    assert!(
        stderr.contains("nothing of what was asked for is computed yet;"),
        "{stderr}"
    );
    let reports = || {
        let entries = std::fs::read_dir(dir.path())
            .into_iter()
            .flatten()
            .flatten();
        entries
            .filter(|entry| entry.path().join("report.html").exists())
            .count()
    };
    assert_eq!(reports(), 0);

    assert_eq!(request("c4", "fits").0, Some(0));
    let (status, stdout, stderr) = request("c4,c5", "results");
    assert_eq!((status, stderr.as_str()), (Some(0), ""));
    let missing = "Not computed yet: 5, the first of them joint 1, load c5, LRc, n = 20.";
    assert!(stdout.contains(missing), "{stdout}");
    assert_eq!(reports(), 2);
}

#[test]
fn another_seed_is_another_draw_with_cells_of_its_own() {
    let dir = tempfile::tempdir().unwrap();
    let small = small("table3", "c4");
    let with_seed = [&small[..], &["--seed", "other"]].concat();
    let averages = |arguments: &[&str]| {
        let output = bench_suite(arguments, dir.path());
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(
            stderr.contains("5 cells to compute, 0 finished before"),
            "{stderr}"
        );
        let stdout = String::from_utf8(output.stdout).unwrap();
        let report = stdout
            .split("Report: ")
            .nth(1)
            .unwrap()
            .split("/report.html")
            .next();
        let report = Path::new(report.unwrap()).to_path_buf();
        let manifest = std::fs::read_to_string(report.join("manifest.toml")).unwrap();
        (
            std::fs::read_to_string(report.join("averages.csv")).unwrap(),
            manifest,
        )
    };
    let (own, manifest) = averages(&small);
    assert!(manifest.contains("seeds = [\"one-context\"]"), "{manifest}");
    let (other, manifest) = averages(&with_seed);
    assert!(
        manifest.contains("seeds = [\"other/one-context\"]"),
        "{manifest}"
    );
    assert_ne!(own, other);
}

#[test]
fn shards_share_the_work_and_the_report_is_that_of_one_run() {
    let (shared, alone) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let small = small("table3,fig07", "c4,c9");
    for shard in ["1/2", "2/2"] {
        let output = bench_suite(&[&small[..], &["--shard", shard]].concat(), shared.path());
        let stdout = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{stdout}");
        let expected = format!("shard {shard}: 7 cells were computed");
        assert!(stdout.starts_with(&expected), "{stdout}");
        assert!(
            reports(shared.path()).is_empty(),
            "a shard writes no report"
        );
    }
    let last = bench_suite(&small, shared.path());
    assert!(last.stderr.is_empty(), "nothing was to be computed");
    bench_suite(&small, alone.path());
    for name in ["table3.csv", "averages.csv", "cells.csv"] {
        let read = |dir: &Path| std::fs::read(reports(dir)[0].join(name)).unwrap();
        assert_eq!(read(shared.path()), read(alone.path()), "{name}");
    }
}

/// Directories of reports, oldest first.
fn reports(dir: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(dir).expect("the directory of results is there");
    let paths = entries.map(|entry| entry.expect("it can be listed").path());
    let mut reports: Vec<PathBuf> = paths.filter(|p| p.join("report.md").exists()).collect();
    reports.sort();
    reports
}

#[test]
fn list_names_experiments_and_profiles() {
    let output = bench_suite(&["list"], Path::new(""));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.contains("smoke  450 cells: 15 loads, joints [1, 3, 6], n [20, 170]"),
        "{text}"
    );
    assert!(
        text.contains("full   145 units: 14 contexts, joints [1, 2, 3, 4, 5, 6], n [280, 364,"),
        "{text}"
    );
}

#[test]
fn a_reader_who_has_gone_ends_nothing() {
    let dir = tempfile::tempdir().unwrap();
    // The reading end is closed before the program starts: its first line cannot be written.
    let closed = || std::io::pipe().unwrap().1;
    let status = |arguments: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bench-suite"));
        command.args(arguments).stdout(closed()).stderr(closed());
        command.status().unwrap().code()
    };
    assert_eq!(status(&["list"]), Some(0));
    let output = dir.path().display().to_string();
    let small = [&small("table3", "c4")[..], &["--output", &output]].concat();
    assert_eq!(status(&small), Some(0));
    assert_eq!(reports(dir.path()).len(), 1);
    assert_eq!(status(&["reproduce-paper", "--only", "fig70"]), Some(2));
}
