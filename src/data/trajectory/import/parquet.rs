//! Parquet files, whose rows are read as lines of a CSV table.

use crate::trajectory::error::ImportError;
use parquet::file::metadata::ParquetMetaData;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::reader::RowIter;
use parquet::record::{Field, Row};
use std::fs::File;
use std::io::{self, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What a Parquet file begins with.
pub(super) const MAGIC: [u8; 4] = *b"PAR1";

/// Times since 1970 beyond this are no dates of measurements and stay numbers \[s\]: the beginning of 2200.
const DATES_S: i64 = 7_258_118_400;

/// The table as text, a row at a time.
pub(super) struct Text {
    rows: RowIter<'static>,
    line: Vec<u8>,
    /// So much of the line is handed on.
    done: usize,
}

impl Text {
    /// # Errors
    /// When it is broken, or has columns that hold more than a value.
    pub fn of(file: File, path: &str) -> Result<Text, ImportError> {
        let failed = |why: String| {
            let source =
                io::Error::other(format!("a Parquet file that cannot be read: {why}; write it again, or as CSV"));
            ImportError::Open { path: path.to_owned(), source }
        };
        let length = file.metadata().map_err(|error| failed(error.to_string()))?.len();
        let reader = of_library(|| SerializedFileReader::new(file)).map_err(|error| failed(error.to_string()))?;
        refuse_ranges(reader.metadata(), length).map_err(failed)?;
        let schema = reader.metadata().file_metadata().schema();
        if let Some(nested) = schema.get_fields().iter().find(|field| !field.is_primitive()) {
            return Err(failed(format!("column {} holds several values a row, expected one", nested.name())));
        }
        if schema.get_fields().is_empty() {
            return Err(failed("it has no column".to_owned()));
        }
        let names: Vec<String> = schema.get_fields().iter().map(|field| quoted(field.name())).collect();
        let line = (names.join(",") + "\n").into_bytes();
        Ok(Text { rows: RowIter::from_file_into(Box::new(reader)), line, done: 0 })
    }
}

impl Read for Text {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.done == self.line.len() {
            let row = of_library(|| self.rows.next().transpose());
            let Some(row) = row.map_err(|error| io::Error::other(format!("Parquet: {error}")))? else { return Ok(0) };
            (self.line, self.done) = (text(&row).into_bytes(), 0);
        }
        let length = buffer.len().min(self.line.len() - self.done);
        buffer[..length].copy_from_slice(&self.line[self.done..self.done + length]);
        self.done += length;
        Ok(length)
    }
}

/// The library takes it for granted that columns lie within the file.
fn refuse_ranges(metadata: &ParquetMetaData, length: u64) -> Result<(), String> {
    let outside = |start: i64, size: i64| {
        let end = u64::try_from(start).ok().zip(u64::try_from(size).ok()).and_then(|(a, b)| a.checked_add(b));
        end.is_none_or(|end| end > length)
    };
    for column in metadata.row_groups().iter().flat_map(|group| group.columns()) {
        let start = column.dictionary_page_offset().unwrap_or_else(|| column.data_page_offset());
        if outside(start, column.compressed_size()) {
            return Err(format!("column {} does not lie within the file", column.column_path()));
        }
    }
    Ok(())
}

/// What the library makes of a file; some contents that contradict each other it meets with a panic.
fn of_library<T, E: std::fmt::Display>(read: impl FnOnce() -> Result<T, E>) -> Result<T, String> {
    match catch_unwind(AssertUnwindSafe(read)) {
        Ok(read) => read.map_err(|error| error.to_string()),
        Err(_) => Err("its contents contradict each other".to_owned()),
    }
}

fn text(row: &Row) -> String {
    let fields: Vec<String> = row.get_column_iter().map(|(_, field)| value(field)).collect();
    fields.join(",") + "\n"
}

fn value(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Str(text) => quoted(text),
        // The library's texts of dates that are none end in a panic.
        Field::TimestampMillis(time) if (time / 1000).abs() > DATES_S => time.to_string(),
        Field::TimestampMicros(time) if (time / 1_000_000).abs() > DATES_S => time.to_string(),
        Field::Bytes(_) | Field::Decimal(_) => quoted(&field.to_string()),
        other => other.to_string(),
    }
}

/// A text as a field of a line.
fn quoted(text: &str) -> String {
    let plain = text.replace(['"', '\n', '\r'], " ");
    if plain.contains(',') { format!("\"{plain}\"") } else { plain }
}
