//! Signals that two cars on a road cannot have: confused units, exchanged speeds, noise instead of accelerations.

use super::finding::{Finding, FindingKind, Remedy, Who};
use super::limits::LIMITS;
use super::link::Link;
use crate::statistics::robust_scale;
use crate::trajectory::factor;

/// Gap and speeds vary together, but by a factor that is not about 1.
pub(super) fn factor(link: &Link) -> Option<Finding> {
    let t: Vec<f64> = (0..link.len()).map(|i| link.time(i)).collect();
    let dv: Vec<f64> = link.v_l.iter().zip(&link.v_f).map(|(v_l, v_f)| v_l - v_f).collect();
    let ratio = factor::of_gap([(t.as_slice(), dv.as_slice(), link.gap.as_slice())])?;
    let exchanged = ratio < 0.0;
    let kind = if exchanged { FindingKind::Exchanged } else { FindingKind::Unit };
    let hint = factor::explain(ratio).map_or_else(String::new, |hint| format!(" ({hint})"));
    let mend = if exchanged && link.alone { "correct" } else { "columns" };
    Some(Finding {
        matters: true,
        remedies: vec![Remedy::of(mend)],
        sentence: format!("{}: changes {ratio:.3} times as much as the speeds imply{hint}: check units", link.called),
        ..Finding::new(kind, Who::Both, if exchanged { "speed" } else { "gap" }, ratio, "-")
    })
}

/// Speeds that no road vehicle reaches. This reveals speeds in ft/s from 60 km/h on, and those in km/h from 55 km/h on.
pub(super) fn too_fast(link: &Link) -> impl Iterator<Item = Finding> + '_ {
    link.signals().into_iter().take(2).filter_map(|signal| {
        let v = signal.values;
        let first = v.iter().position(|v| *v > LIMITS.fast)?;
        let highest = v.iter().copied().fold(0.0, f64::max);
        Some(Finding {
            when: vec![[link.time(first), link.time(v.iter().rposition(|v| *v > LIMITS.fast)?)]],
            matters: true,
            remedies: vec![Remedy::of("columns")],
            sentence: format!(
                "{} is up to {highest:.1} m/s ({:.0} km/h), above {} m/s in {} samples, the first at {:.1} s: no follower \
                 drives that fast; is it in ft/s or km/h?",
                signal.title,
                highest * 3.6,
                LIMITS.fast,
                v.iter().filter(|v| **v > LIMITS.fast).count(),
                link.time(first)
            ),
            ..Finding::new(FindingKind::TooFast, signal.who, "speed", highest, "m/s")
        })
    })
}

/// Fewer differences do not determine their noise.
const DIFFERENCES: usize = 50;

/// The acceleration of the follower, differences of its speed over a time step, is noise that changes from sample to sample.
pub(super) fn noisy(link: &Link) -> Option<Finding> {
    let (v, dt) = (&link.v_f, link.dt);
    let squares: Vec<f64> =
        v.windows(2).map(|v| ((v[1] - v[0]) / dt).powi(2)).filter(|square| square.is_finite()).collect();
    if squares.len() < DIFFERENCES {
        return None;
    }
    let total = squares.iter().sum::<f64>() / squares.len() as f64;
    // Third differences remove the motion of a car within three samples; those of white noise have twenty times its variance.
    let thirds = v.windows(4).map(|v| v[3] - 3.0 * v[2] + 3.0 * v[1] - v[0]);
    let noise = robust_scale(thirds).unwrap_or(0.0).powi(2) / 20.0;
    let share = (2.0 * noise / (dt * dt) / total).min(1.0);
    (total > 0.0 && share > LIMITS.mostly_noise).then(|| Finding {
        matters: true,
        remedies: vec![
            Remedy { option: "gof", value: Some("nrmse-s".to_owned()) },
            Remedy::of("smooth"),
            Remedy::of("resample"),
        ],
        sentence: format!(
            "the acceleration of the follower, from its speeds every {dt} s, is noise to {:.0} % (of its variance)",
            100.0 * share
        ),
        ..Finding::new(FindingKind::Noisy, Who::Follower, "speed", share, "-")
    })
}
