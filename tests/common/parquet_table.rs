//! Parquet files of tables of numbers, and one with text.

use parquet::basic::{Compression, Encoding};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType};
use parquet::file::properties::{WriterProperties, WriterVersion};
use parquet::file::writer::SerializedFileWriter;
use std::fs;
use std::path::Path;
use std::sync::Arc;

/// A Parquet file of a table of numbers.
pub fn parquet(header: &str, rows: &[Vec<f64>], compression: Compression, path: &Path) {
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

/// A pair file with a column of text, `driver`, in this encoding. Its pages are short.
pub fn with_drivers(drivers: &[Option<String>], encoding: Encoding, version: WriterVersion) -> Vec<u8> {
    let numbers = ["time_s", "lead_speed_mps", "speed_mps", "spacing_m"];
    let required = numbers.map(|name| format!("required double {name};")).concat();
    let schema = format!("message table {{ optional binary driver (UTF8); {required} }}");
    let schema = parquet::schema::parser::parse_message_type(&schema).unwrap();
    let properties = WriterProperties::builder()
        .set_dictionary_enabled(false)
        .set_data_page_row_count_limit(400)
        .set_write_batch_size(100)
        .set_compression(Compression::SNAPPY)
        .set_writer_version(version)
        .set_column_encoding("driver".into(), encoding)
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties)).unwrap();
    let mut group = writer.next_row_group().unwrap();
    let present: Vec<i16> = drivers.iter().map(|driver| i16::from(driver.is_some())).collect();
    let texts: Vec<ByteArray> = drivers.iter().flatten().map(|driver| ByteArray::from(driver.as_str())).collect();
    let mut next = group.next_column().unwrap().unwrap();
    next.typed::<ByteArrayType>().write_batch(&texts, Some(&present), None).unwrap();
    next.close().unwrap();
    for column in 0..numbers.len() {
        let value = |row: usize| if column == 0 { row as f64 / 10.0 } else { 15.0 };
        let values: Vec<f64> = (0..drivers.len()).map(value).collect();
        let mut next = group.next_column().unwrap().unwrap();
        next.typed::<DoubleType>().write_batch(&values, None, None).unwrap();
        next.close().unwrap();
    }
    group.close().unwrap();
    writer.into_inner().unwrap()
}

/// Rows of [`table`].
pub const ROWS: usize = 300;

/// A pair file with a further column, which has the same value throughout.
pub fn table<T: DataType>(column: &str, value: T::T, properties: WriterProperties) -> Vec<u8> {
    let numbers = ["time_s", "lead_speed_mps", "speed_mps", "spacing_m"].map(|name| format!("required double {name};"));
    let schema = format!("message table {{ required {column}; {} }}", numbers.concat());
    let schema = Arc::new(parquet::schema::parser::parse_message_type(&schema).expect("a schema"));
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties)).expect("memory");
    let mut group = writer.next_row_group().expect("memory");
    let mut next = group.next_column().expect("memory").expect("a column");
    next.typed::<T>().write_batch(&vec![value; ROWS], None, None).expect("memory");
    next.close().expect("memory");
    let columns: [&dyn Fn(usize) -> f64; 4] = [&|row| row as f64 / 10.0, &|_| 15.0, &|_| 15.0, &|_| 20.0];
    for column in columns {
        let mut next = group.next_column().expect("memory").expect("a column");
        let values: Vec<f64> = (0..ROWS).map(column).collect();
        next.typed::<DoubleType>().write_batch(&values, None, None).expect("memory");
        next.close().expect("memory");
    }
    group.close().expect("memory");
    writer.into_inner().expect("memory")
}
