//! A simulated run as an Apache Parquet file: one row group, text keys and 64-bit floats, no nulls.

use std::io;
use std::sync::Arc;

use parquet::basic::Compression;
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::parser::parse_message_type;

use crate::commands::simulate::run::{KEYS, Run};
use crate::error::CliError;
use crate::output::Output;

/// Writes a run and makes the file visible.
///
/// # Errors
/// A system error.
pub fn write(run: &Run<'_>, mut output: Output) -> Result<(), CliError> {
    let name = output.name().to_owned();
    write_groups(run, &mut output)
        .map_err(io::Error::other)
        .map_err(CliError::io("write", name))?;
    output.commit()
}

fn write_groups(run: &Run<'_>, output: &mut Output) -> Result<(), ParquetError> {
    let schema = Arc::new(parse_message_type(&schema())?);
    let properties = Arc::new(
        WriterProperties::builder()
            .set_compression(Compression::UNCOMPRESSED)
            .build(),
    );
    let mut file = SerializedFileWriter::new(output, schema, properties)?;
    let mut group = file.next_row_group()?;
    for key in [run.context.to_owned(), run.name()] {
        write_text(
            &mut group,
            &vec![ByteArray::from(key.as_str()); run.trajectory.n_samples()],
        )?;
    }
    for column in 0..Run::number_columns().len() {
        write_doubles(&mut group, &run.number_column(column))?;
    }
    group.close()?;
    file.close()?;
    Ok(())
}

/// The message type in Parquet's own notation.
fn schema() -> String {
    let text = KEYS[..2]
        .iter()
        .map(|key| format!("REQUIRED BYTE_ARRAY {key} (STRING);"));
    let doubles = Run::number_columns()
        .into_iter()
        .map(|column| format!("REQUIRED DOUBLE {column};"));
    format!(
        "message run {{ {} }}",
        text.chain(doubles).collect::<String>()
    )
}

fn write_text<W: io::Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[ByteArray],
) -> Result<(), ParquetError> {
    if let Some(mut column) = group.next_column()? {
        column
            .typed::<ByteArrayType>()
            .write_batch(values, None, None)?;
        column.close()?;
    }
    Ok(())
}

fn write_doubles<W: io::Write + Send>(
    group: &mut SerializedRowGroupWriter<'_, W>,
    values: &[f64],
) -> Result<(), ParquetError> {
    if let Some(mut column) = group.next_column()? {
        column
            .typed::<DoubleType>()
            .write_batch(values, None, None)?;
        column.close()?;
    }
    Ok(())
}
