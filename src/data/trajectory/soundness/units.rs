//! Signals that two cars on a road cannot have: confused units, exchanged speeds.

use super::finding::{Finding, FindingKind, Remedy, Who};
use super::limits::LIMITS;
use super::link::Link;
use crate::text::option::{COLUMNS, CORRECT};
use crate::trajectory::factor;

/// Gap and speeds vary together, but by a factor that is not about 1.
pub(super) fn factor(link: &Link) -> Option<Finding> {
    let ratio = link.ratio(1.0).filter(factor::is_unit)?;
    let exchanged = ratio < 0.0;
    let kind = if exchanged { FindingKind::Exchanged } else { FindingKind::Unit };
    let hint = factor::explain(ratio).map_or_else(String::new, |hint| format!(" ({hint})"));
    let mend = if exchanged && link.alone { CORRECT } else { COLUMNS };
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
            remedies: vec![Remedy::of(COLUMNS)],
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
