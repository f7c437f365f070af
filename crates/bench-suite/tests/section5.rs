//! The models that the experiments of section 5 share: the same bits for any number of threads, fitted once.

use std::path::Path;

use bench_suite::run::Reuse;
use bench_suite::section5::bench::Bench;
use bench_suite::section5::make;
use bench_suite::section5::spec::Section5Experiment;
use bench_suite::section5::trained::Trained;
use bench_suite::section5::training_set::TrainingSet;
use bench_suite::spec::Profile;

/// Four loads of six samples each.
fn small() -> TrainingSet {
    TrainingSet {
        n_contexts: 4,
        n_total: 24,
        held_out: Vec::new(),
    }
}

fn bytes(trained: &Trained) -> [Vec<u8>; 3] {
    [&trained.mgp, &trained.igp, &trained.pgp].map(mtgp::MultiTaskModel::to_bytes)
}

fn trained_with(n_threads: usize, dir: &Path, reuse: Reuse) -> [Vec<u8>; 3] {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads);
    pool.build().expect("a pool").install(|| {
        let bench = Bench::new(Profile::Smoke, dir, reuse).expect("the data");
        bytes(&bench.trained(&small()).expect("the models"))
    })
}

#[test]
fn threads_do_not_change_the_models_and_their_files_are_used_again() {
    let (first, second) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let one = trained_with(1, first.path(), Reuse::Fits);
    let two = trained_with(2, second.path(), Reuse::Fits);
    assert!(one == two, "the files differ");

    let models = || {
        let mut files: Vec<_> = std::fs::read_dir(first.path().join("models"))
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .collect();
        files.sort();
        files
    };
    assert_eq!(models().len(), 3);
    // A spoilt file counts as missing; the others alone do not.
    std::fs::write(&models()[0], "spoilt").unwrap();
    let again = trained_with(1, first.path(), Reuse::Fits);
    assert!(one == again, "fitted again, but not the same");
    // What is there is read: a file of other contents would otherwise be replaced.
    let swapped = std::fs::read(&models()[0]).unwrap();
    std::fs::write(&models()[1], &swapped).unwrap();
    let read = trained_with(1, first.path(), Reuse::Fits);
    assert!(read != one, "the files were not read");
}

/// An experiment with the smallest settings that make sense.
fn smallest(name: &str, source: &str, changes: &[(&str, &str)]) -> Section5Experiment {
    let smoke = source.split("[profile.full]").next().expect("a part");
    let (_, text) = source.split_once("[text]").expect("a text");
    let mut source = format!("{smoke}[text]{text}");
    for (from, to) in changes {
        assert!(source.contains(from), "{name}: {from}");
        source = source.replacen(from, to, 1);
    }
    Section5Experiment::parse(name, &source).expect("an experiment")
}

#[test]
fn every_experiment_is_made_and_says_what_was_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let bench = Bench::new(Profile::Smoke, dir.path(), Reuse::Fits).unwrap();
    let context = smallest(
        "context",
        include_str!("../experiments/context.toml"),
        &[
            ("n_total = 280", "n_total = 28"),
            ("places = 24", "places = 2"),
            ("[1, 2, 5, 10, 50]", "[1, 10]"),
            ("tested = [\"p1s2\", \"p2s4\",", "tested = ["),
            ("\"p4s3\", \"p4s4\"]", "\"p4s3\"]"),
            ("windows = [0, 4, 16]", "windows = [0]"),
        ],
    );
    let section = make(&context, &bench).unwrap();
    let names: Vec<&str> = section
        .files
        .iter()
        .map(|(name, _)| name.as_str())
        .collect();
    for name in [
        "context_confusion.csv",
        "context_unknown.csv",
        "context_delays.csv",
        "context.png",
    ] {
        assert!(names.contains(&name), "{names:?}");
    }
    // Two layouts of ten samples, four ways to ask for the unknown load, one window.
    assert_eq!(section.findings.len(), 2 + 4 + 1);
    let table = section.table.unwrap();
    assert_eq!((table.rows.len(), table.header.len()), (6, 4));

    let novel = smallest(
        "novel",
        include_str!("../experiments/novel.toml"),
        &[
            ("n_total = 280", "n_total = 28"),
            ("[1, 2, 5, 10, 20, 50, 100, 200]", "[1, 5, 10]"),
            ("draws = 2", "draws = 1"),
            ("test_stride = 20", "test_stride = 500"),
        ],
    );
    let section = make(&novel, &bench).unwrap();
    let table = section.table.unwrap();
    assert_eq!((table.rows.len(), table.header.len()), (8, 5));
    let of = |learner: &str, column: usize| -> f64 {
        let row = table.rows.iter().find(|row| row[0] == learner).unwrap();
        row[column].parse().unwrap()
    };
    // Ten torques of six joints give ten parameters; nothing learned from 28 samples comes near.
    assert!(of("physics", 4) < 1e-9 && of("physics", 4) < of("mGP", 4));
}

#[test]
fn curves_of_transfer_meet_where_they_are_of_the_same_samples_and_are_kept() {
    let dir = tempfile::tempdir().unwrap();
    let bench = Bench::new(Profile::Smoke, dir.path(), Reuse::Fits).unwrap();
    let transfer = smallest(
        "transfer",
        include_str!("../experiments/transfer.toml"),
        &[
            ("joints = [1, 3, 6]", "joints = [6]"),
            ("others = [0, 1, 4, 13]", "others = [0, 13]"),
            ("n_each = 10 ", "n_each = 4 "),
            ("samples = [2, 10, 50]", "samples = [4, 6]"),
            ("n_each_other = 10", "n_each_other = 4"),
            ("test_stride = 20", "test_stride = 500"),
        ],
    );
    let section = make(&transfer, &bench).unwrap();
    let table = section.table.clone().unwrap();
    assert_eq!((table.rows.len(), table.header.len()), (4, 8));
    assert_eq!(section.findings.len(), 5);
    let text = section
        .files
        .iter()
        .find(|(name, _)| name == "transfer.csv");
    let text = String::from_utf8(text.unwrap().1.clone()).unwrap();
    let of = |axis: &str, count: &str, model: &str| -> f64 {
        let row = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let mut row = row.filter(|row| row[0] == axis && row[1] == count && row[4] == model);
        let row = row.next().expect("a row");
        row.last().expect("a column").parse().expect("a number")
    };
    let bits = |axis, count, model| of(axis, count, model).to_bits();
    // Alone, all models are one; sGP never sees the others.
    for model in ["iGP", "pGP", "mGP"] {
        assert_eq!(bits("others", "0", model), bits("others", "0", "sGP"));
    }
    assert_eq!(bits("others", "13", "sGP"), bits("others", "0", "sGP"));
    // 13 other loads and four samples of the target's own are a place on both curves.
    for model in ["sGP", "iGP", "pGP", "mGP"] {
        assert_eq!(bits("others", "13", model), bits("samples", "4", model));
    }
    assert_ne!(bits("samples", "6", "mGP"), bits("samples", "4", "mGP"));

    let kept = std::fs::read_dir(dir.path().join("transfer")).unwrap();
    assert_eq!(kept.count(), 2);
    assert_eq!(make(&transfer, &bench).unwrap(), section);
}
