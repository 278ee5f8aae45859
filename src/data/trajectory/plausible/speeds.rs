//! Speeds that no road vehicle drives.

use super::Signals;

/// Hardly a car behind another one is faster \[m/s\]: 198 km/h. Speeds in ft/s show from 60 km/h on, those in km/h from 55 km/h on.
const FAST: f64 = 55.0;

pub(super) fn said(signals: &Signals) -> Vec<String> {
    let one = |(who, v): (&str, &[f64])| {
        let too_fast = || (0..v.len()).filter(|&i| v[i] > FAST);
        let first = too_fast().next()?;
        let highest = v.iter().copied().fold(0.0, f64::max);
        Some(format!(
            "the speed of {who} is up to {highest:.1} m/s ({:.0} km/h), above {FAST} m/s in {} samples, the first at {:.1} s: no car \
             behind another one drives so fast; is it in ft/s or km/h?",
            highest * 3.6,
            too_fast().count(),
            signals.t[first]
        ))
    };
    [("the car ahead", signals.v_l), ("the follower", signals.v_f)].into_iter().filter_map(one).collect()
}
