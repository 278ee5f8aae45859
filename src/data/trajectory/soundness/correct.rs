//! Corrections of faults, only on request.

use super::clocks::shifted;
use super::finding::{Finding, FindingKind, Who};
use super::link::Link;
use super::noise::joined;
use crate::text::option::CORRECT;
use crate::trajectory::{Car, Platoon};

/// Corrects one follower of a platoon by the findings about it. Each finding then names the correction, or why there is none.
/// Signals off the grid stay unchanged: a clock is not corrected if rows are missing.
pub fn correct(platoon: &mut Platoon, follower: usize, link: &Link, findings: &mut [Finding]) {
    for finding in findings {
        finding.correction = Some(one(platoon, follower, link, finding));
    }
}

fn car(platoon: &mut Platoon, number: usize) -> Option<&mut Car> {
    platoon.cars.iter_mut().find(|car| car.number == number)
}

fn one(platoon: &mut Platoon, follower: usize, link: &Link, finding: &Finding) -> String {
    let done = format!("{} of the {}'s {}", finding.kind.into_str(), finding.car.into_str(), finding.signal);
    if finding.remedies.iter().all(|remedy| remedy.option != CORRECT) {
        let why = match (finding.kind, finding.car) {
            (FindingKind::SpeedScale | FindingKind::ClockOffset, Who::Either | Who::Both) => {
                "because the data do not show whose signal is off"
            }
            (FindingKind::Inconsistent, _) if finding.unit == "m" => "because the correct side of the jump is unknown",
            _ => "the information is not in the file",
        };
        return format!("{done}: not corrected, {why}");
    }
    let number = if finding.car == Who::Leader { follower } else { follower + 1 };
    let t = platoon.t.clone();
    if finding.kind == FindingKind::Exchanged {
        let Some(lead) = car(platoon, follower).map(|car| std::mem::take(&mut car.v)) else {
            return format!("{done}: not corrected, the car is not in the file");
        };
        let own = car(platoon, number).map(|car| std::mem::replace(&mut car.v, lead)).unwrap_or_default();
        car(platoon, follower).into_iter().for_each(|car| car.v.clone_from(&own));
        return "the speeds of the two cars were exchanged".to_owned();
    }
    let values = match (finding.signal, car(platoon, number)) {
        ("gap", Some(Car { gap: Some(gap), .. })) => gap,
        ("speed", Some(Car { v, .. })) => v,
        _ => return format!("{done}: not corrected, the file has no such signal"),
    };
    match finding.kind {
        FindingKind::SpeedScale => {
            values.iter_mut().for_each(|v| *v /= 1.0 + finding.value);
            format!("{done}: divided by {:.6}", 1.0 + finding.value)
        }
        FindingKind::GapOffset => {
            values.iter_mut().for_each(|v| *v -= finding.value);
            format!("{done}: {:+.3} m subtracted", finding.value)
        }
        FindingKind::ClockOffset if !link.regular => {
            format!("{done}: not corrected, rows are missing; resample the file first")
        }
        FindingKind::ClockOffset => {
            *values = shifted(values, finding.value / link.dt);
            format!("{done}: read {:.3} s later", finding.value)
        }
        FindingKind::Resampled => {
            *values = joined(values, 1.0 / (finding.value * link.dt));
            format!("{done}: its own samples were joined by straight lines")
        }
        _ => {
            let inside = |t: f64| finding.when.iter().any(|[from, to]| (from - 1e-6..=to + 1e-6).contains(&t));
            let mut count = 0;
            for (value, _) in values.iter_mut().zip(&t).filter(|(_, t)| inside(**t)) {
                *value = f64::NAN;
                count += 1;
            }
            format!("{done}: {count} samples marked as missing, so that they are interpolated or split the data")
        }
    }
}
