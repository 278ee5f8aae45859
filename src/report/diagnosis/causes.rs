//! The causes that were tried, and the verdict.

use crate::diagnose::Verdict;
use crate::report::text::wrapped;
use crate::result::diagnosis::{CauseEntry, Outcome, ParameterEntry, RungEntry};
use crate::symbols::Symbol;
use crate::wgsl::{laws, library};
use std::fmt::{Result, Write};

/// Columns of the longest bar.
const BAR: usize = 24;
/// Causes shown per round: the best ones.
const SHOWN: usize = 10;

/// The ladder: evidence of every cause as a bar, the threshold as a mark in it.
pub(super) fn ladder(text: &mut String, rungs: &[RungEntry]) -> Result {
    if rungs.is_empty() {
        text.push_str("no cause came so far as to be compared on held-out stretches\n");
        return Ok(());
    }
    text.push_str(&wrapped(
        0,
        2,
        "Evidence: by how much the extended model predicts stretches better that it was not fitted to (gain in log-likelihood, in \
         nats). It counts above the threshold, marked | in the bar.",
    ));
    let rounds = rungs.iter().map(|rung| rung.round).max().unwrap_or(1);
    for round in 1..=rounds {
        let own = rungs.iter().filter(|rung| rung.round == round);
        let mut tried: Vec<(f64, &RungEntry)> = own.clone().filter_map(|rung| Some((rung.evidence?, rung))).collect();
        tried.sort_by(|a, b| b.0.total_cmp(&a.0));
        writeln!(text, "\nround {round}")?;
        match tried.is_empty() {
            true => text.push_str("no cause was promising enough to be compared on held-out stretches\n"),
            false => writeln!(text, "{:<22}{:>9}{:>10}", "cause", "evidence", "threshold")?,
        }
        for (evidence, rung) in tried.iter().take(SHOWN) {
            let (name, need) = (&rung.name, rung.threshold);
            writeln!(text, "{name:<22}{evidence:>9.0}{need:>10.0}  {}", bar(*evidence, need).trim_end())?;
            text.push_str(&wrapped(4, 4, &rung.fate));
        }
        let others: Vec<&str> = own.filter(|rung| rung.evidence.is_none()).map(|rung| rung.name.as_str()).collect();
        if !others.is_empty() {
            text.push_str(&wrapped(0, 2, &format!("screened, and less promising: {}", others.join(", "))));
        }
    }
    Ok(())
}

/// A bar on a logarithmic scale, on which the threshold stands at a third.
fn bar(evidence: f64, threshold: f64) -> String {
    let mark = BAR / 3;
    let ratio = (evidence.max(0.0) / threshold.max(1e-9)).max(1e-9);
    // Nothing at a tenth of the threshold, the full length at a hundred times it.
    let length = (mark as f64 * (1.0 + ratio.log10())).round().clamp(0.0, BAR as f64) as usize;
    (0..BAR)
        .map(|i| {
            if i == mark {
                '|'
            } else if i < length {
                '#'
            } else {
                ' '
            }
        })
        .collect()
}

/// The mark of a parameter on a bound.
pub(in crate::internal::report) const AT_BOUND: &str = "at its bound";
/// What follows from units that contradict each other.
pub(in crate::internal::report) const MEND_FIRST: &str = "Mend that first: no size below can be trusted until then";

/// Parameters with their intervals; those at a bound are marked.
pub(super) fn parameters(text: &mut String, parameters: &[ParameterEntry]) -> Result {
    for p in parameters {
        let interval = p.interval.map_or(String::new(), |[low, high]| format!("[{low:.4}, {high:.4}]"));
        let mark = if p.at_bound { AT_BOUND } else { "" };
        let row = format!("  {:<10}{:>12.4}  {:<6}{interval:<24}{mark}", p.name, p.value, p.unit);
        writeln!(text, "{}", row.trim_end())?;
    }
    Ok(())
}

/// What a parameter of a model, a built-in law or a built-in cause means; nothing of a user's own one.
pub(in crate::internal::report) fn meaning(parameter: &str) -> &'static str {
    let mut built_in = library().iter().chain(laws()).flat_map(|extension| extension.own_parameters());
    let own = || built_in.find(|symbol| symbol.name() == parameter);
    Symbol::from_name(parameter).or_else(own).map_or("", Symbol::meaning)
}

pub(super) fn verdict(text: &mut String, outcome: &Outcome) -> Result {
    let title = match outcome.verdict {
        Verdict::Named => "NAMED",
        Verdict::Ambiguous => "ONE OF SEVERAL; these data cannot tell which",
        Verdict::Nothing => "NOTHING IS MISSING that these drives show",
        Verdict::NotTestable => "NOT TESTABLE with these data",
        Verdict::Unexplained => "UNEXPLAINED: something is wrong that no cause of the library explains",
        Verdict::BadBase => "NO VERDICT: the base model does not fit",
        Verdict::Helps => "HELPS: no cause is named, but an extension follows unseen drives better",
    };
    text.push('\n');
    if let Some(first) = outcome.data_first() {
        text.push_str(&wrapped(0, 2, &format!("THE DATA FIRST. {first}")));
        text.push_str("\nFor what it is worth: ");
    }
    writeln!(text, "{title}")?;
    text.push_str(&wrapped(0, 2, &outcome.reason));
    if let Some(base) = outcome.likelier_base() {
        text.push_str(&wrapped(0, 2, &next(&base)));
    }
    for cause in &outcome.causes {
        one(text, cause)?;
    }
    if !outcome.confounded_with.is_empty() {
        writeln!(text, "\nexplains the data as well:")?;
        for cause in &outcome.confounded_with {
            one(text, cause)?;
        }
    }
    if !outcome.not_testable.is_empty() {
        text.push_str("\nCannot be tested here, because the calibration absorbs it:\n");
        for entry in &outcome.not_testable {
            text.push_str(&wrapped(2, 4, &format!("{} (in {})", entry.name, entry.absorbed_by.join(", "))));
        }
    }
    if !outcome.not_tried.is_empty() {
        text.push_str("\nNot tried:\n");
        for entry in &outcome.not_tried {
            text.push_str(&wrapped(2, 4, &format!("{}: {}; {}", entry.name, entry.reason, entry.remedy)));
        }
    }
    Ok(())
}

/// What to do where the car follows the law of another base.
pub(in crate::internal::report) fn next(base: &str) -> String {
    format!("Next: the same command with --base {base}")
}

fn one(text: &mut String, cause: &CauseEntry) -> Result {
    let family = if cause.family == cause.name { String::new() } else { format!(" (family {})", cause.family) };
    let (evidence, threshold, kind) = (cause.evidence, cause.threshold, &cause.threshold_kind);
    text.push('\n');
    text.push_str(&wrapped(
        0,
        2,
        &format!("{}{family}: evidence {evidence:.0}, threshold {threshold:.0} ({kind})", cause.name),
    ));
    parameters(text, &cause.parameters)?;
    if let Some((equation, meaning)) = equation(&cause.name) {
        text.push_str(&wrapped(2, 4, &format!("{equation}: {meaning}")));
    }
    if let Some(recording) = &cause.recording {
        text.push_str(&wrapped(2, 4, &format!("in {recording}")));
    }
    Ok(())
}

/// The term of a cause in the loop, as diagnosis tables print it, and what it means; none for a user's own cause.
#[must_use]
pub fn equation(name: &str) -> Option<(&'static str, &'static str)> {
    Some(match name {
        "perception_delay" => ("a_cmd(t) = law(s, v, dv at t - tp)", "the car reacts to what was so long ago"),
        "actuation_lag" => ("da/dt = (a_cmd - a) / ta", "the acceleration follows the command slowly"),
        "asym_lag" => ("da/dt = (a_cmd - a) / (ta or tb)", "thrust and brakes follow with different lags"),
        "sensor_lowpass" => ("d(s, dv)/dt = (measured - filtered) / tf", "gap and speed difference are filtered"),
        "time_offset" => ("law(leader at t - to, ego at t)", "the car ahead is seen late, oneself in time"),
        "grade" => ("a = a - gg g sin(theta(x))", "this share of the slope is not made up for"),
        "aero_drag" => ("a = a - cD v^2", "air drag or head wind is not made up for"),
        "const_decel" => ("a = a - c0", "a constant resistance is not made up for"),
        "gain_mass" => ("a_cmd = (1 + m) a_cmd", "the car is lighter or heavier than its controller thinks"),
        "accel_cap" => ("a_cmd <= acap", "no stronger acceleration is asked for"),
        "decel_cap" => ("a_cmd >= -bcap", "no stronger braking is asked for"),
        "power_cap" => ("a_cmd <= P / v", "the engine's power ends"),
        "jerk_limit" => ("|da_cmd/dt| <= J", "the command changes only so fast"),
        "speed_dep_headway" => ("s_des = s_des + q v^2", "the desired gap grows faster with speed"),
        "headway_mode_change" => ("t_h = (1 + r) t_h from t0 on", "another gap setting was chosen"),
        "set_speed_change" => ("a_cmd <= (vlim - v) / 2 from t1 for dur", "a lower set speed was chosen for a while"),
        "multi_anticipation" => ("a_cmd = a_cmd + k2 (v_l2 - v_l)", "the car before the one ahead is seen, too"),
        "leader_accel_ff" => ("a_cmd = a_cmd + ka a_l", "the acceleration of the car ahead is used"),
        "dead_zone" => ("ds = ds shrunk by w", "small errors of the gap are not corrected"),
        "integral_action" => ("a_cmd = a_cmd + ki int(ds) dt", "lasting errors of the gap are corrected"),
        "range_scale" => ("s = (1 + cs) s", "the gap is measured too large or too small"),
        "range_bias" => ("s = s + b", "the gap is measured too large or too small by a constant"),
        "speed_scale" => ("v = (1 + cv) v", "the own speed is measured too high or too low"),
        "quantised_accel" => ("a_cmd in steps of qz", "the command comes in steps"),
        "periodic" => ("a = a + As sin + Ac cos (2 pi f t)", "something swings by itself"),
        _ => return None,
    })
}
