//! Replaces the reader of Parquet files if the library is built without the feature `parquet`.

use crate::trajectory::error::ImportError;
use std::fs::File;
use std::io::{self, Read};

/// First bytes of a Parquet file.
pub(super) const MAGIC: [u8; 4] = *b"PAR1";

/// No text is ever read.
pub(super) enum Text {}

impl Text {
    pub fn of(_: File, path: &str) -> Result<Text, ImportError> {
        let what = "a Parquet file, and leadlag was built without the feature `parquet`; write it as CSV";
        Err(ImportError::Open { path: path.to_owned(), source: io::Error::other(what) })
    }
}

impl Read for Text {
    fn read(&mut self, _: &mut [u8]) -> io::Result<usize> {
        match *self {}
    }
}
