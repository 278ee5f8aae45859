//! Stretches that no model follows: a driver brings the car up to speed, or brakes, or somebody cuts in. They do not carry over to other drives,
//! and left in they decide a fit. So they are found first, and at the begin and end of drives they are cut off.

use super::fit::{Entry, Field};
use super::loss::{PartLoss, SIGNALS};
use super::parts::Parts;
use super::policy::Policy;
use super::{Horizon, sets};
use crate::calibrate::Overrides;
use crate::catalog::{BASES, Variant};
use crate::diagnose::likelihood::model::PHASE;
use crate::diagnose::{DiagnoseError, Drive};
use crate::extension::{Extension, Extensions};
use crate::result::diagnosis::FindingEntry;
use rayon::prelude::*;
use std::ops::Range;

/// A stretch that no law drives.
#[derive(Debug, Clone, PartialEq)]
pub struct NotFollowed {
    /// The recording ([`Drive::recording`]), and its file.
    pub recording: String,
    /// See `recording`.
    pub file: String,
    /// Begin and end in the file's time \[s\].
    pub when: [f64; 2],
    /// The largest error of the speed over 10 s \[m/s\], root mean square, by the law that follows best there.
    pub error: f64,
    /// What is usual \[m/s\]: nine of ten bins have less.
    pub usual: f64,
    /// True near the begin or the end of the drive, where a driver brings the car up to speed or takes over: it is left out. Elsewhere it
    /// may be what the car does, and no model has it yet.
    pub is_left_out: bool,
}

/// The horizons of a search for them.
const HORIZONS: [Horizon; 2] = [Horizon::Step, Horizon::Window];

/// Finds them: corrected towards the measurement within a quarter of a minute, even the model that follows best is far off there, be it
/// another law or the examined one with what comes late, alone or with what hides it.
///
/// # Errors
/// As [`Field::model`].
pub fn not_followed(
    drives: &[Drive],
    base: Variant,
    causes: &[&'static Extension],
    bounds: &Overrides,
    seed: u64,
    policy: &Policy,
) -> Result<Vec<NotFollowed>, DiagnoseError> {
    let field = Field::new(Parts::whole(drives), bounds, seed);
    let law = |base: Variant| field.law_at(base, &HORIZONS).ok();
    let others = BASES.par_iter().filter(|law| **law != base.base);
    let others = others.filter_map(|other| law(Variant { base: *other, extensions: Extensions::NONE, ..base }));
    let mut all: Vec<Entry> = others.collect();
    if let Some(own) = law(base) {
        let is_late = |set: &Vec<&'static Extension>| set.iter().any(|cause| cause.family() == PHASE);
        let late: Vec<Vec<&'static Extension>> = sets(causes).into_iter().filter(is_late).collect();
        let with = |set: &Vec<&'static Extension>| field.with_causes_at(&own, set, &[], &HORIZONS).ok().flatten();
        all.extend(late.par_iter().filter_map(with).collect::<Vec<_>>());
        all.push(own);
    }
    let best = all.iter().filter_map(speed_errors).reduce(|mut errors, other| {
        for (own, other) in errors.iter_mut().zip(other) {
            own.iter_mut().zip(other).for_each(|(own, other)| *own = own.min(other));
        }
        errors
    });
    let Some(errors) = best else { return Ok(Vec::new()) };
    let usual = usual(&errors, policy);
    let found = stretches(&errors, policy).into_iter().map(|(k, bins)| {
        let (drive, sizes) = (&drives[k], &field.sizes[k]);
        let of = |bin: usize| sizes.of.iter().enumerate().filter(move |(_, own)| **own == Some(bin as u32));
        // Before the first bin nothing is compared.
        let first = if bins.start == 0 { 0 } else { of(bins.start).map(|(t, _)| t).min().unwrap_or(0) };
        let last = of(bins.end - 1).map(|(t, _)| t).max().unwrap_or(first);
        let edge = (policy.edge_s / drive.dt()) as usize;
        NotFollowed {
            is_left_out: first < edge || last + edge >= drive.samples(),
            recording: drive.recording(),
            file: drive.file().to_owned(),
            when: [drive.trajectory.t[first], drive.trajectory.t[last]],
            error: errors[k][bins].iter().copied().fold(0.0, f64::max),
            usual,
        }
    });
    Ok(found.collect())
}

/// Of every drive the error of the speed in every bin \[m/s\].
type Errors = Vec<Vec<f64>>;

/// Of a model at the longer horizon; `None` where it cannot be fitted.
fn speed_errors(entry: &Entry) -> Option<Errors> {
    const SPEED: usize = 1;
    let of_bin = |mse: &[f64; SIGNALS]| mse[SPEED].sqrt();
    let of_drive = |part: &Option<PartLoss>| part.iter().flat_map(|part| &part.mse).map(of_bin).collect();
    Some(entry.fits.last()?.as_ref()?.trained.parts.iter().map(of_drive).collect())
}

/// What the usual bins do not exceed.
fn usual(errors: &[Vec<f64>], policy: &Policy) -> f64 {
    let mut all: Vec<f64> = errors.concat();
    all.sort_by(f64::total_cmp);
    all.get((policy.usual * all.len() as f64) as usize).copied().unwrap_or(f64::INFINITY)
}

/// Drives with runs of unusual bins, one of which is far off.
fn stretches(errors: &[Vec<f64>], policy: &Policy) -> Vec<(usize, Range<usize>)> {
    let usual = usual(errors, policy);
    let far_off = (policy.not_followed * usual).max(policy.least_not_followed);
    let mut found = Vec::new();
    for (drive, errors) in errors.iter().enumerate() {
        let mut from = 0;
        for run in errors.chunk_by(|a, b| (*a > usual) == (*b > usual)) {
            if run.iter().any(|error| *error > far_off) {
                found.push((drive, from..from + run.len()));
            }
            from += run.len();
        }
    }
    found
}

/// The drives without those of these stretches that are left out; what is left of one is a drive where it is long enough. All of them as they are where nothing
/// would be left.
#[must_use]
pub fn without(drives: &[Drive], stretches: &[NotFollowed], policy: &Policy) -> Vec<Drive> {
    let left_out: Vec<&NotFollowed> = stretches.iter().filter(|stretch| stretch.is_left_out).collect();
    let pieces: Vec<Drive> = drives.iter().flat_map(|drive| cut(drive, &left_out, policy)).collect();
    if pieces.is_empty() { drives.to_vec() } else { pieces }
}

fn cut(drive: &Drive, stretches: &[&NotFollowed], policy: &Policy) -> Vec<Drive> {
    let recording = drive.recording();
    let own = |t: f64| stretches.iter().any(|s| s.recording == recording && (s.when[0]..=s.when[1]).contains(&t));
    let t = &drive.trajectory.t;
    if !t.iter().any(|t| own(*t)) {
        return vec![drive.clone()];
    }
    let (mut pieces, mut from) = (Vec::new(), 0);
    for run in t.chunk_by(|a, b| own(*a) == own(*b)) {
        let range = from..from + run.len();
        from = range.end;
        if !own(run[0]) && run.len() as f64 * drive.dt() >= policy.least_piece_s {
            let mut piece = drive.part(range);
            piece.trajectory.label = format!("{} from {:.0} s", drive.label(), run[0]);
            pieces.push(piece);
        }
    }
    pieces
}

impl NotFollowed {
    /// As a finding of the data.
    #[must_use]
    pub fn finding(&self) -> FindingEntry {
        let [from, to] = self.when;
        FindingEntry {
            name: "not_followed".to_owned(),
            car: "follower".to_owned(),
            signal: "speed".to_owned(),
            value: self.error,
            unit: "m/s".to_owned(),
            interval: None,
            file: self.file.clone(),
            when: vec![self.when],
            sentence: format!(
                "from {from:.0} to {to:.0} s no model follows: even the best one is off by {:.1} m/s over 10 s, where {:.1} m/s is \
                 usual. Perhaps the driver drove, or a car cut in",
                self.error, self.usual
            ),
            correction: self.is_left_out.then(|| "left out of the race".to_owned()),
            ..FindingEntry::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_unusual_bins_is_a_stretch_where_one_is_far_off() {
        let mut errors = vec![vec![0.1; 60], vec![0.1; 60]];
        // What is unusual, and not far off, is none.
        errors[0][20] = 0.3;
        errors[1][3] = 0.6;
        errors[1][4] = 2.0;
        assert_eq!(stretches(&errors, &Policy::DEFAULT), [(1, 3..5)]);
        // With precise sensors twenty times the usual error is still nothing to see.
        let precise: Vec<Vec<f64>> = errors.iter().map(|drive| drive.iter().map(|e| 0.1 * e).collect()).collect();
        assert!(stretches(&precise, &Policy::DEFAULT).is_empty());
    }
}
