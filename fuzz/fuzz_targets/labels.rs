//! Tables of vehicle order and lengths.
#![no_main]

use leadlag::trajectory::import::Labels;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    match Labels::read_from(bytes, "fuzz.csv") {
        Ok(labels) => drop(labels.get("drive").map(<[_]>::to_vec)),
        Err(error) => drop(error.to_string()),
    }
});
