//! Reads the CSV fixtures and their provenance.

use std::path::PathBuf;

/// A table of numbers with named columns, and the joints in the order of its columns.
pub struct Fixture {
    header: Vec<String>,
    rows: Vec<Vec<f64>>,
    pub joints: Vec<String>,
}

/// The path of a file under `fixtures/`.
pub fn path(name: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("../../fixtures")
        .join(name)
}

fn text(name: &str) -> String {
    std::fs::read_to_string(path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

impl Fixture {
    /// Reads `fixtures/puma-dyn/{name}.csv` and `.toml`.
    pub fn load(name: &str) -> Self {
        let csv = text(&format!("puma-dyn/{name}.csv"));
        let mut reader = csv::Reader::from_reader(csv.as_bytes());
        let header = reader
            .headers()
            .expect("a header")
            .iter()
            .map(str::to_owned)
            .collect();
        let rows = reader
            .deserialize()
            .collect::<Result<Vec<Vec<f64>>, _>>()
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(!rows.is_empty(), "{name} is empty");
        let toml: toml::Table = text(&format!("puma-dyn/{name}.toml"))
            .parse()
            .expect("TOML");
        let joints = toml["joints"].clone().try_into().expect("a list of names");
        Self {
            header,
            rows,
            joints,
        }
    }

    pub fn rows(&self) -> &[Vec<f64>] {
        &self.rows
    }

    /// The `n` columns that begin with `first`, of one row.
    pub fn block<'a>(&self, row: &'a [f64], first: &str, n: usize) -> &'a [f64] {
        let start = self.header.iter().position(|name| name == first);
        let start = start.unwrap_or_else(|| panic!("no column {first}"));
        &row[start..start + n]
    }

    /// The largest absolute value in the `n` columns that begin with `first`, over all rows.
    pub fn scale(&self, first: &str, n: usize) -> f64 {
        let values = self.rows.iter().flat_map(|row| self.block(row, first, n));
        values.fold(0.0, |largest: f64, value| largest.max(value.abs()))
    }
}

/// Fails if two lists differ by more than `tolerance` anywhere, with the two values.
#[track_caller]
pub fn assert_close(ours: &[f64], expected: &[f64], tolerance: f64, what: &str) {
    assert_eq!(ours.len(), expected.len(), "{what}");
    for (idx, (ours, expected)) in ours.iter().zip(expected).enumerate() {
        let error = (ours - expected).abs();
        assert!(
            error <= tolerance,
            "{what}, entry {idx}: {ours} is not {expected} (error {error:e} > {tolerance:e})"
        );
    }
}
