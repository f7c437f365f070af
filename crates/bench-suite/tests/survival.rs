//! Runs that are killed, that share a directory with another run, or that cannot write: the same files in the end, or a clear error.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A few cells of each kind, LRc and GPc.
const SMALL: [&str; 9] = [
    "reproduce-paper",
    "--only",
    "table3",
    "--loads",
    "c1,c2",
    "--joints",
    "1,3",
    "--sizes",
    "20",
];

fn command(output: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bench-suite"));
    command.args(SMALL).args(["--threads", "1", "--output"]);
    command.arg(output);
    command
}

/// Runs to the end; standard error and whether it went well.
fn run(output: &Path) -> (bool, String) {
    let output = command(output).output().expect("built with this test");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.success(), stderr)
}

fn start(output: &Path) -> Child {
    let mut command = command(output);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    command.spawn().expect("built with this test")
}

/// Files below a directory with an ending of their name.
fn files(directory: &Path, ending: &str) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(directory).into_iter().flatten() {
        let path = entry.expect("readable").path();
        if path.is_dir() {
            found.extend(files(&path, ending));
        } else if path.to_string_lossy().ends_with(ending) {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The CSV files of the only report, without those of seconds.
fn tables(output: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut tables = BTreeMap::new();
    for path in files(output, ".csv") {
        let name = path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        if !name.ends_with("seconds.csv") {
            let contents = std::fs::read(&path).expect("readable");
            assert!(tables.insert(name, contents).is_none(), "two reports");
        }
    }
    assert!(tables.contains_key("cells.csv"), "{:?}", tables.keys());
    tables
}

/// Waits until a number of cells is finished.
fn wait_for_cells(output: &Path, n: usize) {
    let start = Instant::now();
    while files(&output.join("cells"), ".toml").len() < n {
        assert!(start.elapsed() < Duration::from_mins(5), "no cell");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_killed_run_goes_on_and_ends_with_the_same_bytes() {
    let dir = tempfile::tempdir().unwrap();
    let (killed, whole) = (dir.path().join("killed"), dir.path().join("whole"));
    for n_finished in [1, 3] {
        let mut child = start(&killed);
        wait_for_cells(&killed, n_finished);
        child.kill().unwrap(); // SIGKILL: nothing can be tidied up
        child.wait().unwrap();
    }
    let n_kept = files(&killed.join("cells"), ".toml").len();
    assert!((3..20).contains(&n_kept), "{n_kept} cells before the end");
    let (is_good, stderr) = run(&killed);
    assert!(is_good, "{stderr}");
    let expected = format!("{} cells to compute, {n_kept} finished before", 20 - n_kept);
    assert!(stderr.contains(&expected), "{stderr}");

    assert!(run(&whole).0);
    assert_eq!(tables(&killed), tables(&whole));
}

#[test]
fn two_runs_on_one_directory_write_a_whole_report_each() {
    let dir = tempfile::tempdir().unwrap();
    let mut both = [start(dir.path()), start(dir.path())];
    for child in &mut both {
        assert!(child.wait().unwrap().success());
    }
    let reports = files(dir.path(), "report.html");
    assert_eq!(reports.len(), 2);
    let directories: Vec<&Path> = reports.iter().map(|file| file.parent().unwrap()).collect();
    assert_eq!(tables(directories[0]), tables(directories[1]));
    assert!(files(dir.path(), ".partial").is_empty());
}

#[test]
fn a_result_that_cannot_be_kept_ends_the_run_with_its_file_named() {
    let dir = tempfile::tempdir().unwrap();
    assert!(run(dir.path()).0);
    let kept = files(&dir.path().join("cells"), ".toml");
    // A directory where the file should be: it can neither be read nor replaced.
    std::fs::remove_file(&kept[0]).unwrap();
    std::fs::create_dir(&kept[0]).unwrap();
    let (is_good, stderr) = run(dir.path());
    assert!(!is_good);
    let message = format!("error: {}: ", kept[0].display());
    assert!(stderr.contains(&message), "{stderr}");
    assert_eq!(
        files(dir.path(), "report.md").len(),
        1,
        "only the first run's"
    );

    let below_a_file = kept[1].join("results");
    let (is_good, stderr) = run(&below_a_file);
    assert!(!is_good && stderr.contains("error: "), "{stderr}");
    assert!(
        stderr.contains(&below_a_file.display().to_string()),
        "{stderr}"
    );
}
