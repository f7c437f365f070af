//! The models that the experiments of section 5 share: the same bits for any number of threads, fitted once.

use std::path::{Path, PathBuf};

use bench_suite::data_figures::section::Section;
use bench_suite::run::Reuse;
use bench_suite::section_experiment::SectionExperiment;
use bench_suite::section5::bench::Bench;
use bench_suite::section5::campaign::Campaign;
use bench_suite::section5::make;
use bench_suite::section5::trained::Trained;
use bench_suite::section5::training_set::TrainingSet;
use bench_suite::shard::Shard;
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
    [&trained.mgp, &trained.igp, &trained.pgp].map(torque_model::RobotModel::to_bytes)
}

fn trained_with(n_threads: usize, dir: &Path, reuse: Reuse) -> [Vec<u8>; 3] {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads);
    pool.build().expect("a pool").install(|| {
        let bench = Bench::new(dir, reuse, Shard::WHOLE).expect("the data");
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
    assert_eq!(models().len(), 3 * 6);
    // A spoilt file counts as missing; the others alone do not.
    std::fs::write(&models()[0], "spoilt").unwrap();
    let again = trained_with(1, first.path(), Reuse::Fits);
    assert!(one == again, "fitted again, but not the same");
    // What is there is read: a file of other contents would otherwise be replaced.
    let swapped = std::fs::read(&models()[0]).unwrap();
    std::fs::write(&models()[6], &swapped).unwrap();
    let read = trained_with(1, first.path(), Reuse::Fits);
    assert!(read != one, "the files were not read");
}

/// An experiment with the smallest settings that make sense.
fn smallest(name: &str, source: &str, changes: &[(&str, &str)]) -> SectionExperiment {
    let smoke = source.split("[profile.full]").next().expect("a part");
    let (_, text) = source.split_once("[text]").expect("a text");
    let mut source = format!("{smoke}[text]{text}");
    for (from, to) in changes {
        assert!(source.contains(from), "{name}: {from}");
        source = source.replacen(from, to, 1);
    }
    SectionExperiment::parse(name, &source).expect("an experiment")
}

/// The section of an experiment whose work is all there or computed now.
fn made(experiment: &SectionExperiment, campaign: &Campaign) -> Section {
    let section = make(experiment, campaign).expect("no failure");
    section.expect("nothing is missing")
}

/// Files of finished work of an experiment, in the order of their names.
fn kept(output: &Path, experiment: &str) -> Vec<PathBuf> {
    let versions = std::fs::read_dir(output.join("section5").join(experiment));
    let mut files: Vec<PathBuf> = versions
        .into_iter()
        .flatten()
        .flat_map(|version| std::fs::read_dir(version.expect("readable").path()).expect("readable"))
        .map(|file| file.expect("readable").path())
        .collect();
    files.sort();
    files
}

/// Five experiments with models of 28 samples, as small as they can be.
fn small_experiments() -> Vec<SectionExperiment> {
    let n_total = ("n_total = 280", "n_total = 28");
    let rbd = [
        n_total,
        ("[1, 3, 6]", "[3]"),
        ("[20, 170]", "[20, 21]"),
        ("many_joints = [3]", "many_joints = []"),
    ];
    let closed_loop = [
        n_total,
        ("loads = [3, 12]", "loads = [3]"),
        ("new_samples = 50", "new_samples = 5"),
        ("followed = [\"p2s3\", \"p2s4\"]", "followed = [\"p2s4\"]"),
        ("[4.0, 8.0, 16.0, 32.0]", "[32.0]"),
    ];
    let novel = [
        n_total,
        ("[1, 2, 5, 10, 20, 50, 100, 200]", "[5, 10]"),
        ("draws = 2", "draws = 1"),
        ("test_stride = 20", "test_stride = 500"),
    ];
    let sampled = [
        n_total,
        ("n_warmup = 60", "n_warmup = 4"),
        ("n_draws = 60", "n_draws = 6"),
        ("max_depth = 6", "max_depth = 2"),
        ("n_mixture = 20", "n_mixture = 2"),
    ];
    vec![
        smallest(
            "models",
            include_str!("../experiments/models.toml"),
            &[n_total],
        ),
        smallest("novel", include_str!("../experiments/novel.toml"), &novel),
        smallest("rbd", include_str!("../experiments/rbd.toml"), &rbd),
        smallest(
            "sampled",
            include_str!("../experiments/sampled.toml"),
            &sampled,
        ),
        smallest(
            "closed_loop",
            include_str!("../experiments/closed_loop.toml"),
            &closed_loop,
        ),
    ]
}

#[test]
fn shards_share_the_work_a_lost_part_is_computed_again_and_results_are_only_read() {
    let (alone, shared) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let experiments = small_experiments();
    let campaign = |output: &Path, reuse| Campaign::new(Profile::Smoke, output, reuse);
    let whole = campaign(alone.path(), Reuse::Fits).with_threads(1);
    let expected: Vec<Section> = experiments.iter().map(|one| made(one, &whole)).collect();
    let n_all = whole.into_tally().n_computed();

    let mut n_shared = 0;
    for shard in ["2/2", "1/2"] {
        let share = campaign(shared.path(), Reuse::Fits).with_shard(shard.parse().unwrap());
        for experiment in &experiments {
            make(experiment, &share).expect("no failure");
        }
        let tally = share.into_tally();
        assert!(tally.n_computed() >= n_all / 2, "{shard}: {tally:?}");
        assert_eq!((tally.n_reused, tally.missing.len()), (0, 0));
        n_shared += tally.n_computed();
    }
    assert_eq!(n_shared, n_all);

    for (experiment, expected) in experiments.iter().zip(&expected) {
        let name = &experiment.name;
        let stored = campaign(shared.path(), Reuse::Results);
        assert_eq!(
            numbers(&made(experiment, &stored)),
            numbers(expected),
            "{name}"
        );

        let files = kept(shared.path(), name);
        assert!(files.len() > 1 || name == "sampled", "{name}: {files:?}");
        std::fs::write(&files[0], "cut short").unwrap();
        let stored = campaign(shared.path(), Reuse::Results);
        assert_eq!(make(experiment, &stored).unwrap(), None, "{name}");
        assert_eq!(stored.into_tally().missing.len(), 1, "{name}");
        let again = campaign(shared.path(), Reuse::Fits);
        assert_eq!(
            numbers(&made(experiment, &again)),
            numbers(expected),
            "{name}"
        );
        let tally = again.into_tally();
        assert_eq!(
            (tally.n_computed(), tally.n_reused),
            (1, files.len() - 1),
            "{name}"
        );
    }
}

/// The CSV files, in which there are no seconds.
fn numbers(section: &Section) -> Vec<(&str, &str)> {
    let tables = section
        .files
        .iter()
        .filter(|(name, _)| Path::new(name).extension().is_some_and(|e| e == "csv"));
    let text = |contents| std::str::from_utf8(contents).expect("text");
    tables
        .map(|(name, contents)| (name.as_str(), text(contents)))
        .collect()
}

#[test]
fn every_experiment_is_made_and_says_what_was_asked_for() {
    let dir = tempfile::tempdir().unwrap();
    let campaign = Campaign::new(Profile::Smoke, dir.path(), Reuse::Fits);
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
    let section = made(&context, &campaign);
    let names: Vec<&str> = section
        .files
        .iter()
        .map(|(name, _)| name.as_str())
        .collect();
    for name in [
        "context_confusion.csv",
        "context_unknown.csv",
        "context_delays.csv",
        "context_shared.csv",
        "context.png",
    ] {
        assert!(names.contains(&name), "{names:?}");
    }
    // Two layouts of ten samples, four ways to ask for the unknown load, one window, rbd learned without noise for three noises and with two.
    assert_eq!(section.findings.len(), 2 + 4 + 1 + 3 + 2);
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
    let section = made(&novel, &campaign);
    let table = section.table.unwrap();
    assert_eq!((table.rows.len(), table.header.len()), (10, 5));
    let of = |learner: &str, column: usize| -> f64 {
        let row = table.rows.iter().find(|row| row[0] == learner).unwrap();
        row[column].parse().unwrap()
    };
    // Ten torques of six joints give ten parameters; no process of 28 samples comes near.
    assert!(of("physics", 4) < 1e-9 && of("physics", 4) < of("mGP", 4));
    assert!(of("rbd-shared-signs", 4) < of("mGP", 4));
}

#[test]
fn curves_of_transfer_meet_where_they_are_of_the_same_samples_and_are_kept() {
    let dir = tempfile::tempdir().unwrap();
    let campaign = Campaign::new(Profile::Smoke, dir.path(), Reuse::Fits);
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
    let section = made(&transfer, &campaign);
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

    assert_eq!(kept(dir.path(), "transfer").len(), 2);
    assert_eq!(made(&transfer, &campaign), section);
}
