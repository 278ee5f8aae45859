//! Changes that a checksum cannot reveal: numbers that were changed together with it.

use super::common::{fails, ok, part_names, refused, small, stderr, text};
use leadlag::internal::study::part::Part;
use std::fs;

#[test]
fn a_changed_number_with_a_renewed_checksum_is_found_by_computing_again() {
    let study = small("verify");
    refused(1, &["study", "verify", text(&study)]).says("no task is done yet");
    ok(&["study", "run", text(&study)]);
    let parts = part_names(&study);
    let said = ok(&["study", "verify", text(&study), "--seed", "7"]);
    assert!(said.starts_with("1 of 24 parts computed again (--share 0.01 --seed 7): all identical"), "{said}");
    let said = ok(&["study", "verify", text(&study), "--share", "1"]);
    assert!(said.starts_with("24 of 24 parts computed again"), "{said}");

    let file = study.join("parts").join(&parts[5]);
    let mut part = Part::decode(&fs::read(&file).unwrap()).expect("it is whole");
    let score = part.calibration.score.as_mut().expect("it was calibrated");
    *score *= 0.9;
    let changed = *score;
    fs::write(&file, part.encode()).unwrap();
    assert!(ok(&["study", "status", text(&study)]).contains("24 of 24 tasks are done"), "the checksum is right");
    let (code, said) = fails(&["study", "verify", text(&study), "--share", "1"]);
    assert_eq!(code, 1);
    assert!(said.contains(&format!("calibration.score: found {changed}, computed ")), "{said}");
    assert!(said.contains("24 of 24 parts computed again") && said.contains("1 differ"), "{said}");
    // A valid part from another machine must not count as forged.
    assert!(said.contains("from another processor, library or device, whose last digits may differ"), "{said}");
    assert_eq!(part_names(&study), parts);

    for share in ["0", "1.5", "nan"] {
        assert_eq!(fails(&["study", "verify", text(&study), "--share", share]).0, 2);
    }
    let output = super::common::leadlag(&["study", "verify", text(&study.join("none"))]);
    assert_eq!(output.status.code(), Some(1), "{}", stderr(&output));
}
