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

#[test]
fn wrong_requests_are_refused_with_status_2_and_leave_nothing() {
    let cases: [(&[&str], &str); 9] = [
        (
            &["reproduce-paper", "--only", "fig70"],
            "unknown experiment \"fig70\"; known: fig02, table1, fig03",
        ),
        (
            &["reproduce-paper", "--joints", "7"],
            "not a whole number from 1 to 6",
        ),
        (
            &["reproduce-paper", "--loads", "c16"],
            "not one of c1 to c15",
        ),
        (
            &["reproduce-paper", "--sizes", "4001"],
            "not a whole number from 1 to 4000",
        ),
        (
            &["reproduce-paper", "--only", "fig10", "--totals", "281"],
            "n = 281 is not a multiple of the 14 contexts",
        ),
        (
            &["reproduce-paper", "--repeats", "0"],
            "not a whole number from 1 to 100",
        ),
        (
            &["reproduce-paper", "--profile", "huge"],
            "[possible values: smoke, full]",
        ),
        (
            &["reproduce-paper", "--shard", "9/8"],
            "not I/N with whole numbers 1 <= I <= N",
        ),
        (&["reproduce"], "unrecognized subcommand"),
    ];
    let dir = tempfile::tempdir().unwrap();
    for (arguments, message) in cases {
        let output = bench_suite(arguments, &dir.path().join("results"));
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {stderr}");
        assert!(stderr.contains(message), "{arguments:?}: {stderr}");
        assert!(!dir.path().join("results").exists(), "{arguments:?}");
    }
}

#[test]
fn a_small_reproduction_writes_its_report_and_the_next_one_recomputes_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let small = [
        "reproduce-paper",
        "--only",
        "table3,fig07,fig08",
        "--loads",
        "c4",
        "--joints",
        "1",
        "--sizes",
        "20",
        "--threads",
        "1",
    ];
    let first = bench_suite(&small, dir.path());
    let stderr = String::from_utf8(first.stderr).unwrap();
    assert!(first.status.success(), "{stderr}");
    assert!(
        stderr.contains("4 cells to compute, 0 finished before"),
        "{stderr}"
    );
    let stdout = String::from_utf8(first.stdout).unwrap();
    assert!(
        stdout.contains("joint  model  set     n = 20  published"),
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
    let page = std::fs::read_to_string(reports[0].join("report.md")).unwrap();
    assert!(
        page.contains("cargo xtask reproduce-paper --only table3,fig07,fig08 --loads c4"),
        "{page}"
    );
}

#[test]
fn shards_share_the_work_and_the_report_is_that_of_one_run() {
    let (shared, alone) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let small = [
        "reproduce-paper",
        "--only",
        "table3,fig07",
        "--loads",
        "c4,c9",
    ];
    let small = [
        &small[..],
        &["--joints", "1", "--sizes", "20", "--threads", "1"],
    ]
    .concat();
    for shard in ["1/2", "2/2"] {
        let output = bench_suite(&[&small[..], &["--shard", shard]].concat(), shared.path());
        let stdout = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success(), "{stdout}");
        let expected = format!("shard {shard}: 4 cells were computed");
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
        text.contains("smoke  360 cells: 15 loads, joints [1, 3, 6], n [20, 170]"),
        "{text}"
    );
    assert!(
        text.contains("full   48 units: 14 contexts, joints [1, 2, 3, 4, 5, 6], n [280, 364,"),
        "{text}"
    );
}
