//! Fingerprint of everything that a fit's numbers depend on, for `store.rs`.
//!
//! A finished cell is reused as long as this text hash is unchanged; reports and pictures are not part of it.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};

/// Sources, data and dependencies that the numbers of a cell come from.
const MEASURED_BY: [&str; 11] = [
    "Cargo.lock",
    "fixtures/scenario.toml",
    "crates/puma-dyn/src",
    "crates/kernels/src",
    "crates/gp-core/src",
    "crates/bench-suite/src/seed.rs",
    "crates/bench-suite/src/split.rs",
    "crates/bench-suite/src/dataset.rs",
    "crates/bench-suite/src/models.rs",
    "crates/bench-suite/src/measure.rs",
    "crates/bench-suite/src/metrics.rs",
];

/// What the units of the many-contexts experiments come from beside these.
const MANY_MEASURED_BY: [&str; 4] = [
    "crates/mtgp/src",
    "crates/bench-suite/src/multi/draw.rs",
    "crates/bench-suite/src/multi/measure.rs",
    "crates/bench-suite/src/multi/shared.rs",
];

/// What the models of section 5 come from beside all of these.
const TRAINED_BY: [&str; 2] = [
    "crates/bench-suite/src/section5/trained.rs",
    "crates/bench-suite/src/section5/training_set.rs",
];

/// What the parts of an experiment of section 5 come from beside all of these.
const SECTION5: [(&str, &str); 7] = [
    ("CLOSED_LOOP", "closed_loop"),
    ("CONTEXT", "context"),
    ("MODELS", "models.rs"),
    ("NOVEL", "novel"),
    ("RBD", "rbd"),
    ("SAMPLED", "sampled"),
    ("TRANSFER", "transfer"),
];

/// Files of these that only report what was measured; all others count as behind the numbers.
const REPORTING: [&str; 4] = ["confusion.rs", "findings.rs", "picture.rs", "table.rs"];

fn main() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut hasher = DefaultHasher::new();
    for (name, paths) in [
        ("MEASURED_BY", &MEASURED_BY[..]),
        ("MANY_MEASURED_BY", &MANY_MEASURED_BY),
        ("TRAINED_BY", &TRAINED_BY),
    ] {
        add(&mut hasher, &root, paths)?;
        println!("cargo:rustc-env={name}={:016x}", hasher.finish());
    }
    for (name, path) in SECTION5 {
        let mut hasher = hasher.clone();
        let section5 = "crates/bench-suite/src/section5";
        let own = format!("{section5}/{path}");
        add(
            &mut hasher,
            &root,
            &[&format!("{section5}/normal.rs"), &own],
        )?;
        println!(
            "cargo:rustc-env={name}_MEASURED_BY={:016x}",
            hasher.finish()
        );
    }
    println!("cargo:rerun-if-changed=build.rs");
    Ok(())
}

/// Names and contents of all files.
fn add(hasher: &mut DefaultHasher, root: &Path, names: &[&str]) -> std::io::Result<()> {
    for name in names {
        println!("cargo:rerun-if-changed={}", root.join(name).display());
        for file in files_under(&root.join(name))? {
            if is_reporting(&file) {
                continue;
            }
            file.strip_prefix(root).unwrap_or(&file).hash(hasher);
            std::fs::read(&file)?.hash(hasher);
        }
    }
    Ok(())
}

/// Whether a file has no part in any number: it reports, or is prose.
fn is_reporting(file: &Path) -> bool {
    let name = file.file_name().and_then(|name| name.to_str());
    let is_named = name.is_some_and(|name| REPORTING.contains(&name));
    let is_of_section5 = file.iter().any(|folder| folder == "section5");
    is_named && is_of_section5 || file.extension().is_some_and(|e| e == "md")
}

/// The file itself, or every file below a directory in the order of the names.
fn files_under(path: &Path) -> std::io::Result<Vec<PathBuf>> {
    if !path.is_dir() {
        return Ok(if path.exists() {
            vec![path.to_path_buf()]
        } else {
            Vec::new()
        });
    }
    let mut entries = std::fs::read_dir(path)?
        .map(|entry| entry.map(|e| e.path()))
        .collect::<Result<Vec<_>, _>>()?;
    entries.sort();
    let nested: Result<Vec<_>, _> = entries.iter().map(|entry| files_under(entry)).collect();
    Ok(nested?.concat())
}
