//! Signals with the same content that differ by a factor: confused units.

use super::steps::longest_step;

/// The gap follows from differences of speeds, which noise hides; a smaller factor is not a unit.
const FACTOR: f64 = 1.8;
/// Smallest squared correlation of gap and speeds at which their ratio counts.
const TOGETHER: f64 = 0.8;
/// The gap is compared with the speeds over stretches of this length \[s\].
const WINDOW_S: f64 = 5.0;
/// Less variation than this is not enough \[m\].
const VARIATION_M: f64 = 1.0;
/// Fewer stretches are not enough.
const WINDOWS_MIN: usize = 5;

/// Ratio of the change of the gap to that by the speeds, if it is certain and not about 1. A drive is its times,
/// the speed of the vehicle ahead minus that of the follower, and the distance; missing values are NaN.
pub(super) fn of_gap<'a>(drives: impl IntoIterator<Item = (&'a [f64], &'a [f64], &'a [f64])>) -> Option<f64> {
    ratio(drives).filter(is_unit)
}

/// True of a ratio that is not about 1.
pub(super) fn is_unit(ratio: &f64) -> bool {
    !(1.0 / FACTOR..=FACTOR).contains(ratio)
}

/// The same, even if it is about 1.
pub(super) fn ratio<'a>(drives: impl IntoIterator<Item = (&'a [f64], &'a [f64], &'a [f64])>) -> Option<f64> {
    let (mut xx, mut xy, mut yy, mut windows) = (0.0, 0.0, 0.0, 0);
    for (t, dv, distance) in drives {
        for [integral, change] in changes(t, dv, distance) {
            xx += integral * integral;
            xy += integral * change;
            yy += change * change;
            windows += 1;
        }
    }
    let enough = windows >= WINDOWS_MIN && (xx / windows as f64).sqrt() > VARIATION_M;
    let ratio = xy / xx;
    let together = xy * xy > TOGETHER * xx * yy;
    (enough && together).then_some(ratio)
}

/// Change of the gap over each stretch of [`WINDOW_S`] by the speeds, and by the gap \[m\].
fn changes(t: &[f64], dv: &[f64], distance: &[f64]) -> Vec<[f64; 2]> {
    let (mut start, mut integral) = (0, 0.0);
    let longest = longest_step(t);
    let mut changes = Vec::new();
    for i in 1..t.len() {
        integral += (dv[i - 1] + dv[i]) / 2.0 * (t[i] - t[i - 1]);
        let broken = !integral.is_finite() || !distance[i].is_finite() || !distance[start].is_finite();
        if broken || t[i] - t[i - 1] > longest {
            (start, integral) = (i, 0.0);
        } else if t[i] - t[start] >= WINDOW_S {
            changes.push([integral, distance[i] - distance[start]]);
            (start, integral) = (i, 0.0);
        }
    }
    changes
}

/// Ratios of units that are often confused.
const MISTAKES: [(f64, &str); 7] = [
    (1.0 / 0.3048, "feet per metre"),
    (3.6, "km/h per m/s"),
    (3600.0 / 1609.344, "mph per m/s"),
    (1.609_344, "kilometres per mile"),
    (1.097_28, "km/h per ft/s"),
    (2.5, "25 frames per second mistaken for 10"),
    (3.0, "30 frames per second mistaken for 10"),
];

/// Largest deviation of a measured ratio from that of two units that may explain it.
const NEAR: f64 = 0.05;

/// The units that explain a ratio, in words.
pub(super) fn explain(ratio: f64) -> Option<String> {
    let near = |size: f64| (ratio / size - 1.0).abs() < NEAR;
    if ratio < 0.0 {
        return Some("the two speed columns look swapped".to_owned());
    }
    if near(1.0 / 3.6) {
        return Some("the speeds look like km/h".to_owned());
    }
    // A thousand has no unit name; the message names the likely mistake instead.
    if near(1000.0) {
        return Some("a thousand times: is the gap in millimetres?".to_owned());
    }
    if near(1e-3) {
        return Some("a thousandth: is the time in milliseconds, or the gap in kilometres?".to_owned());
    }
    let up = MISTAKES.iter().find(|(size, _)| near(*size)).map(|(size, words)| format!("{size:.4} is {words}"));
    up.or_else(|| {
        let down = MISTAKES.iter().find(|(size, _)| near(1.0 / size));
        down.map(|(size, words)| format!("1/{size:.4} is the inverse of {words}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A gap that oscillates by 10 m, and the same change by two speeds.
    fn drive() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let t: Vec<f64> = (0..1200).map(|i| f64::from(i) * 0.1).collect();
        let dv = t.iter().map(|t| 2.0 * (0.2 * t).cos()).collect();
        let gap = t.iter().map(|t| 30.0 + 10.0 * (0.2 * t).sin()).collect();
        (t, dv, gap)
    }

    #[test]
    fn names_the_units() {
        let (t, dv, gap) = drive();
        assert_eq!(of_gap([(&t[..], &dv[..], &gap[..])]), None);
        let feet: Vec<f64> = gap.iter().map(|gap| gap / 0.3048).collect();
        let ratio = of_gap([(&t[..], &dv[..], &feet[..])]).expect("feet differ");
        assert_eq!(explain(ratio).as_deref(), Some("3.2808 is feet per metre"));
        let kmh: Vec<f64> = dv.iter().map(|dv| dv * 3.6).collect();
        let ratio = of_gap([(&t[..], &kmh[..], &gap[..])]).expect("km/h differ");
        assert_eq!(explain(ratio).as_deref(), Some("the speeds look like km/h"));
        let swapped: Vec<f64> = dv.iter().map(|dv| -dv).collect();
        let ratio = of_gap([(&t[..], &swapped[..], &gap[..])]).expect("the sign differs");
        assert_eq!(explain(ratio).as_deref(), Some("the two speed columns look swapped"));
    }

    #[test]
    fn a_thousand_is_said_in_words() {
        assert_eq!(explain(998.0).as_deref(), Some("a thousand times: is the gap in millimetres?"));
        let thousandth = "a thousandth: is the time in milliseconds, or the gap in kilometres?";
        assert_eq!(explain(0.001).as_deref(), Some(thousandth));
    }

    #[test]
    fn says_nothing_of_what_does_not_vary_together() {
        let (t, dv, gap) = drive();
        let late: Vec<f64> = gap.iter().rev().map(|gap| gap * 3.6).collect();
        assert_eq!(of_gap([(&t[..], &dv[..], &late[..])]), None);
        let still = vec![30.0; t.len()];
        assert_eq!(of_gap([(&t[..], &vec![0.0; t.len()][..], &still[..])]), None);
    }
}
