//! The kinds of work whose results can be adopted.

use std::path::{Path, PathBuf};

use crate::cell::Cell;
use crate::error::BenchError;
use crate::multi::shared::SharedUnit;
use crate::multi::unit::Unit;
use crate::section5::campaign;
use crate::section5::part::{Part, PartRecord, measured_by};
use crate::section5::transfer::Curve;
use crate::store::{self, Work};

/// Work whose results are kept in a directory of their own.
pub(super) trait Kept: Work {
    /// Name that results of the same kind, model and size have in common, and no others.
    fn group(&self) -> String;

    /// Today's directory of its results.
    ///
    /// # Errors
    /// `UnknownName` if no experiment of today has such work.
    fn directory(&self, output: &Path) -> Result<PathBuf, BenchError>;

    /// An old result as today's program would name it.
    ///
    /// # Errors
    /// As [`Self::directory`].
    fn renewed(record: Self::Record) -> Result<Self::Record, BenchError> {
        Ok(record)
    }
}

impl Kept for Cell {
    fn group(&self) -> String {
        format!("{}, n = {}", self.model.name(), self.n)
    }

    fn directory(&self, output: &Path) -> Result<PathBuf, BenchError> {
        Ok(store::of_cells(output))
    }
}

impl Kept for Unit {
    fn group(&self) -> String {
        let (m, n) = (self.n_contexts, self.n_total);
        format!("{:?}, {m} contexts, n = {n}", self.models)
    }

    fn directory(&self, output: &Path) -> Result<PathBuf, BenchError> {
        Ok(store::of_units(output))
    }
}

impl Kept for SharedUnit {
    fn group(&self) -> String {
        format!("ranks {:?}, n = {}", self.ranks, self.n_total())
    }

    fn directory(&self, output: &Path) -> Result<PathBuf, BenchError> {
        Ok(store::of_units(output))
    }
}

impl Kept for Curve {
    fn group(&self) -> String {
        format!("{}, {:?}", self.axis.name(), self.counts)
    }

    fn directory(&self, output: &Path) -> Result<PathBuf, BenchError> {
        campaign::store_of(output, "transfer")
    }
}

impl Kept for Part {
    /// Labels number what is alike: "joint 3", "changes on p1s2, window 4".
    fn group(&self) -> String {
        let kind = self.label.split(|c: char| c.is_ascii_digit()).next();
        let (kind, cost) = (kind.unwrap_or_default(), self.cost);
        format!("{}, {kind}, {cost}, {}", self.experiment, self.settings)
    }

    fn directory(&self, output: &Path) -> Result<PathBuf, BenchError> {
        campaign::store_of(output, &self.experiment)
    }

    fn renewed(record: PartRecord) -> Result<PartRecord, BenchError> {
        let measured_by = measured_by(&record.part.experiment)?.to_string();
        let part = Self {
            measured_by,
            ..record.part
        };
        Ok(PartRecord { part, ..record })
    }
}
