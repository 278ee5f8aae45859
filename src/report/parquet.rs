//! Tables as Parquet: no compression, every column optional. `scripts/check-parquet` tests that others can read them, with
//! pyarrow and DuckDB.

use crate::study::table::{Column, Table, Values};
use parquet::basic::{LogicalType, Repetition, Type as Physical};
use parquet::data_type::{BoolType, ByteArray, ByteArrayType, DataType, DoubleType, Int64Type};
use parquet::errors::Result;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::{Type, TypePtr};
use std::sync::Arc;

/// Rows that share a row group: readers take such pieces one by one.
const GROUP: usize = 100_000;

/// Creator of a file. It is not the library, so that the same table gives the same bytes while the encoding is the
/// same.
const CREATED_BY: &str = concat!("leadlag version ", env!("CARGO_PKG_VERSION"));

/// The bytes of the file; `metadata` are names and texts that readers show beside the schema. Panics if two columns have one name, or not the same
/// number of rows: tables have neither.
pub fn write(table: &Table, metadata: &[(&str, &str)]) -> Vec<u8> {
    try_write(table, metadata).expect("columns of one length, in memory")
}

fn try_write(table: &Table, metadata: &[(&str, &str)]) -> Result<Vec<u8>> {
    let pair = |(key, value): &(&str, &str)| KeyValue::new((*key).to_owned(), (*value).to_owned());
    let properties = WriterProperties::builder()
        .set_created_by(CREATED_BY.to_owned())
        .set_key_value_metadata(Some(metadata.iter().map(pair).collect()))
        .build();
    let fields = table.columns.iter().map(field).collect::<Result<Vec<TypePtr>>>()?;
    let schema = Type::group_type_builder("schema").with_fields(fields).build()?;
    let mut writer = SerializedFileWriter::new(Vec::new(), Arc::new(schema), Arc::new(properties))?;
    let rows = table.rows();
    for first in (0..rows).step_by(GROUP) {
        let range = first..rows.min(first + GROUP);
        let mut group = writer.next_row_group()?;
        for column in &table.columns {
            match &column.values {
                Values::Integer(values) => add::<Int64Type, _>(&mut group, &values[range.clone()], |x| *x)?,
                Values::Number(values) => add::<DoubleType, _>(&mut group, &values[range.clone()], |x| *x)?,
                Values::Flag(values) => add::<BoolType, _>(&mut group, &values[range.clone()], |x| *x)?,
                Values::Text(values) => {
                    add::<ByteArrayType, _>(&mut group, &values[range.clone()], |text| ByteArray::from(text.as_str()))?;
                }
            }
        }
        group.close()?;
    }
    writer.into_inner()
}

fn field(column: &Column) -> Result<TypePtr> {
    let (physical, logical) = match column.values {
        Values::Integer(_) => (Physical::INT64, None),
        Values::Number(_) => (Physical::DOUBLE, None),
        Values::Flag(_) => (Physical::BOOLEAN, None),
        Values::Text(_) => (Physical::BYTE_ARRAY, Some(LogicalType::String)),
    };
    let builder = Type::primitive_type_builder(&column.name, physical);
    Ok(Arc::new(builder.with_repetition(Repetition::OPTIONAL).with_logical_type(logical).build()?))
}

/// Writes the next column: which rows have a value, and the values of those that have.
fn add<T: DataType, V>(
    group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    values: &[Option<V>],
    of: impl Fn(&V) -> T::T,
) -> Result<()> {
    let present: Vec<i16> = values.iter().map(|value| i16::from(value.is_some())).collect();
    let values: Vec<T::T> = values.iter().flatten().map(of).collect();
    let mut column = group.next_column()?.expect("as many columns as the schema has");
    column.typed::<T>().write_batch(&values, Some(&present), None)?;
    column.close()
}

#[cfg(test)]
mod tests {
    use super::*;
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;

    #[test]
    fn reads_back_what_was_written() {
        let mut table = Table::default();
        table.integer("n", [Some(1), None, Some(-2)].into_iter());
        table.number("x_m", [Some(1.5), None, Some(f64::MIN_POSITIVE)].into_iter());
        table.flag("is_best", [None, Some(true), Some(false)].into_iter());
        table.text("name", [Some("a"), Some(""), None].into_iter());
        let bytes = write(&table, &[("schema_version", "1")]);
        assert_eq!(bytes, write(&table, &[("schema_version", "1")]), "the same bytes each time");
        let mut file = tempfile::tempfile().expect("a temporary file");
        std::io::Write::write_all(&mut file, &bytes).expect("room on the disk");
        let reader = SerializedFileReader::new(file).expect("a Parquet file");
        let metadata = reader.metadata().file_metadata();
        assert_eq!(metadata.created_by(), Some(CREATED_BY));
        assert_eq!(metadata.key_value_metadata().expect("as given")[0].key, "schema_version");
        let rows: Vec<Vec<Field>> = reader
            .get_row_iter(None)
            .expect("rows")
            .map(|row| row.expect("a row").get_column_iter().map(|(_, field)| field.clone()).collect())
            .collect();
        let text = |text: &str| Field::Str(text.to_owned());
        assert_eq!(rows[0], [Field::Long(1), Field::Double(1.5), Field::Null, text("a")]);
        assert_eq!(rows[1], [Field::Null, Field::Null, Field::Bool(true), text("")]);
        assert_eq!(rows[2], [Field::Long(-2), Field::Double(f64::MIN_POSITIVE), Field::Bool(false), Field::Null]);
    }
}
