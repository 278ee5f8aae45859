//! Corrections of what was found, made only on request.

use super::clocks::shifted;
use super::finding::{Finding, FindingKind, Who};
use super::link::Link;
use crate::trajectory::{Platoon, Recording};

/// Corrects one platoon of a recording by the findings about one follower, and says in one line each what was done, or why
/// nothing could be.
pub fn correct(recording: &mut Recording, platoon: usize, follower: usize, findings: &[Finding]) -> Vec<String> {
    let Some(link) = Link::of(recording, platoon, follower) else { return Vec::new() };
    let Some(platoon) = recording.platoons.get_mut(platoon) else { return Vec::new() };
    findings.iter().map(|finding| one(platoon, follower, &link, finding)).collect()
}

fn one(platoon: &mut Platoon, follower: usize, link: &Link, finding: &Finding) -> String {
    let done = format!("{} of the {}'s {}", finding.kind.into_str(), finding.car.into_str(), finding.signal);
    let number = match finding.car {
        Who::Leader => follower,
        Who::Follower => follower + 1,
        Who::Either | Who::Both => {
            return format!("{done}: not corrected, as it cannot be told whose signal is off");
        }
    };
    let t = platoon.t.clone();
    let Some(car) = platoon.cars.iter_mut().find(|car| car.number == number) else {
        return format!("{done}: not corrected, the car is not in the file");
    };
    let values = match (finding.signal, &mut car.gap) {
        ("gap", Some(gap)) => gap,
        _ => &mut car.v,
    };
    match finding.kind {
        FindingKind::SpeedScale => {
            values.iter_mut().for_each(|v| *v /= 1.0 + finding.value);
            format!("{done}: divided by {:.6}", 1.0 + finding.value)
        }
        FindingKind::GapOffset => {
            values.iter_mut().for_each(|v| *v -= finding.value);
            format!("{done}: {:+.3} m taken off", finding.value)
        }
        FindingKind::ClockOffset => {
            let regular = t.windows(2).all(|w| ((w[1] - w[0]) / link.dt - 1.0).abs() < 0.01);
            if !regular {
                return format!("{done}: not corrected, rows are missing; resample the file first");
            }
            *values = shifted(values, finding.value / link.dt);
            format!("{done}: read {:.3} s later", finding.value)
        }
        FindingKind::Dropout => {
            let inside = |t: f64| finding.when.iter().any(|[from, to]| (from - 1e-6..=to + 1e-6).contains(&t));
            let mut count = 0;
            for (value, _) in values.iter_mut().zip(&t).filter(|(_, t)| inside(**t)) {
                *value = f64::NAN;
                count += 1;
            }
            format!("{done}: {count} samples marked as missing, so that they are interpolated or split the data")
        }
        FindingKind::Inconsistent if finding.unit == "m" => {
            format!(
                "{done}: not corrected, as nobody knows which side of a jump is right; a diagnosis begins a new piece where it is \
                 more than 2 m from one sample to the next"
            )
        }
        FindingKind::Resampled | FindingKind::Smoothed | FindingKind::Inconsistent => {
            format!("{done}: cannot be corrected, the information is not in the file")
        }
    }
}
