//! Parquet files, whose rows are read as lines of a CSV table.

mod delta;
mod pages;

use crate::text::bounded::{LINE_MAX, ROW, table_memory};
use crate::trajectory::error::ImportError;
use delta::PlainText;
use pages::{Dictionaries, FOOTER, Pages};
use parquet::basic::ConvertedType;
use parquet::file::metadata::ParquetMetaData;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::reader::RowIter;
use parquet::record::{Field, Row};
use parquet::schema::types::Type;
use std::cell::Cell;
use std::fs::File;
use std::io::{self, Read};
use std::panic::{self, AssertUnwindSafe, catch_unwind};
use std::sync::{Arc, Once};

/// First bytes of a Parquet file.
pub(super) const MAGIC: [u8; 4] = *b"PAR1";

/// Times since 1970 beyond this are not dates of measurements and stay numbers \[s\]: the beginning of 2200.
const DATES_S: i64 = 7_258_118_400;
const DAY_S: i64 = 86_400;

/// Largest number of digits of a decimal number: that of 256 bits. Converting many more takes too long.
const DIGITS_MAX: i32 = 76;

/// The table as text, a row at a time.
pub(super) struct Text {
    rows: RowIter<'static>,
    line: Vec<u8>,
    /// Length of the part of the line that is passed on.
    done: usize,
}

impl Text {
    /// Fails if it is broken, or has columns with several values.
    pub fn of(file: File, path: &str) -> Result<Text, ImportError> {
        let failed = |why: String| {
            let source =
                io::Error::other(format!("a Parquet file that cannot be read: {why}; write it again, or as CSV"));
            ImportError::Open { path: path.to_owned(), source }
        };
        let length = file.metadata().map_err(|error| failed(error.to_string()))?.len();
        let dictionaries = Arc::new(Dictionaries::default());
        let pages = Pages::of(file, Arc::clone(&dictionaries));
        let reader = of_library(|| SerializedFileReader::new(pages)).map_err(failed)?;
        let schema = reader.metadata().file_metadata().schema();
        if schema.get_fields().is_empty() {
            return Err(failed("it has no column".to_owned()));
        }
        schema.get_fields().iter().try_for_each(|column| refuse_type(column)).map_err(failed)?;
        refuse_ranges(reader.metadata(), length, &dictionaries).map_err(failed)?;
        refuse_rows(reader.metadata()).map_err(failed)?;
        let names: Vec<String> = schema.get_fields().iter().map(|field| quoted(field.name())).collect();
        let line = (names.join(",") + "\n").into_bytes();
        Ok(Text { rows: RowIter::from_file_into(Box::new(PlainText(reader))), line, done: 0 })
    }
}

impl Read for Text {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.done == self.line.len() {
            let line = of_library(|| {
                let row = self.rows.next().transpose().map_err(|error| error.to_string())?;
                row.map(|row| text(&row)).transpose()
            });
            let Some(line) = line.map_err(|error| io::Error::other(format!("Parquet: {error}")))? else { return Ok(0) };
            (self.line, self.done) = (line.into_bytes(), 0);
        }
        let length = buffer.len().min(self.line.len() - self.done);
        buffer[..length].copy_from_slice(&self.line[self.done..self.done + length]);
        self.done += length;
        Ok(length)
    }
}

/// Values that are neither number nor text.
fn refuse_type(column: &Type) -> Result<(), String> {
    let name = column.name();
    let found = match column {
        Type::GroupType { .. } => "several values a row, expected one".to_owned(),
        // The library cannot convert them to text.
        Type::PrimitiveType { basic_info, .. } if basic_info.converted_type() == ConvertedType::INTERVAL => {
            "time intervals (INTERVAL), expected numbers or text".to_owned()
        }
        Type::PrimitiveType { precision, .. } if *precision > DIGITS_MAX => {
            format!("decimal numbers of {precision} digits, expected at most {DIGITS_MAX}")
        }
        Type::PrimitiveType { .. } => return Ok(()),
    };
    Err(format!("column {name} holds {found}"))
}

/// A few bytes can declare any number of rows, and encode them.
fn refuse_rows(metadata: &ParquetMetaData) -> Result<(), String> {
    let rows = metadata.row_groups().iter().map(|group| u64::try_from(group.num_rows()).unwrap_or(u64::MAX));
    let rows = rows.fold(0_u64, u64::saturating_add);
    match table_memory() / ROW {
        most if rows > most => Err(format!("it has {rows} rows, expected at most {most}")),
        _ => Ok(()),
    }
}

/// The library takes it for granted that columns lie within the file. Where they do, their dictionaries are watched.
fn refuse_ranges(metadata: &ParquetMetaData, length: u64, dictionaries: &Dictionaries) -> Result<(), String> {
    let within = |start: i64, size: i64| {
        let start = u64::try_from(start).ok()?;
        let end = start.checked_add(u64::try_from(size).ok()?)?;
        (end <= length.saturating_sub(FOOTER)).then_some((start, end))
    };
    for column in metadata.row_groups().iter().flat_map(|group| group.columns()) {
        let start = column.dictionary_page_offset().unwrap_or_else(|| column.data_page_offset());
        let Some((start, end)) = within(start, column.compressed_size()) else {
            return Err(format!("column {} does not lie within the file", column.column_path()));
        };
        dictionaries.watch(start, end);
    }
    Ok(())
}

thread_local! {
    /// Whether this thread is in the library, whose panics become errors and are not printed.
    static IN_LIBRARY: Cell<bool> = const { Cell::new(false) };
}

/// Result of the Parquet library, which panics on some contradictory contents.
fn of_library<T, E: std::fmt::Display>(read: impl FnOnce() -> Result<T, E>) -> Result<T, String> {
    static QUIET: Once = Once::new();
    QUIET.call_once(|| {
        let print = panic::take_hook();
        panic::set_hook(Box::new(move |what| {
            if !IN_LIBRARY.get() {
                print(what);
            }
        }));
    });
    IN_LIBRARY.set(true);
    let read = catch_unwind(AssertUnwindSafe(read));
    IN_LIBRARY.set(false);
    match read {
        Ok(read) => read.map_err(|error| error.to_string()),
        Err(_) => Err("its contents contradict each other".to_owned()),
    }
}

fn text(row: &Row) -> Result<String, String> {
    let fields = row.get_column_iter().map(|(name, field)| {
        let (length, most) = match field {
            Field::Str(text) => (text.len(), LINE_MAX),
            Field::Bytes(bytes) => (bytes.len(), LINE_MAX),
            // Each byte holds more than two digits.
            Field::Decimal(number) => (number.data().len(), DIGITS_MAX as usize / 2),
            _ => (0, 0),
        };
        if length > most {
            return Err(format!("column {name}: expected values of at most {most} bytes, found one of {length}"));
        }
        Ok(value(field))
    });
    Ok(fields.collect::<Result<Vec<String>, String>>()?.join(",") + "\n")
}

fn value(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Str(text) => quoted(text),
        // The library panics on texts of invalid dates.
        Field::Date(days) if (i64::from(*days) * DAY_S).abs() > DATES_S => days.to_string(),
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
