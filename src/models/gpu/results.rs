//! The meaning of results from a device.

use super::plan::Work;
use crate::evaluator::{Failure, FailureKind, Raw, Score, status};

/// Bits of a result word beside [`status`]: the candidate touched a bound and the convention rejects it.
const REJECTED: u32 = status::FAILED | 3 << 28;

/// Results of some work: the contents of `results`, part by part, and of `blocks`, or the sums of products.
#[derive(Debug, Default)]
pub(super) struct Results {
    pub(super) words: Vec<u32>,
    pub(super) blocks: Vec<u32>,
}

/// Calls `take` with the position and the words of each candidate.
pub(super) fn for_each_candidate(
    work: &Work,
    words: u32,
    results: &[u32],
    mut take: impl FnMut(usize, &mut dyn Iterator<Item = u32>),
) {
    let (mut positions, mut rest) = (work.plan.positions.iter(), results);
    for part in &work.plan.parts {
        let count = part.count as usize;
        let (own, others) = rest.split_at(count * words as usize);
        rest = others;
        for (i, position) in positions.by_ref().take(count).enumerate() {
            take(*position, &mut own.iter().skip(i).step_by(count).copied());
        }
    }
}

/// In the form of the kernel for `Sums::All`.
pub(super) fn raw_of(words: &mut dyn Iterator<Item = u32>) -> Raw {
    let mut word = || words.next().unwrap_or_default();
    let (status, n_cut_acc, n_cut_dec) = (word(), word(), word());
    let mut sum = || f64::from(f32::from_bits(word()));
    let mut three = || [sum(), sum(), sum()];
    let (error2, simulated2, relative2) = (three(), three(), three());
    Raw { status, n_cut_acc, n_cut_dec, error2, simulated2, relative2, floored2_v: sum() }
}

/// A score in the form of the kernel.
pub(super) fn score_of(word: u32) -> Score {
    if word & status::FAILED == 0 {
        // An undefined value is NaN.
        return Score::Value(f64::from(f32::from_bits(word)));
    }
    if word == REJECTED {
        return Score::Rejected;
    }
    let raw = Raw { status: word, ..Raw::default() };
    Score::Failed(raw.failure().unwrap_or(Failure { kind: FailureKind::NotFinite, step: 0 }))
}
