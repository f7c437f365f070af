//! A recorded motion against what another program made of it.

use std::path::{Path, PathBuf};

use robot_log::{DelimitedText, EffortUnit, LogError, Settings, TimeUnit, prepare};

const N_JOINTS: usize = 7;

fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../../fixtures/robot-log")
        .join(name)
}

/// Rows of the numbers behind context, run and t, with t.
fn golden(name: &str) -> Vec<(f64, Vec<f64>)> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .from_path(fixture(name))
        .unwrap();
    let number = |text: &str| text.parse::<f64>().unwrap();
    let rows = reader.records().map(|record| {
        let record = record.unwrap();
        (
            number(&record[2]),
            record.iter().skip(3).map(number).collect(),
        )
    });
    rows.collect()
}

fn prepared(every: usize) -> Vec<(f64, Vec<f64>)> {
    let log = DelimitedText::open(&fixture("gen3_recorded.csv")).unwrap();
    let mut mapping = log.guess().unwrap();
    mapping.time_unit = TimeUnit::parse("ms").unwrap();
    mapping.effort_unit = Some(EffortUnit::parse("N·m").unwrap());
    let mut log = log.with_mapping(mapping).unwrap();
    let settings = Settings {
        every: Some(every),
        ..Settings::default()
    };
    let mut rows = Vec::new();
    let tally = prepare::<LogError>(&mut log, &settings, |run| {
        assert_eq!(run.name, "gen3_recorded");
        assert!((run.rate - 1000.0).abs() < 1e-9);
        let t = run.t.clone();
        run.columns.for_each_row(|row, values| {
            rows.push((t[row], values.to_vec()));
            Ok(())
        })
    });
    let tally = tally.unwrap();
    assert_eq!((tally.n_read, tally.n_garbage, tally.n_gaps), (2294, 0, 0));
    assert_eq!(tally.n_written, rows.len());
    rows
}

fn assert_close(found: &[(f64, Vec<f64>)], expected: &[(f64, Vec<f64>)]) {
    assert!(expected.len() >= 40, "{}", expected.len());
    assert_eq!(found.len(), expected.len());
    for ((t, values), (expected_t, expected)) in found.iter().zip(expected) {
        assert!((t - expected_t).abs() < 1e-9);
        assert_eq!(values.len(), expected.len());
        for (column, (value, expected)) in values.iter().zip(expected).enumerate() {
            let tolerance = match column / N_JOINTS {
                0 | 1 => 1e-7,
                2..=5 => 1e-6,
                _ => 0.0,
            };
            assert!(
                (value - expected).abs() <= tolerance,
                "t {t} column {column}: {value} {expected}"
            );
        }
    }
}

#[test]
fn a_recorded_motion_is_prepared_as_by_another_program() {
    assert_close(&prepared(10)[..200], &golden("gen3_prepared.csv"));
    assert_close(
        &prepared(1)[400..440],
        &golden("gen3_prepared_full_rate.csv"),
    );
}

#[test]
fn the_coefficients_are_those_of_another_program() {
    let filter = robot_log::LowPass::butterworth(10.0, 1000.0).unwrap();
    let (b, a) = filter.coefficients();
    // Butterworth of order 4, 10 Hz at 1 kHz, by NumPy.
    let golden_b = [
        8.984_861_463_970_648e-7,
        3.593_944_585_588_259e-6,
        5.390_916_878_382_389e-6,
        3.593_944_585_588_259e-6,
        8.984_861_463_970_648e-7,
    ];
    let golden_a = [
        1.0,
        -3.835_825_540_647_348,
        5.520_819_136_622_229,
        -3.533_535_219_463_014_5,
        0.848_555_999_266_477,
    ];
    for (found, golden) in b.iter().zip(golden_b).chain(a.iter().zip(golden_a)) {
        assert!((found / golden - 1.0).abs() < 1e-9, "{found} {golden}");
    }
}
