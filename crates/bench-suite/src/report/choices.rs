//! Tables of the ranks that BIC chose and of the models that the mGPs started from.

use super::finding::Finding;
use super::published_fig10::Published;
use super::text_table::TextTable;
use crate::multi::model::MultiModel;
use crate::multi::ranks::{Choice, Choices};
use crate::multi::unit::UnitRecord;

/// One row a repeat and size: chosen rank and start of every joint, the chapter's in parentheses where it names the size.
pub fn ranks_and_starts(
    records: &[UnitRecord],
    choices: &Choices,
    published: &Published,
) -> TextTable {
    let joints = joints(records);
    let mut header: Vec<String> = ["draw", "n", "rank"].map(String::from).to_vec();
    header.extend(joints.iter().map(|joint| format!("start of joint {joint}")));
    let row = |(&(repeat, n), choice): (&(usize, usize), &Choice)| {
        let theirs = published.choice(n);
        let rank = beside(&choice.rank.to_string(), theirs.map(|c| c.rank.to_string()));
        let mut row = vec![(repeat + 1).to_string(), n.to_string(), rank];
        row.extend(joints.iter().map(|&joint| {
            let ours = start(records, repeat, n, joint);
            beside(&ours, theirs.map(|c| c.starts[joint - 1].clone()))
        }));
        row
    };
    TextTable::new(0, header, choices.0.iter().map(row))
}

/// The chapter's ranks and starts beside how many of them are met, at the sizes that it names.
///
/// # Source
/// Section 4.6.
pub fn claims(records: &[UnitRecord], choices: &Choices, published: &Published) -> Vec<Finding> {
    let (mut ranks, mut starts) = (Vec::new(), Vec::new());
    for (&(repeat, n), choice) in &choices.0 {
        let Some(theirs) = published.choice(n) else {
            continue;
        };
        ranks.push(choice.rank == theirs.rank);
        let is_met = |&joint: &usize| start(records, repeat, n, joint) == theirs.starts[joint - 1];
        starts.extend(choice.joints.iter().map(is_met));
    }
    let met = |all: &[bool]| {
        let n_met = all.iter().filter(|met| **met).count();
        format!("the same in {n_met} of {}", all.len())
    };
    if ranks.is_empty() {
        return Vec::new();
    }
    vec![
        Finding::new(
            "BIC chooses r = 4, but r = 5 at n = 476 and 1820",
            met(&ranks) + " sizes that the chapter names",
        ),
        Finding::new(
            "the mGPs start from iGP, but from pGP on joint 1 at n < 532",
            met(&starts) + " joints and sizes",
        ),
    ]
}

/// BIC above the least of its row, by rank.
pub fn bic_differences(choices: &Choices) -> TextTable {
    let mut ranks: Vec<usize> = choices
        .0
        .values()
        .flat_map(|choice| choice.bic.iter().map(|&(rank, _)| rank))
        .collect();
    ranks.sort_unstable();
    ranks.dedup();
    let mut header: Vec<String> = ["draw", "n"].map(String::from).to_vec();
    header.extend(ranks.iter().map(|rank| format!("r = {rank}")));
    let row = |(&(repeat, n), choice): (&(usize, usize), &Choice)| {
        let values = || choice.bic.iter().map(|&(_, bic)| bic);
        let least = values().fold(f64::INFINITY, f64::min);
        let mut row = vec![(repeat + 1).to_string(), n.to_string()];
        row.extend(ranks.iter().map(|rank| {
            let bic = choice.bic.iter().find(|(r, _)| r == rank);
            bic.map_or("–".to_string(), |(_, bic)| format!("{:.0}", bic - least))
        }));
        row
    };
    TextTable::new(0, header, choices.0.iter().map(row))
}

/// The chapter's value in parentheses.
fn beside(ours: &str, theirs: Option<String>) -> String {
    theirs.map_or_else(|| ours.to_string(), |theirs| format!("{ours} ({theirs})"))
}

/// The model that step 1 of A.3 chose for a joint: of pGP and iGP the one with the higher likelihood.
fn start(records: &[UnitRecord], repeat: usize, n: usize, joint: usize) -> String {
    let is_it =
        |r: &&UnitRecord| (r.unit.repeat, r.unit.n_total, r.unit.joint) == (repeat, n, joint);
    let log = |record: &UnitRecord, model| record.of(model)?.log_marginal_likelihood;
    let chosen = records.iter().filter(is_it).find_map(|record| {
        let independent = log(record, MultiModel::Independent)?;
        let pooled = log(record, MultiModel::Pooled)?;
        let is_independent = independent > pooled;
        Some(if is_independent {
            MultiModel::Independent
        } else {
            MultiModel::Pooled
        })
    });
    chosen.map_or("–".to_string(), |model| model.to_string())
}

fn joints(records: &[UnitRecord]) -> Vec<usize> {
    let mut joints: Vec<usize> = records.iter().map(|record| record.unit.joint).collect();
    joints.sort_unstable();
    joints.dedup();
    joints
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::curves::tests::record;

    #[test]
    fn the_chapters_choice_stands_in_parentheses_where_it_names_the_size() {
        let records = [
            record(1, 280, [1.0; 5]),
            record(3, 280, [1.0; 5]),
            record(1, 364, [1.0; 5]),
        ];
        let choices = Choices::of(&records).unwrap();
        let table = ranks_and_starts(&records, &choices, &Published::read().unwrap());
        assert_eq!(table.header[4], "start of joint 3");
        // Equal likelihoods: step 1 takes the simpler pGP.
        let first = ["1", "280", "2 (4)", "pGP (pGP)", "pGP (iGP)"];
        assert_eq!(table.rows[0], first);
        assert_eq!(table.rows[1], ["1", "364", "2", "pGP", "–"]);
        let bic = bic_differences(&choices);
        assert_eq!(bic.header, ["draw", "n", "r = 2", "r = 4"]);
        assert_eq!(bic.rows[0][2], "0");
        // Rank 2 instead of 4; pGP on joint 1 as in the chapter, and on joint 3 where it has iGP.
        let claims = claims(&records, &choices, &Published::read().unwrap());
        let here: Vec<&str> = claims.iter().map(|claim| claim.here.as_str()).collect();
        assert!(here[0].starts_with("the same in 0 of 1 "), "{here:?}");
        assert!(here[1].starts_with("the same in 1 of 2 "), "{here:?}");
    }
}
