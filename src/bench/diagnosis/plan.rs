//! Selects the cases.

use super::super::BenchError;
use crate::optimize::stream;
use crate::synthetic::{Base, EffectKind};
use rand::RngExt;
use serde::{Deserialize, Serialize};
use strum::VariantArray;

/// A case: the planted effects, and everything that determines the drives.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct DiagnosisTask {
    /// `one`, `pair`, `none`, `coloured`, `absorbed`, `outside` or `family`.
    pub kind: String,
    /// The planted base: one of the five of the paper.
    pub base: String,
    /// The planted effects.
    pub causes: Vec<String>,
    /// Change of the follower's speed by each effect \[m/s\], root mean square.
    pub rms_mps: f64,
    /// Standard deviation of the gusts \[m/s²\]; 0 without gusts.
    pub gusts_mps2: f64,
    /// Length of each of the three drives \[s\].
    pub duration_s: f64,
    /// Seed of parameters, leaders and noise.
    pub seed: u64,
    /// `quick`, `normal` or `thorough`.
    pub effort: String,
}

impl DiagnosisTask {
    /// The kind in words.
    #[must_use]
    pub fn in_words(&self) -> &str {
        match self.kind.as_str() {
            "one" => "one effect",
            "pair" => "two effects",
            "none" => "no effect",
            "coloured" => "coloured noise only",
            "absorbed" => "absorbed effect",
            "outside" => "unmeasured road",
            "family" => "another law",
            other => other,
        }
    }

    /// The planted effects; in brackets the special property of a drive without any.
    #[must_use]
    pub fn planted(&self) -> String {
        if self.causes.is_empty() { format!("({})", self.in_words()) } else { self.causes.join(" + ") }
    }
}

impl Eq for DiagnosisTask {}

impl PartialOrd for DiagnosisTask {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for DiagnosisTask {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        let words = |task: &Self| (task.kind.clone(), task.base.clone(), task.causes.clone(), task.effort.clone());
        let sizes = |task: &Self| [task.rms_mps, task.gusts_mps2, task.duration_s];
        let numbers = sizes(self).into_iter().zip(sizes(other)).map(|(a, b)| a.total_cmp(&b));
        let numbers = numbers.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then);
        self.seed.cmp(&other.seed).then_with(|| words(self).cmp(&words(other))).then(numbers)
    }
}

/// Bases of synthetic cars, in the order of [`Base`].
pub(super) const BASES: [&str; Base::VARIANTS.len()] = {
    let mut names = [""; Base::VARIANTS.len()];
    let mut k = 0;
    while k < names.len() {
        names[k] = Base::VARIANTS[k].into_str();
        k += 1;
    }
    names
};
/// Drives without any effect, per base; a third of them has coloured noise.
const SILENT: usize = 24;
/// Effects that a calibration absorbs.
const ABSORBED: [EffectKind; 4] =
    [EffectKind::GainMass, EffectKind::RangeScale, EffectKind::RangeBias, EffectKind::SpeedScale];
/// A medium effect \[m/s\].
pub(super) const MEDIUM: f64 = 0.10;
/// The sizes at which each effect is planted \[m/s\] by default: medium and weak.
pub const SIZES: [f64; 2] = [MEDIUM, 0.03];
/// Gusts \[m/s²\].
const GUSTS: f64 = 0.05;

/// Largest number of cases of one seed: with more, cases of two seeds would share a seed.
const MOST_CASES: usize = 1000;
/// The largest seed whose cases have seeds that fit into 64 bits.
pub const LARGEST_SEED: u64 = u64::MAX / MOST_CASES as u64 - 1;

/// The cases of a seed, shuffled so that the first ones are a fair sample: per base every effect at all sizes \[m/s\], half of them in
/// gusts; drives without an effect; absorbed effects, pairs, an effect outside the library, a base of another family.
///
/// # Errors
/// [`BenchError::Seed`] above [`LARGEST_SEED`]; [`BenchError::Cases`] with more than 1000 cases.
pub fn diagnosis_tasks(
    seed: u64,
    duration_s: f64,
    effort: &str,
    sizes: &[f64],
) -> Result<Vec<DiagnosisTask>, BenchError> {
    if seed > LARGEST_SEED {
        return Err(BenchError::Seed { most: LARGEST_SEED, found: seed });
    }
    let mut tasks = Vec::new();
    let mut rng = stream(seed, 0, 0, 0);
    let mut number = 0;
    let mut add = |kind: &str, base: &str, causes: &[EffectKind], rms_mps: f64, gusty: bool| {
        number += 1;
        tasks.push(DiagnosisTask {
            kind: kind.to_owned(),
            base: base.to_owned(),
            causes: causes.iter().map(|cause| cause.into_str().to_owned()).collect(),
            rms_mps,
            gusts_mps2: if gusty { GUSTS } else { 0.0 },
            duration_s,
            // The check below refuses more cases than there are seeds.
            seed: (seed * MOST_CASES as u64).wrapping_add(number),
            effort: effort.to_owned(),
        });
    };
    let identifiable: Vec<EffectKind> =
        EffectKind::VARIANTS.iter().copied().filter(|kind| !ABSORBED.contains(kind)).collect();
    for (b, base) in BASES.iter().enumerate() {
        for (k, kind) in identifiable.iter().enumerate() {
            for (i, size) in sizes.iter().enumerate() {
                add("one", base, &[*kind], *size, (b + k + i) % 2 == 0);
            }
        }
        for i in 0..SILENT {
            let kind = if i % 3 == 2 { "coloured" } else { "none" };
            add(kind, base, &[], 0.0, i % 2 == 1);
        }
        for kind in ABSORBED {
            add("absorbed", base, &[kind], MEDIUM, false);
        }
        for i in 0..8 {
            let first = identifiable[rng.random_range(0..identifiable.len())];
            let second = identifiable[rng.random_range(0..identifiable.len())];
            // Two of the phase family, or the same twice, are one effect.
            let phase = |kind: EffectKind| kind <= EffectKind::TimeOffset;
            if first != second && !(phase(first) && phase(second)) {
                add("pair", base, &[first, second], MEDIUM, i % 2 == 1);
            }
        }
        for i in 0..3 {
            add("outside", base, &[], MEDIUM, i == 2);
            add("family", base, &[], 0.0, i == 2);
        }
    }
    if tasks.len() > MOST_CASES {
        return Err(BenchError::Cases { most: MOST_CASES, found: tasks.len(), sizes: sizes.len() });
    }
    // Fisher and Yates.
    for i in (1..tasks.len()).rev() {
        tasks.swap(i, rng.random_range(0..=i));
    }
    Ok(tasks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn seeds(seed: u64, sizes: &[f64]) -> Result<BTreeSet<u64>, BenchError> {
        let tasks = diagnosis_tasks(seed, 300.0, "quick", sizes)?;
        let seeds: BTreeSet<u64> = tasks.iter().map(|task| task.seed).collect();
        assert_eq!(seeds.len(), tasks.len());
        Ok(seeds)
    }

    #[test]
    fn every_case_has_a_seed_of_its_own() {
        let many: Vec<f64> = (1..=7).map(|i| 0.01 * f64::from(i)).collect();
        let of = |seed: u64| seeds(seed, &many).expect("below a thousand cases");
        assert!(of(7).is_disjoint(&of(8)));
        assert_eq!(seeds(7, &SIZES).expect("few").first(), Some(&7001));
        of(LARGEST_SEED);
    }

    #[test]
    fn more_cases_than_seeds_are_refused() {
        let many: Vec<f64> = (1..=20).map(|i| 0.01 * f64::from(i)).collect();
        let message = seeds(7, &many).expect_err("too many").to_string();
        assert!(message.starts_with("20 sizes make 2") && message.contains("at most 1000"), "{message}");
        let message = seeds(LARGEST_SEED + 1, &SIZES).expect_err("too large").to_string();
        assert!(message.contains("seed") && message.contains(&LARGEST_SEED.to_string()), "{message}");
    }
}
