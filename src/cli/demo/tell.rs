//! Output of the demo: a few lines per step, and at the end the result beside the hidden effect.

use super::super::output;
use super::{Args, BASE, Found};
use crate::diagnose::Verdict;
use crate::report::text::wrapped;
use crate::result::ResultFile;
use crate::result::diagnosis::{CauseEntry, Outcome};
use crate::synthetic::Effect;
use std::path::Path;

pub fn beginning(args: &Args, follower: usize) -> String {
    let folder = args.out.display();
    let text = format!(
        "A drive of five cars, {} s at 10 Hz on a hilly road, as sensors would have measured it: {folder}/platoon.csv (layout astazero-rebuilt), \
         {folder}/Slope.csv. Follower {follower} follows the model {BASE}, and may have an effect that {BASE} lacks. The next steps \
         read only these two files; the end reveals the hidden effect.",
        args.duration
    );
    format!("{}\n", wrapped(0, 0, &text))
}

/// Prints the heading of a step.
pub fn step(title: &str) -> anyhow::Result<()> {
    output::print(&format!("\n== {title}\n"))
}

/// Prints the result of a command.
pub fn line(text: &str) -> anyhow::Result<()> {
    output::print(&wrapped(2, 4, text))
}

pub fn command(words: &[&str], log: Option<&Path>) -> String {
    let typed: Vec<String> = words.iter().map(|word| quoted(word)).collect();
    let log = log.map_or(String::new(), |log| format!(" > {}", quoted(&log.display().to_string())));
    format!("$ leadlag {}{log}\n", typed.join(" "))
}

/// A word as a shell takes it.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "/._-+=:,".contains(c);
    if word.chars().all(plain) { word.to_owned() } else { format!("'{}'", word.replace('\'', "'\\''")) }
}

pub fn calibrated(result: &ResultFile) -> String {
    let score = result.score.get("nrmse_sva").copied().flatten();
    let score = score.map_or("undefined".to_owned(), |score| format!("{score:.4}"));
    let simulations = result.evaluations;
    format!("{}: NRMSE(s,v,a) {score} after {simulations} simulations", result.model())
}

pub fn held_back(model: &str, score: Option<f64>) -> String {
    match score {
        Some(score) => format!("{model}: NRMSE(s,v,a) {score:.4}"),
        None => format!("{model}: the simulation ends early"),
    }
}

/// Parameters of a cause with units and intervals.
fn parameters(cause: &CauseEntry) -> String {
    let one = |p: &crate::result::diagnosis::ParameterEntry| {
        let unit = if p.unit == "-" { String::new() } else { format!(" {}", p.unit) };
        let interval = p.interval.map_or(String::new(), |[low, high]| format!(" [{low:.4}, {high:.4}]"));
        format!("{} = {:.4}{unit}{interval}", p.name, p.value)
    };
    cause.parameters.iter().map(one).collect::<Vec<_>>().join(", ")
}

pub fn verdict(outcome: &Outcome) -> String {
    let names = |causes: &[CauseEntry]| causes.iter().map(|c| c.name.clone()).collect::<Vec<_>>().join(", ");
    let causes = &outcome.causes;
    match outcome.verdict {
        Verdict::Named => {
            let one = |c: &CauseEntry| {
                let meaning = c.meaning.as_ref().map_or(String::new(), |meaning| format!(" ({meaning})"));
                let (evidence, threshold) = (c.evidence, c.threshold);
                format!("{}{meaning}: {}; evidence {evidence:.0}, {threshold:.0} needed", c.name, parameters(c))
            };
            format!("named {}", causes.iter().map(one).collect::<Vec<_>>().join("; and "))
        }
        Verdict::Ambiguous => {
            format!("one of several: {}, {}", names(causes), names(&outcome.confounded_with))
        }
        Verdict::Nothing => "these data show no error of the model".to_owned(),
        _ => outcome.reason.clone(),
    }
}

/// The last lines.
pub fn ending(found: &Found, hidden: Option<&Effect>, page: &str) -> String {
    let mut text = "\n== Planted effect and result\n".to_owned();
    let mut say = |who: &str, what: &str| text += &wrapped(0, 8, &format!("{who:<8}{what}"));
    say("found", &verdict(&found.outcome));
    say("hidden", &hidden.map_or("nothing".to_owned(), in_words));
    say("so", &judgement(&found.outcome, hidden));
    if let [Some(base), Some(extended)] = found.held_back {
        let percent = 100.0 * (1.0 - extended / base);
        let more = if percent >= 0.0 { "less" } else { "more" };
        let size = percent.abs();
        say(
            "gain",
            &format!(
                "on the held-back third NRMSE(s,v,a) is {base:.4} with {BASE} and {extended:.4} with the extension, {size:.0} % {more} (the report compares separate calibrations, with wider bounds)"
            ),
        );
    }
    text += &format!("\n== Look at\n{page}\n\n== The same with your own data\n");
    text += "$ leadlag inspect FILE.csv\n";
    text += &format!("$ leadlag diagnose --data FILE.csv --follower 1 --base {BASE} --out diagnosis\n");
    text += "      if the slope of the road is known, with --grade SLOPE.csv and\n";
    text += "      --lead-start POSITION: where on SLOPE.csv the car ahead is in the first row\n";
    text += "$ leadlag report diagnosis -o report.html\n";
    text
}

fn in_words(effect: &Effect) -> String {
    let kind = effect.kind();
    let values: Vec<String> = kind
        .parameters()
        .iter()
        .zip(effect.values())
        .map(|(p, value)| {
            format!("{} = {value} {}", p.name, if p.unit == "-" { "" } else { p.unit }).trim_end().to_owned()
        })
        .collect();
    format!("{kind}, {} ({})", values.join(", "), kind.meaning())
}

/// Whether the verdict is right, in words; the demo also reports a failure.
fn judgement(outcome: &Outcome, hidden: Option<&Effect>) -> String {
    let named = || outcome.causes.iter().chain(&outcome.confounded_with);
    let several = outcome.causes.len() > 1;
    let Some(hidden) = hidden else {
        return match outcome.verdict {
            Verdict::Nothing => "right: nothing was hidden, and nothing is named".to_owned(),
            Verdict::Named | Verdict::Ambiguous => "wrong: no effect was planted".to_owned(),
            _ => "no name, and nothing was hidden; but the verdict should be `nothing`".to_owned(),
        };
    };
    let name = hidden.kind().into_str();
    let own = outcome.causes.iter().find(|cause| cause.name == name);
    match (outcome.verdict, own) {
        (Verdict::Named, Some(cause)) => {
            let inside = cause.parameters.iter().all(|p| {
                let index = hidden.kind().parameters().iter().position(|own| own.name == p.name);
                let truth = index.map(|index| hidden.values()[index]);
                truth.zip(p.interval).is_none_or(|(truth, [low, high])| (low..=high).contains(&truth))
            });
            let size = if inside { "within" } else { "but outside" };
            let also = if several { "; another named effect was not hidden" } else { "" };
            format!("right, {size} the 95 % intervals{also}")
        }
        (Verdict::Named, None) => {
            let family = outcome.causes.iter().map(|c| c.family.as_str()).find(|f| !f.is_empty()).unwrap_or("-");
            format!(
                "another name than the planted effect (family {family}): on this drive the two may look similar; another --seed gives another drive"
            )
        }
        (Verdict::Ambiguous, _) if named().any(|cause| cause.name == name) => {
            "the planted effect is among the names; this drive does not distinguish them".to_owned()
        }
        (Verdict::Ambiguous, _) => "wrong: the planted effect is not among the names".to_owned(),
        (Verdict::NotTestable, _) | (Verdict::Nothing, _) if untestable(outcome, name) => {
            "not found: the calibration absorbs it, as the diagnosis reports".to_owned()
        }
        _ => "missed: the planted effect is too weak on this drive, or the calibration absorbs most of it".to_owned(),
    }
}

fn untestable(outcome: &Outcome, name: &str) -> bool {
    outcome.not_testable.iter().any(|entry| entry.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(verdict: &str, names: &[&str]) -> Outcome {
        let cause = |name: &&str| {
            serde_json::json!({"name": name, "family": name, "evidence": 50.0, "threshold": 20.0, "threshold_kind": "table",
                "parameters": [{"name": "gg", "value": 0.4, "unit": "-", "interval": [0.38, 0.42]}]})
        };
        serde_json::from_value(serde_json::json!({
            "schema_version": 1, "verdict": verdict, "reason": "", "causes": names.iter().map(cause).collect::<Vec<_>>(),
            "confounded_with": [], "not_testable": [{"name": "range_bias", "absorbed_by": ["d_0"]}], "data_findings": [],
            "gain": null, "left_over": [], "simulations": 0, "seed": 1, "effort": "quick", "data": [], "drives": [], "held_back": "",
            "base": null, "extended": null, "budget": null, "missing": null, "missing_left": null, "ladder": []
        }))
        .expect("an outcome")
    }

    #[test]
    fn commands_can_be_typed() {
        let line = command(&["inspect", "my drive.csv"], Some(Path::new("out/it's.txt")));
        assert_eq!(line, "$ leadlag inspect 'my drive.csv' > 'out/it'\\''s.txt'\n");
    }

    #[test]
    fn says_whether_the_verdict_is_right() {
        let judge = |verdict: &str, names: &[&str], hidden: &str| {
            let effect = (hidden != "none").then(|| hidden.parse::<Effect>().expect("good"));
            judgement(&outcome(verdict, names), effect.as_ref())
        };
        let cases: [(&str, &[&str], &str, &str); 10] = [
            ("nothing", &[], "none", "right: "),
            ("named", &["grade"], "none", "wrong: no effect"),
            ("unexplained", &[], "none", "no name"),
            ("named", &["grade"], "grade:gg=0.4", "right, within"),
            ("named", &["grade"], "grade:gg=0.6", "right, but outside"),
            ("named", &["const_decel"], "grade", "another name"),
            ("ambiguous", &["grade", "aero_drag"], "aero_drag", "the planted effect is among"),
            ("ambiguous", &["grade"], "aero_drag", "wrong: "),
            ("nothing", &[], "range_bias", "not found: the calibration absorbs it"),
            ("nothing", &[], "grade", "missed"),
        ];
        for (verdict, names, hidden, words) in cases {
            let said = judge(verdict, names, hidden);
            assert!(said.starts_with(words), "{verdict} {names:?} {hidden}: {said}");
        }
    }
}
