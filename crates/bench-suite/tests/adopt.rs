//! Results of an earlier revision: taken over if witnesses come out the same, all or none.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;

use bench_suite::adopt::{Adoption, Request, adopt};
use bench_suite::cell::{Cell, ModelKind};
use bench_suite::run::{Reuse, RunOutcome, run};
use bench_suite::section_experiment::SectionExperiment;
use bench_suite::section5::campaign::Campaign;
use bench_suite::section5::make;
use bench_suite::section5::part::measured_by;
use bench_suite::spec::Profile;
use bench_suite::store::{MEASURED_BY, Store, of_cells};

const EARLIER: &str = "00000000000000aa";

fn cells() -> BTreeSet<Cell> {
    let cell = |(load, model)| Cell {
        seed: "test".to_string(),
        load,
        joint: 1,
        model,
        n: 20,
    };
    let (lr, gp) = (ModelKind::LrCoulomb, ModelKind::GpCoulomb);
    [(1, lr), (2, lr), (1, gp)].map(cell).into()
}

fn run_in(output: &Path, reuse: Reuse) -> RunOutcome {
    let store = Store::open(of_cells(output)).expect("a store");
    run(&cells(), &store, reuse, 1).expect("a run")
}

/// Cells as an earlier revision would have left them.
fn old_cells(output: &Path) -> Vec<PathBuf> {
    run_in(output, Reuse::Fits);
    let earlier = output.join("cells").join(EARLIER);
    std::fs::rename(of_cells(output), &earlier).expect("a directory");
    files(&earlier, |text| text.replace(MEASURED_BY, EARLIER))
}

/// Changes the texts of all files of a directory.
fn files(directory: &Path, change: impl Fn(String) -> String) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(directory).expect("a directory");
    let mut files: Vec<PathBuf> = entries.map(|e| e.expect("readable").path()).collect();
    files.sort();
    for path in &files {
        let text = std::fs::read_to_string(path).expect("a text");
        std::fs::write(path, change(text)).expect("writable");
    }
    files
}

fn request(from: &Path, output: &Path, n_witnesses: usize) -> Request {
    Request {
        from: from.to_path_buf(),
        output: output.to_path_buf(),
        n_witnesses,
        n_threads: 1,
        experiments: Vec::new(),
    }
}

#[test]
fn results_that_differ_in_the_fingerprints_alone_are_adopted_and_not_computed_again() {
    let [old, new] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let kept = old_cells(old.path());
    let unknown = old.path().join("cells/later.toml");
    std::fs::write(
        &unknown,
        "key = \"format 9\"\n[record]\nx = 1\n# end of cell\n",
    )
    .unwrap();
    let cut = old.path().join("cells/cut.toml");
    let text = std::fs::read_to_string(&kept[0]).unwrap();
    std::fs::write(&cut, &text[..text.len() - 5]).unwrap();

    let adoption = adopt(&request(old.path(), new.path(), 1)).unwrap();
    let reason = "not a whole result of a known kind";
    let unread = [&cut, &unknown].map(|path| format!("{}: {reason}", path.display()));
    let expected = Adoption {
        n_adopted: 3,
        n_witnesses: 2, // one of each model
        unread: unread.to_vec(),
        ..Adoption::default()
    };
    assert_eq!(adoption, expected);
    let outcome = run_in(new.path(), Reuse::Results);
    assert_eq!((outcome.n_reused, outcome.missing.len()), (3, 0));

    // Once more there is nothing to do, and another fingerprint in the same place is as good.
    let again = adopt(&request(&old.path().join("cells"), new.path(), 1)).unwrap();
    assert_eq!(
        (again.n_adopted, again.n_there, again.n_witnesses),
        (0, 3, 0)
    );
}

#[test]
fn one_digit_that_is_not_computed_again_stops_everything() {
    let old = tempfile::tempdir().unwrap();
    let kept = old_cells(old.path());
    let text = std::fs::read_to_string(&kept[0]).unwrap();
    let line = text.lines().find(|l| l.starts_with("nmse_interp")).unwrap();
    let is: f64 = line.split(" = ").nth(1).unwrap().parse().unwrap();
    let was = is.next_up();
    let altered = format!("nmse_interp = {was:?}");
    std::fs::write(&kept[0], text.replace(line, &altered)).unwrap();

    let arguments = ["adopt", "--threads", "1", "--from"];
    let output = Command::new(env!("CARGO_BIN_EXE_bench-suite"))
        .args(arguments)
        .args([old.path(), Path::new("--output"), old.path()])
        .output()
        .unwrap();
    let stdout = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(2), "{stdout}");
    let expected = format!("n = 20: nmse_interp was {was:?}, is {is:?}\n");
    assert!(stdout.contains(&expected), "{stdout}");
    assert!(stdout.contains("Nothing is adopted"), "{stdout}");
    let left: Vec<_> = std::fs::read_dir(old.path()).unwrap().collect();
    assert_eq!(left.len(), 1, "{left:?}");
    assert!(!of_cells(old.path()).exists());
}

/// The experiment about the models themselves, of two samples a load.
fn models() -> SectionExperiment {
    let text = "name = \"models\"\nkind = \"section5\"\ntitle = \"t\"\n[profile.smoke]\nn_total = 28\n[text]\nanalysis = \"a\"\n";
    SectionExperiment::parse("models", text).expect("an experiment")
}

fn is_made(output: &Path, reuse: Reuse) -> bool {
    let campaign = Campaign::new(Profile::Smoke, output, reuse);
    make(&models(), &campaign).expect("no failure").is_some()
}

#[test]
fn model_files_and_parts_of_section_5_are_adopted_together() {
    let [old, new, swapped] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    assert!(is_made(old.path(), Reuse::Fits));
    let today = measured_by("models").unwrap();
    let parts = old.path().join("section5/models");
    std::fs::rename(parts.join(today), parts.join(EARLIER)).unwrap();
    files(&parts.join(EARLIER), |text| text.replace(today, EARLIER));
    let models_of = |output: &Path| -> Vec<PathBuf> {
        let entries = std::fs::read_dir(output.join("models")).unwrap();
        entries.map(|entry| entry.unwrap().path()).collect()
    };
    std::fs::create_dir(swapped.path().join("models")).unwrap();
    for path in models_of(old.path()) {
        let name = path.file_name().unwrap().to_str().unwrap();
        let (stem, _) = name.rsplit_once('-').unwrap();
        let earlier = path.with_file_name(format!("{stem}-{EARLIER}.tgp"));
        std::fs::rename(&path, &earlier).unwrap();
        // There, every pGP passes for the mGP too.
        let of_other = format!("models/{stem}-{EARLIER}.tgp").replace("pgp", "mgp");
        if !stem.starts_with("mgp") {
            let name = earlier.file_name().unwrap();
            std::fs::copy(&earlier, swapped.path().join("models").join(name)).unwrap();
        }
        if stem.starts_with("pgp") {
            std::fs::copy(&earlier, swapped.path().join(of_other)).unwrap();
        }
    }

    let request = |from: &Path, output: &Path| Request {
        experiments: vec![models()],
        ..request(from, output, 1)
    };
    let adoption = adopt(&request(old.path(), new.path())).unwrap();
    assert_eq!(
        (adoption.differences, adoption.unread),
        (Vec::new(), Vec::new())
    );
    // 18 files and 18 lines of the table; a joint and a line of each model are witnesses.
    assert_eq!((adoption.n_adopted, adoption.n_witnesses), (36, 4));
    assert!(is_made(new.path(), Reuse::Results));
    assert_eq!(models_of(new.path()).len(), 18);

    let adoption = adopt(&request(swapped.path(), swapped.path())).unwrap();
    assert_eq!((adoption.n_adopted, adoption.differences.len()), (0, 1));
    let line = &adoption.differences[0];
    assert!(
        line.contains("mgp-joint") && line.contains(": byte "),
        "{line}"
    );
    assert_eq!(models_of(swapped.path()).len(), 18);
}
