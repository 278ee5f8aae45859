//! The road under the drives: where it repeats, and where a drive without measured positions was on it.

use super::Drive;

/// Distance of the points at which grades are compared \[m\].
const NODE: f64 = 5.0;
/// Number of points of the shortest lap, and smallest overlap of two stretches: 400 m.
const SHORTEST: usize = 80;
/// Scatter of two stretches around their common grade, as a share of its variance: below the first they are the same, above the second they
/// differ.
const SAME: f64 = 0.02;
const OTHER: f64 = 0.1;
/// Variance of the sine of the grade below which a road is level.
const LEVEL: f64 = 1e-8;

/// Puts drives on the road of the first one. Without measured positions every drive begins at 0, so an effect that repeats with the place
/// would not line up. If the grade of a drive contradicts that of the first one but matches it further along the road, its positions move
/// there; all other drives stay. Only positions change. Returns the displacement of each \[m\]; `None` for one that stayed.
pub fn on_the_road_of(first: &Drive, others: &mut [Drive]) -> Vec<Option<f64>> {
    let profile = Profile::of(first);
    let moved = |drive: &mut Drive| {
        let by = further(profile.as_ref()?, &Profile::of(drive)?)?;
        drive.move_along_the_road(by);
        Some(by)
    };
    others.iter_mut().map(moved).collect()
}

/// Displacement of a profile \[m\] at which it matches another one, if it contradicts that at its own positions.
fn further(profile: &Profile, other: &Profile) -> Option<f64> {
    let variance = variance(&profile.sin);
    if variance < LEVEL {
        return None;
    }
    let least = SHORTEST.max(profile.sin.len().min(other.sin.len()) / 2);
    let scatter = |shift: isize| profile.scatter(other, shift, least).map(|scatter| scatter / variance);
    let stated = ((other.from - profile.from) / NODE).round() as isize;
    if scatter(stated)? < OTHER {
        return None;
    }
    let (longest, most) = (other.sin.len() as isize, profile.sin.len() as isize);
    let shares = (-longest..most).filter_map(|shift| Some((shift, scatter(shift)?)));
    let (shift, share) = shares.min_by(|a, b| a.1.total_cmp(&b.1))?;
    (share < SAME).then_some(profile.from + shift as f64 * NODE - other.from)
}

/// Length of a lap \[m\]: that of the closed track, or the shortest one after which the grade of every drive repeats.
#[must_use]
pub fn lap(drives: &[Drive]) -> Option<f64> {
    if let Some(lap) = drives.iter().find_map(|drive| drive.lap) {
        return Some(lap);
    }
    let mut best: Option<usize> = None;
    for drive in drives {
        let sin = Profile::of(drive)?.sin;
        let variance = variance(&sin);
        if variance < LEVEL {
            return None;
        }
        best = [best, repeats(&sin, variance)].into_iter().flatten().min();
    }
    best.map(|shift| shift as f64 * NODE)
}

/// The grade of a drive at points along the road.
struct Profile {
    /// Position of the first point \[m\].
    from: f64,
    sin: Vec<f64>,
}

impl Profile {
    fn of(drive: &Drive) -> Option<Profile> {
        let grade = drive.trajectory.grade.as_ref()?;
        let (from, last) = (*drive.trajectory.x_f.first()?, *drive.trajectory.x_f.last()?);
        let count = ((last - from) / NODE).max(0.0) as usize;
        Some(Profile { from, sin: (0..count).map(|i| grade.at(from + i as f64 * NODE)).collect() })
    }

    /// Mean squared scatter of both around their mean, if the other one begins `shift` points after this one (before it, if negative);
    /// `None` if they share fewer than `least` points.
    fn scatter(&self, other: &Profile, shift: isize, least: usize) -> Option<f64> {
        let skip = |back: isize| usize::try_from(back).unwrap_or(0);
        let (mine, theirs) = (self.sin.get(skip(shift)..)?, other.sin.get(skip(-shift)..)?);
        let both = mine.len().min(theirs.len());
        (both >= least.max(1)).then(|| apart(mine, theirs) / both as f64)
    }
}

/// Half the sum of squared differences, which is the scatter around the mean of both.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    0.5 * a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>()
}

fn variance(sin: &[f64]) -> f64 {
    let mean = sin.iter().sum::<f64>() / sin.len().max(1) as f64;
    sin.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / sin.len().max(1) as f64
}

/// The first shift after which a profile repeats to 2 % of its variance, best of those around it. It also repeats after two laps, and may
/// match better there by chance.
fn repeats(sin: &[f64], variance: f64) -> Option<usize> {
    let share = |shift: usize| apart(sin, &sin[shift..]) / (sin.len() - shift) as f64 / variance;
    let shares: Vec<f64> = (SHORTEST..sin.len().saturating_sub(SHORTEST)).map(share).collect();
    let mut from = 0;
    while let Some(begin) = (from..shares.len()).find(|&i| shares[i] < SAME) {
        let end = (begin..shares.len()).find(|&i| shares[i] >= SAME).unwrap_or(shares.len());
        let least = (begin..end).min_by(|&a, &b| shares[a].total_cmp(&shares[b])).expect("one at least");
        // The scatter may still fall at the end of the range.
        if least > 0 && least + 1 < shares.len() {
            return Some(SHORTEST + least);
        }
        from = end;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synthetic;
    use crate::trajectory::{Preparation, import, prepare};

    /// Three laps of the authors' 5757.9 m, 1151.58 points: after two laps the points are closer to each other than after one.
    #[test]
    fn a_lap_is_one_lap() {
        let sin = |i: usize| {
            let place = std::f64::consts::TAU * (i as f64 * NODE) / 5757.9;
            0.02 * place.sin() + 0.01 * (3.0 * place).cos() + 0.008 * (7.0 * place).sin()
        };
        let profile: Vec<f64> = (0..3600).map(sin).collect();
        let variance = 0.5 * (0.02_f64.powi(2) + 0.01_f64.powi(2) + 0.008_f64.powi(2));
        assert_eq!(repeats(&profile, variance), Some(1152));
        // A little more than one lap, and a road that changes so slowly that it nearly repeats after 400 m.
        assert_eq!(repeats(&profile[..1400], variance), Some(1152));
        assert_eq!(repeats(&profile[..1200], variance), None);
        let slow: Vec<f64> = (0..3600).map(|i| (i as f64 / 2000.0).sin()).collect();
        assert_eq!(repeats(&slow, 0.3), None);
    }

    fn drive(road_seed: u64) -> Drive {
        let scenario =
            synthetic::Scenario { duration_s: 300.0, road_seed: Some(road_seed), ..synthetic::Scenario::default() };
        let mut file = Vec::new();
        synthetic::write_pair(&synthetic::run(&scenario).expect("drives"), 1, &mut file).expect("memory");
        let recording = import::read_bytes(&file, "made_up.csv", None).expect("a pair file");
        let trajectory = prepare(&recording, 1, &Preparation::default()).expect("complete").remove(0);
        Drive::of(&trajectory, None).expect("no jump").0.remove(0)
    }

    #[test]
    fn a_drive_without_positions_is_moved_to_where_its_grade_belongs() {
        let (first, other) = (drive(1), drive(2));
        let mut elsewhere = first.clone();
        elsewhere.move_along_the_road(-1234.0);
        let mut drives = [elsewhere, first.clone(), other.clone()];
        let told = on_the_road_of(&first, &mut drives);
        let moved = |k: usize, from: &Drive| drives[k].trajectory.x_f[0] - from.trajectory.x_f[0];
        assert!(moved(0, &first).abs() <= NODE, "{}", moved(0, &first));
        assert_eq!(told.iter().map(Option::is_some).collect::<Vec<_>>(), [true, false, false]);
        assert!((told[0].expect("moved") - 1234.0).abs() <= NODE, "{told:?}");
        // The grade and the measured positions moved, too.
        let (x_f, grade) = (&drives[0].trajectory.x_f, drives[0].trajectory.grade.as_ref().expect("in the file"));
        let at_first = first.trajectory.grade.as_ref().expect("in the file");
        for (x, own) in x_f.iter().zip(&first.trajectory.x_f) {
            assert!((grade.at(*x) - at_first.at(*own)).abs() < 1e-6);
        }
        assert!((drives[0].x_road[0] - first.x_road[0]).abs() <= NODE);
        // A drive stays if its grade says so, or if it is on another road.
        assert!((moved(1, &first), moved(2, &other)) == (0.0, 0.0), "{} {}", moved(1, &first), moved(2, &other));
    }
}
