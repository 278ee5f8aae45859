//! The first and the next action that a result recommends to its reader.

use super::Outcome;
use crate::diagnose::Verdict;
use crate::diagnose::drive::drivers::DIFFERENT;
use crate::text::option::{FROM, TO};

impl Outcome {
    /// The action before the verdict, if the data are at fault.
    #[must_use]
    pub fn data_first(&self) -> Option<String> {
        if self.data.iter().any(|entry| entry.units.is_some()) {
            return Some(
                "The units of the data contradict each other (section 1): correct this first; until then, no size or verdict is reliable"
                    .to_owned(),
            );
        }
        if self.data_findings.iter().any(|finding| finding.name == DIFFERENT) {
            return Some(
                "These drives probably have different drivers (section 1), and a named cause may only compensate for that: \
                 diagnose each driver separately"
                    .to_owned(),
            );
        }
        if self.has_bad_data() {
            return Some(
                "Gap and speeds contradict each other (section 1): correct this first; until then, no verdict is reliable"
                    .to_owned(),
            );
        }
        // The base is not at fault if the gap is physically impossible.
        let broken = self.data_findings.iter().any(|f| f.name == "inconsistent");
        let shaken = matches!(self.verdict, Verdict::BadBase | Verdict::Unexplained);
        (broken && shaken).then(|| {
            format!(
                "The data are broken (section 1: INCONSISTENT), and no base model can follow them: correct the data first (section 1), or \
                 select the sound part with {FROM} and {TO}"
            )
        })
    }

    /// The base model to continue with if the car follows another law, as `--base` takes it.
    #[must_use]
    pub fn likelier_base(&self) -> Option<String> {
        let family = self.left_over.iter().find(|left| left.kind == "family")?;
        let base = &self.base.as_ref()?.variant;
        let rest = base.split_once('+').map_or(String::new(), |(_, rest)| format!("+{rest}"));
        Some(format!("{}{rest}", family.r#where))
    }
}
