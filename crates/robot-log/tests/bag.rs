//! Joint states in a bag of ROS 2, written here byte by byte.

use std::path::{Path, PathBuf};

use robot_log::{EffortUnit, LogError, Mapping, SqliteBag, Tally};
use rusqlite::Connection;
use tempfile::TempDir;

const N: usize = 400;
const NAMES: [&str; 2] = ["elbow", "wrist_1"];

/// sensor_msgs/msg/JointState in little-endian CDR.
fn joint_state(stamp: i64, names: &[&str], numbers: [&[f64]; 3]) -> Vec<u8> {
    let mut bytes: Vec<u8> = Vec::new();
    let pad = |bytes: &mut Vec<u8>, size: usize| {
        bytes.resize(bytes.len().next_multiple_of(size), 0);
    };
    let put = |bytes: &mut Vec<u8>, n: i64| {
        pad(bytes, 4);
        bytes.extend(u32::try_from(n).unwrap().to_le_bytes());
    };
    let text = |bytes: &mut Vec<u8>, text: &str| {
        put(bytes, i64::try_from(text.len()).unwrap() + 1);
        bytes.extend(text.as_bytes());
        bytes.push(0);
    };
    put(&mut bytes, stamp / 1_000_000_000);
    put(&mut bytes, stamp % 1_000_000_000);
    text(&mut bytes, "base");
    put(&mut bytes, i64::try_from(names.len()).unwrap());
    for name in names {
        text(&mut bytes, name);
    }
    for numbers in numbers {
        put(&mut bytes, i64::try_from(numbers.len()).unwrap());
        if !numbers.is_empty() {
            pad(&mut bytes, 8);
        }
        bytes.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    }
    [&[0, 1, 0, 0], &bytes[..]].concat()
}

fn state(k: usize) -> [[f64; 2]; 3] {
    let t = 0.01 * k as f64;
    let q = [(3.0 * t).sin(), (2.0 * t).cos()];
    let qd = [3.0 * (3.0 * t).cos(), -2.0 * (2.0 * t).sin()];
    [q, qd, [2.0 * q[0] + qd[0], -q[1]]]
}

fn stamp(k: usize) -> i64 {
    1_700_000_000_000_000_000 + 10_000_000 * i64::try_from(k).unwrap()
}

fn message(k: usize) -> Vec<u8> {
    let [q, qd, tau] = state(k);
    joint_state(stamp(k), &NAMES, [&q, &qd, &tau])
}

struct Bag {
    folder: TempDir,
    db: Connection,
}

impl Bag {
    fn new(kind: &str) -> Self {
        let folder = TempDir::new().unwrap();
        let db = Connection::open(folder.path().join("bag.db3")).unwrap();
        db.execute_batch(
            "CREATE TABLE topics (id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL);
             CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);",
        )
        .unwrap();
        let bag = Self { folder, db };
        bag.topic(1, "/joint_states", kind);
        bag
    }

    fn topic(&self, id: i64, name: &str, kind: &str) {
        let text = "INSERT INTO topics VALUES (?1, ?2, ?3)";
        self.db.execute(text, (id, name, kind)).unwrap();
    }

    fn push(&self, topic: i64, k: usize, bytes: &[u8]) {
        let text = "INSERT INTO messages (topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
        self.db.execute(text, (topic, stamp(k), bytes)).unwrap();
    }

    fn path(&self) -> PathBuf {
        self.folder.path().join("bag.db3")
    }
}

const JOINT_STATE: &str = "sensor_msgs/msg/JointState";

fn whole() -> Bag {
    let bag = Bag::new(JOINT_STATE);
    bag.db.execute_batch("BEGIN").unwrap();
    (0..N).for_each(|k| bag.push(1, k, &message(k)));
    bag.db.execute_batch("COMMIT").unwrap();
    bag
}

type Rows = Vec<Vec<f64>>;

fn samples(path: &Path, joints: &[&str]) -> Result<(Rows, Tally), LogError> {
    let mapping = Mapping {
        effort_unit: Some(EffortUnit::parse("Nm")?),
        joints: joints.iter().map(|joint| (*joint).to_owned()).collect(),
        ..Mapping::default()
    };
    let mut bag = SqliteBag::open(path, None, &mapping)?;
    crate::rows_of(&mut bag)
}

#[test]
fn a_bag_is_read_in_the_order_asked_for() {
    let bag = whole();
    let (rows, tally) = samples(&bag.path(), &[]).unwrap();
    assert_eq!((tally.n_read, rows.len()), (N, N));
    let (turned, _) = samples(&bag.path(), &["wrist_1", "elbow"]).unwrap();
    for (row, turned) in rows.iter().zip(&turned) {
        assert_eq!(
            [row[1], row[2], row[7]].map(f64::to_bits),
            [turned[2], turned[1], turned[8]].map(f64::to_bits)
        );
    }
    // A sine at a third of a hertz passes the filter; 10⁻³ is more than what the ends add inside.
    let k = N / 2;
    assert!((rows[k][0] - 0.01 * k as f64).abs() < 1e-12);
    assert!((rows[k][1] - state(k)[0][0]).abs() < 1e-3, "{:?}", rows[k]);
}

#[test]
fn bags_that_are_none_or_spoilt_are_refused_with_the_message() {
    let refusal = |bag: &Bag, joints: &[&str]| {
        let message = samples(&bag.path(), joints).unwrap_err().to_string();
        assert!(message.contains("bag.db3"), "{message}");
        message
    };
    let other = Bag::new("sensor_msgs/msg/Imu");
    assert!(refusal(&other, &[]).contains("/joint_states (sensor_msgs/msg/Imu)"));
    let empty = Bag::new(JOINT_STATE);
    assert!(refusal(&empty, &[]).contains("no message"));
    assert!(refusal(&whole(), &["hip"]).contains("no joint `hip`"));
    let two = whole();
    two.topic(2, "/other/joint_states", JOINT_STATE);
    assert!(refusal(&two, &[]).contains("--topic"));

    let cut = whole();
    cut.push(1, N, &message(N)[..60]);
    assert!(refusal(&cut, &[]).contains("message 401: it ends"));
    let turned = whole();
    let [q, qd, tau] = state(N);
    turned.push(
        1,
        N,
        &joint_state(stamp(N), &["wrist_1", "elbow"], [&q, &qd, &tau]),
    );
    assert!(refusal(&turned, &[]).contains("message 401: its joints are wrist_1, elbow"));
    let short = whole();
    short.push(1, N, &joint_state(stamp(N), &NAMES, [&q, &qd, &[]]));
    assert!(refusal(&short, &[]).contains("0 efforts of 2 joints"));
    let back = whole();
    back.push(1, N, &joint_state(stamp(5), &NAMES, [&q, &qd, &tau]));
    assert!(refusal(&back, &[]).contains("time runs backwards at row 401"));
}

#[test]
fn a_file_that_is_cut_ends_in_an_error_or_in_fewer_rows() {
    let bag = whole();
    bag.db.execute_batch("PRAGMA wal_checkpoint").ok();
    let bytes = std::fs::read(bag.path()).unwrap();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("cut.db3");
    let mut n_refused = 0;
    for end in (0..bytes.len()).step_by(997) {
        std::fs::write(&path, &bytes[..end]).unwrap();
        n_refused += usize::from(samples(&path, &[]).is_err());
    }
    assert_eq!(n_refused, bytes.len().div_ceil(997), "every cut is noticed");
}
