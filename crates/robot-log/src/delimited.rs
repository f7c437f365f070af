//! Text in columns, in any dialect: commas, semicolons, tabs or blanks; decimal commas; with or without a header.

use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::Path;

use csv::{ReaderBuilder, StringRecord};

use crate::error::LogError;
use crate::guess::guess;
use crate::mapping::{Mapping, Places};
use crate::recording::{Measurement, Recording};

/// Lines that are looked at to see what a file is like.
const LOOK_LINES: usize = 20;
/// Bytes of a line beyond which it is no line of a log.
const LONGEST_LINE: u64 = 1 << 20;

/// How a file separates its columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Dialect {
    /// `None`: blanks.
    separator: Option<u8>,
    has_decimal_comma: bool,
}

/// A log as text in columns.
pub struct DelimitedText {
    file: String,
    dialect: Dialect,
    mapping: Mapping,
    places: Option<Places>,
    header: Vec<String>,
    fields: Fields,
    record: StringRecord,
    row: u64,
    /// Factors of position, speed and time.
    factors: [f64; 3],
}

enum Fields {
    Separated(csv::Reader<BufReader<File>>),
    Blanks(BufReader<File>, u64, String),
}

impl DelimitedText {
    /// Opens a file and reads its header; of a file without one, columns are called c1, c2, ….
    ///
    /// # Errors
    /// A file that cannot be read, is empty or is not text.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let file = path.display().to_string();
        let first = first_lines(&file, path)?;
        let dialect = Dialect::of(&first);
        let header = dialect.header(&file, &first)?;
        let open = || {
            File::open(path).map_err(|source| LogError::Io {
                file: file.clone(),
                source,
            })
        };
        let mut fields = match dialect.separator {
            Some(separator) => Fields::Separated(
                ReaderBuilder::new()
                    .delimiter(separator)
                    .flexible(true)
                    .has_headers(false)
                    .comment(Some(b'#'))
                    .from_reader(BufReader::new(open()?)),
            ),
            None => Fields::Blanks(BufReader::new(open()?), 0, String::new()),
        };
        let mut record = StringRecord::new();
        if header.is_a_row {
            fields.next(&file, &mut record)?;
        }
        Ok(Self {
            mapping: Mapping::default(),
            places: None,
            header: header.names,
            file,
            dialect,
            fields,
            record,
            row: 0,
            factors: [1.0; 3],
        })
    }

    /// The names of its columns.
    pub fn header(&self) -> &[String] {
        &self.header
    }

    /// The same with a mapping of its columns.
    ///
    /// # Errors
    /// [`LogError::File`] for a mapping that does not fit, with what is missing.
    pub fn with_mapping(mut self, mapping: Mapping) -> Result<Self, LogError> {
        let places = mapping.places(&self.header);
        self.places = Some(places.map_err(|cause| LogError::file(&self.file, cause.to_string()))?);
        self.factors = [
            mapping.position_unit.factor(),
            mapping.velocity_unit.factor(),
            mapping.time_unit.factor(),
        ];
        self.mapping = mapping;
        Ok(self)
    }

    /// A mapping by the names of its columns.
    ///
    /// # Errors
    /// [`LogError::File`] for names that are not known, with them.
    pub fn guess(&self) -> Result<Mapping, LogError> {
        guess(&self.header).ok_or_else(|| {
            let shown: Vec<&str> = self.header.iter().take(40).map(String::as_str).collect();
            LogError::file(
                &self.file,
                format!(
                    "the columns' names are not known: {}. Say which are which: --position 'NAME{{}}' --velocity 'NAME{{}}' \
                     --effort 'NAME{{}}' --time NAME, {{}} in the place of a joint's name, or --mapping FILE.toml",
                    shown.join(", ")
                ),
            )
        })
    }

    fn number(&self, column: usize) -> Result<f64, LogError> {
        let text = self.record.get(column).unwrap_or_default().trim();
        let parsed = if self.dialect.has_decimal_comma {
            text.replace(',', ".").parse::<f64>()
        } else {
            text.parse::<f64>()
        };
        parsed.or_else(|_| fortran(text)).map_err(|()| {
            let what = if text.is_empty() {
                "the field is empty".to_owned()
            } else {
                let shown: String = text.chars().take(40).collect();
                format!("`{}` is not a number", shown.escape_debug())
            };
            let name = self.header[column].escape_debug();
            LogError::file(
                &self.file,
                format!("row {}: column `{name}`: {what}", self.row),
            )
        })
    }
}

/// Numbers as Fortran writes them, 1.5D-3.
fn fortran(text: &str) -> Result<f64, ()> {
    text.replace(['D', 'd'], "e").parse().map_err(|_| ())
}

impl Recording for DelimitedText {
    fn file(&self) -> &str {
        &self.file
    }

    fn joints(&self) -> &[String] {
        self.places.as_ref().map_or(&[], |places| &places.joints)
    }

    fn has_velocity(&self) -> bool {
        self.places
            .as_ref()
            .is_some_and(|places| !places.velocity.is_empty())
    }

    fn next(&mut self, into: &mut Measurement) -> Result<bool, LogError> {
        let mut record = std::mem::take(&mut self.record);
        let is_there = self.fields.next(&self.file, &mut record);
        self.record = record;
        if !is_there? {
            return Ok(false);
        }
        self.row += 1;
        let (n_fields, n_columns) = (self.record.len(), self.header.len());
        let has_tail = n_fields == n_columns + 1
            && self
                .record
                .get(n_columns)
                .is_some_and(|tail| tail.trim().is_empty());
        if n_fields != n_columns && !has_tail {
            return Err(LogError::file(
                &self.file,
                format!(
                    "row {} has {n_fields} fields, the header has {n_columns}",
                    self.row
                ),
            ));
        }
        let Some(places) = &self.places else {
            return Err(LogError::Mapping(
                "which columns are what was not said".to_owned(),
            ));
        };
        let [position, velocity, time] = self.factors;
        let read = |columns: &[usize], factor: f64, into: &mut Vec<f64>| {
            into.clear();
            for column in columns {
                into.push(factor * self.number(*column)?);
            }
            Ok::<(), LogError>(())
        };
        read(&places.position, position, &mut into.position)?;
        read(&places.velocity, velocity, &mut into.velocity)?;
        read(&places.effort, 1.0, &mut into.effort)?;
        for (effort, factor) in into.effort.iter_mut().zip(&places.effort_factor) {
            *effort *= factor;
        }
        into.t = places
            .time
            .map(|column| self.number(column).map(|t| time * t))
            .transpose()?;
        into.row = self.row;
        let label = |column: Option<usize>, into: &mut String| {
            into.clear();
            into.push_str(
                column
                    .and_then(|column| self.record.get(column))
                    .unwrap_or_default()
                    .trim(),
            );
        };
        label(places.run, &mut into.run);
        label(places.context, &mut into.context);
        Ok(true)
    }
}

impl Fields {
    fn next(&mut self, file: &str, record: &mut StringRecord) -> Result<bool, LogError> {
        match self {
            Self::Separated(reader) => reader.read_record(record).map_err(|error| {
                let line = error.position().map_or(0, csv::Position::line);
                match error.into_kind() {
                    csv::ErrorKind::Io(source) => LogError::Io {
                        file: file.to_owned(),
                        source,
                    },
                    _ => LogError::file(file, format!("line {line}: the text is not UTF-8")),
                }
            }),
            Self::Blanks(reader, line, text) => loop {
                text.clear();
                let n = reader.read_line(text).map_err(|source| LogError::Io {
                    file: file.to_owned(),
                    source,
                })?;
                if n == 0 {
                    return Ok(false);
                }
                *line += 1;
                let content = text.trim();
                if !content.is_empty() && !content.starts_with('#') {
                    record.clear();
                    content
                        .split_whitespace()
                        .for_each(|field| record.push_field(field));
                    return Ok(true);
                }
            },
        }
    }
}

/// The first lines of a text file.
fn first_lines(file: &str, path: &Path) -> Result<Vec<String>, LogError> {
    use std::io::Read as _;
    let io = |source| LogError::Io {
        file: file.to_owned(),
        source,
    };
    let reader = BufReader::new(
        File::open(path)
            .map_err(io)?
            .take(LONGEST_LINE * LOOK_LINES as u64),
    );
    let mut lines = Vec::new();
    for line in reader.split(b'\n').take(LOOK_LINES) {
        let line = line.map_err(io)?;
        if let Some(kind) = lines.is_empty().then(|| other_format(&line)).flatten() {
            return Err(LogError::file(file, kind));
        }
        let text = String::from_utf8(line).map_err(|_| {
            LogError::file(
                file,
                format!("line {}: the text is not UTF-8", lines.len() + 1),
            )
        })?;
        let text = text.trim_start_matches('\u{feff}').trim_end_matches('\r');
        if !text.trim().is_empty() {
            lines.push(text.to_owned());
        }
    }
    if lines.is_empty() {
        return Err(LogError::file(file, "the file is empty"));
    }
    Ok(lines)
}

/// What a file that begins so is, where it is known and not text.
fn other_format(first: &[u8]) -> Option<&'static str> {
    let starts = |magic: &[u8]| first.starts_with(magic);
    if starts(b"#ROSBAG") {
        Some(
            "a bag of ROS 1: convert it to ROS 2 (`rosbags-convert`) or export the topic as CSV (`rostopic echo -p`)",
        )
    } else if starts(b"\x89MCAP0") {
        Some("an MCAP file: `ros2 bag convert` makes a .db3 bag of it, which is read")
    } else if starts(b"PAR1") {
        Some("a Parquet file: export it as CSV")
    } else if starts(b"PK\x03\x04") {
        Some("a ZIP archive (.npz, .xlsx): export the columns as CSV")
    } else if starts(b"\x93NUMPY") {
        Some("a NumPy array: write it with numpy.savetxt(…, header=names, delimiter=',')")
    } else if starts(b"MATLAB") || starts(b"\x89HDF") {
        Some("a MATLAB or HDF5 file: export the columns as CSV (writetable)")
    } else if starts(b"\xff\xfe") || starts(b"\xfe\xff") {
        Some("the text is UTF-16: save it as UTF-8")
    } else {
        None
    }
}

/// Names of the columns, and whether they are the first row that is no comment.
struct Header {
    names: Vec<String>,
    is_a_row: bool,
}

impl Dialect {
    /// The separator that cuts the lines into the most fields, as many in each.
    fn of(lines: &[String]) -> Self {
        let rows: Vec<&str> = lines
            .iter()
            .map(String::as_str)
            .filter(|line| !line.starts_with('#'))
            .collect();
        let last = rows.last().copied().unwrap_or_default();
        let separators = [Some(b'\t'), Some(b';'), Some(b','), None];
        let score = |separator: &Option<u8>| {
            let dialect = Self {
                separator: *separator,
                has_decimal_comma: false,
            };
            let n = dialect.split(last).len();
            let is_same = rows
                .iter()
                .all(|row| dialect.split(row).len().abs_diff(n) <= 1);
            // A comma between digits of fields that another separator cuts is a decimal comma.
            (is_same && n > 1, n)
        };
        let best = separators
            .iter()
            .find(|separator| matches!(separator, Some(b'\t' | b';')) && score(separator).0);
        let best = best.or_else(|| {
            separators
                .iter()
                .rev()
                .max_by_key(|separator| score(separator))
        });
        let separator = best.copied().unwrap_or(Some(b','));
        let plain = Self {
            separator,
            has_decimal_comma: false,
        };
        let fields = plain.split(last);
        let is_comma = |field: &&str| {
            field.contains(',') && field.replace(',', ".").trim().parse::<f64>().is_ok()
        };
        Self {
            separator,
            has_decimal_comma: separator != Some(b',') && fields.iter().any(is_comma),
        }
    }

    fn split(self, line: &str) -> Vec<&str> {
        match self.separator {
            Some(separator) => line.split(char::from(separator)).collect(),
            None => line.split_whitespace().collect(),
        }
    }

    fn header(self, file: &str, lines: &[String]) -> Result<Header, LogError> {
        let unquoted = |name: &&str| name.trim().trim_matches('"').trim().to_owned();
        let is_comment = |line: &&String| line.starts_with('#');
        let Some(first) = lines.iter().find(|line| !is_comment(line)) else {
            return Err(LogError::file(file, "comments and no row"));
        };
        let fields = self.split(first);
        let is_number = |field: &&str| field.replace(',', ".").trim().parse::<f64>().is_ok();
        if !fields.iter().all(is_number) {
            let names = fields.iter().map(unquoted).collect();
            return Ok(Header {
                names,
                is_a_row: true,
            });
        }
        // numpy.savetxt writes its header as a comment.
        let named = lines.iter().take_while(is_comment).find_map(|line| {
            let names = self.split(line.trim_start_matches('#').trim());
            (names.len() == fields.len() && !names.iter().all(is_number)).then_some(names)
        });
        let names = match named {
            Some(names) => names.iter().map(unquoted).collect(),
            None => (1..=fields.len())
                .map(|number| format!("c{number}"))
                .collect(),
        };
        Ok(Header {
            names,
            is_a_row: false,
        })
    }
}
