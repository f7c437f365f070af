//! A ROS 2 bag in SQLite (`.db3`): the joint states of one topic.

use std::path::Path;

use rusqlite::{Connection, OpenFlags};

use crate::error::LogError;
use crate::joint_state::{JointOrder, JointState, TYPE};
use crate::mapping::Mapping;
use crate::recording::{Measurement, Recording};

/// Messages that are read at a time.
const PAGE: i64 = 256;

/// A bag whose topic and joints are known.
pub struct SqliteBag {
    file: String,
    bag: Connection,
    topic: i64,
    order: JointOrder,
    joints: Vec<String>,
    has_velocity: bool,
    /// Factors of positions and speeds, and of each joint's effort.
    factors: [f64; 2],
    effort_factor: Vec<f64>,
    first_stamp: i64,
    page: std::vec::IntoIter<Message>,
    /// Time and number of the last message of the page.
    last: (i64, i64),
    row: u64,
}

/// Bytes of a database's head.
const HEAD: usize = 100;

/// Recorder's time, number, bytes.
type Message = (i64, i64, Vec<u8>);

impl SqliteBag {
    /// Whether a file is a SQLite database, whatever its name.
    pub fn is_one(path: &Path) -> bool {
        head(path).is_ok_and(|head| head.starts_with(b"SQLite format 3\0"))
    }

    /// Opens a bag: the topic asked for, or the only one with joint states.
    ///
    /// Of the mapping it takes units, gain and joints.
    /// # Errors
    /// [`LogError::File`] for a database that is no bag or damaged, no or several topics of joint states, messages that
    /// cannot be read, joints that there are not, efforts without a unit.
    pub fn open(path: &Path, topic: Option<&str>, mapping: &Mapping) -> Result<Self, LogError> {
        let file = path.display().to_string();
        require_whole(&file, path)?;
        let damaged = |error: rusqlite::Error| {
            LogError::file(&file, format!("cannot be read as a bag: {error}"))
        };
        let bag =
            Connection::open_with_flags(path, OpenFlags::SQLITE_OPEN_READ_ONLY).map_err(damaged)?;
        let topic = topic_of(&file, &bag, topic)?;
        let mut recording = Self {
            order: JointOrder::empty(),
            joints: Vec::new(),
            has_velocity: false,
            factors: [
                mapping.position_unit.factor(),
                mapping.velocity_unit.factor(),
            ],
            effort_factor: Vec::new(),
            first_stamp: 0,
            page: Vec::new().into_iter(),
            last: (i64::MIN, i64::MIN),
            row: 0,
            topic,
            bag,
            file,
        };
        let first = recording.message()?;
        let first =
            first.ok_or_else(|| LogError::file(&recording.file, "the topic has no message"))?;
        recording.order = JointOrder::new(&recording.file, &first, &mapping.joints)?;
        recording.joints = recording.order.joints();
        recording.has_velocity = first.velocity.len() == first.name.len();
        let factors = mapping.effort_factors(&recording.joints);
        recording.effort_factor =
            factors.map_err(|cause| LogError::file(&recording.file, cause.to_string()))?;
        recording.first_stamp = first.stamp;
        recording.page = Vec::new().into_iter();
        recording.last = (i64::MIN, i64::MIN);
        recording.row = 0;
        Ok(recording)
    }

    /// The next message; one without a stamp has the recorder's time.
    fn message(&mut self) -> Result<Option<JointState>, LogError> {
        if self.page.len() == 0 {
            self.read_page().map_err(|error| {
                LogError::file(&self.file, format!("after message {}: {error}", self.row))
            })?;
        }
        let Some((time, _, bytes)) = self.page.next() else {
            return Ok(None);
        };
        self.row += 1;
        let mut message = JointState::parse(&bytes).map_err(|what| self.fault(&what))?;
        if message.stamp == 0 {
            message.stamp = time;
        }
        Ok(Some(message))
    }

    fn read_page(&mut self) -> rusqlite::Result<()> {
        let mut query = self.bag.prepare(
            "SELECT timestamp, id, data FROM messages WHERE topic_id = ?1 AND (timestamp, id) > (?2, ?3) \
             ORDER BY timestamp, id LIMIT ?4",
        )?;
        let (time, number) = self.last;
        let rows = query.query_map((self.topic, time, number, PAGE), |row| {
            Ok((row.get(0)?, row.get(1)?, row.get(2)?))
        })?;
        let page: Vec<Message> = rows.collect::<rusqlite::Result<_>>()?;
        if let Some((time, number, _)) = page.last() {
            self.last = (*time, *number);
        }
        self.page = page.into_iter();
        Ok(())
    }

    fn fault(&self, what: &str) -> LogError {
        LogError::file(&self.file, format!("message {}: {what}", self.row))
    }
}

impl Recording for SqliteBag {
    fn file(&self) -> &str {
        &self.file
    }

    fn joints(&self) -> &[String] {
        &self.joints
    }

    fn has_velocity(&self) -> bool {
        self.has_velocity
    }

    fn next(&mut self, into: &mut Measurement) -> Result<bool, LogError> {
        let Some(message) = self.message()? else {
            return Ok(false);
        };
        let checked = self.order.check(&message, self.has_velocity);
        checked.map_err(|what| self.fault(&what))?;
        let [position, velocity] = self.factors;
        let of = |values: &[f64], factor: f64, into: &mut Vec<f64>| {
            into.clear();
            let places = self.order.places.iter();
            into.extend(
                places
                    .filter_map(|place| values.get(*place))
                    .map(|x| factor * x),
            );
        };
        of(&message.position, position, &mut into.position);
        of(&message.velocity, velocity, &mut into.velocity);
        of(&message.effort, 1.0, &mut into.effort);
        for (effort, factor) in into.effort.iter_mut().zip(&self.effort_factor) {
            *effort *= factor;
        }
        into.row = self.row;
        // The difference of whole nanoseconds is exact where seconds since 1970 are not.
        into.t = Some((message.stamp - self.first_stamp) as f64 * 1e-9);
        into.run.clear();
        into.context.clear();
        Ok(true)
    }
}

/// The first bytes of a database, which say how large it is.
fn head(path: &Path) -> std::io::Result<[u8; HEAD]> {
    use std::io::Read as _;
    let mut head = [0; HEAD];
    std::fs::File::open(path)?.read_exact(&mut head)?;
    Ok(head)
}

/// Refuses a file that is shorter than its first bytes say: SQLite itself reads what is there.
///
/// # Source
/// "Database File Format", sec. 1.3: size of a page at byte 16, number of pages at byte 28.
fn require_whole(file: &str, path: &Path) -> Result<(), LogError> {
    let io = |source| LogError::Io {
        file: file.to_owned(),
        source,
    };
    let head = head(path).map_err(io)?;
    let n_bytes = std::fs::metadata(path).map_err(io)?.len();
    let page = match u16::from_be_bytes([head[16], head[17]]) {
        1 => 1 << 16,
        page => u64::from(page),
    };
    let n_pages = u32::from_be_bytes([head[28], head[29], head[30], head[31]]);
    let needed = page * u64::from(n_pages);
    if n_bytes < needed {
        return Err(LogError::file(
            file,
            format!("the bag is cut: {n_bytes} of {needed} bytes"),
        ));
    }
    Ok(())
}

/// Number of the topic asked for, or of the only one with joint states.
fn topic_of(file: &str, bag: &Connection, asked: Option<&str>) -> Result<i64, LogError> {
    let damaged =
        |error: rusqlite::Error| LogError::file(file, format!("cannot be read as a bag: {error}"));
    let mut query = bag
        .prepare("SELECT id, name, type FROM topics ORDER BY id")
        .map_err(damaged)?;
    let rows = query.query_map((), |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)));
    let topics: Vec<(i64, String, String)> = rows.and_then(Iterator::collect).map_err(damaged)?;
    let listed = || {
        let names: Vec<String> = topics
            .iter()
            .map(|(_, name, kind)| format!("{name} ({kind})"))
            .collect();
        names.join(", ")
    };
    let is_asked = |name: &str| asked.is_none_or(|asked| asked == name);
    let found: Vec<&(i64, String, String)> = topics
        .iter()
        .filter(|(_, name, kind)| is_asked(name) && kind == TYPE)
        .collect();
    match found[..] {
        [(topic, _, _)] => Ok(*topic),
        [] => Err(LogError::file(
            file,
            format!("no topic of {TYPE} to read; there are {}", listed()),
        )),
        _ => Err(LogError::file(
            file,
            format!(
                "several topics of {TYPE}: say --topic; there are {}",
                listed()
            ),
        )),
    }
}
