//! Finished cells as files, found again by the hash of everything that determines them.

use std::fmt::{Debug, Display};
use std::io::Write;
use std::path::{Path, PathBuf};

use atomic_write_file::AtomicWriteFile;
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::cell::{Cell, CellRecord, ModelKind};
use crate::digest::sha256_hex;
use crate::error::BenchError;

/// Fingerprint of sources, data and dependencies behind a cell, made by the build script.
pub const MEASURED_BY: &str = env!("MEASURED_BY");
/// The same for a unit of the many-contexts experiments.
pub const MANY_MEASURED_BY: &str = env!("MANY_MEASURED_BY");
/// The same for cells and units of models with the prior of section 3.2.
pub const RIGID_BODY_MEASURED_BY: &str = env!("RIGID_BODY_MEASURED_BY");

/// Last line of a whole file: TOML that is cut short can still be TOML.
const END: &str = "# end of cell\n";

/// Directory of finished cells inside an output directory.
pub fn of_cells(output: &Path) -> PathBuf {
    output.join("cells").join(MEASURED_BY)
}

/// Directory of finished units inside an output directory.
pub fn of_units(output: &Path) -> PathBuf {
    output.join("units").join(MANY_MEASURED_BY)
}

/// A piece of work whose result is kept: a cell, or a unit of the many-contexts experiments.
pub trait Work: Ord + Clone + Debug + Display + Sync {
    /// Its result.
    type Record: Finished<Work = Self>;

    /// Everything that the numbers of the result depend on.
    fn key(&self) -> String;

    /// Key of an order in which what takes longer is greater.
    fn cost(&self) -> impl Ord;

    /// Name of the file that keeps its result.
    fn file_name(&self) -> String {
        let hash = sha256_hex(self.key().as_bytes());
        format!("{}.toml", &hash[..32])
    }
}

/// The result of a piece of work.
pub trait Finished: Clone + Debug + Send + Serialize + DeserializeOwned {
    /// What was done.
    type Work: Work<Record = Self>;

    /// What was done.
    fn work(&self) -> &Self::Work;
}

impl Work for Cell {
    type Record = CellRecord;

    fn key(&self) -> String {
        format!(
            "format 3; measured by {}; seed {}; load c{}; joint {}; model {}; n {}",
            match self.model.rigid_body() {
                None => MEASURED_BY,
                Some(_) => RIGID_BODY_MEASURED_BY,
            },
            self.seed,
            self.load,
            self.joint,
            self.model.name(),
            self.n
        )
    }

    fn cost(&self) -> impl Ord {
        // GP¬c takes longest: without the sgn terms its factor has no low rank.
        let is_smooth = self.model == ModelKind::GpSmooth;
        (self.model.is_gp(), self.n, is_smooth)
    }
}

impl Finished for CellRecord {
    type Work = Cell;

    fn work(&self) -> &Cell {
        &self.cell
    }
}

/// Directory of finished cells: one file a cell, written atomically, never changed.
#[derive(Debug, Clone)]
pub struct Store {
    dir: PathBuf,
}

/// A file of the store: the text that was hashed, and the result.
#[derive(Serialize, Deserialize)]
struct Stored<R> {
    key: String,
    record: R,
}

impl Store {
    /// Store in a directory, which is created if missing.
    ///
    /// # Errors
    /// `Io` if the directory cannot be created.
    pub fn open(dir: impl Into<PathBuf>) -> Result<Self, BenchError> {
        let dir = dir.into();
        std::fs::create_dir_all(&dir).map_err(BenchError::io(&dir))?;
        Ok(Self::at(dir))
    }

    /// Store in a directory that need not be there as long as nothing is kept.
    pub fn at(dir: impl Into<PathBuf>) -> Self {
        Self { dir: dir.into() }
    }

    /// Result of a cell, if it is finished; an unreadable file counts as unfinished.
    pub fn load<W: Work>(&self, work: &W) -> Option<W::Record> {
        let text = std::fs::read_to_string(self.path(work)).ok()?;
        let (key, record) = parse::<W::Record>(&text)?;
        (key == work.key() && record.work() == work).then_some(record)
    }

    /// Keeps the result of a cell.
    ///
    /// # Errors
    /// `Io` if the file cannot be written; then no file is left.
    pub fn save<R: Finished>(&self, record: &R) -> Result<(), BenchError> {
        let path = self.path(record.work());
        let text = to_text(record).map_err(|e| BenchError::malformed(&path, e))?;
        write_atomically(&path, text.as_bytes())
    }

    fn path<W: Work>(&self, work: &W) -> PathBuf {
        self.dir.join(work.file_name())
    }
}

/// The text of a whole file.
///
/// # Errors
/// If TOML cannot hold the result.
pub fn to_text<R: Finished>(record: &R) -> Result<String, toml::ser::Error> {
    let stored = Stored {
        key: record.work().key(),
        record: record.clone(),
    };
    Ok(toml::to_string(&stored)? + END)
}

/// Key and result in the text of a whole file; `None` if it is cut short or of another kind of work.
pub fn parse<R: DeserializeOwned>(text: &str) -> Option<(String, R)> {
    let stored: Stored<R> = toml::from_str(text.strip_suffix(END)?).ok()?;
    Some((stored.key, stored.record))
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
    use crate::fit_summary::tests::{start, summary};
    use crate::fit_summary::{FitSummary, StartSummary};

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
                bounds_hit: vec!["noise_std".into()],
                starts: vec![StartSummary {
                    log_marginal_likelihood: f64::NEG_INFINITY,
                    stop: "start-undefined".into(),
                    ..start()
                }],
                ..summary()
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
