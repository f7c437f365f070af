//! Samples of the simulated PUMA 560 as CSV, simulated once for all tests.

use std::sync::OnceLock;

use crate::command::Folder;

/// The run c3, p2, s3 as CSV text: header and 4000 rows.
fn run() -> &'static str {
    static RUN: OnceLock<String> = OnceLock::new();
    RUN.get_or_init(|| {
        let folder = Folder::new();
        folder.run("simulate --load c3 --path p2 --speed s3 --output run.csv");
        folder.read("run.csv")
    })
}

/// `count` rows of the run, evenly spaced from row `first` on, with the header.
pub fn rows(first: usize, count: usize) -> String {
    let mut lines = run().lines();
    let header = lines.next().unwrap();
    let step = (4000 - first) / count;
    let chosen = lines.skip(first).step_by(step).take(count);
    std::iter::once(header)
        .chain(chosen)
        .map(|line| line.to_owned() + "\n")
        .collect()
}

/// A folder with `train.csv` of `n_train` rows and `test.csv` of 200 other rows of the same run.
pub fn folder(n_train: usize) -> Folder {
    let folder = Folder::new();
    folder.write("train.csv", rows(0, n_train));
    folder.write("test.csv", rows(7, 200));
    folder
}
