//! The rows in a journal.

use super::{Found, Place, Row};
use crate::batch::{Journal, JournalError};
use std::path::Path;

fn row(pair: usize) -> Row {
    let found = Found {
        score: 0.1 + pair as f64 / 3.0,
        rmse: [Some(1.0); 3],
        nrmse: [Some(0.1), Some(1.0 / 3.0), None],
        parameters: vec![1.0 / 3.0, 2.0],
        at_bound: vec!["v_0".to_owned()],
        intervals: Some(vec![Some([0.1, 0.3]), None]),
        optimism: Some(crate::identify::Optimism { score: 0.01, noise: 1.0 / 3.0 }),
        evaluations: 100,
        stop: "converged".to_owned(),
    };
    let place = Place { pair, model: 0, measure: 0 };
    Row { place, found: if pair == 2 { Err("too short".to_owned()) } else { Ok(found) } }
}

fn open(path: &Path, key: &str) -> Result<Journal<Row>, JournalError> {
    Journal::open(path, Some(key), &|line| serde_json::from_slice(line).map(Some).map_err(|error| error.to_string()))
}

fn rows_of(journal: &Journal<Row>) -> Vec<Row> {
    (0..10).filter_map(|pair| journal.get(&Place { pair, model: 0, measure: 0 })).cloned().collect()
}

fn add(path: &Path, rows: &[Row]) {
    let mut journal = open(path, "k").expect("whole");
    rows.iter().for_each(|row| journal.keep(row.clone()).expect("room"));
}

#[test]
fn rows_come_back_and_a_cut_line_is_dropped() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("journal.jsonl");
    let rows: Vec<Row> = (0..4).map(row).collect();
    add(&path, &rows);
    let known = |path: &Path| rows_of(&open(path, "k").expect("whole"));
    assert_eq!(known(&path), rows);
    let text = std::fs::read(&path).expect("there");
    // An editor removes the end of the last line.
    std::fs::write(&path, &text[..text.len() - 1]).expect("room");
    assert_eq!(known(&path), rows);
    assert_eq!(std::fs::read(&path).expect("there"), text);
    std::fs::write(&path, &text[..text.len() - 5]).expect("room");
    assert_eq!(known(&path), rows[..3]);
    add(&path, &rows[3..]);
    assert_eq!(known(&path), rows);
    assert_eq!(std::fs::read(&path).expect("there"), text);
    assert!(matches!(open(&path, "another"), Err(JournalError::Other(_))));
    let held = open(&path, "k").expect("whole");
    assert!(matches!(open(&path, "k"), Err(JournalError::Busy { .. })));
    drop(held);
    std::fs::write(&path, "notes of a user").expect("room");
    assert!(matches!(open(&path, "k"), Err(JournalError::Other(_))));
    assert_eq!(std::fs::read(&path).expect("there"), b"notes of a user", "it is left alone");
    std::fs::write(&path, [&text[..], b"what?\n"].concat()).expect("room");
    assert!(matches!(open(&path, "k"), Err(JournalError::Broken { line: 6, .. })));
}
/// After a power cut, zeros replace missing bytes: at the beginning, after a line, within the last one, before a complete one.
#[test]
fn zeros_of_a_power_cut_are_dropped() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("journal.jsonl");
    let rows: Vec<Row> = (0..3).map(row).collect();
    add(&path, &rows);
    let text = std::fs::read(&path).expect("there");
    let ends: Vec<usize> = (1..=text.len()).filter(|&end| text[end - 1] == b'\n').collect();
    let zeros = [0; 4096];
    for (content, left) in [
        (zeros.to_vec(), 0),
        ([&text[..10], &zeros].concat(), 0),
        ([&text[..], &zeros].concat(), 3),
        ([&text[..ends[2] + 7], &zeros].concat(), 2),
        ([&text[..ends[1]], &zeros, &text[ends[2]..]].concat(), 1),
    ] {
        std::fs::write(&path, content).expect("room");
        assert_eq!(rows_of(&open(&path, "k").expect("the rest is whole")), rows[..left]);
        add(&path, &rows[left..]);
        assert_eq!(std::fs::read(&path).expect("there"), text);
    }
    std::fs::write(&path, [&b"notes of a user"[..], &zeros].concat()).expect("room");
    assert!(matches!(open(&path, "k"), Err(JournalError::Other(_))));
}
