//! Whether a measured gap and the two speeds describe the same cars.

use super::{Layout, Note, factor};

/// Gap rate and speed difference that disagree by more than this do not describe the same cars \[m/s\].
pub(super) const CONTRADICTION_MPS: f64 = 2.0;

/// Central difference of the gap over time minus the speed difference `shift` samples later, root mean square \[m/s\].
pub(super) fn rate_rms(t: &[f64], gap: &[f64], dv: &[f64], shift: isize) -> Option<f64> {
    rms((1..gap.len().saturating_sub(1)).filter_map(|i| {
        let j = i.checked_add_signed(shift)?;
        let rate = (gap[i + 1] - gap[i - 1]) / (t[i + 1] - t[i - 1]);
        Some(rate - dv.get(j)?)
    }))
}

/// What there is to say of a gap, of which `rms` is [`rate_rms`], whose unit is that of the speeds.
pub(super) fn contradiction(signal: &str, rms: Option<f64>) -> Option<Note> {
    let rms_mps = rms.filter(|&rms| rms > CONTRADICTION_MPS)?;
    Some(Note::GapContradicts { signal: signal.to_owned(), rms_mps })
}

/// The same of measured signals, if they differ by more than a unit, of which there is a note of its own.
pub(super) fn judge(signal: &str, t: &[f64], gap: &[f64], dv: &[f64]) -> Option<Note> {
    let note = contradiction(signal, rate_rms(t, gap, dv, 0));
    note.filter(|_| factor::of_gap([(t, dv, gap)]).is_none())
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

/// Root mean square of the finite values.
pub(super) fn rms(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut squares, mut n) = (0.0, 0_usize);
    for value in values.filter(|value| value.is_finite()) {
        squares += value * value;
        n += 1;
    }
    (n > 0).then(|| (squares / n as f64).sqrt())
}
