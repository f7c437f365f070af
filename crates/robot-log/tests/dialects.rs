//! The same log in every dialect of text gives the same samples to the bit; what is none is refused with the remedy.

use std::fmt::Write as _;
use std::path::PathBuf;

use robot_log::{DelimitedText, EffortUnit, LogError, Mapping, Tally};
use tempfile::TempDir;

const N: usize = 200;

struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    fn write(&self, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join("log.csv");
        std::fs::write(&path, text).unwrap();
        path
    }
}

fn row(k: usize) -> [f64; 7] {
    let t = 0.01 * k as f64;
    let (a, b) = ((3.0 * t).sin(), (2.0 * t).cos());
    [
        t,
        a,
        b,
        3.0 * (3.0 * t).cos(),
        -2.0 * (2.0 * t).sin(),
        1.5 * a,
        -b,
    ]
}

fn text(header: &str, separator: &str, end: &str) -> String {
    let mut text = header.replace(',', separator) + if header.is_empty() { "" } else { end };
    for k in 0..N {
        let fields: Vec<String> = row(k).iter().map(|x| format!("{x:.9}")).collect();
        let _ = write!(text, "{}{end}", fields.join(separator));
    }
    text
}

const HEADER: &str = "t,q1,q2,dq1,dq2,tau1,tau2";

type Rows = Vec<Vec<f64>>;

fn samples(log: DelimitedText, mapping: Mapping) -> Result<(Rows, Tally), LogError> {
    let mut log = log.with_mapping(mapping)?;
    crate::rows_of(&mut log)
}

fn by_name(path: &std::path::Path) -> Result<(Rows, Tally), LogError> {
    let log = DelimitedText::open(path)?;
    let mut mapping = log.guess()?;
    mapping.effort_unit = Some(EffortUnit::parse("Nm")?);
    samples(log, mapping)
}

fn refusal(bytes: impl AsRef<[u8]>) -> String {
    let folder = Folder::new();
    by_name(&folder.write(bytes)).unwrap_err().to_string()
}

#[test]
fn every_dialect_gives_the_same_samples() {
    let folder = Folder::new();
    let (expected, tally) = by_name(&folder.write(text(HEADER, ",", "\n"))).unwrap();
    assert_eq!(tally.n_read, N);
    assert!(expected.len() == N);
    let plain = text(HEADER, ",", "\n");
    let decimal_comma = text(HEADER, ";", "\n").replace('.', ",");
    for other in [
        text(HEADER, ";", "\n"),
        text(HEADER, "\t", "\r\n"),
        text(HEADER, " ", "\n"),
        text(HEADER, "   ", "\n"),
        decimal_comma,
        format!("\u{feff}{plain}"),
        format!("# a remark\n{plain}"),
        format!("# {HEADER}\n{}", text("", ",", "\n")),
        format!("# {}\n{}", HEADER.replace(',', " "), text("", " ", "\n")),
        text(HEADER, ",", ",\n"),
        text(HEADER, ",", "\n")
            .replace("0.5", "5.0D-1")
            .replace("5.0D-1", "0.5"),
    ] {
        let (rows, _) = by_name(&folder.write(&other))
            .unwrap_or_else(|error| panic!("{error}: {}", &other[..80]));
        assert!(rows == expected, "{}", &other[..80]);
    }
    let log = DelimitedText::open(&folder.write(text("", " ", "\n"))).unwrap();
    let mapping = Mapping::parse(
        "time = \"c1\"\nposition = [\"c2\", \"c3\"]\nvelocity = [\"c4\", \"c5\"]\neffort = [\"c6\", \"c7\"]\neffort_unit = \"Nm\"",
    )
    .unwrap();
    assert!(samples(log, mapping).unwrap().0 == expected);
}

#[test]
fn speeds_that_are_missing_are_made_from_the_positions() {
    let folder = Folder::new();
    let (with, _) = by_name(&folder.write(text(HEADER, ",", "\n"))).unwrap();
    let without = text("t,q1,q2,a,b,tau1,tau2", ",", "\n");
    let (rows, _) = by_name(&folder.write(without)).unwrap();
    for (row, with) in rows.iter().zip(&with).skip(30).take(N - 60) {
        // Central differences of 3 rad/s sines at 100 Hz: (ωh)²/6 of the speed.
        for column in [3, 4] {
            assert!((row[column] - with[column]).abs() < 3.0 * 0.03_f64.powi(2) / 6.0 + 1e-6);
        }
    }
}

#[test]
fn garbage_is_dropped_and_counted_and_turns_are_unwrapped() {
    let folder = Folder::new();
    let spoilt = text(HEADER, ",", "\n").replacen("\n1.000000000,", "\n1.000000000,1e149,", 1);
    let spoilt = spoilt.replacen("1e149,0.141120008", "1e149", 1);
    let (_, tally) = by_name(&folder.write(&spoilt)).unwrap();
    assert_eq!((tally.n_garbage, tally.first_garbage), (1, Some(101)));

    let mut turning = HEADER.to_owned() + "\n";
    for k in 0..N {
        let t = 0.01 * k as f64;
        let angle = (4.0 * t + 3.0) % std::f64::consts::TAU - std::f64::consts::PI;
        let _ = writeln!(turning, "{t},{angle},0,4,0,1,1");
    }
    let (rows, _) = by_name(&folder.write(turning)).unwrap();
    // Away from the ends, at which the filter bends a line.
    let way = rows[150][1] - rows[50][1];
    assert!((way - 4.0).abs() < 1e-6, "{way}");
}

#[test]
fn what_cannot_be_read_says_what_to_do() {
    for (bytes, expected) in [
        (text("t,a,b,c,d,e,f", ",", "\n").into_bytes(), "--position"),
        (b"#ROSBAG V2.0\n".to_vec(), "a bag of ROS 1"),
        (b"PAR1xx".to_vec(), "Parquet"),
        (b"\x89MCAP0\r\nxx".to_vec(), "ros2 bag convert"),
        (b"\xff\xfet\0,\0".to_vec(), "UTF-16"),
        (b"".to_vec(), "empty"),
        (
            text(HEADER, ",", "\n")
                .replacen("0.010000000,", "0.010000000,x", 1)
                .into_bytes(),
            "is not a number",
        ),
        (
            text(HEADER, ",", "\n")
                .replacen("0.010000000,", "", 1)
                .into_bytes(),
            "row 2 has 6 fields",
        ),
        (
            text(HEADER, ",", "\n")
                .replacen("0.050000000,", "0.005000000,", 1)
                .into_bytes(),
            "time runs backwards at row 6",
        ),
        (
            (HEADER.to_owned() + "\n0,1,1,1,1,1,1\n").into_bytes(),
            "the same time",
        ),
    ] {
        let message = refusal(&bytes);
        assert!(
            message.contains(expected) && message.contains("log.csv"),
            "{expected}: {message}"
        );
    }
    let folder = Folder::new();
    let log = DelimitedText::open(&folder.write(text(HEADER, ",", "\n"))).unwrap();
    let mapping = log.guess().unwrap();
    let message = samples(log, mapping).unwrap_err().to_string();
    assert!(
        message.contains("in which unit are the efforts (tau1, tau2)"),
        "{message}"
    );
}
