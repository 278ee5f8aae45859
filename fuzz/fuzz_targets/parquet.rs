//! Parquet tables.
#![no_main]

#[path = "../../tests/common/all_steps.rs"]
mod all_steps;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    // The Parquet reader needs files, because it seeks in them; workers on one machine must not share one.
    let path = std::env::temp_dir().join(format!("leadlag-fuzz-{}.parquet", std::process::id()));
    std::fs::write(&path, bytes).expect("room");
    all_steps::file(&path);
});
