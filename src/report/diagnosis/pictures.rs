//! Pictures of a diagnosis: the missing acceleration against what it may depend on, and the ladder of causes.

use crate::diagnose::describe::missing::{Class, Profile, Profiles};
use crate::report::figure::{Anchor, Figure, INK, PALE, PALETTE};
use crate::result::diagnosis::RungEntry;

/// Colours of the base and of the extended model.
const BASE: &str = PALETTE[1];
const EXTENDED: &str = PALETTE[0];
/// One panel \[px\].
const PANEL: [f64; 2] = [460.0, 250.0];
/// Room for numbers on the left and below \[px\].
const LEFT: f64 = 62.0;
const BELOW: f64 = 46.0;

/// The missing acceleration of the base model, and of the extended one where there is one, with 95 % bars.
#[must_use]
pub fn missing(title: &str, base: &Profiles, extended: Option<&Profiles>) -> String {
    let count = base.profiles.len();
    let rows = count.div_ceil(2).max(1);
    let height = 84.0 + rows as f64 * PANEL[1];
    let repeats =
        base.repeats_by_place.map_or(String::new(), |r| format!("; repeats by place between runs: r = {r:.2}"));
    let line = format!("mean of the missing acceleration in classes, with 95 % intervals{repeats}");
    let mut figure = Figure::new(2.0 * PANEL[0] + 40.0, height, title, &[&line]);
    let mut entries = vec![("base model", BASE)];
    entries.extend(extended.map(|_| ("extended model", EXTENDED)));
    figure.legend([16.0, 72.0], &entries);
    for (i, profile) in base.profiles.iter().enumerate() {
        let corner = [20.0 + (i % 2) as f64 * PANEL[0], 84.0 + (i / 2) as f64 * PANEL[1]];
        let other = extended.and_then(|e| e.profiles.iter().find(|p| p.name == profile.name));
        panel(&mut figure, corner, profile, other);
    }
    figure.finish()
}

fn panel(figure: &mut Figure, corner: [f64; 2], profile: &Profile, other: Option<&Profile>) {
    let both = || [Some((profile, BASE)), other.map(|p| (p, EXTENDED))].into_iter().flatten();
    let classes = || both().flat_map(|(p, _)| &p.classes);
    let range = |values: &mut dyn Iterator<Item = f64>| {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        let room = 0.05 * (high - low).max(1e-6);
        [low - room, high + room]
    };
    let x_range = range(&mut classes().map(|c| c.at));
    let y_range = range(&mut classes().flat_map(|c| [c.mean - 1.96 * c.error, c.mean + 1.96 * c.error, 0.0]));
    let [left, top] = [corner[0] + LEFT, corner[1] + 12.0];
    let [right, bottom] = [corner[0] + PANEL[0] - 12.0, corner[1] + PANEL[1] - BELOW];
    let x = |value: f64| left + (value - x_range[0]) / (x_range[1] - x_range[0]) * (right - left);
    let y = |value: f64| bottom - (value - y_range[0]) / (y_range[1] - y_range[0]) * (bottom - top);
    for value in ticks(y_range) {
        figure.line([left, y(value)], [right, y(value)], 0.8, PALE);
        figure.text([left - 6.0, y(value) + 4.0], 11.0, Anchor::End, INK, &number(value));
    }
    for value in ticks(x_range) {
        figure.line([x(value), bottom], [x(value), bottom + 4.0], 1.0, INK);
        figure.text([x(value), bottom + 16.0], 11.0, Anchor::Middle, INK, &number(value));
    }
    figure.line([left, y(0.0)], [right, y(0.0)], 1.2, INK);
    figure.line([left, bottom], [right, bottom], 1.0, INK);
    let name = if profile.unit == "-" { profile.name.clone() } else { format!("{} [{}]", profile.name, profile.unit) };
    figure.text([0.5 * (left + right), bottom + 33.0], 12.0, Anchor::Middle, INK, &name);
    figure.upright([corner[0] + 14.0, 0.5 * (top + bottom)], 12.0, "d [m/s²]");
    for (own, colour) in both() {
        let points: Vec<[f64; 2]> = own.classes.iter().map(|c| [x(c.at), y(c.mean)]).collect();
        // Where a class between two has no data, nothing is known of the way from one to the other.
        let adjoin = |a: &Class, b: &Class| a.number.zip(b.number).is_none_or(|(a, b)| a + 1 == b);
        let mut from = 0;
        for stretch in own.classes.chunk_by(adjoin) {
            if stretch.len() > 1 {
                figure.polyline(&points[from..from + stretch.len()], 1.0, colour);
            }
            from += stretch.len();
        }
        for (class, point) in own.classes.iter().zip(&points) {
            let reach = 1.96 * class.error;
            figure.line([point[0], y(class.mean - reach)], [point[0], y(class.mean + reach)], 1.4, colour);
            figure.dot(*point, 2.6, colour);
        }
    }
}

/// Round values within a range, three to seven of them.
fn ticks([low, high]: [f64; 2]) -> Vec<f64> {
    let span = high - low;
    let power = 10f64.powf((span / 3.0).log10().floor());
    let step = [5.0, 2.0, 1.0].into_iter().map(|f| f * power).find(|step| span / step >= 3.0).unwrap_or(power);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last).map(|k| k as f64 * step).collect()
}

/// Without the digits that binary fractions leave behind.
fn number(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    // Adding 0 turns -0 into 0.
    (rounded + 0.0).to_string()
}

/// The ladder: evidence of each cause, with its threshold.
#[must_use]
pub fn ladder(title: &str, rungs: &[RungEntry]) -> String {
    const ROW: f64 = 20.0;
    const LINE: f64 = 14.0;
    // As many characters as fit to the right of the bars.
    const WORDS: usize = 42;
    let mut sorted: Vec<(f64, &RungEntry)> = rungs.iter().filter_map(|rung| Some((rung.evidence?, rung))).collect();
    sorted.sort_by(|a, b| a.1.round.cmp(&b.1.round).then(b.0.total_cmp(&a.0)));
    // Many fates begin with the evidence themselves.
    let fates: Vec<String> = sorted
        .iter()
        .map(|(evidence, rung)| {
            let fate = &rung.fate;
            if fate.contains("nats") { fate.clone() } else { format!("{evidence:.0} nats, {fate}") }
        })
        .collect();
    let fates: Vec<_> = fates.iter().map(|fate| textwrap::wrap(fate, WORDS)).collect();
    let row = |lines: usize| ROW + LINE * (lines as f64 - 1.0);
    let height = 110.0 + fates.iter().map(|lines| row(lines.len())).sum::<f64>();
    let line =
        "evidence in nats on held-out stretches, on a scale of square roots; the line in each row is its threshold";
    let mut figure = Figure::new(960.0, height, title, &[line]);
    figure.legend([16.0, 70.0], &[("above its threshold", PALETTE[0]), ("below", PALETTE[5])]);
    let (left, right) = (220.0, 700.0);
    let most = sorted.iter().map(|(e, r)| e.max(r.threshold)).fold(1.0, f64::max);
    let x = |value: f64| left + (value.max(0.0) / most).sqrt() * (right - left);
    let mut y = 92.0;
    for ((evidence, rung), lines) in sorted.iter().zip(&fates) {
        let colour = if *evidence > rung.threshold { PALETTE[0] } else { PALETTE[5] };
        let name = format!("{}. {}", rung.round, rung.name);
        figure.text([left - 8.0, y + 10.0], 12.0, Anchor::End, INK, &name);
        figure.bar([left, y], [x(*evidence), y + 13.0], colour, colour);
        figure.line([x(rung.threshold), y - 2.0], [x(rung.threshold), y + 15.0], 2.0, INK);
        for (k, words) in lines.iter().enumerate() {
            figure.text([right + 10.0, y + 10.0 + LINE * k as f64], 11.0, Anchor::Start, INK, words);
        }
        y += row(lines.len());
    }
    figure.finish()
}

#[cfg(test)]
mod tests {
    use super::ladder;
    use crate::result::diagnosis::RungEntry;

    #[test]
    fn no_word_of_a_fate_is_cut_off() {
        let fate = "no likelier than perception_delay, which has fewer parameters and says the same of these";
        let rung = |fate: &str| RungEntry {
            name: "leader_accel_ff".into(),
            round: 1,
            gain: Some(900.0),
            evidence: Some(880.0),
            threshold: 69.0,
            checks: Vec::new(),
            fate: fate.into(),
        };
        let picture = ladder("Causes", &[rung(fate), rung("adopted")]);
        for word in fate.split(' ') {
            assert!(picture.contains(word), "{word} in {picture}");
        }
    }
}
