//! Pair files.
#![no_main]

#[path = "../../tests/common/all_steps.rs"]
mod all_steps;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    all_steps::run(bytes, Some("pair"));
});
