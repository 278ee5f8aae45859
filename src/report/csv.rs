//! Tables as CSV: a header line, an empty field for a missing value, numbers in their shortest form that reads back the same.
//!
//! Texts are written unchanged, because other tables are joined by them. A spreadsheet that opens the file runs a text that begins like a
//! formula: [`formula`] finds it.

use super::html::is_formula;
use crate::study::table::{Table, Values};

/// The bytes of the file.
pub fn write(table: &Table) -> Vec<u8> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let into_memory = "writing into memory does not fail";
    writer.write_record(table.columns.iter().map(|column| column.name.as_str())).expect(into_memory);
    for row in 0..table.rows() {
        writer.write_record(table.columns.iter().map(|column| column.values.text(row))).expect(into_memory);
    }
    writer.into_inner().expect(into_memory)
}

/// The first text that a spreadsheet would take for a formula.
pub fn formula(table: &Table) -> Option<&str> {
    let texts = table.columns.iter().filter_map(|column| match &column.values {
        Values::Text(values) => Some(values),
        _ => None,
    });
    texts.flatten().flatten().map(String::as_str).find(|text| is_formula(text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_formula_is_found_and_left_as_it_is() {
        let mut table = Table::default();
        table.number("x", [Some(-1.5), None].into_iter());
        table.text("name", [Some("-12"), Some("a=b")].into_iter());
        assert_eq!(formula(&table), None);
        table.text("id", [None, Some("=HYPERLINK(\"x\")")].into_iter());
        assert_eq!(formula(&table), Some("=HYPERLINK(\"x\")"));
        assert_eq!(write(&table), b"x,name,id\n-1.5,-12,\n,a=b,\"=HYPERLINK(\"\"x\"\")\"\n");
    }
}
