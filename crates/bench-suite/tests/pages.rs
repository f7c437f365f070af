//! The report's pages: what they must have, and that every table says truly where its rows are.

use std::path::PathBuf;
use std::process::Command;

#[test]
fn both_pages_have_claims_sources_and_deviations_and_the_html_page_needs_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let small =
        "reproduce-paper --only fig05,table3,fig07,fig08 --loads c4 --joints 1 --sizes 20 --output";
    let output = Command::new(env!("CARGO_BIN_EXE_bench-suite"))
        .args(small.split(' '))
        .arg(dir.path())
        .output()
        .unwrap();
    assert!(output.status.success());
    let is_report = |path: &PathBuf| path.join("report.html").exists();
    let mut entries = std::fs::read_dir(dir.path())
        .unwrap()
        .map(|e| e.unwrap().path());
    let report = entries.find(is_report).unwrap();
    let read = |name: &str| std::fs::read_to_string(report.join(name)).unwrap();

    for page in [read("report.md"), read("report.html")] {
        for part in [
            "cargo xtask reproduce-paper --only fig05,table3,fig07,fig08 --loads c4",
            "extrap at least ten times harder than interp",
            "What differs, and why",
            "Fits that needed help",
            "Where this implementation departs from the chapter",
        ] {
            assert!(page.contains(part), "{part}: {page}");
        }
    }
    let page = read("report.html");
    assert_eq!(page.matches("<svg ").count(), 3);
    for way in ["<script", "src=\"", "@import", "<link rel=\"stylesheet"] {
        assert!(!page.contains(way), "{way}");
    }

    // "Rows: [`cells.csv`](cells.csv), columns joint, load."
    let page = read("report.md");
    let sources = page
        .lines()
        .filter_map(|line| line.strip_prefix("Rows: [`"));
    let mut n_sources = 0;
    for (file, rest) in sources.map(|source| source.split_once('`').unwrap()) {
        let table = read(file);
        let header: Vec<&str> = table.lines().next().unwrap().split(',').collect();
        let key = rest
            .split_once(", columns ")
            .unwrap()
            .1
            .trim_end_matches('.');
        for column in key.split(", ") {
            assert!(header.contains(&column), "{file}: {column} of {header:?}");
        }
        n_sources += 1;
    }
    assert!(n_sources > 8, "{n_sources}");
}
