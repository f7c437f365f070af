//! Average and median nMSE over the contexts against the number of samples: what figures 10 and 11 show.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

use crate::cell::TestSet;
use crate::multi::model::MultiModel;
use crate::multi::ranks::Choices;
use crate::multi::shared::SharedRecord;
use crate::multi::unit::{ModelRecord, UnitRecord};
use crate::rigid_body::Terms;

/// A line of the figures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Series {
    /// sGP.
    Single,
    /// iGP.
    Independent,
    /// pGP.
    Pooled,
    /// mGP of the rank chosen by BIC.
    TransferBic,
    /// The same with one K^ρ for all joints; not the chapter's.
    SharedBic,
    /// rbd+gp; not the chapter's.
    RigidBodyAndProcess,
    /// rbd as the command learns it, all joints together; not the chapter's.
    Shared(Terms),
}

impl Series {
    /// All four, in the order of the chapter's legend.
    pub const ALL: [Self; 4] = [
        Self::Single,
        Self::Independent,
        Self::Pooled,
        Self::TransferBic,
    ];

    /// Those that are drawn: the chapter's, and ours where they exist.
    pub const DRAWN: [Self; 8] = [
        Self::Single,
        Self::Independent,
        Self::Pooled,
        Self::TransferBic,
        Self::SharedBic,
        Self::RigidBodyAndProcess,
        Self::Shared(Terms::Chosen),
        Self::Shared(Terms::Signs),
    ];

    /// Name in tables, pictures and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Single => "sGP",
            Self::Independent => "iGP",
            Self::Pooled => "pGP",
            Self::TransferBic => "mGP-BIC",
            Self::SharedBic => "mGP-one-K",
            Self::RigidBodyAndProcess => "rbd+gp",
            Self::Shared(terms) => terms.name(),
        }
    }

    /// This line's model in a unit.
    fn record<'a>(self, unit: &'a UnitRecord, choices: &Choices) -> Option<&'a ModelRecord> {
        match self {
            Self::Single => unit.of(MultiModel::Single),
            Self::Independent => unit.of(MultiModel::Independent),
            Self::Pooled => unit.of(MultiModel::Pooled),
            Self::TransferBic => choices.chosen(unit),
            Self::SharedBic => None,
            Self::RigidBodyAndProcess => unit.of(MultiModel::RigidBodyAndProcess),
            Self::Shared(terms) => unit.of(MultiModel::Shared(terms)),
        }
    }
}

/// How the contexts are summed up.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Statistic {
    /// Arithmetic mean.
    Average,
    /// Middle value, or the mean of the two middle ones.
    Median,
}

impl Statistic {
    /// Both, in the order of the figures' rows.
    pub const ALL: [Self; 2] = [Self::Average, Self::Median];

    /// average or median.
    pub fn name(self) -> &'static str {
        match self {
            Self::Average => "average",
            Self::Median => "median",
        }
    }

    fn of(self, values: &[f64]) -> f64 {
        match self {
            Self::Average => values.iter().sum::<f64>() / values.len() as f64,
            Self::Median => median(values),
        }
    }
}

/// A line of one panel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct CurveKey {
    /// Joint, from 1.
    pub joint: usize,
    /// Test set.
    pub set: TestSet,
    /// Sum over the contexts.
    pub statistic: Statistic,
    /// Line.
    pub series: Series,
}

impl CurveKey {
    /// Joint from 1.
    pub fn new(joint: usize, set: TestSet, statistic: Statistic, series: Series) -> Self {
        Self {
            joint,
            set,
            statistic,
            series,
        }
    }
}

impl fmt::Display for CurveKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (joint, set) = (self.joint, self.set.name());
        let (statistic, series) = (self.statistic.name(), self.series.name());
        write!(f, "joint {joint}, {set}, {statistic} of {series}")
    }
}

/// The repeats of one size: their median and their extremes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Point {
    /// Training samples of all contexts together.
    pub n: usize,
    /// Median over the repeats; the value itself if there is only one.
    pub value: f64,
    /// Smallest over the repeats.
    pub low: f64,
    /// Largest over the repeats.
    pub high: f64,
}

/// All lines of a run, points ascending in n.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Curves(pub BTreeMap<CurveKey, Vec<Point>>);

impl Curves {
    /// Sums up the contexts of every unit, then the repeats.
    pub fn of(records: &[UnitRecord], choices: &Choices) -> Self {
        let mut repeats: BTreeMap<(CurveKey, usize), Vec<f64>> = BTreeMap::new();
        for record in records {
            for (key, value) in values(record, choices) {
                let of_key = repeats.entry((key, record.unit.n_total)).or_default();
                of_key.push(value);
            }
        }
        let mut curves: BTreeMap<CurveKey, Vec<Point>> = BTreeMap::new();
        for ((key, n), values) in repeats {
            curves.entry(key).or_default().push(point(n, &values));
        }
        Self(curves)
    }

    /// The same with the lines of one K^ρ for all joints, at the rank of least BIC.
    #[must_use]
    pub fn with_shared(&self, records: &[SharedRecord]) -> Self {
        let mut repeats: BTreeMap<(CurveKey, usize), Vec<f64>> = BTreeMap::new();
        for record in records {
            let Some(fit) = record.chosen() else {
                continue;
            };
            for (idx, unit) in record.unit.joints.iter().enumerate() {
                for set in TestSet::ALL {
                    for statistic in Statistic::ALL {
                        let key = CurveKey::new(unit.joint, set, statistic, Series::SharedBic);
                        let value = statistic.of(&fit.nmses(idx, set));
                        repeats.entry((key, unit.n_total)).or_default().push(value);
                    }
                }
            }
        }
        let mut curves = self.clone();
        for ((key, n), values) in repeats {
            curves.0.entry(key).or_default().push(point(n, &values));
        }
        curves
    }

    /// The point of a line at a size.
    pub fn at(&self, key: &CurveKey, n: usize) -> Option<Point> {
        self.0.get(key)?.iter().find(|point| point.n == n).copied()
    }

    /// Joints that occur, ascending.
    pub fn joints(&self) -> Vec<usize> {
        let joints: BTreeSet<usize> = self.0.keys().map(|key| key.joint).collect();
        joints.into_iter().collect()
    }

    /// Sizes that occur, ascending.
    pub fn sizes(&self) -> Vec<usize> {
        let sizes: BTreeSet<usize> = self.0.values().flatten().map(|point| point.n).collect();
        sizes.into_iter().collect()
    }
}

fn values(record: &UnitRecord, choices: &Choices) -> Vec<(CurveKey, f64)> {
    let mut values = Vec::new();
    for series in Series::DRAWN {
        let Some(model) = series.record(record, choices) else {
            continue;
        };
        for set in TestSet::ALL {
            let nmses = model.nmses(set);
            values.extend(Statistic::ALL.map(|statistic| {
                let key = CurveKey::new(record.unit.joint, set, statistic, series);
                (key, statistic.of(&nmses))
            }));
        }
    }
    values
}

fn point(n: usize, repeats: &[f64]) -> Point {
    Point {
        n,
        value: median(repeats),
        low: repeats.iter().copied().fold(f64::INFINITY, f64::min),
        high: repeats.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    }
}

/// Middle value; NaN if there is none.
fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    match (sorted.len(), sorted.len() / 2) {
        (0, _) => f64::NAN,
        (n, half) if n % 2 == 1 => sorted[half],
        (_, half) => f64::midpoint(sorted[half - 1], sorted[half]),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::multi::unit::tests::{unit, unit_record};

    /// Records of a joint whose models have these interp nMSEs in their first context.
    pub(crate) fn record(joint: usize, n: usize, interp: [f64; 5]) -> UnitRecord {
        let values = interp.map(|nmse| (0.0, nmse)); // equal likelihoods: BIC takes the smallest rank
        unit_record(unit(joint, n), &values)
    }

    pub(crate) fn curves(records: &[UnitRecord]) -> Curves {
        Curves::of(records, &Choices::of(records).unwrap())
    }

    fn key(series: Series, statistic: Statistic) -> CurveKey {
        CurveKey::new(1, TestSet::Extrap, statistic, series)
    }

    #[test]
    fn medians_worked_by_hand() {
        let close = |values: &[f64], expected: f64| {
            let found = median(values);
            assert!(
                (found - expected).abs() <= f64::EPSILON * expected,
                "{found}"
            );
        };
        close(&[9.0, 1.0, 4.0], 4.0);
        close(&[9.0, 1.0, 4.0, 2.0], 3.0);
        assert!(median(&[]).is_nan());
    }

    #[test]
    fn contexts_are_averaged_and_the_rank_of_bic_is_taken() {
        let curves = curves(&[record(1, 280, [1.0, 2.0, 3.0, 4.0, 5.0])]);
        // Extrap is 10 and 30 times the number given: average and median 20 times.
        let average = curves.at(&key(Series::TransferBic, Statistic::Average), 280);
        assert!((average.unwrap().value - 80.0).abs() <= 80.0 * f64::EPSILON);
        assert_eq!(
            curves.at(&key(Series::Single, Statistic::Median), 476),
            None
        );
    }

    #[test]
    fn repeats_become_a_median_with_extremes() {
        let mut records: Vec<UnitRecord> = [1.0, 7.0, 2.0]
            .map(|nmse| record(1, 280, [nmse; 5]))
            .to_vec();
        for (repeat, record) in records.iter_mut().enumerate() {
            record.unit.repeat = repeat;
        }
        let point = curves(&records)
            .at(&key(Series::Pooled, Statistic::Average), 280)
            .unwrap();
        let bits = [point.low, point.value, point.high].map(f64::to_bits);
        assert_eq!(bits, [20.0_f64, 40.0, 140.0].map(f64::to_bits));
    }
}
