//! The decision on a cause that was tried, and the reason for a rejection.

use std::fmt;

/// Why a cause that gains is not named. `Display` follows "it is not the cause: ".
#[derive(Debug, Clone, PartialEq)]
pub enum Rejection {
    /// Its evidence does not exceed the threshold \[nats\].
    Weak {
        /// Its evidence.
        evidence: f64,
        /// The threshold.
        need: f64,
    },
    /// Fitted on one fold, it does not gain on the other.
    OneFold,
    /// Its size has a sign that only another effect can have.
    WrongSign(Size),
    /// Its size lies on a bound.
    OnBound(Size),
    /// Other parameters absorb most of its effect.
    Absorbed {
        /// Their names.
        by: Vec<String>,
    },
    /// It gains in too few bootstraps of the hold-out.
    NoTransfer {
        /// That share.
        share: f64,
    },
}

/// A parameter of a cause with its value.
#[derive(Debug, Clone, PartialEq)]
pub struct Size {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: String,
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} = {:.3} {}", self.name, self.value, self.unit)
    }
}

impl fmt::Display for Rejection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Rejection::Weak { evidence, need } => write!(f, "{evidence:.1} nats, {need:.1} needed"),
            Rejection::OneFold => f.write_str("it loses on one of the two folds"),
            Rejection::WrongSign(size) => write!(f, "{size} has the wrong sign"),
            Rejection::OnBound(size) => write!(f, "{size} lies on its bound"),
            Rejection::Absorbed { by } => write!(f, "a calibration absorbs it in {}", by.join(", ")),
            Rejection::NoTransfer { share } => {
                write!(f, "it gains in only {:.0} % of the bootstraps of the hold-out", 100.0 * share)
            }
        }
    }
}

/// The decision on a cause in a round. `Display` is the text in a diagnosis.
#[derive(Debug, Clone, PartialEq)]
pub enum Decision {
    /// It gains too little to be cross-fitted.
    Screened,
    /// It gains enough, but other causes filled the list of those to cross-fit.
    NotListed {
        /// Number of causes that are cross-fitted.
        listed: usize,
    },
    /// A check rejected it.
    Stopped(Rejection),
    /// The adopted one is likelier.
    LessLikely,
    /// A cause that a calibration absorbs is likelier.
    LessLikelyThanAbsorbed {
        /// The name of that cause.
        other: String,
    },
    /// It is a rival of the adopted one.
    AsLikely {
        /// The name of the adopted cause.
        adopted: String,
    },
    /// It is no likelier than the adopted one, and has more parameters.
    NoBetter {
        /// The name of the adopted cause.
        adopted: String,
    },
    /// It became part of the model.
    Adopted,
    /// It was adopted, and dropped for this reason beside a later one.
    Dropped(Rejection),
}

impl Decision {
    /// The decision on a cause that is not cross-fitted; `hopeful` if it gains enough, `listed` is the number of causes that are.
    pub(crate) fn unjudged(hopeful: bool, listed: usize) -> Decision {
        if hopeful { Decision::NotListed { listed } } else { Decision::Screened }
    }

    /// True while it is part of the model.
    #[must_use]
    pub fn is_adopted(&self) -> bool {
        matches!(self, Decision::Adopted)
    }
}

impl fmt::Display for Decision {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Decision::Screened => f.write_str("gains too little on all training data"),
            Decision::NotListed { listed } => write!(f, "not judged: {listed} others gain more on all training data"),
            Decision::Stopped(objection) => objection.fmt(f),
            Decision::LessLikely => f.write_str("less likely than the adopted one"),
            Decision::LessLikelyThanAbsorbed { other } => write!(f, "less likely than {other}, which is absorbed"),
            Decision::AsLikely { adopted } => write!(f, "as likely as {adopted}, within the margin"),
            Decision::NoBetter { adopted } => write!(f, "no likelier than {adopted}, which has fewer parameters"),
            Decision::Adopted => f.write_str("adopted"),
            Decision::Dropped(objection) => write!(f, "dropped later: {objection}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_short_list_is_not_said_to_be_a_small_gain() {
        let said = |hopeful: bool| Decision::unjudged(hopeful, 5).to_string();
        assert_eq!(said(true), "not judged: 5 others gain more on all training data");
        assert_eq!(said(false), "gains too little on all training data");
    }
}
