//! Average nMSE over loads, the number that table 3 and fig. 7 show.

use std::collections::BTreeMap;

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::cell::{CellRecord, ModelKind, TestSet};
use crate::error::BenchError;

/// What is averaged over the loads.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct AverageKey<M = ModelKind> {
    /// Joint, from 1.
    pub joint: usize,
    /// Model.
    pub model: M,
    /// Test set.
    pub set: TestSet,
    /// Training samples.
    pub n: usize,
}

impl<M> AverageKey<M> {
    /// Joint and size from 1.
    pub fn new(joint: usize, model: M, set: TestSet, n: usize) -> Self {
        Self {
            joint,
            model,
            set,
            n,
        }
    }
}

/// Average over the loads that have a result.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Average {
    /// (load, nMSE), ascending in the load.
    pub per_load: Vec<(usize, f64)>,
}

impl Average {
    /// Arithmetic mean over the loads, added in their order.
    ///
    /// ```text
    /// (1/m) Σ_γ nMSE_γ
    /// ```
    pub fn mean(&self) -> f64 {
        let sum: f64 = self.per_load.iter().map(|(_, nmse)| nmse).sum();
        sum / self.per_load.len() as f64
    }

    /// The load with the largest nMSE and its share of the sum.
    pub fn worst(&self) -> Option<(usize, f64)> {
        let sum: f64 = self.per_load.iter().map(|(_, nmse)| nmse).sum();
        self.per_load
            .iter()
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .map(|&(load, nmse)| (load, nmse / sum))
    }
}

/// All averages of a run.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Averages(pub BTreeMap<AverageKey, Average>);

impl Averages {
    /// Groups records; their order does not matter.
    pub fn of(records: &[CellRecord]) -> Self {
        let mut averages: BTreeMap<AverageKey, Average> = BTreeMap::new();
        for record in records {
            for set in TestSet::ALL {
                let key = AverageKey::new(record.cell.joint, record.cell.model, set, record.cell.n);
                let average = averages.entry(key).or_default();
                average.per_load.push((record.cell.load, record.nmse(set)));
            }
        }
        for average in averages.values_mut() {
            average.per_load.sort_by_key(|&(load, _)| load);
        }
        Self(averages)
    }

    /// The averages of the models that the chapter compares.
    #[must_use]
    pub fn of_the_chapter(&self) -> Self {
        let is_chapters = |key: &AverageKey| key.model.rigid_body().is_none();
        let averages = self.0.iter().filter(|(key, _)| is_chapters(key));
        Self(
            averages
                .map(|(key, average)| (*key, average.clone()))
                .collect(),
        )
    }

    /// The mean at a key, if any load has a result there.
    pub fn mean(&self, key: &AverageKey) -> Option<f64> {
        self.0.get(key).map(Average::mean)
    }

    /// The means in the format of [`read_table`].
    pub fn to_csv(&self) -> String {
        let means = self.0.iter().map(|(key, average)| (key, average.mean()));
        write_table(means, |model| model.name())
    }

    /// Joints that occur, ascending.
    pub fn joints(&self) -> Vec<usize> {
        self.distinct(|key| key.joint)
    }

    /// Sizes that occur, ascending.
    pub fn sizes(&self) -> Vec<usize> {
        self.distinct(|key| key.n)
    }

    /// Models that occur, in the order of fig. 7.
    pub fn models(&self) -> Vec<ModelKind> {
        self.distinct(|key| key.model)
    }

    fn distinct<T: Ord>(&self, part: impl Fn(&AverageKey) -> T) -> Vec<T> {
        let mut values: Vec<T> = self.0.keys().map(part).collect();
        values.sort();
        values.dedup();
        values
    }
}

/// A table of averages read from a file.
pub type Table<M = ModelKind> = BTreeMap<AverageKey<M>, f64>;

/// The published table 3.
///
/// # Errors
/// `Malformed` if the fixture is not what [`read_table`] reads.
/// # Source
/// Table 3.
pub fn published() -> Result<Table, BenchError> {
    let text = include_str!("../../../../fixtures/bench-suite/table3_published.csv");
    read_table("fixtures/bench-suite/table3_published.csv", text)
}

/// Reads a CSV with the columns joint, model, set, n, nmse.
///
/// # Errors
/// `Malformed`, with the path given, if a row does not fit, a key comes twice, or a value is not positive.
pub fn read_table<M: DeserializeOwned + Ord>(
    path: &str,
    text: &str,
) -> Result<Table<M>, BenchError> {
    #[derive(Deserialize)]
    struct Row<M> {
        joint: usize,
        model: M,
        set: TestSet,
        n: usize,
        nmse: f64,
    }
    let mut table = Table::new();
    let rows = csv::Reader::from_reader(text.as_bytes()).into_deserialize::<Row<M>>();
    for (i, row) in rows.enumerate() {
        let line = i + 2; // line 1 is the header
        let refuse = |what: &dyn std::fmt::Display| {
            BenchError::malformed(path, format!("line {line}: {what}"))
        };
        let row = row.map_err(|e| refuse(&e))?;
        if row.nmse.is_nan() || row.nmse <= 0.0 {
            return Err(refuse(&format!("nMSE {} is not positive", row.nmse)));
        }
        let key = AverageKey::new(row.joint, row.model, row.set, row.n);
        if table.insert(key, row.nmse).is_some() {
            return Err(refuse(&"this joint, model, set and n come twice"));
        }
    }
    Ok(table)
}

/// Writes averages in the format of [`read_table`], shortest digits that read back to the same number.
pub fn write_table<'a, M: 'a>(
    averages: impl Iterator<Item = (&'a AverageKey<M>, f64)>,
    name: impl Fn(&M) -> &str,
) -> String {
    let mut text = String::from("joint,model,set,n,nmse\n");
    for (key, nmse) in averages {
        let (joint, model, set, n) = (key.joint, name(&key.model), key.set.name(), key.n);
        let line = format!("{joint},{model},{set},{n},{nmse:e}\n");
        text.push_str(&line);
    }
    text
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::cell::Cell;

    /// Record with `interp` as nMSE on one set and ten times it on the other.
    pub(crate) fn record(
        joint: usize,
        load: usize,
        model: ModelKind,
        n: usize,
        interp: f64,
    ) -> CellRecord {
        CellRecord {
            nmse_interp: interp,
            nmse_extrap: 10.0 * interp,
            seconds_fit: 0.0,
            seconds_predict: 0.0,
            cell: Cell {
                seed: "s".into(),
                load,
                joint,
                model,
                n,
            },
            fit: None,
        }
    }

    #[test]
    fn means_go_over_the_loads() {
        let records = [
            record(1, 2, ModelKind::LrCoulomb, 20, 3.0),
            record(1, 1, ModelKind::LrCoulomb, 20, 1.0),
            record(3, 1, ModelKind::LrCoulomb, 20, 7.0),
        ];
        let averages = Averages::of(&records);
        let key = AverageKey::new(1, ModelKind::LrCoulomb, TestSet::Extrap, 20);
        assert_eq!(averages.0[&key].per_load, [(1, 10.0), (2, 30.0)]);
        assert!((averages.mean(&key).unwrap() - 20.0).abs() <= f64::EPSILON * 20.0);
        assert_eq!(averages.0[&key].worst(), Some((2, 0.75)));
        assert_eq!(averages.joints(), [1, 3]);
    }

    #[test]
    fn the_published_table_has_all_48_numbers() {
        let table = published().unwrap();
        assert_eq!(table.len(), 48);
        let key = AverageKey::new(3, ModelKind::GpCoulomb, TestSet::Interp, 4000);
        assert!((table[&key] / 3e-9 - 1.0).abs() <= f64::EPSILON);
    }

    #[test]
    fn a_written_table_reads_back() {
        let averages = Averages::of(&[record(1, 1, ModelKind::GpSmooth, 30, 0.1 + 0.2)]);
        let table: Table = read_table("x.csv", &averages.to_csv()).unwrap();
        for (key, average) in &averages.0 {
            assert_eq!(table[key].to_bits(), average.mean().to_bits());
        }
    }

    #[test]
    fn a_bad_row_is_named() {
        let error =
            read_table::<ModelKind>("x.csv", "joint,model,set,n,nmse\n1,GPc,interp,20,-1\n");
        assert_eq!(
            error.unwrap_err().to_string(),
            "x.csv: line 2: nMSE -1 is not positive"
        );
    }
}
