//! The part of the long lists that a run takes: changes that tests must detect, kills after which no data may be lost, names.
//!
//! `LEADLAG_EIGHTH=3` takes every eighth, from the fourth on; without it a run takes all. scripts/test sets it from the commit.

const PARTS: usize = 8;

fn eighth() -> Option<usize> {
    let text = std::env::var("LEADLAG_EIGHTH").ok()?;
    Some(text.parse().ok().filter(|eighth| *eighth < PARTS).expect("LEADLAG_EIGHTH is a number from 0 to 7"))
}

/// The items that this run takes, and the others.
pub fn split<T>(items: Vec<T>) -> (Vec<T>, Vec<T>) {
    let eighth = eighth();
    let (taken, left): (Vec<_>, Vec<_>) =
        items.into_iter().enumerate().partition(|(k, _)| eighth.is_none_or(|own| k % PARTS == own));
    [taken, left].map(|part| part.into_iter().map(|(_, item)| item).collect()).into()
}

/// Number of repetitions in this run of an action that a full run repeats `count` times.
pub fn times(count: usize) -> usize {
    if eighth().is_some() { count.div_ceil(PARTS) } else { count }
}
