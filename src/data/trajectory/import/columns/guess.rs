//! Finds an unmapped column that may distinguish drives.

use super::super::number::fingerprint;
use std::collections::HashMap;

/// A column with more different values than this, and than a tenth of the rows, does not identify drives.
const NAMES: usize = 50;
const ROWS_PER_NAME: usize = 10;

/// The columns that are not read, each with the latest time of each of its values, as long as time rises within all of them.
pub(super) struct Guess {
    columns: Vec<(usize, String, HashMap<u64, f64>)>,
    rows: usize,
}

impl Guess {
    pub fn among(columns: impl IntoIterator<Item = (usize, String)>) -> Guess {
        Guess { columns: columns.into_iter().map(|(place, name)| (place, name, HashMap::new())).collect(), rows: 0 }
    }

    /// Adds the fields of a row at its time.
    pub fn take<'a>(&mut self, time: f64, field: impl Fn(usize) -> &'a str) {
        self.rows += 1;
        let rows = self.rows;
        self.columns.retain_mut(|(place, _, latest)| {
            let before = latest.insert(fingerprint(field(*place)), time);
            let few = latest.len() <= NAMES || latest.len() * ROWS_PER_NAME <= rows;
            few && before.is_none_or(|before| time > before)
        });
    }

    /// Columns within whose values every time occurs once; one with a single value distinguishes nothing.
    pub fn names(&self) -> Vec<&str> {
        let several = self.columns.iter().filter(|(.., latest)| latest.len() > 1);
        several.map(|(_, name, _)| name.as_str()).collect()
    }
}
