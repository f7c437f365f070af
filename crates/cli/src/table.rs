//! Rows of a CSV file, one at a time, with the checks that make every later error name its place.
//!
//! A byte-order mark, CRLF line ends, quoted fields and blanks around names and numbers are accepted; lines that begin
//! with `#` are comments.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

use csv::{ErrorKind, ReaderBuilder, StringRecord};
use sha2::{Digest, Sha256};

use crate::error::CliError;
use crate::number_column::NumberColumn;

/// Bytes of a file that are read at a time.
const BUFFER: usize = 1 << 16;

/// A CSV file whose header has been read.
///
/// Only the buffer and one row of it are held at a time.
pub struct Table {
    file: String,
    reader: csv::Reader<Source>,
    /// Column names as written.
    header: StringRecord,
    record: StringRecord,
    n_rows: u64,
}

/// Where a table's bytes come from, and the hash of those that have come.
struct Source {
    bytes: Box<dyn Read>,
    /// Only where it is asked for.
    hash: Option<Sha256>,
}

impl Read for Source {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let n_bytes = self.bytes.read(buffer)?;
        if let Some(hash) = &mut self.hash {
            hash.update(&buffer[..n_bytes]);
        }
        Ok(n_bytes)
    }
}

/// A row of the table that has as many fields as the header.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    file: &'a str,
    fields: &'a StringRecord,
    /// 1-based number of the data row.
    pub number: u64,
    line: u64,
}

impl Table {
    /// Opens a file, or standard input for `-`, and reads its header.
    ///
    /// # Errors
    /// A file that cannot be read, is empty, starts with numbers, or names a column twice.
    pub fn open(path: &Path) -> Result<Self, CliError> {
        let (file, bytes) = open_source(path)?;
        Self::from_source(file, Source { bytes, hash: None })
    }

    /// As [`Table::open`], with [`Table::sha256`] of what is read.
    ///
    /// # Errors
    /// As for [`Table::open`].
    pub fn open_hashed(path: &Path) -> Result<Self, CliError> {
        let (file, bytes) = open_source(path)?;
        let hash = Some(Sha256::new());
        Self::from_source(file, Source { bytes, hash })
    }

    /// A table whose bytes are all read, and `file` as its name in messages.
    ///
    /// # Errors
    /// As for [`Table::open`].
    #[cfg(test)]
    pub fn from_bytes(file: String, bytes: Vec<u8>) -> Result<Self, CliError> {
        let bytes = Box::new(io::Cursor::new(bytes));
        let hash = Some(Sha256::new());
        Self::from_source(file, Source { bytes, hash })
    }

    fn from_source(file: String, source: Source) -> Result<Self, CliError> {
        let mut reader = ReaderBuilder::new()
            .flexible(true)
            .comment(Some(b'#'))
            .buffer_capacity(BUFFER)
            .from_reader(source);
        let header = reader
            .headers()
            .map_err(|error| csv_error(&file, error))?
            .clone();
        check_header(&file, &header)?;
        Ok(Self {
            file,
            reader,
            header,
            record: StringRecord::new(),
            n_rows: 0,
        })
    }

    /// The file's name in messages.
    pub fn file(&self) -> &str {
        &self.file
    }

    /// SHA-256 of the bytes read so far, which are all once there is no further row; `None` if nobody asked for it.
    pub fn sha256(&self) -> Option<[u8; 32]> {
        let hash = self.reader.get_ref().hash.clone();
        hash.map(|hash| hash.finalize().into())
    }

    /// The column names, without blanks around them.
    pub fn column_names(&self) -> Vec<String> {
        self.header
            .iter()
            .map(|name| name.trim().to_owned())
            .collect()
    }

    /// The next row; `None` after the last.
    ///
    /// # Errors
    /// A row with another number of fields than the header, text that is not UTF-8, a header without rows.
    pub fn next_row(&mut self) -> Result<Option<Row<'_>>, CliError> {
        let has_row = self
            .reader
            .read_record(&mut self.record)
            .map_err(|error| csv_error(&self.file, error))?;
        if !has_row {
            return if self.n_rows > 0 {
                Ok(None)
            } else {
                Err(CliError::NoRows {
                    file: self.file.clone(),
                })
            };
        }
        self.n_rows += 1;
        let line = self.record.position().map_or(0, csv::Position::line);
        if self.record.len() != self.header.len() {
            return Err(CliError::RowLength {
                file: self.file.clone(),
                row: self.n_rows,
                line,
                found: self.record.len(),
                expected: self.header.len(),
            });
        }
        Ok(Some(Row {
            file: &self.file,
            fields: &self.record,
            number: self.n_rows,
            line,
        }))
    }
}

impl<'a> Row<'a> {
    /// A field as it is written.
    ///
    /// # Panics
    /// If the table has no such column.
    pub fn text(&self, idx: usize) -> &'a str {
        &self.fields[idx]
    }

    /// A field as a finite number.
    ///
    /// # Errors
    /// Text that is not a number, NaN and infinities, with row, line, column, joint and unit.
    pub fn number(&self, column: &NumberColumn) -> Result<f64, CliError> {
        let text = self.fields[column.idx].trim();
        let problem = match text.parse::<f64>() {
            Ok(value) if value.is_finite() => return Ok(value),
            Ok(value) => format!("{value} is not a finite number"),
            Err(_) if text.is_empty() => "the field is empty".to_owned(),
            Err(_) => format!("`{text}` is not a number"),
        };
        Err(self.refused(column, problem))
    }

    /// The error of a field, with row, line, column, joint and unit.
    pub fn refused(&self, column: &NumberColumn, problem: String) -> CliError {
        CliError::Field {
            file: self.file.to_owned(),
            row: self.number,
            line: self.line,
            column: Box::new(column.clone()),
            problem,
        }
    }

    /// Where the row stands, for messages: `row 3 (line 4)`.
    pub fn place(&self) -> String {
        format!("row {} (line {})", self.number, self.line)
    }
}

fn open_source(path: &Path) -> Result<(String, Box<dyn Read>), CliError> {
    if path == Path::new("-") {
        return Ok(("standard input".to_owned(), Box::new(io::stdin())));
    }
    let file = path.display().to_string();
    let source = open_file(path).map_err(CliError::io("read", file.clone()))?;
    Ok((file, Box::new(source)))
}

/// Opens a file for reading; a directory is an error at once, not at the first byte.
fn open_file(path: &Path) -> io::Result<File> {
    if path.is_dir() {
        return Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "it is a directory",
        ));
    }
    File::open(path)
}

fn check_header(file: &str, header: &StringRecord) -> Result<(), CliError> {
    let file = || file.to_owned();
    let names: Vec<&str> = header.iter().map(str::trim).collect();
    if names.iter().all(|name| name.is_empty()) {
        return Err(CliError::Empty { file: file() });
    }
    if names.iter().all(|name| name.parse::<f64>().is_ok()) {
        return Err(CliError::NoHeader { file: file() });
    }
    if names[0].starts_with("SQLite format 3") {
        return Err(CliError::Columns {
            file: file(),
            reason: "a database, as bags of ROS 2 are: `torque-gp prepare` makes samples of it"
                .to_owned(),
        });
    }
    if let [only] = names[..]
        && only.split_whitespace().count() > 1
        && !only.contains([';', '\t'])
    {
        return Err(CliError::Blanks { file: file() });
    }
    for (second, name) in names.iter().enumerate() {
        if let Some(first) = names[..second].iter().position(|other| other == name) {
            let column = (*name).to_owned();
            return Err(CliError::DuplicateColumn {
                file: file(),
                column,
                first: first + 1,
                second: second + 1,
            });
        }
    }
    Ok(())
}

fn csv_error(file: &str, error: csv::Error) -> CliError {
    let file = file.to_owned();
    let line = error.position().map_or(1, csv::Position::line);
    match error.into_kind() {
        ErrorKind::Io(source) => CliError::Io {
            action: "read",
            file,
            source,
        },
        _ => CliError::NotText { file, line },
    }
}
