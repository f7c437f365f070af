//! Table 2: which trajectories each load is trained on.

use super::samples::label;
use super::section::{Section, csv};
use crate::error::BenchError;
use crate::report::text_table::TextTable;
use crate::split::{REFERENCE, TrajectoryId, UNIQUE};

/// The published rows, in their order.
const PUBLISHED: &str = include_str!("../../../../fixtures/bench-suite/table2_published.csv");

/// Makes the table.
///
/// # Errors
/// `Malformed` if the published rows cannot be read.
///
/// # Source
/// Table 2.
pub fn make() -> Result<Section, BenchError> {
    let published = published()?;
    let mut section = Section::of_table(table(&published));
    let rows = (1..=UNIQUE.len()).flat_map(|load| {
        [
            ("Tr".to_string(), REFERENCE),
            (format!("T{load}"), UNIQUE[load - 1]),
        ]
        .map(|(name, id)| {
            let (path, speed) = (id.path_idx + 1, id.speed_idx + 1);
            let labels = [
                format!("c{load}"),
                name,
                format!("p{path}"),
                format!("s{speed}"),
            ];
            (labels.to_vec(), Vec::new())
        })
    });
    section.file("table2.csv", csv("load,trajectory,path,speed", rows));
    let n_equal = published
        .iter()
        .filter(|(name, id)| of_name(name) == Some(*id))
        .count();
    section.found(
        "16 trajectories: T1 to T15, one a load, and Tr = (p2,s3) of all loads",
        format!("{n_equal} of {} as printed", published.len()),
    );
    Ok(section)
}

/// The trajectory that the splits use under a name of the table.
fn of_name(name: &str) -> Option<TrajectoryId> {
    match name.strip_prefix('T')? {
        "r" => Some(REFERENCE),
        number => UNIQUE
            .get(number.parse::<usize>().ok()?.checked_sub(1)?)
            .copied(),
    }
}

/// Rows as printed, a mark where a load is trained.
fn table(published: &[(String, TrajectoryId)]) -> TextTable {
    let loads = 1..=UNIQUE.len();
    let header = ["trajectory".to_string()]
        .into_iter()
        .chain(loads.clone().map(|load| format!("c{load}")));
    let row = |(name, _): &(String, TrajectoryId)| {
        let id = of_name(name);
        let mark = |load: usize| {
            let is_trained = id.is_some_and(|id| id == REFERENCE || id == UNIQUE[load - 1]);
            if is_trained { "■" } else { "" }.to_string()
        };
        let shown = id.map_or_else(String::new, label);
        [format!("{name}: {shown}")]
            .into_iter()
            .chain(loads.clone().map(mark))
            .collect()
    };
    TextTable::new(1, header, published.iter().map(row))
}

fn published() -> Result<Vec<(String, TrajectoryId)>, BenchError> {
    PUBLISHED.lines().skip(1).map(row).collect()
}

/// A line such as `T6,p2,s1`.
fn row(line: &str) -> Result<(String, TrajectoryId), BenchError> {
    let refuse = || {
        BenchError::malformed(
            "fixtures/bench-suite/table2_published.csv",
            format!("not a trajectory: {line}"),
        )
    };
    let parts: Vec<&str> = line.split(',').collect();
    let [name, path, speed] = parts[..] else {
        return Err(refuse());
    };
    let number = |text: &str, letter| {
        let digits = text.strip_prefix(letter)?;
        digits.parse::<usize>().ok()?.checked_sub(1)
    };
    let (path, speed) = (number(path, 'p'), number(speed, 's'));
    let (path_idx, speed_idx) = path.zip(speed).ok_or_else(refuse)?;
    let id = TrajectoryId {
        path_idx,
        speed_idx,
    };
    Ok((name.to_string(), id))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_splits_use_the_published_trajectories() {
        let published = published().unwrap();
        assert_eq!(published.len(), 16);
        for (name, id) in &published {
            assert_eq!(of_name(name), Some(*id), "{name}");
        }
    }

    #[test]
    fn a_load_is_marked_at_its_own_trajectory_and_at_the_reference() {
        let table = table(&published().unwrap());
        for load in 1..=15 {
            let marked: Vec<&str> = table
                .rows
                .iter()
                .filter(|row| row[load] == "■")
                .map(|row| row[0].as_str())
                .collect();
            let own = format!("T{load}: {}", label(UNIQUE[load - 1]));
            assert_eq!(marked.len(), 2, "{marked:?}");
            assert!(
                marked.contains(&own.as_str()) && marked.contains(&"Tr: (p2,s3)"),
                "{marked:?}"
            );
        }
    }
}
