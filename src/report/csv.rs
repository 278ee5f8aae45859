//! Tables as CSV: a header line, an empty field where there is no value, numbers in their shortest form that reads back the same.

use crate::study::table::Table;

/// The bytes of the file.
///
/// # Panics
/// Never: a `Vec` takes all.
#[must_use]
pub fn write(table: &Table) -> Vec<u8> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let into_memory = "writing into memory does not fail";
    writer.write_record(table.columns.iter().map(|column| column.name.as_str())).expect(into_memory);
    for row in 0..table.rows() {
        writer.write_record(table.columns.iter().map(|column| column.values.text(row))).expect(into_memory);
    }
    writer.into_inner().expect(into_memory)
}
