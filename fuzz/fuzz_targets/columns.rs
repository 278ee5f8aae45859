//! A column map, or the name of a shipped one, a zero byte, and a table.
#![no_main]

#[path = "../../tests/common/all_steps.rs"]
mod all_steps;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let mut parts = bytes.splitn(2, |byte| *byte == b'\0');
    let (map, table) = (parts.next().unwrap_or_default(), parts.next().unwrap_or_default());
    all_steps::mapped(map, table);
});
