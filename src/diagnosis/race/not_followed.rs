//! Stretches that no model follows: a driver brings the car up to speed or brakes, or another car cuts in. They do not carry over to other
//! drives and can dominate a fit. So leadlag finds them first, and cuts them off near the start and end of drives.

use super::Horizon;
use super::fit::{Entry, Field};
use super::policy::Policy;
use crate::diagnose::Drive;
use crate::result::diagnosis::FindingEntry;

/// A stretch that no model follows.
#[derive(Debug, Clone, PartialEq)]
pub struct NotFollowed {
    /// The recording ([`Drive::recording`]), and its file.
    pub recording: String,
    /// See `recording`.
    pub file: String,
    /// Id of the trajectory, if the file has several.
    pub trajectory: Option<String>,
    /// Begin and end in the file's time \[s\].
    pub when: [f64; 2],
    /// The largest root mean square error of the speed over 10 s \[m/s\], by the model that follows best there.
    pub error: f64,
    /// True near the start or the end of the drive, where a driver brings the car up to speed or takes over: the race omits the stretch.
    /// Elsewhere it may be normal behaviour of the car that no model has yet.
    pub is_left_out: bool,
}

/// Finds the stretches in which even the best model is far off, although it is corrected towards the measurement within a quarter of a
/// minute.
pub fn stretches<'a>(
    drives: &[Drive],
    field: &Field,
    models: impl Iterator<Item = &'a Entry>,
    policy: &Policy,
) -> Vec<NotFollowed> {
    let least = |mut errors: Vec<f64>, other: Vec<f64>| {
        errors.iter_mut().zip(other).for_each(|(own, other)| *own = own.min(other));
        errors
    };
    let Some(errors) = models.filter_map(speed_errors).reduce(least) else { return Vec::new() };
    let bins = bins(field, errors);
    let found = far_off(&bins, policy).into_iter().map(|bins| {
        let (drive, [first, last]) = (&drives[bins[0].drive], [bins[0].when[0], bins[bins.len() - 1].when[1]]);
        let t = &drive.trajectory.t;
        NotFollowed {
            is_left_out: first < t[0] + policy.edge_s || last + policy.edge_s >= t[t.len() - 1],
            recording: drive.recording(),
            file: drive.file().to_owned(),
            trajectory: drive.trajectory.id.clone(),
            when: [first, last],
            error: bins.iter().map(|bin| bin.error).fold(0.0, f64::max),
        }
    });
    found.collect()
}

/// A bin of a drive.
#[derive(Debug, Clone, Copy)]
struct Bin {
    drive: usize,
    /// Begin and end in the file's time \[s\]. Nothing is compared before the first bin of a drive, so this bin begins with the drive.
    when: [f64; 2],
    /// Error of the speed \[m/s\], root mean square.
    error: f64,
}

/// Errors of a model bin by bin at the longest horizon with a correction; `None` if it cannot be fitted.
fn speed_errors(entry: &Entry) -> Option<Vec<f64>> {
    const SPEED: usize = 1;
    let (fit, _) = entry.fits.iter().zip(Horizon::ALL).rfind(|(_, horizon)| !horizon.is_whole())?;
    let parts = fit.as_ref()?.trained.parts.iter().flatten();
    Some(parts.flat_map(|part| &part.mse).map(|mse| mse[SPEED].sqrt()).collect())
}

/// The bins of all drives with their errors.
fn bins(field: &Field, errors: Vec<f64>) -> Vec<Bin> {
    let (parts, mut errors, mut bins) = (&field.parts, errors.into_iter(), Vec::<Bin>::new());
    for ((drive, part), sizes) in parts.of.iter().zip(&parts.drives).zip(&field.sizes) {
        let t = &part.trajectory.t;
        for (bin, error) in (0..sizes.count()).zip(&mut errors) {
            let of = |own: &Option<u32>| *own == Some(bin as u32);
            let first = sizes.of.iter().position(of).filter(|_| bins.last().is_some_and(|last| last.drive == *drive));
            let last = sizes.of.iter().rposition(of).unwrap_or(0);
            bins.push(Bin { drive: *drive, when: [t[first.unwrap_or(0)], t[last]], error });
        }
    }
    bins
}

/// The error that the usual bins do not exceed.
fn usual(bins: &[Bin], policy: &Policy) -> f64 {
    let mut all: Vec<f64> = bins.iter().map(|bin| bin.error).collect();
    all.sort_by(f64::total_cmp);
    all.get((policy.usual * all.len() as f64) as usize).copied().unwrap_or(f64::INFINITY)
}

/// Sequences of unusual bins of a drive, at least one of which is far off.
fn far_off<'a>(bins: &'a [Bin], policy: &Policy) -> Vec<&'a [Bin]> {
    let usual = usual(bins, policy);
    let far_off = (policy.not_followed * usual).max(policy.least_not_followed);
    let runs = bins.chunk_by(|a, b| a.drive == b.drive && (a.error > usual) == (b.error > usual));
    runs.filter(|run| run.iter().any(|bin| bin.error > far_off)).collect()
}

/// The drives without the stretches that are left out; the rest of a drive counts if it is long enough. If nothing would remain, all drives
/// unchanged.
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
    /// Converts it to a finding of the data.
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
            trajectory: self.trajectory.clone(),
            when: vec![self.when],
            sentence: format!("no model follows the car from {from:.0} to {to:.0} s, perhaps a driver took over"),
            matters: true,
            correction: self.is_left_out.then(|| "left out".to_owned()),
            ..FindingEntry::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_unusual_bins_is_a_stretch_where_one_is_far_off() {
        let bin = |k: usize| Bin { drive: k / 60, when: [10.0 * k as f64, 10.0 * (k + 1) as f64], error: 0.1 };
        let mut bins: Vec<Bin> = (0..120).map(bin).collect();
        // An unusual bin that is not far off is not a stretch.
        bins[20].error = 0.3;
        bins[63].error = 0.6;
        bins[64].error = 2.0;
        let found: Vec<Vec<f64>> =
            far_off(&bins, &Policy::DEFAULT).iter().map(|run| run.iter().map(|bin| bin.when[0]).collect()).collect();
        assert_eq!(found, [[630.0, 640.0]]);
        // With precise sensors, twenty times the usual error is still too small to matter.
        bins.iter_mut().for_each(|bin| bin.error *= 0.1);
        assert!(far_off(&bins, &Policy::DEFAULT).is_empty());
    }
}
