//! Table 3 beside the published one.

use super::averages::{AverageKey, Averages, Table};
use super::text_table::{TextTable, printed_score, ratio, score};
use crate::cell::{ModelKind, TestSet};
use crate::spec::Scope;

/// Rows joint × model × set, three columns a size: ours, published, ratio.
///
/// ```text
/// ratio = ours / published          above 1: worse than published
/// ```
/// # Source
/// Table 3.
pub fn beside_published(
    averages: &Averages,
    published: &Table,
    models: &[ModelKind],
    scope: &Scope,
) -> TextTable {
    let mut header: Vec<String> = ["joint", "model", "set"].map(String::from).to_vec();
    for n in &scope.sizes {
        header.extend([format!("n = {n}"), "published".into(), "ratio".into()]);
    }
    let mut rows = Vec::new();
    for (joint, model, set) in row_keys(&scope.joints, models) {
        let mut row = vec![
            joint.to_string(),
            model.label().to_string(),
            set.name().to_string(),
        ];
        for &n in &scope.sizes {
            let key = AverageKey::new(joint, model, set, n);
            let (ours, theirs) = (averages.mean(&key), published.get(&key).copied());
            let quotient = ours.zip(theirs).map(|(a, b)| a / b);
            row.extend([score(ours), printed_score(theirs), ratio(quotient)]);
        }
        rows.push(row);
    }
    TextTable::new(3, header, rows)
}

/// All averages of a run: rows joint × model, columns set × size.
pub fn all_averages(averages: &Averages) -> TextTable {
    let (joints, models, sizes) = (averages.joints(), averages.models(), averages.sizes());
    let mut header: Vec<String> = ["joint", "model"].map(String::from).to_vec();
    for set in TestSet::ALL {
        header.extend(sizes.iter().map(|n| format!("{} {n}", set.name())));
    }
    let mut rows = Vec::new();
    for &joint in &joints {
        for &model in &models {
            let mut row = vec![joint.to_string(), model.label().to_string()];
            for set in TestSet::ALL {
                let cell =
                    |&n: &usize| score(averages.mean(&AverageKey::new(joint, model, set, n)));
                row.extend(sizes.iter().map(cell));
            }
            rows.push(row);
        }
    }
    TextTable::new(2, header, rows)
}

/// The same numbers in long form, one row a cell of table 3.
pub fn to_csv(
    averages: &Averages,
    published: &Table,
    models: &[ModelKind],
    scope: &Scope,
) -> String {
    let mut text = String::from("joint,model,set,n,nmse,published,ratio\n");
    for (joint, model, set) in row_keys(&scope.joints, models) {
        for &n in &scope.sizes {
            let key = AverageKey::new(joint, model, set, n);
            let number = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:e}"));
            let (ours, theirs) = (averages.mean(&key), published.get(&key).copied());
            let quotient = ours.zip(theirs).map(|(a, b)| a / b);
            let values = [ours, theirs, quotient].map(number).join(",");
            let row = [
                joint.to_string(),
                model.name().into(),
                set.name().into(),
                n.to_string(),
                values,
            ];
            text.push_str(&row.join(","));
            text.push('\n');
        }
    }
    text
}

fn row_keys(joints: &[usize], models: &[ModelKind]) -> Vec<(usize, ModelKind, TestSet)> {
    let mut keys = Vec::new();
    for &joint in joints {
        for set in TestSet::ALL {
            keys.extend(models.iter().map(|&model| (joint, model, set)));
        }
    }
    keys
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::averages::{published, tests::record};

    #[test]
    fn ours_stands_beside_the_published_value_with_its_ratio() {
        let averages = Averages::of(&[record(1, 1, ModelKind::LrCoulomb, 20, 1.8e-2)]);
        let scope = Scope {
            loads: vec![1],
            joints: vec![1],
            sizes: vec![20, 170],
        };
        let models = [ModelKind::LrCoulomb];
        let table = beside_published(&averages, &published().unwrap(), &models, &scope);
        let interp = [
            "1", "LRc", "interp", "1.8e-2", "9e-3", "2.00", "–", "7e-6", "–",
        ];
        assert_eq!(table.rows[0], interp);
        let csv = to_csv(&averages, &published().unwrap(), &models, &scope);
        assert!(csv.contains("1,LRc,interp,170,,7e-6,\n"), "{csv}");
    }
}
