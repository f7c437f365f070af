//! Fingerprints of everything that numbers depend on, for `store.rs`, and the revision that is compiled.
//!
//! A finished cell is reused as long as its fingerprint is unchanged; reports, pictures, prose, and packages that only
//! these need are not part of it.

#[path = "src/revision.rs"]
mod revision;

use std::collections::BTreeSet;
use std::collections::hash_map::DefaultHasher;
use std::hash::{Hash, Hasher};
use std::path::{Path, PathBuf};

/// Sources, data and dependencies that the numbers of a cell come from.
const MEASURED_BY: [&str; 12] = [
    "fixtures/scenario.toml",
    "crates/puma-dyn/src",
    "crates/linalg/src",
    "crates/kernels/src",
    "crates/gp-core/src",
    "crates/bench-suite/src/seed.rs",
    "crates/bench-suite/src/split.rs",
    "crates/bench-suite/src/dataset.rs",
    "crates/bench-suite/src/fit_summary.rs",
    "crates/bench-suite/src/models.rs",
    "crates/bench-suite/src/measure.rs",
    "crates/bench-suite/src/metrics.rs",
];

/// Members of the workspace that numbers come from.
const MEMBERS: [&str; 6] = [
    "puma-dyn",
    "linalg",
    "kernels",
    "gp-core",
    "mtgp",
    "torque-model",
];

/// Packages that this one's own numbers come from.
const PACKAGES: [&str; 4] = ["faer", "rayon", "rand_chacha", "sha2"];

/// What the units of the many-contexts experiments come from beside these.
const MANY_MEASURED_BY: [&str; 5] = [
    "crates/mtgp/src",
    "crates/bench-suite/src/multi/bench.rs",
    "crates/bench-suite/src/multi/draw.rs",
    "crates/bench-suite/src/multi/measure.rs",
    "crates/bench-suite/src/multi/shared.rs",
];

/// What models with the prior of section 3.2 come from beside these and those.
const RIGID_BODY_MEASURED_BY: [&str; 2] = [
    "crates/torque-model/src",
    "crates/bench-suite/src/rigid_body",
];

/// What the models of section 5 come from beside those of cells and units.
const TRAINED_BY: [&str; 2] = [
    "crates/bench-suite/src/section5/trained.rs",
    "crates/bench-suite/src/section5/training_set.rs",
];

/// Files of these that only report what was measured; all others count as behind the numbers.
const REPORTING: [&str; 5] = [
    "confusion.rs",
    "counts.rs",
    "findings.rs",
    "picture.rs",
    "table.rs",
];

fn main() -> std::io::Result<()> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut hasher = DefaultHasher::new();
    let mut packages = BTreeSet::from(PACKAGES.map(String::from));
    for member in MEMBERS {
        let manifest = read(&root.join("crates").join(member).join("Cargo.toml"))?;
        packages.extend(dependencies_of_manifest(&manifest));
    }
    locked(&read(&root.join("Cargo.lock"))?, packages).hash(&mut hasher);
    for (name, paths) in [
        ("MEASURED_BY", &MEASURED_BY[..]),
        ("MANY_MEASURED_BY", &MANY_MEASURED_BY),
        ("RIGID_BODY_MEASURED_BY", &RIGID_BODY_MEASURED_BY),
        ("TRAINED_BY", &TRAINED_BY),
    ] {
        add(&mut hasher, &root, paths)?;
        println!("cargo:rustc-env={name}={:016x}", hasher.finish());
    }
    let mut of_section5 = Vec::new();
    for name in experiments_of_section5()? {
        let mut hasher = hasher.clone();
        let folder = "crates/bench-suite/src/section5";
        let own = ["normal.rs".to_string(), name.clone(), format!("{name}.rs")];
        for file in own.map(|file| format!("{folder}/{file}")) {
            if root.join(&file).exists() {
                add(&mut hasher, &root, &[&file])?;
            }
        }
        let fingerprint = format!("{:016x}", hasher.finish());
        let variable = name.to_uppercase();
        println!("cargo:rustc-env={variable}_MEASURED_BY={fingerprint}");
        of_section5.push(format!("{name}={fingerprint}"));
    }
    let of_section5 = of_section5.join(" ");
    println!("cargo:rustc-env=SECTION5_MEASURED_BY={of_section5}");
    println!("cargo:rerun-if-changed=build.rs");
    println!("cargo:rerun-if-changed=src");
    println!("cargo:rustc-env=COMPILED_FROM={}", revision::of(&root));
    Ok(())
}

/// The experiments that are described as of section 5; each has a folder or a file of its name.
fn experiments_of_section5() -> std::io::Result<Vec<String>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
    println!("cargo:rerun-if-changed={}", folder.display());
    let mut names = Vec::new();
    for file in files_under(&folder)? {
        let is_one = read(&file)?.contains("\nkind = \"section5\"\n");
        let stem = file.file_stem().filter(|_| is_one);
        names.extend(stem.map(|stem| stem.to_string_lossy().into_owned()));
    }
    Ok(names)
}

fn read(path: &Path) -> std::io::Result<String> {
    println!("cargo:rerun-if-changed={}", path.display());
    std::fs::read_to_string(path)
}

/// Names in the section `[dependencies]` of a manifest, without those of the workspace itself.
fn dependencies_of_manifest(manifest: &str) -> impl Iterator<Item = String> {
    let section = manifest.split("[dependencies]").nth(1).unwrap_or("");
    let lines = section.lines().take_while(|line| !line.starts_with('['));
    let names = lines.filter_map(|line| line.split(['.', ' ', '=']).next());
    let is_package = |name: &&str| !name.is_empty() && !name.starts_with('#');
    let names = names
        .filter(is_package)
        .filter(|name| !MEMBERS.contains(name));
    names.map(String::from)
}

/// The entries of the lock file that some packages need, directly or not; of a name, all versions.
fn locked(lock_file: &str, mut needed: BTreeSet<String>) -> Vec<&str> {
    let entries: Vec<&str> = lock_file.split("[[package]]").skip(1).collect();
    loop {
        let chosen: Vec<&str> = (entries.iter().copied())
            .filter(|entry| needed.contains(name(entry)))
            .collect();
        let n_before = needed.len();
        let of_chosen = chosen.iter().flat_map(|entry| dependencies(entry));
        needed.extend(of_chosen.map(String::from));
        if needed.len() == n_before {
            return chosen;
        }
    }
}

/// Name in an entry: `name = "faer"`.
fn name(entry: &str) -> &str {
    let after = entry.split("name = \"").nth(1);
    after.and_then(|text| text.split('"').next()).unwrap_or("")
}

/// Names in the list of an entry, whose items are `"faer"` or `"faer 0.24.4"`.
fn dependencies(entry: &str) -> impl Iterator<Item = &str> {
    let list = entry.split("dependencies = [").nth(1).unwrap_or("");
    let quoted = list.split('"').skip(1).step_by(2);
    quoted.filter_map(|item| item.split(' ').next())
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
