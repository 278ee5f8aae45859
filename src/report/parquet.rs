//! Tables as Parquet: plain encoding, no compression, every column optional.
//!
//! Written here and not by a library because this is the simplest file the format allows, while the library would cost
//! as much compile time as all of leadlag; and because the same table must give the same bytes whatever is upgraded. Format:
//! <https://parquet.apache.org/docs/file-format/>. That others can read it, `scripts/check-parquet` tests with pyarrow and DuckDB.

mod thrift;

use crate::study::table::{Column, Table, Values};
use thrift::Struct;

/// Rows that share a row group: readers take such pieces one by one.
const GROUP: usize = 100_000;

const MAGIC: &[u8] = b"PAR1";
const CREATED_BY: &str = concat!("leadlag version ", env!("CARGO_PKG_VERSION"));

// Numbers of the format: physical types, repetition, encodings, page type, converted type.
const BOOLEAN: i64 = 0;
const INT64: i64 = 2;
const DOUBLE: i64 = 5;
const BYTE_ARRAY: i64 = 6;
const OPTIONAL: i64 = 1;
const PLAIN: i64 = 0;
const RLE: i64 = 3;
const UNCOMPRESSED: i64 = 0;
const DATA_PAGE: i64 = 0;
const UTF8: i64 = 0;

/// The bytes of the file; `metadata` are names and texts that readers show beside the schema.
#[must_use]
pub fn write(table: &Table, metadata: &[(&str, &str)]) -> Vec<u8> {
    let rows = table.rows();
    let mut file = MAGIC.to_vec();
    let mut groups = Vec::new();
    for first in (0..rows).step_by(GROUP) {
        let last = rows.min(first + GROUP);
        let start = file.len();
        let chunks = table.columns.iter().map(|column| chunk(&mut file, column, first..last)).collect();
        let mut group = Struct::new();
        group.structs(1, chunks);
        group.i64(2, (file.len() - start) as i64);
        group.i64(3, (last - first) as i64);
        groups.push(group);
    }
    let mut root = Struct::new();
    root.string(4, "schema");
    root.i32(5, table.columns.len() as i64);
    let schema = std::iter::once(root).chain(table.columns.iter().map(element)).collect();
    let mut footer = Struct::new();
    footer.i32(1, 1);
    footer.structs(2, schema);
    footer.i64(3, rows as i64);
    footer.structs(4, groups);
    footer.structs(5, metadata.iter().map(|(key, value)| key_value(key, value)).collect());
    footer.string(6, CREATED_BY);
    let footer = footer.finish();
    file.extend_from_slice(&footer);
    file.extend_from_slice(&(footer.len() as u32).to_le_bytes());
    file.extend_from_slice(MAGIC);
    file
}

fn key_value(key: &str, value: &str) -> Struct {
    let mut pair = Struct::new();
    pair.string(1, key);
    pair.string(2, value);
    pair
}

fn physical(values: &Values) -> i64 {
    match values {
        Values::Integer(_) => INT64,
        Values::Number(_) => DOUBLE,
        Values::Flag(_) => BOOLEAN,
        Values::Text(_) => BYTE_ARRAY,
    }
}

/// `SchemaElement` of a column.
fn element(column: &Column) -> Struct {
    let mut element = Struct::new();
    element.i32(1, physical(&column.values));
    element.i32(3, OPTIONAL);
    element.string(4, &column.name);
    if matches!(column.values, Values::Text(_)) {
        element.i32(6, UTF8);
        // LogicalType::STRING, for readers that no longer know the converted type.
        let mut logical = Struct::new();
        logical.structure(1, Struct::new());
        element.structure(10, logical);
    }
    element
}

/// Writes the values of a column as one page; returns its `ColumnChunk`.
fn chunk(file: &mut Vec<u8>, column: &Column, rows: std::ops::Range<usize>) -> Struct {
    let data = page(&column.values, rows.clone());
    let mut values = Struct::new();
    values.i32(1, rows.len() as i64);
    values.i32(2, PLAIN);
    values.i32(3, RLE);
    values.i32(4, RLE);
    let mut header = Struct::new();
    header.i32(1, DATA_PAGE);
    header.i32(2, data.len() as i64);
    header.i32(3, data.len() as i64);
    header.structure(5, values);
    let offset = file.len();
    file.extend(header.finish());
    file.extend(data);
    let size = (file.len() - offset) as i64;

    let mut meta = Struct::new();
    meta.i32(1, physical(&column.values));
    meta.i32s(2, &[PLAIN, RLE]);
    meta.strings(3, &[&column.name]);
    meta.i32(4, UNCOMPRESSED);
    meta.i64(5, rows.len() as i64);
    meta.i64(6, size);
    meta.i64(7, size);
    meta.i64(9, offset as i64);
    let mut chunk = Struct::new();
    chunk.i64(2, offset as i64);
    chunk.structure(3, meta);
    chunk
}

/// Which rows have a value, then the values of those that have.
fn page(values: &Values, rows: std::ops::Range<usize>) -> Vec<u8> {
    match values {
        Values::Integer(values) => {
            let values = &values[rows];
            data(values, |bytes| values.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes())))
        }
        Values::Number(values) => {
            let values = &values[rows];
            data(values, |bytes| values.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes())))
        }
        Values::Flag(values) => {
            let values = &values[rows];
            data(values, |bytes| bytes.extend(bits(values.iter().flatten().copied())))
        }
        Values::Text(values) => {
            let values = &values[rows];
            data(values, |bytes| {
                for text in values.iter().flatten() {
                    bytes.extend((text.len() as u32).to_le_bytes());
                    bytes.extend(text.as_bytes());
                }
            })
        }
    }
}

fn data<T>(values: &[Option<T>], write: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    // Definition levels, 1 = there is a value: one bit-packed run of groups of eight.
    let levels = bits(values.iter().map(Option::is_some));
    let mut run = thrift::varint((levels.len() as u64) << 1 | 1);
    run.extend(levels);
    let mut bytes = (run.len() as u32).to_le_bytes().to_vec();
    bytes.extend(run);
    write(&mut bytes);
    bytes
}

/// Eight to a byte, the first in the lowest bit.
fn bits(flags: impl Iterator<Item = bool>) -> Vec<u8> {
    let mut bytes = Vec::new();
    for (i, flag) in flags.enumerate() {
        if i % 8 == 0 {
            bytes.push(0);
        }
        bytes[i / 8] |= u8::from(flag) << (i % 8);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_one_column_is_what_the_format_says() {
        let values = Values::Integer(vec![Some(1), None, Some(-2)]);
        let table = Table { columns: vec![Column { name: "n".to_owned(), values }] };
        let file = write(&table, &[]);
        // Length 2, one group of eight levels, rows 1 and 3 have a value; then the values.
        let mut data = vec![2, 0, 0, 0, 3, 0b101];
        data.extend(1i64.to_le_bytes());
        data.extend((-2i64).to_le_bytes());
        // Page header: type 0, both sizes 22, data page header with 3 values, PLAIN, RLE, RLE.
        let header = [0x15, 0, 0x15, 44, 0x15, 44, 0x2c, 0x15, 6, 0x15, 0, 0x15, 6, 0x15, 6, 0, 0];
        let start = [MAGIC, &header, &data].concat();
        assert_eq!(&file[..start.len()], start);
        let footer = u32::from_le_bytes(file[file.len() - 8..file.len() - 4].try_into().unwrap()) as usize;
        assert_eq!(file.len(), start.len() + footer + 8);
        assert_eq!(&file[file.len() - 4..], MAGIC);
    }

    #[test]
    fn bits_fill_bytes_from_the_lowest() {
        assert_eq!(bits([true, false, true, true].into_iter()), [0b1101]);
        assert_eq!(bits([false; 9].into_iter().chain([true])), [0, 0b10]);
    }
}
