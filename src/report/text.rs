//! A calibration as text for a terminal of 80 columns.

use super::own;
use crate::result::diagnosis::FindingEntry;
use crate::result::{
    CorrelationEntry, DataEntry, DriveScore, IdentifiabilityEntry, ReplicateEntry, ResultFile, Scores,
};
use crate::text::option::{BOUNDS, CORRECT};
use crate::trajectory::driver_id;
use std::fmt::Write;
use textwrap::{Options, WordSplitter};

/// Model and data, quality of the fit, parameters.
pub fn calibration(result: &ResultFile) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_calibration(&mut text, result);
    text
}

/// Largest number of drives that are described one by one.
const DRIVES_SHOWN: usize = 10;
/// Number of drives with the largest errors that are named.
const WORST_SHOWN: usize = 3;

fn write_calibration(text: &mut String, result: &ResultFile) -> std::fmt::Result {
    writeln!(text, "variant      {}", result.numbered_model())?;
    let shown = if result.data.len() > DRIVES_SHOWN { 0 } else { result.data.len() };
    if shown == 0 {
        let mut files: Vec<&str> = result.data.iter().map(|data| data.path.as_str()).collect();
        files.dedup();
        writeln!(text, "data         {} drives of {} files, the first {}", result.data.len(), files.len(), files[0])?;
    }
    for data in &result.data[..shown] {
        let [from, to] = data.window_s;
        writeln!(text, "data         {}", data.path)?;
        writeln!(text, "             follower {}, {}", data.follower, data.name)?;
        let (samples, first) = (data.samples, data.first_scored);
        let window = format!("{from:.1} to {to:.1} s, {samples} samples, scored from sample {first}");
        let lines = [window, format!("sha256 {}", &data.sha256[..16.min(data.sha256.len())])];
        let grade = data.grade.iter().map(|grade| format!("grade: {}", grade.path));
        for line in lines.into_iter().chain(data.preparation.iter().cloned()).chain(grade) {
            text.push_str(&wrapped(INDENT, INDENT + 2, &line));
        }
    }
    if let Some(vehicle) = &result.vehicle {
        writeln!(text, "vehicle      {}, {} kg unladen", vehicle.slug, vehicle.m_0)?;
        text.push_str(&wrapped(INDENT, INDENT + 2, &format!("from {}", vehicle.from)));
    }
    writeln!(text, "convention   {}", result.convention)?;
    if let Some(from) = &result.bounds_from {
        text.push_str(&wrapped(0, INDENT, &format!("bounds       {from}")));
    }
    let adapter = result.adapter.as_deref().map_or(String::new(), |a| format!(" on {a}"));
    writeln!(text, "evaluator    {} ({}){adapter}", result.evaluator, result.precision)?;
    let population = result.population.map_or(String::new(), |size| format!(", {size} candidates a generation"));
    writeln!(
        text,
        "optimizer    {}{population}, seed {}, {} evaluations",
        result.optimizer, result.seed, result.evaluations
    )?;
    for replicate in &result.replicates {
        writeln!(
            text,
            "replicate {:<3}{} = {} after {} evaluations: {}",
            replicate.replicate,
            result.gof,
            replicate.score.map_or("none in f64".to_owned(), |score| format!("{score:.6}")),
            replicate.evaluations,
            replicate.stop
        )?;
    }
    if let Some((evaluations, share)) = result.replicates.iter().filter_map(arrival).max() {
        writeln!(text, "             within 0.1 % of its best after {evaluations} evaluations ({share} %)")?;
    }
    if let Some(cv) = result.cv {
        writeln!(text, "             coefficient of variation over replicates {:.3} %", 100.0 * cv)?;
    }
    for (finding, on, told) in faults(&result.data) {
        text.push('\n');
        text.push_str(&wrapped(0, 2, &format!("DATA {}{on}: {told}", finding.name.to_uppercase())));
    }
    if let Some(changes) = changes(result) {
        text.push_str(&wrapped(0, 2, &changes));
    }

    write_parameters(text, result)?;

    let own = own::rows(result);
    if !own.is_empty() {
        text.push('\n');
        let head = own::HEAD.map(str::to_owned).to_vec();
        for row in std::iter::once(&head).chain(&own) {
            let [first, rest @ ..] = &row[..] else { continue };
            let rest: String = rest.iter().zip(own::WIDTHS).map(|(cell, width)| format!(" {cell:>width$}")).collect();
            writeln!(text, "{first:<12}{rest}")?;
        }
    }

    if let Some(identifiability) = &result.identifiability {
        write_identifiability(text, result, identifiability)?;
    }

    let score = |name: &str| result.score.get(name).copied().flatten();
    writeln!(text, "\n{:<14}{:>10}{:>10}{:>10}{:>12}", "", "spacing", "speed", "accel.", "sum")?;
    for (title, names) in [
        ("NRMSE", ["nrmse_s", "nrmse_v", "nrmse_a", "nrmse_sva"]),
        ("Theil's U", ["u_s", "u_v", "u_a", "u_sva"]),
        ("RMSE (SI)", ["rmse_s", "rmse_v", "rmse_a", ""]),
    ] {
        let [s, v, a, sum] = names.map(|n| score(n).map_or(String::new(), |x| format!("{x:.4}")));
        writeln!(text, "{}", format!("{title:<14}{s:>10}{v:>10}{a:>10}{sum:>12}").trim_end())?;
    }
    for (name, scores) in [("drives", &result.per_drive), ("held back", &result.held_back)] {
        if let Some(scores) = scores {
            text.push_str(&wrapped(0, 2, &scores_in_words(name, scores, &result.gof)));
        }
    }
    Ok(())
}

/// The faults of the data, each kind once, of several drives with the same fault the first: kind, drives that have it, and the fault.
pub(in crate::internal::report) fn faults(data: &[DataEntry]) -> Vec<(&FindingEntry, String, String)> {
    let matter = |data: &'_ DataEntry, name: &str| data.findings.iter().any(|f| f.matters && f.name == name);
    let mut told: Vec<(&FindingEntry, String, String)> = Vec::new();
    for drive in data {
        for finding in drive.findings.iter().filter(|finding| finding.matters) {
            if data.len() > 1 && told.iter().any(|(known, ..)| known.name == finding.name) {
                continue;
            }
            let with = data.iter().filter(|data| matter(data, &finding.name)).count();
            let on = match data.len() {
                1 => String::new(),
                all => {
                    format!(" on {with} of {all} drives, here {}", driver_id(&drive.name, None).unwrap_or(&drive.path))
                }
            };
            told.push((finding, on, finding.correction.as_ref().map_or_else(|| finding.told(), Clone::clone)));
        }
    }
    told
}

/// Scores of several drives, and the worst of them.
pub(in crate::internal::report) fn scores_in_words(name: &str, scores: &Scores, gof: &str) -> String {
    let count = scores.drives.len();
    let mut all: Vec<(f64, &DriveScore)> =
        scores.drives.iter().filter_map(|drive| Some((drive.score?, drive))).collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let worst: Vec<String> = all
        .iter()
        .take(WORST_SHOWN)
        .map(|(score, drive)| {
            let same = scores.drives.iter().filter(|other| other.path == drive.path).count();
            let follower = if same > 1 { format!(" follower {}", drive.follower) } else { String::new() };
            let id = drive.trajectory.as_ref().map_or(follower, |id| format!(" trajectory {id}"));
            format!("{}{id} {score:.4}", drive.path)
        })
        .collect();
    let score = scores.pooled.or(scores.mean).map_or("none".to_owned(), |score| format!("{score:.4}"));
    let mean = if scores.pooled.is_some() { "" } else { "mean " };
    let mse = scores.mse_s_m2.map_or("none".to_owned(), |mse| format!("{mse:.3} m²"));
    let folds = scores.folds.map_or(String::new(), |folds| format!(", in {folds} folds"));
    format!(
        "{name}{folds}: {count}, {mean}{gof} {score}, mean squared error of the spacing {mse}, {} fail; the worst: {}",
        scores.failed,
        worst.join(", ")
    )
}

/// Smallest change of a parameter that is printed, as a share \[-\].
const CHANGED: f64 = 0.02;
/// Number of printed parameters, the most changed first.
const CHANGES: usize = 4;

/// Effect of faults of the data on the parameters, if computed.
fn changes(result: &ResultFile) -> Option<String> {
    let compared = result.compared.as_ref()?;
    let mut changed: Vec<(&str, f64, f64)> = result
        .parameters
        .iter()
        .filter_map(|(name, value)| Some((name.as_str(), *value, *compared.parameters.get(name)?)))
        .filter(|(_, value, other)| (value - other).abs() > CHANGED * other.abs())
        .collect();
    let size = |(_, value, other): &(&str, f64, f64)| ((value - other) / other).abs();
    changed.sort_by(|a, b| size(b).total_cmp(&size(a)));
    changed.truncate(CHANGES);
    let listed = |other: bool| {
        let one = |(name, value, twin): &(&str, f64, f64)| format!("{name} {:.3}", if other { twin } else { value });
        changed.iter().map(one).collect::<Vec<_>>().join(", ")
    };
    if changed.is_empty() {
        return Some(format!("with and without {CORRECT} no parameter differs by more than 2 %"));
    }
    let (found, other) = (listed(false), listed(true));
    Some(if compared.corrected {
        format!("{found} because of this; {CORRECT} gives {other}")
    } else {
        format!("corrected: {found}; as measured: {other}")
    })
}

/// The mark of a parameter at a bound, in its own column, if any.
const AT_BOUND: &str = "AT BOUND";

/// Values, units, bounds, meanings.
fn write_parameters(text: &mut String, result: &ResultFile) -> std::fmt::Result {
    let mark = |marked: bool| match (result.at_bound.is_empty(), marked) {
        (true, _) => String::new(),
        (false, true) => format!("  {AT_BOUND}"),
        (false, false) => format!("  {:1$}", "", AT_BOUND.len()),
    };
    writeln!(text, "\n{:<10}{:>11}  {:<5}{:>17}{}  meaning", "parameter", "value", "unit", "bounds", mark(false))?;
    for (name, value) in &result.parameters {
        let [lower, upper] = result.bounds.get(name).copied().unwrap_or([f64::NAN; 2]);
        let bounds = if lower == upper { "fixed".to_owned() } else { format!("{} .. {}", short(lower), short(upper)) };
        let unit = result.units.get(name).map_or("", String::as_str);
        let row = format!("{name:<10}{value:>11.5}  {unit:<5}{bounds:>17}{}  ", mark(result.at_bound.contains(name)));
        let meaning = result.meaning(name);
        text.push_str(&wrapped(0, row.chars().count(), &format!("{row}{meaning}")));
    }
    if let Some(drivers) = &result.drivers {
        text.push('\n');
        text.push_str(&wrapped(0, 2, &format!("NOT ONE DRIVER: {drivers}")));
    }
    if !result.at_bound.is_empty() {
        // Bounds of cars with adaptive cruise control, of Table 3 or as requested.
        let acc = result.bounds_from.as_ref().is_some_and(|from| from.starts_with("acc:") && !from.contains("human:"));
        let human = if acc { format!("{BOUNDS} human is for a human driver, and ") } else { String::new() };
        let told = format!(
            "{AT_BOUND}: the data favour values beyond the bounds or do not determine the parameter; {human}{BOUNDS} FILE.toml widens them \
             (docs/FIRST_CALIBRATION.md, \"Bounds for your car\")"
        );
        text.push_str(&wrapped(0, 2, &told));
    }
    Ok(())
}

/// Evaluations after which a replicate was within 0.1 % of its final score, and their share of all \[%\].
fn arrival(replicate: &ReplicateEntry) -> Option<(u64, u64)> {
    let (_, last) = replicate.convergence.last()?;
    let (evaluations, _) = replicate.convergence.iter().find(|(_, score)| *score <= last + 1e-3 * last.abs())?;
    Some((*evaluations, 100 * evaluations / replicate.evaluations.max(1)))
}

/// Intervals, and the most correlated parameter of each.
fn write_identifiability(
    text: &mut String,
    result: &ResultFile,
    identifiability: &IdentifiabilityEntry,
) -> std::fmt::Result {
    let confidence = format!("{:.0} % interval", 100.0 * identifiability.confidence);
    if let Some(note) = identifiability.note.as_ref().filter(|_| identifiability.parameters.is_empty()) {
        text.push('\n');
        text.push_str(&wrapped(0, 2, &format!("no {confidence}s: {note}")));
        return Ok(());
    }
    writeln!(text, "\n{:<10}{confidence:>24}{:>14}  goes with", "parameter", "eff. samples")?;
    for (name, knowledge) in &identifiability.parameters {
        let [lower, upper] = result.intervals.get(name).copied().unwrap_or([f64::NAN; 2]);
        let end = |x: f64, open: bool| if open { format!("({})", short(x)) } else { short(x) };
        let [open_lower, open_upper] = knowledge.open;
        let interval = match knowledge.determined {
            true => format!("{} .. {}", end(lower, open_lower), end(upper, open_upper)),
            false => UNDETERMINED.to_owned(),
        };
        let partner = identifiability.correlation.as_ref().and_then(|c| partner(c, name)).unwrap_or_default();
        let line = format!("{name:<10}{interval:>24}{:>14.0}  {partner}", knowledge.effective_samples);
        writeln!(text, "{}", line.trim_end())?;
    }
    let known = identifiability.parameters.values();
    if known.clone().any(|k| k.determined && k.open != [false; 2]) {
        writeln!(text, "{OPEN}")?;
    }
    if known.clone().any(|k| !k.determined) {
        writeln!(text, "{UNDETERMINED}: the interval would cover more than half of the range")?;
    }
    if let Some(note) = &identifiability.note {
        text.push_str(&wrapped(0, 2, note));
    }
    Ok(())
}

/// Text in place of an interval that excludes almost nothing.
pub(super) const UNDETERMINED: &str = "not determined";

/// Meaning of parentheses around the end of an interval.
pub(super) const OPEN: &str = "in parentheses: a bound of the search, not a limit set by the data";

/// The other parameter with the strongest correlation, if it is above 0.5.
pub(super) fn partner(correlation: &CorrelationEntry, name: &str) -> Option<String> {
    let row = correlation.parameters.iter().position(|p| p == name)?;
    let others = correlation.matrix[row].iter().enumerate().filter(|(column, r)| *column != row && r.abs() > 0.5);
    let (column, r) = others.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    Some(format!("{} ({r:+.2})", correlation.parameters[column]))
}

/// Columns of the terminal.
const WIDTH: usize = 80;
const INDENT: usize = 13;
/// Largest number of blanks before a continued line: the longest words of a table still fit after them.
const INDENT_MAX: usize = WIDTH - 16;

/// A line wrapped to 80 columns: its first part is indented by `first` blanks, the rest by `rest`. A number stays with its unit.
pub fn wrapped(first: usize, rest: usize, line: &str) -> String {
    let [first, rest] = [first, rest].map(|blanks| " ".repeat(blanks.min(INDENT_MAX)));
    let options = Options::new(WIDTH)
        .initial_indent(&first)
        .subsequent_indent(&rest)
        .word_splitter(WordSplitter::Custom(split_points));
    textwrap::wrap(&joined(line), options).join("\n").replace(JOINT, " ") + "\n"
}

/// A blank at which no line ends.
const JOINT: char = '\u{e000}';
/// Words that have no meaning without the number before them.
const UNITS: [&str; 12] = ["m", "m/s", "m/s²", "m/s2", "s", "%", "Hz", "kg", "km", "km/h", "m/km", "nats"];

/// A line whose units stay with their numbers.
fn joined(line: &str) -> String {
    let mut text = String::with_capacity(line.len());
    for word in line.split_inclusive(' ') {
        let unit = word.trim_end_matches([' ', ',', ';', ':', '.', ')', ']']);
        if UNITS.contains(&unit)
            && text.ends_with(' ')
            && text[..text.len() - 1].ends_with(|c: char| c.is_ascii_digit())
        {
            text.pop();
            text.push(JOINT);
        }
        text.push_str(word);
    }
    text
}

/// Where a word may be broken: after a hyphen, but not in an exponent, and never in a flag or the name of a file, because users copy it.
fn split_points(word: &str) -> Vec<usize> {
    if word.contains("--") || word.trim_end_matches(['.', ',', ':', ';', ')']).contains(['/', '.']) {
        return Vec::new();
    }
    let is_exponent = |at: usize| {
        let digits = word[..at].strip_suffix("e-");
        digits.is_some_and(|digits| digits.ends_with(|c: char| c.is_ascii_digit()))
    };
    WordSplitter::HyphenSplitter.split_points(word).into_iter().filter(|at| !is_exponent(*at)).collect()
}

/// At most four significant digits.
fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    rounded.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A result with these entries.
    fn result(own: serde_json::Value) -> ResultFile {
        let mut result = serde_json::json!({
            "schema_version": 1, "program": "", "model_id": 1, "variant": "idm", "convention": "paper", "extensions": [],
            "evaluator": "lanes", "precision": "plain", "adapter": null, "data": [], "vehicle": null, "gof": "nrmse-sva",
            "optimizer": "ga", "seed": 1, "score": {}, "at_bound": [], "intervals": {}, "evaluations": 1, "replicates": [], "cv": null
        });
        let serde_json::Value::Object(own) = own else { panic!("{own}") };
        result.as_object_mut().expect("an object").extend(own);
        serde_json::from_value(result).expect("a result")
    }

    fn table(at_bound: &[&str]) -> String {
        let result = result(serde_json::json!({
            "parameters": {"delta": 10.0, "v_0": 30.5, "a_min": -2.0},
            "units": {"delta": "-", "v_0": "m/s", "a_min": "m/s²"},
            "bounds": {"delta": [0.1, 10.0], "v_0": [30.0, 35.0], "a_min": [-2.0, -2.0]}, "at_bound": at_bound
        }));
        let mut text = String::new();
        write_parameters(&mut text, &result).expect("a String takes everything");
        text
    }

    #[test]
    fn a_number_stays_with_its_unit_and_with_its_exponent() {
        for (number, rest) in [("4.5e-4 m", ", and so on"), ("-0.35 m/s²", "; more"), ("97 %", "")] {
            for before in 40..90 {
                let line = format!("{} {number}{rest}, and a well-known word", "x".repeat(before % 75 + 1));
                let text = wrapped(0, 2, &line);
                assert!(text.contains(number) && !text.contains(JOINT), "{text}");
                assert!(text.lines().all(|line| line.chars().count() <= 80), "{text}");
            }
        }
        // Columns keep their distance, and other hyphens still break.
        assert_eq!(wrapped(0, 0, "v_0  30.5  m/s  desired"), "v_0  30.5  m/s  desired\n");
        assert_eq!(split_points("well-known"), [5]);
        for name in ["my-data/car-a.csv:", "car-a.csv,", "--max-gap"] {
            assert!(split_points(name).is_empty(), "{name}");
        }
        assert_eq!(split_points("well-known."), [5]);
    }

    /// Names and units from files have any length: a line after a long one would otherwise be indented by the same length, word by word.
    #[test]
    fn an_indent_is_no_wider_than_the_terminal() {
        let text = wrapped(0, 40_000, &format!("{} {}", "x".repeat(200), "word ".repeat(1000)));
        assert!(text.len() < 100 * 1000 && text.lines().all(|line| line.chars().count() <= WIDTH), "{}", text.len());
    }

    #[test]
    fn what_to_mind_with_intervals_stands_below_them() {
        let told = |note: &str, parameters: serde_json::Value| {
            let result = result(serde_json::json!({
                "parameters": {"t_h": 1.0}, "units": {"t_h": "s"}, "bounds": {"t_h": [0.1, 3.0]}, "intervals": {"t_h": [0.9, 1.1]},
                "identifiability": {"confidence": 0.95, "parameters": parameters, "correlation": null,
                "replicate_range": {}, "evaluations": 1, "note": note}
            }));
            let mut text = String::new();
            let known = result.identifiability.as_ref().expect("it is there");
            write_identifiability(&mut text, &result, known).expect("a String takes everything");
            text
        };
        let known = serde_json::json!({"t_h": {"open": [false, false], "effective_samples": 9.0, "rise": 0.1,
            "determined": true}});
        let text = told("the drive is short", known);
        assert!(text.contains("0.9 .. 1.1") && text.ends_with("the drive is short\n"), "{text}");
        let text = told("the score has no curvature", serde_json::json!({}));
        assert!(text.contains("no 95 % intervals: the score has no curvature"), "{text}");
    }

    #[test]
    fn a_parameter_at_a_bound_keeps_its_meaning() {
        let (plain, marked) = (table(&[]), table(&["delta"]));
        assert!(!plain.contains("BOUND") && !plain.contains("--bounds"), "{plain}");
        assert!(plain.contains("m/s           30 .. 35  desired speed (ACC set speed)\n"), "{plain}");
        let row = marked.lines().find(|line| line.starts_with("delta ")).expect("a row");
        assert!(row.ends_with("0.1 .. 10  AT BOUND  exponent factor of the"), "{marked}");
        assert!(marked.contains("30 .. 35            desired speed (ACC"), "{marked}");
        assert!(marked.contains("\nAT BOUND: the data favour values beyond the bounds") && marked.contains("--bounds"));
        assert!(marked.lines().all(|line| line.chars().count() <= 80), "{marked}");
    }
}
