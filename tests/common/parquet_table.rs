//! Parquet files of tables of numbers.

use parquet::data_type::DoubleType;
use parquet::file::{properties::WriterProperties, writer::SerializedFileWriter};
use std::fs;
use std::path::Path;
use std::sync::Arc;

/// A Parquet file of a table of numbers.
pub fn parquet(header: &str, rows: &[Vec<f64>], compression: parquet::basic::Compression, path: &Path) {
    let columns: Vec<String> = header.split(',').map(|name| format!("optional double {name};")).collect();
    let schema =
        parquet::schema::parser::parse_message_type(&format!("message table {{ {} }}", columns.join(" "))).unwrap();
    let properties = WriterProperties::builder().set_compression(compression).build();
    let file = fs::File::create(path).unwrap();
    let mut writer = SerializedFileWriter::new(file, Arc::new(schema), Arc::new(properties)).unwrap();
    let mut group = writer.next_row_group().unwrap();
    for column in 0..columns.len() {
        // Anything but a number is missing.
        let present: Vec<i16> = rows.iter().map(|row| i16::from(!row[column].is_nan())).collect();
        let values: Vec<f64> = rows.iter().map(|row| row[column]).filter(|value| !value.is_nan()).collect();
        let mut next = group.next_column().unwrap().unwrap();
        next.typed::<DoubleType>().write_batch(&values, Some(&present), None).unwrap();
        next.close().unwrap();
    }
    group.close().unwrap();
    writer.close().unwrap();
}
