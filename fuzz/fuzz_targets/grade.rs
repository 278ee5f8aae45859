//! Grade profiles.
#![no_main]

use leadlag::trajectory::Grade;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    match Grade::read_from(bytes, "fuzz.csv") {
        Ok(grade) => {
            for x in [-1e9, -1.0, 0.0, 1e-300, 2.5, 5757.9, 1e12] {
                assert!(grade.at(x).abs() <= 0.5 + 1e-12, "{x}: {}", grade.at(x));
            }
        }
        Err(error) => drop(error.to_string()),
    }
});
