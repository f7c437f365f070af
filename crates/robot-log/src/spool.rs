//! A table of numbers that is written by rows and read by columns, or the other way round, on disk where it is large.

use std::io::{self, Read, Seek, SeekFrom, Write};

use tempfile::SpooledTempFile;

use crate::error::LogError;

/// Bytes that are kept in memory before a temporary file takes them.
const IN_MEMORY: usize = 32 << 20;
/// Rows that are written at once.
const BLOCK_ROWS: usize = 4096;
const BYTES: usize = size_of::<f64>();

/// A table of numbers of which at most one column and one block of rows is in memory.
#[derive(Debug)]
pub struct Spool {
    file: SpooledTempFile,
    n_columns: usize,
    n_rows: usize,
    /// Blocks of rows, column after column each, that the file has.
    n_in_file: usize,
    /// Rows that it does not have yet.
    block: Vec<f64>,
    bytes: Vec<u8>,
}

impl Spool {
    /// An empty table.
    pub fn new(n_columns: usize) -> Self {
        Self {
            file: SpooledTempFile::new(IN_MEMORY),
            n_columns,
            n_rows: 0,
            n_in_file: 0,
            block: vec![0.0; BLOCK_ROWS * n_columns],
            bytes: Vec::new(),
        }
    }

    /// A table of columns that are yet to be written.
    pub fn of_columns(n_columns: usize, n_rows: usize) -> Self {
        Self {
            n_rows,
            n_in_file: n_rows.div_ceil(BLOCK_ROWS),
            block: Vec::new(),
            ..Self::new(n_columns)
        }
    }

    /// Number of rows n.
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Appends a row.
    ///
    /// # Errors
    /// Of the file system.
    pub fn push(&mut self, row: &[f64]) -> io::Result<()> {
        let at = self.n_rows % BLOCK_ROWS;
        for (column, value) in row.iter().enumerate() {
            self.block[column * BLOCK_ROWS + at] = *value;
        }
        self.n_rows += 1;
        if at + 1 == BLOCK_ROWS {
            let block = std::mem::take(&mut self.block);
            self.write(self.n_in_file, 0, &block)?;
            self.block = block;
            self.n_in_file += 1;
        }
        Ok(())
    }

    /// Writes a column of a table of columns.
    ///
    /// # Shapes
    /// `values` (n,).
    /// # Errors
    /// Of the file system.
    pub fn set_column(&mut self, column: usize, values: &[f64]) -> io::Result<()> {
        for (number, values) in values.chunks(BLOCK_ROWS).enumerate() {
            self.write(number, column, values)?;
        }
        Ok(())
    }

    fn write(&mut self, number: usize, column: usize, values: &[f64]) -> io::Result<()> {
        self.bytes.clear();
        let bytes = values.iter().flat_map(|value| value.to_le_bytes());
        self.bytes.extend(bytes);
        self.file
            .seek(SeekFrom::Start(self.place(number, column)))?;
        self.file.write_all(&self.bytes)
    }

    /// The values of a column at some rows.
    ///
    /// # Errors
    /// Of the file system.
    pub fn column(&mut self, column: usize, rows: std::ops::Range<usize>) -> io::Result<Vec<f64>> {
        let mut values = Vec::with_capacity(rows.len());
        let mut row = rows.start;
        while row < rows.end {
            let (number, first) = (row / BLOCK_ROWS, row % BLOCK_ROWS);
            let end = BLOCK_ROWS.min(first + rows.end - row);
            if number == self.n_in_file {
                let start = column * BLOCK_ROWS;
                values.extend_from_slice(&self.block[start + first..start + end]);
            } else {
                let place = self.place(number, column) + (first * BYTES) as u64;
                self.file.seek(SeekFrom::Start(place))?;
                self.bytes.resize((end - first) * BYTES, 0);
                self.file.read_exact(&mut self.bytes)?;
                let (numbers, _) = self.bytes.as_chunks::<BYTES>();
                values.extend(numbers.iter().map(|bytes| f64::from_le_bytes(*bytes)));
            }
            row += end - first;
        }
        Ok(values)
    }

    /// Calls `take` with the values of every row, in order.
    ///
    /// # Errors
    /// Of the file system, and what `take` fails with.
    pub fn for_each_row<E: From<LogError>>(
        &mut self,
        mut take: impl FnMut(usize, &[f64]) -> Result<(), E>,
    ) -> Result<(), E> {
        let mut row = vec![0.0; self.n_columns];
        for start in (0..self.n_rows).step_by(BLOCK_ROWS) {
            let rows = start..(start + BLOCK_ROWS).min(self.n_rows);
            let columns = (0..self.n_columns)
                .map(|column| self.column(column, rows.clone()))
                .collect::<io::Result<Vec<_>>>()
                .map_err(LogError::Temporary)?;
            for at in rows {
                for (value, column) in row.iter_mut().zip(&columns) {
                    *value = column[at - start];
                }
                take(at, &row)?;
            }
        }
        Ok(())
    }

    /// Byte at which a column of a block begins.
    fn place(&self, number: usize, column: usize) -> u64 {
        ((number * self.n_columns + column) * BLOCK_ROWS * BYTES) as u64
    }
}

#[cfg(test)]
#[allow(clippy::float_cmp, reason = "what was written is read")]
mod tests {
    use super::*;

    #[test]
    fn columns_that_were_written_are_read_by_rows() {
        let n = BLOCK_ROWS + 3;
        let mut spool = Spool::of_columns(2, n);
        for column in 0..2 {
            let values: Vec<f64> = (0..n).map(|row| (2 * row + column) as f64).collect();
            spool.set_column(column, &values).unwrap();
        }
        let mut expected = 0;
        let check = |row: usize, values: &[f64]| {
            assert_eq!(values, [(2 * row) as f64, (2 * row + 1) as f64]);
            expected += 1;
            Ok::<_, LogError>(())
        };
        spool.for_each_row(check).unwrap();
        assert_eq!(expected, n);
    }

    #[test]
    fn what_was_written_is_read_from_memory_and_from_disk() {
        let n = 3 * BLOCK_ROWS + 17;
        let value = |row: usize, column: usize| (row * 7 + column) as f64 / 3.0;
        for columns in [2, 500] {
            let mut spool = Spool::new(columns);
            for row in 0..n {
                let values: Vec<f64> = (0..columns).map(|column| value(row, column)).collect();
                spool.push(&values).unwrap();
            }
            for rows in [
                0..n,
                5..9,
                BLOCK_ROWS - 3..2 * BLOCK_ROWS + 5,
                n - 4..n,
                7..7,
            ] {
                let expected: Vec<f64> = rows.clone().map(|row| value(row, 1)).collect();
                assert_eq!(spool.column(1, rows).unwrap(), expected);
            }
        }
    }
}
