//! Table 1: durations of the speeds, centres and rotations of the paths, masses of the loads — measured on the samples.

use std::f64::consts::PI;

use super::samples::Samples;
use super::section::{Section, csv};
use crate::error::BenchError;
use crate::report::text_table::TextTable;
use crate::split::{N_PATHS, N_SPEEDS, TrajectoryId};

/// The published numbers.
const PUBLISHED: &str = include_str!("../../../../fixtures/bench-suite/table1_published.csv");
/// Rounding of angles and lengths that went through a sine: a few units in the last place of numbers up to 40.
const ROUNDING: f64 = 1e-12;

/// A number of the table: quantity, name, value.
type Row = (String, String, f64);

/// Makes the table.
///
/// # Errors
/// `Malformed` if the published numbers cannot be read.
///
/// # Source
/// Table 1.
pub fn make(samples: &Samples) -> Result<Section, BenchError> {
    let published = published()?;
    let ours = measured(samples);
    let mut section = Section::of_table(table(&ours));
    let rows = ours.iter().map(|(quantity, name, value)| {
        let of_row = published.iter().find(|p| (&p.0, &p.1) == (quantity, name));
        let printed = of_row.map_or(f64::NAN, |p| p.2);
        (vec![quantity.clone(), name.clone()], vec![*value, printed])
    });
    section.file("table1.csv", csv("quantity,name,value,published", rows));
    let n_equal = published.iter().filter(|p| is_met(p, &ours)).count();
    section.found(
        format!("{} numbers", published.len()),
        format!("{n_equal} of them met by the samples to rounding"),
    );
    Ok(section)
}

/// The numbers as the samples have them: durations from the times, centres and rotations from the points of the paths.
fn measured(samples: &Samples) -> Vec<Row> {
    let scenario = samples.scenario();
    let mut rows = Vec::new();
    for speed_idx in 0..N_SPEEDS {
        let id = TrajectoryId {
            path_idx: 0,
            speed_idx,
        };
        let time = &samples.trajectory(id).time;
        // Samples are at regular times from 0, so the round ends one step after the last.
        let duration = time[1] * time.len() as f64;
        rows.push(("duration_s".into(), format!("s{}", speed_idx + 1), duration));
    }
    for (quantity, axis) in [("centre_x_m", 0), ("centre_z_m", 2)] {
        for path_idx in 0..N_PATHS {
            let centre = scenario.path_point(path_idx, 0.0)[axis]; // the crossing of the figure of eight
            rows.push((quantity.into(), format!("p{}", path_idx + 1), centre));
        }
    }
    for path_idx in 0..N_PATHS {
        let (centre, widest) = (
            scenario.path_point(path_idx, 0.0),
            scenario.path_point(path_idx, PI / 2.0),
        );
        let (along, across) = (widest[1] - centre[1], centre[0] - widest[0]);
        let angle = across.atan2(along).to_degrees();
        rows.push(("rotation_deg".into(), format!("p{}", path_idx + 1), angle));
    }
    for (load_idx, name) in scenario.load_names().into_iter().enumerate() {
        rows.push(("mass_kg".into(), name, scenario.payload(load_idx).mass()));
    }
    rows
}

/// The printed form: a block of names and numbers for speeds, paths and loads.
fn table(rows: &[Row]) -> TextTable {
    let titles = [
        ("duration_s", "time to complete a path/s"),
        ("centre_x_m", "centre along the x axis/m"),
        ("centre_z_m", "centre along the z axis/m"),
        ("rotation_deg", "rotation about the z axis/°"),
        ("mass_kg", "mass/kg"),
    ];
    let line = |(quantity, title): (&str, &str)| {
        let of_quantity = rows.iter().filter(|row| row.0 == quantity);
        let values: Vec<String> = of_quantity
            .map(|(_, name, value)| format!("{name} {}", short(*value)))
            .collect();
        vec![title.to_string(), values.join(", ")]
    };
    TextTable::new(2, ["quantity", "values"], titles.map(line))
}

/// At most two decimals, no trailing zero, a true minus sign.
fn short(value: f64) -> String {
    let text = format!("{:.2}", value + 0.0);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match text {
        "-0" => "0".to_string(),
        text => text.replace('-', "−"),
    }
}

fn is_met(published: &Row, ours: &[Row]) -> bool {
    let same = |row: &&Row| (&row.0, &row.1) == (&published.0, &published.1);
    ours.iter()
        .find(same)
        .is_some_and(|row| (row.2 - published.2).abs() <= ROUNDING)
}

fn published() -> Result<Vec<Row>, BenchError> {
    let path = "fixtures/bench-suite/table1_published.csv";
    let read = |line: &str| {
        let parts: Vec<&str> = line.split(',').collect();
        match parts[..] {
            [quantity, name, value] => {
                let value = value.parse().map_err(|e| BenchError::malformed(path, e))?;
                Ok((quantity.to_string(), name.to_string(), value))
            }
            _ => Err(BenchError::malformed(
                path,
                format!("not three columns: {line}"),
            )),
        }
    };
    PUBLISHED.lines().skip(1).map(read).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_published_number_is_met() {
        let ours = measured(&Samples::reference().unwrap());
        let published = published().unwrap();
        assert_eq!((published.len(), ours.len()), (31, 31));
        for row in &published {
            assert!(is_met(row, &ours), "{row:?}");
        }
    }

    #[test]
    fn numbers_are_written_as_printed() {
        assert_eq!(
            [short(-10.0), short(0.4), short(-1e-15), short(20.0)],
            ["−10", "0.4", "0", "20"]
        );
    }
}
