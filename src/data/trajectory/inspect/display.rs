//! The inspection as text, 80 columns wide unless names are long.

use super::{CarInspection, FollowerInspection, Inspection, PlatoonInspection, SignalInspection, rounded};
use crate::text::option::FOLLOWER;
use crate::text::shown::first;
use crate::trajectory::{Layout, Stretch};
use std::fmt;

impl fmt::Display for Inspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}", self.source.path)?;
        writeln!(f, "layout {}\nSHA-256 {}", self.layout, &self.source.sha256)?;
        for file in &self.companions {
            writeln!(f, "beside it {}", file.path)?;
        }
        if let Some(track) = self.track_m {
            writeln!(f, "grade known on a closed track of {track} m")?;
        }
        let mut platoons: Vec<&PlatoonInspection> = self.platoons.iter().collect();
        if platoons.len() > WHOLE_MAX && self.layout == Layout::Columns {
            platoons.sort_by(|a, b| b.duration_s.total_cmp(&a.duration_s));
            write_pairs(f, &platoons)?;
            platoons.truncate(1);
        }
        platoons.into_iter().try_for_each(|platoon| write!(f, "{platoon}"))
    }
}

/// For tables of many pairs: a list of the longest ones, and the very longest in full.
const WHOLE_MAX: usize = 3;
/// Pairs that are listed.
const LISTED_MAX: usize = 20;

fn write_pairs(f: &mut fmt::Formatter<'_>, platoons: &[&PlatoonInspection]) -> fmt::Result {
    writeln!(f, "\n{} pairs of a follower and the vehicle ahead, the longest first:\n", platoons.len())?;
    writeln!(
        f,
        "{:20} {:18} {:>12} {:>8} {:>6} {:>11}",
        "follower", "behind", "from [s]", "time [s]", "km", "gap [m]"
    )?;
    for platoon in platoons.iter().take(LISTED_MAX) {
        let [lead, ego] = [0, 1].map(|car| platoon.cars.get(car));
        let name = |car: Option<&CarInspection>, width| {
            car.map_or(String::new(), |car| car.name.chars().take(width).collect())
        };
        let gap = ego.and_then(|car| car.gap.as_ref()).and_then(|gap| gap.min.zip(gap.max));
        let gap = gap.map_or_else(|| "-".to_owned(), |(low, high)| format!("{low:.1}-{high:.1}"));
        writeln!(
            f,
            "{:20} {:18} {:>12.1} {:>8.1} {:>6.2} {gap:>11}",
            name(ego, 20),
            name(lead, 18),
            platoon.t_first_s,
            platoon.duration_s,
            ego.map_or(0.0, |car| car.driven_m / 1000.0),
        )?;
    }
    if platoons.len() > LISTED_MAX {
        writeln!(f, "... and {} shorter ones", platoons.len() - LISTED_MAX)?;
    }
    let doubtful: Vec<String> = platoons
        .iter()
        .filter(|platoon| !platoon.doubts().is_empty())
        .map(|platoon| format!("{} ({})", platoon.name(), platoon.doubts().join(", ")))
        .collect();
    if !doubtful.is_empty() {
        writeln!(
            f,
            "\nwarning: {} pairs have doubtful data, of the followers {}",
            doubtful.len(),
            first(&doubtful, LISTED_MAX)
        )?;
    }
    writeln!(f, "\nthe longest in full ({FOLLOWER} chooses another one):")
}

impl fmt::Display for PlatoonInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f)?;
        if let Some(id) = &self.id {
            writeln!(f, "trajectory {id}")?;
        }
        writeln!(
            f,
            "{} rows, {:.1} .. {:.1} s ({:.1} s), step {} s, {} rows incomplete",
            self.rows,
            self.t_first_s,
            self.t_last_s,
            self.duration_s,
            rounded(self.sampling.step_s),
            self.rows_with_missing
        )?;
        writeln!(f)?;
        let width = self.cars.iter().map(|car| speed_name(car).chars().count()).fold(NAME_WIDTH, usize::max);
        writeln!(
            f,
            "{:>3} {:width$} {:>7} {:>8} {:>8} {:>8} {:>8} {:>7}",
            "car", "name [unit]", "missing", "min", "max", "noise", "standing", "driven"
        )?;
        for car in &self.cars {
            write_car(f, car, width)?;
        }
        writeln!(f, "min, max and noise in the unit of the row; noise: deviation from a smooth curve")?;
        if let Some((car, follower)) = self.cars.iter().rev().find_map(|car| Some((car.number, car.follower?))) {
            writeln!(f, "{FOLLOWER} counts from the car behind the leader: car {car} is follower {follower}")?;
        }
        if !self.links.is_empty() {
            writeln!(f)?;
            writeln!(f, "gap rate minus speed difference over a second (rms), outside of faults")?;
        }
        for link in &self.links {
            let rms = link.gap_rate_rms_mps.map_or_else(|| "-".to_owned(), |rms| format!("{rms:.3}"));
            writeln!(f, "{:>3} behind {:<3} {rms:>8} m/s", link.follower_car, link.follower_car.saturating_sub(1))?;
        }
        write_segments(f, &self.followers)?;
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        Ok(())
    }
}

impl PlatoonInspection {
    /// The name of its last car, or its id.
    fn name(&self) -> &str {
        let car = self.cars.last().map_or("", |car| car.name.as_str());
        self.id.as_deref().unwrap_or(car)
    }
}

/// Names and their units are at least this wide.
const NAME_WIDTH: usize = 23;

fn speed_name(car: &CarInspection) -> String {
    format!("{} [m/s]", car.name)
}

/// The longest segments of each follower that has several.
fn write_segments(f: &mut fmt::Formatter<'_>, followers: &[FollowerInspection]) -> fmt::Result {
    let mut cut = followers.iter().filter(|follower| follower.segments.len() > 1).peekable();
    if let Some(first) = cut.peek() {
        writeln!(f, "\nsegments between gaps of more than {} s, the longest first", first.max_gap_s)?;
        writeln!(f, "{:>8} {:>9} {:>12} {:>12} {:>8}", "follower", "--segment", "from [s]", "to [s]", "samples")?;
    }
    for FollowerInspection { follower, segments, .. } in cut {
        let (longest, more) = Stretch::longest(segments);
        for Stretch { number, from_s, to_s, samples } in longest {
            writeln!(f, "{follower:>8} {number:>9} {from_s:>12.1} {to_s:>12.1} {samples:>8}")?;
        }
        if more > 0 {
            writeln!(f, "{follower:>8} {:>9} none of them longer", format!("+ {more}"))?;
        }
    }
    Ok(())
}

fn write_car(f: &mut fmt::Formatter<'_>, car: &CarInspection, width: usize) -> fmt::Result {
    write_signal(f, &car.number.to_string(), &speed_name(car), &car.speed, width)?;
    writeln!(f, " {:>6.1} s {:>5.2} km", car.standstill_s, car.driven_m / 1000.0)?;
    if let Some(gap) = &car.gap {
        let of = car.follower.map_or_else(|| "ahead".to_owned(), |follower| format!("of follower {follower}"));
        write_signal(f, "", &format!("  gap {of} [m]"), gap, width)?;
        writeln!(f)?;
    }
    Ok(())
}

fn write_signal(
    f: &mut fmt::Formatter<'_>,
    number: &str,
    name: &str,
    signal: &SignalInspection,
    width: usize,
) -> fmt::Result {
    let or_dash = |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.digits$}"));
    write!(
        f,
        "{number:>3} {name:width$} {:>7} {:>8} {:>8} {:>8}",
        signal.missing,
        or_dash(signal.min, 2),
        or_dash(signal.max, 2),
        or_dash(signal.noise, 4)
    )
}
