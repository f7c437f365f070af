//! Finished cells as files, found again by the hash of everything that determines them.

use std::io::Write;
use std::path::{Path, PathBuf};

use atomic_write_file::AtomicWriteFile;
use serde::{Deserialize, Serialize};

use crate::cell::{Cell, CellRecord};
use crate::digest::sha256_hex;
use crate::error::BenchError;

/// Fingerprint of sources, data and dependencies, made by the build script.
pub const MEASURED_BY: &str = env!("MEASURED_BY");

/// Last line of a whole file: TOML that is cut short can still be TOML.
const END: &str = "# end of cell\n";

/// Directory of finished cells: one file a cell, written atomically, never changed.
#[derive(Debug, Clone)]
pub struct Store {
    dir: PathBuf,
}

/// A file of the store: the text that was hashed, and the result.
#[derive(Serialize, Deserialize)]
struct StoredCell {
    key: String,
    record: CellRecord,
}

impl Store {
    /// Store in a directory, which is created if missing.
    ///
    /// # Errors
    /// `Io` if the directory cannot be created.
    pub fn open(dir: impl Into<PathBuf>) -> Result<Self, BenchError> {
        let dir = dir.into();
        std::fs::create_dir_all(&dir).map_err(BenchError::io(&dir))?;
        Ok(Self { dir })
    }

    /// Result of a cell, if it is finished; an unreadable file counts as unfinished.
    pub fn load(&self, cell: &Cell) -> Option<CellRecord> {
        let text = std::fs::read_to_string(self.path(cell)).ok()?;
        let stored: StoredCell = toml::from_str(text.strip_suffix(END)?).ok()?;
        (stored.key == key(cell) && stored.record.cell == *cell).then_some(stored.record)
    }

    /// Keeps the result of a cell.
    ///
    /// # Errors
    /// `Io` if the file cannot be written; then no file is left.
    pub fn save(&self, record: &CellRecord) -> Result<(), BenchError> {
        let path = self.path(&record.cell);
        let stored = StoredCell {
            key: key(&record.cell),
            record: record.clone(),
        };
        let text = toml::to_string(&stored).map_err(|e| BenchError::malformed(&path, e))?;
        write_atomically(&path, (text + END).as_bytes())
    }

    fn path(&self, cell: &Cell) -> PathBuf {
        let hash = sha256_hex(key(cell).as_bytes());
        self.dir.join(format!("{}.toml", &hash[..32]))
    }
}

/// Everything that a cell's numbers depend on.
fn key(cell: &Cell) -> String {
    format!(
        "format 3; measured by {MEASURED_BY}; seed {}; load c{}; joint {}; model {}; n {}",
        cell.seed,
        cell.load,
        cell.joint,
        cell.model.name(),
        cell.n
    )
}

/// Writes a file so that an interruption leaves the old contents or the new ones, never a part.
///
/// # Errors
/// `Io` if it cannot be written.
pub fn write_atomically(path: &Path, contents: &[u8]) -> Result<(), BenchError> {
    let write = || {
        let mut file = AtomicWriteFile::open(path)?;
        file.write_all(contents)?;
        file.commit()
    };
    write().map_err(BenchError::io(path))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{FitSummary, ModelKind, StartSummary};

    fn record() -> CellRecord {
        CellRecord {
            nmse_interp: 0.1 + 0.2,
            nmse_extrap: 3e-10,
            seconds_fit: 1.5,
            seconds_predict: 0.25,
            cell: Cell {
                seed: "s".into(),
                load: 3,
                joint: 6,
                model: ModelKind::GpCoulomb,
                n: 170,
            },
            fit: Some(FitSummary {
                log_marginal_likelihood: -705.25,
                start: "eq22".into(),
                iterations: 7,
                evaluations: 11,
                stop: "gradient-small".into(),
                recoveries: 0,
                noise_std: 0.01,
                hyperparameters: vec![1.0, 1.0 / 3.0],
                bounds_hit: vec!["noise_std".into()],
                method: "dense".into(),
                rank: 170,
                error_bound: 1e-9,
                starts: vec![StartSummary {
                    samples: 170,
                    name: "eq22".into(),
                    log_marginal_likelihood: f64::NEG_INFINITY,
                    evaluations: 1,
                    work: 1.0,
                    projected_gradient: 0.5,
                    stop: "start-undefined".into(),
                }],
            }),
        }
    }

    #[test]
    fn a_saved_cell_comes_back_bit_for_bit() {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        assert_eq!(store.load(&record().cell), None);
        store.save(&record()).unwrap();
        assert_eq!(store.load(&record().cell), Some(record()));
    }

    #[test]
    fn another_cell_is_another_file() {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        store.save(&record()).unwrap();
        let other = Cell {
            n: 171,
            ..record().cell
        };
        assert_eq!(store.load(&other), None);
    }

    #[test]
    fn a_truncated_file_counts_as_unfinished() {
        let dir = tempfile::tempdir().unwrap();
        let store = Store::open(dir.path()).unwrap();
        store.save(&record()).unwrap();
        let path = store.path(&record().cell);
        let text = std::fs::read_to_string(&path).unwrap();
        for length in 0..text.len() {
            std::fs::write(&path, &text.as_bytes()[..length]).unwrap();
            assert_eq!(store.load(&record().cell), None, "{length} bytes");
        }
    }
}
