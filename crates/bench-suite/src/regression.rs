//! Whether the averages of the smoke profile have moved from the committed ones.

use crate::report::averages::{AverageKey, Averages, Table};
use crate::report::text_table::{ratio, score};

/// An average may get worse by this factor before it counts as broken.
pub const WORSE_AT_MOST: f64 = 1.25;
/// An average may get better by this factor before the committed value must be renewed.
pub const BETTER_AT_MOST: f64 = 3.0;

/// Averages outside the band, one sentence each; empty if all is well.
///
/// ```text
/// 1/3 ≤ ours / expected ≤ 1.25
/// ```
/// A key that is only on one side is outside.
pub fn moved(averages: &Averages, expected: &Table) -> Vec<String> {
    let mut moved: Vec<String> = expected
        .iter()
        .filter_map(|(key, &expected)| judge(key, averages.mean(key), expected))
        .collect();
    let unexpected = averages.0.keys().filter(|key| !expected.contains_key(key));
    moved.extend(unexpected.map(|key| format!("{}: not in the committed file", name(key))));
    moved
}

fn judge(key: &AverageKey, ours: Option<f64>, expected: f64) -> Option<String> {
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

fn name(key: &AverageKey) -> String {
    let AverageKey {
        joint,
        model,
        set,
        n,
    } = key;
    format!("joint {joint}, {}, {}, n = {n}", model.label(), set.name())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::ModelKind;
    use crate::report::averages::{read_table, tests::record};

    fn moved_from(expected: f64, ours: f64) -> Vec<String> {
        let header = "joint,model,set,n,nmse";
        let csv = format!(
            "{header}\n1,GPc,interp,20,{expected}\n1,GPc,extrap,20,{}\n",
            10.0 * expected
        );
        let averages = Averages::of(&[record(1, 1, ModelKind::GpCoulomb, 20, ours)]);
        moved(&averages, &read_table("x", &csv).unwrap())
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
        let expected = read_table("x", "joint,model,set,n,nmse\n3,GPc,interp,20,1\n").unwrap();
        let averages = Averages::of(&[record(1, 1, ModelKind::GpCoulomb, 20, 1.0)]);
        let found = moved(&averages, &expected);
        assert_eq!(found[0], "joint 3, GPc, interp, n = 20: no result");
        assert_eq!(
            found[1],
            "joint 1, GPc, interp, n = 20: not in the committed file"
        );
        assert_eq!(found.len(), 3);
    }
}
