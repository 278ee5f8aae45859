//! Helpers that several test programs share.
#![allow(dead_code, reason = "every test program uses some of them")]

pub mod cars;
pub mod drivers;
pub mod extended;
pub mod followers;
pub mod gpu;
pub mod laws;
pub mod made_up;
pub mod mutant;
pub mod parquet_table;
pub mod program;
pub mod sample;
pub mod tolerance;

use std::path::{Path, PathBuf};

/// Folder of the data that are shared between projects: `LEADLAG_SHARED`, else `../shared` beside the repository.
/// `None`, with a line that names the test, without such a folder.
pub fn shared(test_name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("LEADLAG_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("SKIPPED {test_name}: no shared data (set LEADLAG_SHARED)");
    None
}

/// Folder of the small made-up files.
pub fn data() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data")
}
