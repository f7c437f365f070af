//! Fingerprint of everything that a fit's numbers depend on, for `store.rs`.
//!
//! A finished cell is reused as long as this text hash is unchanged; reports and pictures are not part of it.

use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};

/// Sources, data and dependencies that the numbers of a cell come from.
const MEASURED_BY: [&str; 9] = [
    "Cargo.lock",
    "fixtures/scenario.toml",
    "crates/puma-dyn/src",
    "crates/kernels/src",
    "crates/gp-core/src",
    "crates/bench-suite/src/seed.rs",
    "crates/bench-suite/src/split.rs",
    "crates/bench-suite/src/dataset.rs",
    "crates/bench-suite/src/models.rs",
];

/// What the units of the many-contexts experiments come from beside these.
const MANY_MEASURED_BY: [&str; 4] = [
    "crates/mtgp/src",
    "crates/bench-suite/src/multi/draw.rs",
    "crates/bench-suite/src/multi/measure.rs",
    "crates/bench-suite/src/multi/shared.rs",
];

/// What models with the prior of section 3.2 come from beside these and those.
const RIGID_BODY_MEASURED_BY: [&str; 2] = [
    "crates/bench-suite/src/measure.rs",
    "crates/bench-suite/src/rigid_body",
];

/// What the models of section 5 come from beside those of cells and units.
const TRAINED_BY: [&str; 2] = [
    "crates/bench-suite/src/section5/trained.rs",
    "crates/bench-suite/src/section5/training_set.rs",
];

/// What the learning curves of transfer come from beside all of these.
const TRANSFER_MEASURED_BY: [&str; 1] = ["crates/bench-suite/src/section5/transfer/measure.rs"];

fn main() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut hasher = DefaultHasher::new();
    add(&mut hasher, &root, &MEASURED_BY)?;
    println!("cargo:rustc-env=MEASURED_BY={:016x}", hasher.finish());
    add(&mut hasher, &root, &MANY_MEASURED_BY)?;
    println!("cargo:rustc-env=MANY_MEASURED_BY={:016x}", hasher.finish());
    let mut of_rigid_body = hasher.clone();
    add(&mut of_rigid_body, &root, &RIGID_BODY_MEASURED_BY)?;
    println!(
        "cargo:rustc-env=RIGID_BODY_MEASURED_BY={:016x}",
        of_rigid_body.finish()
    );
    add(&mut hasher, &root, &TRAINED_BY)?;
    println!("cargo:rustc-env=TRAINED_BY={:016x}", hasher.finish());
    add(&mut hasher, &root, &TRANSFER_MEASURED_BY)?;
    println!(
        "cargo:rustc-env=TRANSFER_MEASURED_BY={:016x}",
        hasher.finish()
    );
    println!("cargo:rerun-if-changed=build.rs");
    Ok(())
}

/// Names and contents of all files.
fn add(hasher: &mut DefaultHasher, root: &Path, names: &[&str]) -> std::io::Result<()> {
    for name in names {
        println!("cargo:rerun-if-changed={}", root.join(name).display());
        for file in files_under(&root.join(name))? {
            file.strip_prefix(root).unwrap_or(&file).hash(hasher);
            std::fs::read(&file)?.hash(hasher);
        }
    }
    Ok(())
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
