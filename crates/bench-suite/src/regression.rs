//! Whether the averages of the smoke profile have moved from the committed ones.

use crate::error::BenchError;
use crate::report::averages::{AverageKey, Averages, Table, read_table, write_table};
use crate::report::curves::{CurveKey, Curves, Series, Statistic};
use crate::report::text_table::{ratio, score};

/// An average may get worse by this factor before it counts as broken.
pub const WORSE_AT_MOST: f64 = 1.25;
/// An average may get better by this factor before the committed value must be renewed.
pub const BETTER_AT_MOST: f64 = 3.0;

/// What is averaged, over the loads of section 3.4 or the contexts of section 4.6, by the model's name.
pub type ScoreKey = AverageKey<String>;

/// Averages by key.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scores(pub Table<String>);

impl Scores {
    /// Adds the averages over the loads, of the chapter's models.
    pub fn add_averages(&mut self, averages: &Averages) {
        for (key, average) in &averages.of_the_chapter().0 {
            let model = key.model.name().to_string();
            let key = ScoreKey::new(key.joint, model, key.set, key.n);
            self.0.insert(key, average.mean());
        }
    }

    /// Adds the averages over the contexts, of the chapter's models.
    pub fn add_curves(&mut self, curves: &Curves) {
        let lines = curves.0.iter();
        let is_scored = |key: &CurveKey| {
            key.statistic == Statistic::Average && Series::ALL.contains(&key.series)
        };
        for (key, points) in lines.filter(|(key, _)| is_scored(key)) {
            for point in points {
                let model = key.series.name().to_string();
                let key = ScoreKey::new(key.joint, model, key.set, point.n);
                self.0.insert(key, point.value);
            }
        }
    }

    /// Reads a CSV with the columns joint, model, set, n, nmse.
    ///
    /// # Errors
    /// As for [`read_table`].
    pub fn read(path: &str, text: &str) -> Result<Self, BenchError> {
        read_table(path, text).map(Self)
    }

    /// The format of [`Self::read`], shortest digits that read back to the same number.
    pub fn to_csv(&self) -> String {
        write_table(
            self.0.iter().map(|(key, nmse)| (key, *nmse)),
            String::as_str,
        )
    }
}

/// Averages outside the band, one sentence each; empty if all is well.
///
/// ```text
/// 1/3 ≤ ours / expected ≤ 1.25
/// ```
/// A key that is only on one side is outside.
pub fn moved(ours: &Scores, expected: &Scores) -> Vec<String> {
    let mut moved: Vec<String> = expected
        .0
        .iter()
        .filter_map(|(key, &expected)| judge(key, ours.0.get(key).copied(), expected))
        .collect();
    let unexpected = ours.0.keys().filter(|key| !expected.0.contains_key(key));
    moved.extend(unexpected.map(|key| format!("{}: not in the committed file", name(key))));
    moved
}

fn judge(key: &ScoreKey, ours: Option<f64>, expected: f64) -> Option<String> {
    let Some(ours) = ours else {
        return Some(format!("{}: no result", name(key)));
    };
    let quotient = ours / expected;
    let verdict = if quotient.is_nan() || quotient > WORSE_AT_MOST {
        "worse"
    } else if quotient < 1.0 / BETTER_AT_MOST {
        "better by more than a factor 3; renew the file with --update"
    } else {
        return None;
    };
    let (ours, theirs) = (score(Some(ours)), score(Some(expected)));
    let quotient = ratio(Some(quotient));
    Some(format!(
        "{}: {ours}, committed {theirs}, ratio {quotient}: {verdict}",
        name(key)
    ))
}

fn name(key: &ScoreKey) -> String {
    let (joint, model, set, n) = (key.joint, &key.model, key.set.name(), key.n);
    format!("joint {joint}, {model}, {set}, n = {n}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{ModelKind, TestSet};
    use crate::report::averages::tests::record;
    use crate::report::curves::tests::{curves, record as unit_record};

    fn scores(ours: f64) -> Scores {
        let mut scores = Scores::default();
        let records = [record(1, 1, ModelKind::GpCoulomb, 20, ours)];
        scores.add_averages(&Averages::of(&records));
        scores
    }

    fn moved_from(expected: f64, ours: f64) -> Vec<String> {
        let header = "joint,model,set,n,nmse";
        let csv = format!(
            "{header}\n1,GPc,interp,20,{expected}\n1,GPc,extrap,20,{}\n",
            10.0 * expected
        );
        moved(&scores(ours), &Scores::read("x", &csv).unwrap())
    }

    #[test]
    fn the_band_is_a_quarter_worse_and_three_times_better() {
        assert!(moved_from(1.0, 1.24).is_empty());
        assert!(moved_from(1.0, 0.34).is_empty());
        assert!(moved_from(1.0, 1.26)[0].ends_with("ratio 1.26: worse"));
        assert!(moved_from(1.0, 0.33)[1].contains("better by more than a factor 3"));
    }

    #[test]
    fn a_missing_and_an_unexpected_average_are_outside() {
        let expected = Scores::read("x", "joint,model,set,n,nmse\n3,GPc,interp,20,1\n").unwrap();
        let found = moved(&scores(1.0), &expected);
        assert_eq!(found[0], "joint 3, GPc, interp, n = 20: no result");
        assert_eq!(
            found[1],
            "joint 1, GPc, interp, n = 20: not in the committed file"
        );
        assert_eq!(found.len(), 3);
    }

    #[test]
    fn many_contexts_join_and_a_written_file_reads_back() {
        let mut scores = scores(0.1 + 0.2);
        scores.add_curves(&curves(&[unit_record(3, 280, [1.0, 2.0, 3.0, 4.0, 5.0])]));
        // GPc on two sets; four models on two sets, averages only.
        assert_eq!(scores.0.len(), 2 + 8);
        assert_eq!(Scores::read("x", &scores.to_csv()).unwrap(), scores);
        let key = ScoreKey::new(3, "mGP-BIC".to_string(), TestSet::Interp, 280);
        // Contexts 4 and 12.
        assert!((scores.0[&key] - 8.0).abs() <= 8.0 * f64::EPSILON);
        let error = Scores::read("x.csv", "joint,model,set,n,nmse\n1,GPc,interp,20,-1\n");
        assert!(
            error
                .unwrap_err()
                .to_string()
                .contains("line 2: nMSE -1 is not positive")
        );
    }
}
