//! Whether a measured gap and the two speeds describe the same cars.

use super::{Layout, Note, factor};
use crate::statistics::rms;

/// Gap rate and speed difference that disagree by more than this do not describe the same cars \[m/s\].
pub(super) const CONTRADICTION_MPS: f64 = 2.0;

/// Central difference of the gap over time minus the speed difference `shift` samples later, root mean square \[m/s\]. No difference is
/// taken over more than `longest` on either side \[s\].
pub(super) fn rate_rms(t: &[f64], gap: &[f64], dv: &[f64], shift: isize, longest: f64) -> Option<f64> {
    rms((1..gap.len().saturating_sub(1)).filter_map(|i| {
        let j = i.checked_add_signed(shift)?;
        if t[i + 1] - t[i] > longest || t[i] - t[i - 1] > longest {
            return None;
        }
        let rate = (gap[i + 1] - gap[i - 1]) / (t[i + 1] - t[i - 1]);
        Some(rate - dv.get(j)?)
    }))
}

/// Change of the gap over a second minus that of the integrated speed difference, root mean square \[m/s\]: at any sampling rate the noise
/// of the gap counts over a second, and a sensor that holds its value for that long is accepted.
fn second_rms(t: &[f64], gap: &[f64], dv: &[f64]) -> Option<f64> {
    // Distance by the speeds, and the number of samples that lack one of the two, up to each sample.
    let (mut told, mut lacking) = (vec![0.0; t.len()], vec![0_usize; t.len() + 1]);
    for i in 0..t.len() {
        lacking[i + 1] = lacking[i] + usize::from(!(gap[i].is_finite() && dv[i].is_finite()));
        if i > 0 {
            let step = 0.5 * (dv[i - 1] + dv[i]) * (t[i] - t[i - 1]);
            told[i] = told[i - 1] + if step.is_finite() { step } else { 0.0 };
        }
    }
    let mut j = 0;
    rms((0..t.len()).filter_map(|i| {
        while j < t.len() && t[j] - t[i] < SECOND {
            j += 1;
        }
        let whole = j < t.len() && lacking[j + 1] == lacking[i] && t[j] - t[i] < 2.0 * SECOND;
        whole.then(|| (gap[j] - gap[i] - (told[j] - told[i])) / (t[j] - t[i]))
    }))
}

/// Time over which a gap is compared with the speeds \[s\], reduced by rounding.
const SECOND: f64 = 1.0 - 1e-6;

/// Warns that a gap and the speeds describe different cars, if they differ by more than a unit, which has its own note.
pub(super) fn contradiction(signal: &str, t: &[f64], gap: &[f64], dv: &[f64]) -> Option<Note> {
    let rms_mps = second_rms(t, gap, dv).filter(|&rms| rms > CONTRADICTION_MPS)?;
    let note = Note::GapContradicts { signal: signal.to_owned(), rms_mps };
    factor::of_gap([(t, dv, gap)]).is_none().then_some(note)
}

/// Name of the column with the gap ahead of a car.
pub(super) fn gap_column(number: usize, layout: Layout) -> String {
    match layout {
        Layout::OpenAcc | Layout::AstazeroRebuilt => format!("IVS{}", number.saturating_sub(1)),
        Layout::AstazeroProcessed => format!("Spacing{number}"),
        Layout::UltraAv => "Spatial_Gap".to_owned(),
        Layout::Pair if number == 1 => "lead2_spacing_m".to_owned(),
        Layout::Pair => "spacing_m".to_owned(),
        Layout::Columns => "gap".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A minute behind a car whose speed differs by a sine, with the gap as a sensor measures it.
    fn drive(dt: f64, sensor: impl Fn(usize, f64) -> f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let t: Vec<f64> = (0..(60.0 / dt) as usize).map(|i| i as f64 * dt).collect();
        let gap = t.iter().enumerate().map(|(i, t)| sensor(i, 30.0 - 2.0 * (0.5 * t).cos())).collect();
        let dv = t.iter().map(|t| (0.5 * t).sin()).collect();
        (t, gap, dv)
    }

    fn is_broken(dt: f64, sensor: impl Fn(usize, f64) -> f64) -> bool {
        let (t, gap, dv) = drive(dt, sensor);
        contradiction("gap", &t, &gap, &dv).is_some()
    }

    #[test]
    fn noise_is_no_contradiction_at_any_sampling_rate_and_jumps_are() {
        // Numbers of a fixed sequence between -1 and 1.
        let noise = |i: usize| ((i as f64 * 12.9898).sin() * 43_758.545).fract();
        for dt in [0.01, 0.04, 0.1, 0.5, 1.0] {
            assert!(!is_broken(dt, |i, s| s + 0.5 * noise(i)), "{dt}");
            let jumping = |i: usize, s: f64| s + if (i as f64 * dt) as usize % 11 < 3 { 20.0 } else { 0.0 };
            assert!(is_broken(dt, jumping), "{dt}");
        }
        let held = |i: usize, _: f64| 30.0 - 2.0 * (0.5 * (i / 10) as f64).cos();
        assert!(!is_broken(0.1, held), "a gap that is renewed every second");
    }
}
