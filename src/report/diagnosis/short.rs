//! The conclusion of a diagnosis, in plain words.

use super::causes::{next, not_tried};
use crate::diagnose::Verdict;
use crate::diagnose::describe::missing::Profiles;
use crate::race::loss::BIN_S;
use crate::result::diagnosis::recommended::{ClosedLoopGain, Power, Recommended, RecommendedCause, Trial, Why};
use crate::result::diagnosis::{CauseEntry, FleetEntry, Outcome, ParameterEntry, ShareEntry};
use crate::text::option::GRADE;
use crate::text::shown::counted;
use crate::wgsl::library;

fn base(outcome: &Outcome) -> &str {
    outcome.base.as_ref().map_or("the base", |base| base.variant.as_str())
}

/// The common effect of the members of a family, in words.
const FAMILIES: [(&str, &str); 3] = [
    ("phase", "the car answers late"),
    ("anticipation", "the car uses more information from ahead than spacing and speeds"),
    ("drag_or_headway", "the spacing grows with the square of the speed, or the car does not compensate for air drag"),
];

/// The missing effect, in one sentence.
fn verdict(outcome: &Outcome) -> String {
    let base = base(outcome);
    let one =
        |cause: &CauseEntry| in_words(&cause.name, cause.meaning.as_deref().unwrap_or_default(), &cause.parameters);
    let words = |cause: &CauseEntry| {
        let words = FAMILIES.iter().find(|(family, _)| *family == cause.family).map(|(_, words)| *words);
        let mut rivals = outcome.rivals(cause).peekable();
        words.filter(|_| rivals.peek().is_some() && rivals.all(|rival| rival.family == cause.family))
    };
    // A family describes an effect on the car; its members are possible mechanisms.
    let families: Vec<String> = outcome
        .causes
        .iter()
        .filter_map(|cause| {
            let others: Vec<&str> = outcome.rivals(cause).map(|rival| rival.name.as_str()).collect();
            Some(format!(
                "{}, unlike {base}: {}, or {} (these data do not distinguish them).",
                capitalised(words(cause)?),
                one(cause),
                others.join(", ")
            ))
        })
        .collect();
    let either = |cause: &CauseEntry| {
        let rivals: Vec<String> = outcome.rivals(cause).map(one).collect();
        match rivals.is_empty() {
            true => one(cause),
            false => format!("either {} or {} (these data do not distinguish them)", one(cause), rivals.join(" or ")),
        }
    };
    let others = outcome.causes.iter().filter(|cause| words(cause).is_none());
    let others: Vec<String> = others.map(either).collect();
    let named = || {
        let lacks = if others.is_empty() { String::new() } else { format!("{base} lacks {}.", others.join(", and ")) };
        families.iter().cloned().chain([lacks]).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
    };
    match outcome.verdict {
        Verdict::Named | Verdict::Ambiguous => named(),
        Verdict::Nothing => format!("No cause was found that {base} lacks.{}", unexplained(outcome)),
        Verdict::NotTestable if is_untried(outcome) => {
            format!("These data do not show what {base} lacks: {}.", outcome.reason)
        }
        Verdict::NotTestable => format!("These data do not show what {base} lacks.{}", unexplained(outcome)),
        Verdict::Unexplained => format!("{base} errs, and no built-in cause explains why.{}", unexplained(outcome)),
        Verdict::BadBase => format!("{base} does not fit these drives, so no cause can be identified."),
    }
}

/// True if the reason of the verdict is that no extension could be tried.
fn is_untried(outcome: &Outcome) -> bool {
    outcome.closed_loop.not_testable.as_ref() == Some(&outcome.reason)
}

/// The unexplained acceleration of the base: its size, its duration, and whether it belongs to places of the road; and the causes that
/// more data would allow.
fn unexplained(outcome: &Outcome) -> String {
    let mut text = String::new();
    let noise = outcome.base.as_ref().and_then(|base| base.noise.as_ref());
    if let Some(noise) = noise.filter(|noise| noise.sigma_d_mps2 >= LEAST_UNEXPLAINED) {
        let (size, time) = (noise.sigma_d_mps2, noise.tau_d_s);
        text += &format!(" An acceleration of {size:.2} m/s² with a time constant of {time:.0} s remains unexplained.");
        let of_place = outcome.left_over.iter().any(|left| left.kind == OF_PLACE);
        let repeats = outcome.missing.as_ref().and_then(Profiles::repeats);
        let place = match repeats {
            Some(r) => Some(format!("It repeats at the same places of the road in other drives (correlation {r:.2})")),
            None => of_place.then(|| "It depends on the place on the road".to_owned()),
        };
        if let Some(place) = place {
            let untried = outcome.not_tried.iter().any(|entry| needs_grade(&entry.name));
            let remedy =
                if untried { format!(", as on slopes: give the grade of the road ({GRADE})") } else { String::new() };
            text += &format!(" {place}{remedy}.");
        }
    }
    let untried = not_tried(outcome.not_tried.iter().filter(|entry| entry.needs.is_some()));
    if !untried.is_empty() {
        text += &format!(" Not tried: {untried}.");
    }
    text
}

/// True for a built-in cause that reads the grade of the road.
fn needs_grade(cause: &str) -> bool {
    let own = library().iter().find(|extension| extension.name == cause);
    own.is_some_and(|extension| extension.reads.iter().any(|read| read == "sin_grade"))
}

/// The kind of structure that depends on the place on the road.
const OF_PLACE: &str = "road";

/// Smallest acceleration worth reporting \[m/s²\]: it is printed as 0.01.
const LEAST_UNEXPLAINED: f64 = 0.005;

/// The text with a capital first letter.
pub(super) fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A cause in words: its name, effect and sizes.
fn in_words(name: &str, meaning: &str, parameters: &[ParameterEntry]) -> String {
    let sizes: Vec<String> = parameters.iter().map(parameter).collect();
    let what = [meaning.trim_end_matches('.').to_owned(), sizes.join(", ")]
        .into_iter()
        .filter(|part| !part.is_empty())
        .collect::<Vec<_>>();
    if what.is_empty() { name.to_owned() } else { format!("{name} ({})", what.join("; ")) }
}

/// The conclusion of a diagnosis.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Short {
    /// A warning about the data, the verdict, and what whole drives say beyond or against it.
    pub answer: Vec<String>,
    /// The consequences of the verdict.
    pub more: Vec<String>,
}

impl Short {
    /// All sentences, the most important first.
    pub fn sentences(&self) -> impl Iterator<Item = &String> {
        self.answer.iter().chain(&self.more)
    }
}

/// The conclusion for the terminal and the page.
#[must_use]
pub fn in_short(outcome: &Outcome) -> Short {
    let mut answer: Vec<String> = outcome.data_first().map(|first| format!("{first}.")).into_iter().collect();
    answer.push(verdict(outcome));
    answer.extend(outcome.fleet.iter().filter_map(|fleet| fleet.share.as_ref()).map(share));
    answer.extend(whole_drives(outcome));
    let mut more = match &outcome.recommended {
        Some(recommended) => vec![recommendation(outcome, recommended)],
        None => outcome.gain.iter().map(unconfirmed).collect(),
    };
    let minutes = outcome.closed_loop.bins as f64 * BIN_S / 60.0;
    more.extend(outcome.power.iter().map(|found| power(found, minutes)));
    more.extend(outcome.likelier_base().map(|base| format!("{}.", next(&base))));
    if !outcome.base_notes.is_empty() {
        more.push(format!("The base model: {}.", outcome.base_notes.join("; ")));
    }
    Short { answer, more }
}

/// The share of the drivers with the named causes.
fn share(share: &ShareEntry) -> String {
    let [percent, low, high] = [share.share, share.interval[0], share.interval[1]].map(|share| 100.0 * share);
    let sizes: Vec<String> = share.parameters.iter().map(parameter).collect();
    format!(
        "{percent:.0} % of the drivers [{low:.0}, {high:.0}] have this effect, if all have the same size: {}.",
        sizes.join(", ")
    )
}

/// The drives of a fleet, and those that cannot be used.
#[must_use]
pub fn fleet_in_words(fleet: &FleetEntry) -> String {
    let FleetEntry { drivers, drives, minutes, unusable, .. } = fleet;
    let without = match unusable.first() {
        None => String::new(),
        Some([place, why]) => format!(" {} more cannot be used; the first: {place}: {why}.", unusable.len()),
    };
    // Minutes without digits would show a short drive as 0.
    let digits = usize::from(*minutes < 10.0);
    format!("{} of {}, {minutes:.digits$} minutes.{without}", counted(*drives, "drive"), counted(*drivers, "driver"))
}

fn is_named(outcome: &Outcome) -> bool {
    matches!(outcome.verdict, Verdict::Named | Verdict::Ambiguous)
}

/// Largest multiple of the given driving time that is still useful advice.
const MOST_MORE: f64 = 10.0;

/// The gain that the drives could have shown, and the driving time that would decide.
fn power(power: &Power, given: f64) -> String {
    let more = power.minutes.filter(|minutes| *minutes <= MOST_MORE * given);
    let more = more.map_or(String::new(), |minutes| {
        format!(" About {minutes:.0} more minutes of such driving would decide on {}.", power.causes.join(" with "))
    });
    let percent = 100.0 * power.gain;
    let digits = usize::from(percent < 1.0);
    format!(
        "These drives show a gain of {percent:.digits$} % at 15 s with a probability of 80 %, smaller ones less often.{more}"
    )
}

/// What whole drives say beyond or against the named causes.
fn whole_drives(outcome: &Outcome) -> Option<String> {
    let base = base(outcome);
    let is_named = is_named(outcome);
    let several = outcome.causes.len() + outcome.confounded_with.len() > 1;
    let it = if several { "them" } else { "it" };
    match (&outcome.recommended, &outcome.closed_loop.not_testable) {
        (Some(recommended), _) if recommended.why == Why::Helps => Some(beyond_names(outcome, recommended)),
        (Some(_), _) => failed_check(outcome).map(|check| format!("Do not use {it} yet, because {check}.")),
        (None, _) if is_named && once(outcome) => {
            Some(format!("Whole drives cannot test an effect that occurs only once: do not use {it} for other drives."))
        }
        (None, Some(why)) if is_named => Some(format!("Whole drives could not test {it}: {why}.")),
        (None, Some(_)) if is_untried(outcome) => None,
        (None, Some(why)) => Some(format!("Whether an extension follows unseen drives better was not tested: {why}.")),
        (None, None) if outcome.closed_loop.bins == 0 => None,
        (None, None) if is_named => {
            let why = failed_check(outcome).map_or(String::new(), |check| format!(", because {check}"));
            Some(format!("Do not use {it} yet{why}."))
        }
        (None, None) => Some(format!("No extension of {base} is recommended: none passes all checks.")),
    }
}

/// The recommended causes that are not named.
fn beyond_names(outcome: &Outcome, recommended: &Recommended) -> String {
    let is_named = |own: &&RecommendedCause| outcome.causes.iter().any(|cause| cause.name == own.name);
    let others: Vec<&str> =
        recommended.causes.iter().filter(|own| !is_named(own)).map(|own| own.name.as_str()).collect();
    format!("Not named, but supported by whole drives: {}.", others.join(" and "))
}

/// The first check that the model with the named causes fails.
fn failed_check(outcome: &Outcome) -> Option<String> {
    let is_named = |name: &String| outcome.causes.iter().any(|cause| cause.name == *name);
    let with_named = |trial: &&Trial| trial.causes.len() == outcome.causes.len() && trial.causes.iter().all(is_named);
    let check = outcome.closed_loop.trials.iter().find(with_named)?.checks.iter().find(|check| !check.met)?;
    Some(format!("a check fails ({})", check.in_words()))
}

/// True if all named causes happen at one time of one drive.
fn once(outcome: &Outcome) -> bool {
    !outcome.causes.is_empty() && outcome.causes.iter().all(|cause| happens_once(&cause.name))
}

/// True for a cause that begins at a time of one drive; the race does not try these causes.
fn happens_once(cause: &str) -> bool {
    let own = library().iter().find(|extension| extension.name == cause);
    own.is_some_and(|extension| extension.parameters.iter().any(|symbol| symbol.is_time()))
}

/// The gain of named causes that are not recommended.
pub(in crate::internal::report) fn unconfirmed(gain: &ClosedLoopGain) -> String {
    format!("With it, {}.", change(gain))
}

/// The change of the error on unseen drives, with its interval.
fn change(gain: &ClosedLoopGain) -> String {
    let [low, high] = gain.interval;
    let [falls, low, high] = [gain.base - gain.extended, low, high].map(|difference| 100.0 * difference / gain.base);
    let (changes, values) = match falls.round() < 0.0 {
        true => ("rises", [-falls, -high, -low]),
        false => ("falls", [falls, low, high]),
    };
    // Adding 0 makes -0 positive.
    let [change, low, high] = values.map(|value| value.round() + 0.0);
    format!("the error on unseen drives {changes} by {change} % [{low}, {high}]")
}

fn recommendation(outcome: &Outcome, recommended: &Recommended) -> String {
    let base = base(outcome);
    // The verdict gives the meaning of a named cause.
    let meaning = |cause: &RecommendedCause| match outcome.causes.iter().any(|named| named.name == cause.name) {
        true => String::new(),
        false => cause.meaning.clone(),
    };
    let one = |cause: &RecommendedCause| in_words(&cause.name, &meaning(cause), &cause.parameters);
    let causes: Vec<String> = recommended.causes.iter().map(one).collect();
    // One entry per driver of a fleet, otherwise per file.
    let (all, of) = (recommended.per_drive.len(), if outcome.fleet.is_some() { "drivers" } else { "files" });
    let better = recommended.per_drive.iter().filter(|drive| drive.extended < drive.base).count();
    let each = if all > 1 { format!(", and is smaller on {better} of {all} {of}") } else { String::new() };
    format!("Recommended: {base} with {}; {}{each}.", causes.join(" and "), change(&recommended.gain))
}

pub(super) fn parameter(p: &ParameterEntry) -> String {
    let unit = if p.unit == "-" { String::new() } else { format!(" {}", p.unit) };
    let digits = if p.value.abs() < 0.1 { 4 } else { 2 };
    let interval = p.interval.map_or(String::new(), |[low, high]| format!(" [{low:.digits$}, {high:.digits$}]"));
    format!("{} = {:.digits$}{unit}{interval}", p.name, p.value)
}
