//! A column map, or the name of a shipped one, a zero byte, and a table.
#![no_main]

mod all_steps;

use leadlag::trajectory::import::{ColumnMap, read_mapped_from};

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut parts = bytes.splitn(2, |byte| *byte == b'\0');
    let (map, table) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    let Ok(map) = std::str::from_utf8(map) else { return };
    let map = ColumnMap::shipped().iter().find(|(name, _)| *name == map).map_or(map, |(_, text)| *text);
    match ColumnMap::parse(map, "fuzz.toml") {
        Ok(map) => match read_mapped_from(table, "fuzz.csv", &map) {
            Ok(recording) => all_steps::check(&recording),
            Err(error) => drop(error.to_string()),
        },
        Err(error) => drop(error.to_string()),
    }
});
