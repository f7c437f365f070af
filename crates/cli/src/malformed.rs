//! Tables spoilt at random: reading them ends in an error, or in the numbers that are under the names.

use std::collections::BTreeMap;

use faer::Mat;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use torque_model::Samples;

use crate::columns::{QUANTITIES, StateColumns};
use crate::joints::Joints;
use crate::samples::DataColumns;
use crate::table::Table;

const N_FILES: u64 = 10_000;

/// Texts that break careless readers.
const NASTY: [&str; 22] = [
    "NaN",
    "inf",
    "-inf",
    "1e999",
    "",
    " ",
    ",",
    ";",
    "\"",
    "\"\"",
    "\r",
    "\n",
    "\r\n",
    "\0",
    "\u{feff}",
    "é",
    "-",
    "0x10",
    "1_000",
    "99999999999999999999",
    "q",
    "1e308",
];

/// Two joints, torques and a context, eight rows.
fn valid() -> String {
    let mut text = "context,t,q1,q2,qd1,qd2,qdd1,qdd2,tau1,tau2\n".to_owned();
    for row in 0..8 {
        let numbers = (0..9).map(|col| format!("{:?}", f64::from(row * 9 + col) / 7.0));
        text.push_str("c1,");
        text.push_str(&(numbers.collect::<Vec<_>>().join(",") + "\n"));
    }
    text
}

/// One to three random changes of bytes, fields, lines or columns.
fn spoilt(rng: &mut ChaCha8Rng) -> Vec<u8> {
    let mut bytes = valid().into_bytes();
    for _ in 0..rng.random_range(1..=3) {
        match rng.random_range(0..8) {
            0 => flip_byte(&mut bytes, rng),
            1 => _ = bytes.remove(rng.random_range(0..bytes.len())),
            2 => insert_nasty(&mut bytes, rng),
            3 => bytes.truncate(rng.random_range(1..=bytes.len())),
            4 => on_lines(&mut bytes, rng, |lines, a, b| lines.swap(a, b)),
            5 => on_lines(&mut bytes, rng, |lines, a, b| lines[a] = lines[b].clone()),
            6 => on_fields(&mut bytes, rng, |fields, a, b| {
                fields[a] = fields[b].clone();
            }),
            _ => on_columns(&mut bytes, rng),
        }
        if bytes.is_empty() {
            return bytes;
        }
    }
    bytes
}

fn flip_byte(bytes: &mut [u8], rng: &mut ChaCha8Rng) {
    let at = rng.random_range(0..bytes.len());
    bytes[at] ^= 1 << rng.random_range(0..8);
}

fn insert_nasty(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    let at = rng.random_range(0..bytes.len());
    let text = NASTY[rng.random_range(0..NASTY.len())];
    bytes.splice(at..at, text.bytes());
}

fn on_lines(
    bytes: &mut Vec<u8>,
    rng: &mut ChaCha8Rng,
    change: impl Fn(&mut Vec<Vec<u8>>, usize, usize),
) {
    let mut lines: Vec<Vec<u8>> = bytes
        .split(|byte| *byte == b'\n')
        .map(<[u8]>::to_vec)
        .collect();
    let (a, b) = (
        rng.random_range(0..lines.len()),
        rng.random_range(0..lines.len()),
    );
    change(&mut lines, a, b);
    *bytes = lines.join(&b'\n');
}

/// Changes the fields of one line, the header as often as all others together.
fn on_fields(
    bytes: &mut Vec<u8>,
    rng: &mut ChaCha8Rng,
    change: impl Fn(&mut Vec<Vec<u8>>, usize, usize),
) {
    let mut lines: Vec<Vec<u8>> = bytes
        .split(|byte| *byte == b'\n')
        .map(<[u8]>::to_vec)
        .collect();
    let line = if rng.random_bool(0.5) {
        0
    } else {
        rng.random_range(0..lines.len())
    };
    let mut fields: Vec<Vec<u8>> = lines[line]
        .split(|byte| *byte == b',')
        .map(<[u8]>::to_vec)
        .collect();
    let (a, b) = (
        rng.random_range(0..fields.len()),
        rng.random_range(0..fields.len()),
    );
    change(&mut fields, a, b);
    lines[line] = fields.join(&b',');
    *bytes = lines.join(&b'\n');
}

/// Exchanges two columns in every line: a right answer must follow the names.
fn on_columns(bytes: &mut Vec<u8>, rng: &mut ChaCha8Rng) {
    let (a, b) = (rng.random_range(0..10), rng.random_range(0..10));
    let lines = bytes.split(|byte| *byte == b'\n').map(|line| {
        let mut fields: Vec<&[u8]> = line.split(|byte| *byte == b',').collect();
        if a.max(b) < fields.len() {
            fields.swap(a, b);
        }
        fields.join(&b',')
    });
    *bytes = lines.collect::<Vec<_>>().join(&b'\n');
}

/// Every row by column name, read without any code of this crate.
fn by_name(bytes: &[u8]) -> Vec<BTreeMap<String, String>> {
    let mut reader = csv::ReaderBuilder::new().flexible(true).from_reader(bytes);
    let trimmed = |field: &str| field.trim().to_owned();
    let header: Vec<String> = reader.headers().unwrap().iter().map(trimmed).collect();
    let rows = reader.records().map(|record| {
        let record = record.unwrap();
        header
            .iter()
            .cloned()
            .zip(record.iter().map(trimmed))
            .collect()
    });
    rows.collect()
}

fn assert_right(bytes: &[u8], joints: &[String], samples: &Samples, context: Option<&str>) {
    let mut rows = by_name(bytes);
    rows.retain(|row| context.is_none_or(|wanted| row["context"] == wanted));
    let number = |row: usize, name: String| rows[row][&name].parse::<f64>().unwrap();
    let n_joints = joints.len();
    let x = Mat::from_fn(rows.len(), 3 * n_joints, |row, col| {
        number(
            row,
            format!("{}{}", QUANTITIES[col / n_joints], col % n_joints + 1),
        )
    });
    assert!(samples.x == x, "{}", String::from_utf8_lossy(bytes));
    for torques in &samples.torques {
        let expected: Vec<f64> = (0..rows.len())
            .map(|row| number(row, format!("tau{}", torques.joint_idx + 1)))
            .collect();
        assert_eq!(torques.values, expected);
    }
    let finite = |value: &f64| value.is_finite();
    assert!(
        samples
            .torques
            .iter()
            .all(|torques| torques.values.iter().all(finite))
    );
    assert!(
        rows.iter()
            .all(|row| row.get("context") == rows[0].get("context"))
    );
}

#[test]
fn ten_thousand_spoilt_tables_end_in_an_error_or_the_right_numbers() {
    let mut rng = ChaCha8Rng::seed_from_u64(560);
    let (mut n_read, mut n_refused) = (0, 0);
    for file in 0..N_FILES {
        let bytes = spoilt(&mut rng);
        let context = (file % 2 == 0).then_some("c1");
        let asked = if file % 3 == 0 {
            vec!["2".to_owned()]
        } else {
            Vec::new()
        };
        let read = Table::from_bytes("data.csv".to_owned(), bytes.clone()).and_then(|mut table| {
            let columns = DataColumns::of_header(&table, "tau", "--joints", &asked)?;
            let samples = columns.read(&mut table, context)?.samples;
            Ok((columns.joints.names, samples))
        });
        match read {
            Ok((joints, samples)) => {
                assert_right(&bytes, &joints, &samples, context);
                n_read += 1;
            }
            Err(error) => {
                assert!(
                    error.to_string().starts_with("data.csv: ") || asked.len() == 1,
                    "{error}"
                );
                n_refused += 1;
            }
        }
    }
    assert!(
        n_read > 1000 && n_refused > 1000,
        "{n_read} read, {n_refused} refused"
    );
}

#[test]
fn spoilt_tables_of_a_known_model_too() {
    let mut rng = ChaCha8Rng::seed_from_u64(561);
    let mut n_read = 0;
    for _ in 0..N_FILES {
        let bytes = spoilt(&mut rng);
        let names = vec!["joint1".to_owned(), "joint2".to_owned()];
        let read = Table::from_bytes("data.csv".to_owned(), bytes.clone()).and_then(|mut table| {
            let joints = Joints::by_name("model", names.clone());
            StateColumns::find("data.csv", &table.column_names(), &joints)?;
            DataColumns::of_joints(&table, joints, "tau", &[0, 1])?.read(&mut table, None)
        });
        if let Ok(data) = read {
            assert_right(&bytes, &names, &data.samples, None);
            n_read += 1;
        }
    }
    assert!(n_read > 1000, "{n_read}");
}
