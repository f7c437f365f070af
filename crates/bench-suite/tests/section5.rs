//! The models that the experiments of section 5 share: the same bits for any number of threads, fitted once.

use std::path::Path;

use bench_suite::run::Reuse;
use bench_suite::section5::bench::Bench;
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
    pool.build().unwrap().install(|| {
        let bench = Bench::new(Profile::Smoke, dir, reuse).unwrap();
        bytes(&bench.trained(&small()).unwrap())
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
