//! The diagnosis of a fleet: the race with one pooled model for the drives of many drivers, each driver left out of one fit.

use crate::diagnose::{DiagnoseError, Effort, Progress, Verdict};
use crate::race::{Answer, Delivered, Policy, Request, combine, race};
use crate::result::diagnosis::{FleetEntry, ModelEntry, Outcome, ShareEntry};
use std::ops::ControlFlow;

/// Diagnoses the drives of a request, whose unit is the driver. The entries on files are the caller's.
///
/// # Errors
/// As [`race`].
pub fn of_fleet(
    request: &Request<'_>,
    effort: Effort,
    progress: &mut (dyn FnMut(Progress) -> ControlFlow<()> + Send),
) -> Result<Outcome, DiagnoseError> {
    if request.drives.is_empty() {
        return Err(DiagnoseError::NoData);
    }
    let answer = race(request, &Policy::FLEET, progress)?;
    let entry = |model: Delivered| {
        let variant = model.causes.iter().try_fold(request.base, |variant, cause| variant.with(cause)).ok()?;
        Some(ModelEntry {
            variant: variant.name(),
            extensions: variant.causes().map(|cause| cause.name.clone()).collect(),
            parameters: model.entries,
            noise: None,
        })
    };
    let (verdict, reason) = match (&answer.tried.not_testable, answer.other_law()) {
        (Some(why), _) => (Verdict::NotTestable, why.clone()),
        (None, Some(law)) => {
            let base = request.base;
            (
                Verdict::Unexplained,
                format!(
                    "{} without causes predicts left-out drivers better over 2 and 15 s than {base} with any cause",
                    law.name
                ),
            )
        }
        (None, None) => {
            (Verdict::Nothing, "no model with a cause follows left-out drivers better than chance allows".to_owned())
        }
    };
    let mut outcome = Outcome {
        verdict,
        reason,
        base_held_back: answer.left_out(),
        not_tried: answer.untried(request),
        base: answer.base().and_then(entry),
        extended: answer.extended().and_then(entry),
        fleet: Some(FleetEntry { share: ShareEntry::of(&answer, request.seed), ..entry_of(request, &answer) }),
        held_back: "Each driver is left out of one of five fits. Gains are those on left-out drivers.".to_owned(),
        ..Outcome::new(effort, request.seed)
    };
    combine(&mut outcome, &answer);
    Ok(outcome)
}

fn entry_of(request: &Request<'_>, answer: &Answer) -> FleetEntry {
    let seconds: f64 = request.drives.iter().map(|drive| drive.samples() as f64 * drive.dt()).sum();
    FleetEntry {
        drivers: answer.units(),
        drives: request.drives.len(),
        minutes: seconds / 60.0,
        unusable: Vec::new(),
        share: None,
    }
}
