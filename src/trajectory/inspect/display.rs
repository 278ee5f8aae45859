//! The inspection as text, 80 columns wide.

use super::{CarInspection, Inspection, PlatoonInspection, SignalInspection};
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
        for platoon in &self.platoons {
            write!(f, "{platoon}")?;
        }
        Ok(())
    }
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
            self.rows, self.t_first_s, self.t_last_s, self.duration_s, self.sampling.step_s, self.rows_with_missing
        )?;
        writeln!(f)?;
        writeln!(
            f,
            "{:>3} {:23} {:>7} {:>8} {:>8} {:>8} {:>8} {:>7}",
            "car", "name", "missing", "min", "max", "noise", "standing", "driven"
        )?;
        for car in &self.cars {
            write_car(f, car)?;
        }
        if !self.links.is_empty() {
            writeln!(f)?;
            writeln!(f, "gap rate minus speed difference (rms), and drift of the gap against the speeds")?;
        }
        let or_dash = |value: Option<f64>| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
        for link in &self.links {
            writeln!(
                f,
                "{:>3} behind {:<3} {:>8} m/s   drift rms {:>8} m, {:>8} m/km over {:.0} s",
                link.follower_car,
                link.follower_car.saturating_sub(1),
                or_dash(link.gap_rate_rms_mps),
                or_dash(link.drift_rms_m),
                or_dash(link.drift_m_per_km),
                link.longest_complete_s
            )?;
        }
        for note in &self.notes {
            writeln!(f, "note: {note}")?;
        }
        for warning in &self.warnings {
            writeln!(f, "warning: {warning}")?;
        }
        Ok(())
    }
}

fn write_car(f: &mut fmt::Formatter<'_>, car: &CarInspection) -> fmt::Result {
    let name: String = car.name.chars().take(16).collect();
    write_signal(f, &car.number.to_string(), &format!("{name} [m/s]"), &car.speed)?;
    writeln!(f, " {:>6.1} s {:>5.2} km", car.standstill_s, car.driven_m / 1000.0)?;
    if let Some(gap) = &car.gap {
        write_signal(f, "", "  gap ahead [m]", gap)?;
        writeln!(f)?;
    }
    Ok(())
}

fn write_signal(f: &mut fmt::Formatter<'_>, number: &str, name: &str, signal: &SignalInspection) -> fmt::Result {
    let or_dash = |value: Option<f64>, digits: usize| value.map_or_else(|| "-".to_owned(), |v| format!("{v:.digits$}"));
    write!(
        f,
        "{number:>3} {name:23} {:>7} {:>8} {:>8} {:>8}",
        signal.missing,
        or_dash(signal.min, 2),
        or_dash(signal.max, 2),
        or_dash(signal.noise, 4)
    )
}
