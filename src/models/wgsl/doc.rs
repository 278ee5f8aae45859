//! Doc comments of extensions, in words and numbers.

use crate::extension::{Cause, Initial, Signal};
use crate::symbols::{Scale, SearchKind};
use crate::text::spelling::any_of;
use std::str::FromStr;
use strum::VariantNames;

/// Content of a parameter's comment.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct About {
    pub(super) meaning: String,
    pub(super) unit: String,
    pub(super) lower: f64,
    pub(super) upper: f64,
    pub(super) neutral: f64,
    pub(super) is_length: bool,
}

/// Reads `MEANING [UNIT], LOWER to UPPER`, and, for a neutral value, `, neutral VALUE`, or, for the duration of an event,
/// `, length of time`.
pub(super) fn parameter(comment: &str) -> Result<About, String> {
    let expected = || {
        format!(
            "expected a doc comment such as `/// share of the grade force [-], -0.3 to 1.3, neutral 0`, found {}",
            if comment.is_empty() { "none".to_owned() } else { format!("`{comment}`") }
        )
    };
    let (meaning, rest) = comment.split_once('[').ok_or_else(expected)?;
    let (unit, rest) = rest.split_once(']').ok_or_else(expected)?;
    let mut parts = rest.split(',').map(str::trim).filter(|part| !part.is_empty());
    let number = |text: &str| text.trim().parse().ok().filter(|x: &f64| x.is_finite());
    let (lower, upper) = parts.next().and_then(|range| range.split_once(" to ")).ok_or_else(expected)?;
    let (lower, upper) = number(lower).zip(number(upper)).ok_or_else(expected)?;
    let (neutral, is_length) = match parts.next() {
        None => (f64::NAN, false),
        Some("length of time") => (f64::NAN, true),
        Some(part) => (part.strip_prefix("neutral").and_then(number).ok_or_else(expected)?, false),
    };
    if parts.next().is_some() {
        return Err(expected());
    }
    if lower >= upper {
        return Err(format!("expected bounds in ascending order, found {lower} to {upper}"));
    }
    if !neutral.is_nan() && !(lower..=upper).contains(&neutral) {
        return Err(format!("expected a neutral value within {lower} to {upper}, found {neutral}"));
    }
    let unit = unit.trim().to_owned();
    if is_length && unit != "s" {
        return Err(format!("expected a length of time in [s], found [{unit}]"));
    }
    Ok(About { meaning: meaning.trim().to_owned(), unit, lower, upper, neutral, is_length })
}

/// Reads `..., starts at VALUE` with a number or one of s, v_f, v_l, a_f.
pub(super) fn initial(comment: &str) -> Result<Initial, String> {
    let start = comment.rsplit_once("starts at ").map(|(_, value)| value.trim().trim_end_matches('.'));
    match start {
        Some("s") => Ok(Initial::Measured(Signal::S)),
        Some("v_f") => Ok(Initial::Measured(Signal::Vf)),
        Some("v_l") => Ok(Initial::Measured(Signal::Vl)),
        Some("a_f") => Ok(Initial::Measured(Signal::Af)),
        Some(number) => number.parse().ok().filter(|x: &f32| x.is_finite()).map(Initial::Value).ok_or_else(|| {
            format!("expected `starts at` a number or a measured signal: s, v_f, v_l or a_f; found `{number}`")
        }),
        None => Err(format!(
            "expected a doc comment that ends in `starts at 0`, or at another number, s, v_f, v_l or a_f; found {}",
            if comment.is_empty() { "none".to_owned() } else { format!("`{comment}`") }
        )),
    }
}

/// The comment at the top of a file: lines that begin with `//!`.
#[derive(Debug, Default)]
pub(super) struct Head {
    pub(super) meaning: String,
    pub(super) cause: Option<Cause>,
    pub(super) reference: Option<String>,
    pub(super) delay: Option<String>,
    pub(super) look_back: Option<String>,
    pub(super) search: Option<SearchKind>,
    pub(super) scale: Scale,
}

/// Keys of the lines about a cause.
const KEYS: [&str; 13] = [
    "in short",
    "equation",
    "family",
    "looks like",
    "confounded with",
    "search",
    "scale",
    "sign",
    "hides",
    "experiment",
    "reference",
    LOOP,
    "tool",
];

/// The key of the lines for the time loop.
const LOOP: &str = "loop";

/// A key has two different values.
fn twice(key: &str) -> String {
    format!("`//! {key}`: expected once, found more than once; remove the others")
}

/// The word of a line that allows only certain words.
fn word<T: FromStr + VariantNames>(key: &str, value: &str) -> Result<T, String> {
    value.parse().map_err(|_| format!("`//! {key}:`: expected {}, found `{value}`", any_of(T::VARIANTS)))
}

impl Head {
    /// `KEY: TEXT` lines are about the cause; everything before the first of them is the meaning. A text without `looks like` is
    /// a cause too if it is not marked `tool`.
    pub(super) fn of(text: &str) -> Result<Head, String> {
        let mut head = Head::default();
        let mut cause = Cause::default();
        let mut tool = false;
        // The last key, for continued lines.
        let mut entries: Vec<(String, String)> = vec![(String::new(), String::new())];
        for line in text.lines().filter_map(|line| line.strip_prefix("//!")) {
            match line.split_once(':').filter(|(key, _)| KEYS.contains(&key.trim())) {
                // The two lines for the loop contradict each other.
                Some((key, _)) if key.trim() != LOOP && entries.iter().any(|(known, _)| known == key.trim()) => {
                    return Err(twice(key.trim()));
                }
                Some((key, value)) => entries.push((key.trim().to_owned(), value.trim().to_owned())),
                None => {
                    let (_, value) = entries.last_mut().expect("there is the first");
                    if !value.is_empty() {
                        value.push(' ');
                    }
                    value.push_str(line.trim());
                }
            }
        }
        for (key, value) in entries {
            match key.as_str() {
                "" => head.meaning = value,
                "in short" => cause.in_short = Some(value),
                "equation" => cause.equation = Some(value),
                "family" => cause.family = Some(value),
                "looks like" => cause.looks_like = value,
                "confounded with" => {
                    cause.confounded_with = value.split(',').map(|name| name.trim().to_owned()).collect();
                }
                "search" => head.search = Some(word(&key, &value)?),
                "scale" => head.scale = word(&key, &value)?,
                "sign" if value == "positive" => cause.positive = true,
                "sign" => return Err(format!("`//! sign:`: expected positive, found `{value}`")),
                "hides" => cause.hides = Some(value),
                "experiment" => cause.experiment = Some(value),
                "reference" => head.reference = Some(value),
                "tool" => tool = true,
                _ => {
                    let (need, parameter) = match value.split_once(" by ") {
                        Some(("delay", parameter)) => (&mut head.delay, parameter),
                        Some(("look back", parameter)) => (&mut head.look_back, parameter),
                        _ => {
                            return Err(format!(
                                "expected `//! loop: delay by NAME` or `//! loop: look back by NAME`, found `//! loop: {value}`"
                            ));
                        }
                    };
                    if need.replace(parameter.trim().to_owned()).is_some() {
                        return Err(twice(LOOP));
                    }
                }
            }
        }
        head.cause = (!tool).then_some(cause);
        Ok(head)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters() {
        let read = parameter("share of the grade force [-], -0.3 to 1.3, neutral 0").expect("as documented");
        let expected = About {
            meaning: "share of the grade force".to_owned(),
            unit: "-".to_owned(),
            lower: -0.3,
            upper: 1.3,
            neutral: 0.0,
            is_length: false,
        };
        assert_eq!(read, expected);
        assert!(parameter("time [s], 0 to 10").expect("no neutral value").neutral.is_nan());
        assert!(parameter("how long [s], 0 to 10, length of time").expect("marked").is_length);
        for bad in [
            "",
            "x [m], 0 to 1, length of time",
            "x [s], 0 to 1, neutral 0, length of time",
            "no unit, 0 to 1",
            "x [m]",
            "x [m], 0 - 1",
            "x [m], 1 to 0",
            "x [m], 0 to 1, neutral 2",
        ] {
            assert!(parameter(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn initial_values() {
        assert_eq!(initial("filtered gap [m], starts at s"), Ok(Initial::Measured(Signal::S)));
        assert_eq!(initial("starts at -0.5"), Ok(Initial::Value(-0.5)));
        assert!(initial("starts at x").is_err());
        assert!(initial("").is_err());
    }

    #[test]
    fn heads() {
        let head = Head::of(
            "//! Pulls\n//! back.\n//! in short: back\n//! equation: a = -a\n//! family: phase\n//! looks like: one\n//! two\n//! loop: delay by tp\nfn x() {}",
        )
        .expect("as documented");
        assert_eq!(head.meaning, "Pulls back.");
        let cause = head.cause.expect("it is one");
        assert_eq!((cause.family.as_deref(), cause.looks_like.as_str()), (Some("phase"), "one two"));
        assert_eq!([cause.in_short.as_deref(), cause.equation.as_deref()], [Some("back"), Some("a = -a")]);
        assert_eq!(head.delay.as_deref(), Some("tp"));
        assert!(Head::of("//! Lead.\n//! tool: nuisance").expect("as documented").cause.is_none());
        for text in ["//! search: size\n//! search: steps", "//! loop: delay by a\n//! loop: delay by b"] {
            let message = Head::of(text).expect_err("two of them");
            assert!(message.contains("expected once, found more than once"), "{message}");
        }
        assert!(Head::of("//! loop: delay by a\n//! loop: look back by b").is_ok());
        let message = Head::of("//! loop: dely by tp").expect_err("misspelt");
        assert!(message.contains("delay by") && message.ends_with("found `//! loop: dely by tp`"), "{message}");
    }
}
