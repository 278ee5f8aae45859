//! Other base models, without any cause: a chain of large causes can imitate another law, and only this comparison shows it.

use super::base::calibrate_once;
use super::candidate::{Candidate, Setting};
use super::screen::Spending;
use super::verdict::DiagnoseError;
use crate::catalog::{BASES, Variant};
use crate::extension::Extensions;

/// The other base models with the same delay, dynamics and constraint, calibrated once; the likeliest comes first.
///
/// # Errors
/// As [`calibrate_once`].
pub fn others(setting: &Setting<'_>, spending: &Spending) -> Result<Vec<Candidate>, DiagnoseError> {
    let own = setting.question.base;
    let mut found = Vec::new();
    for base in BASES.iter().filter(|base| **base != own.base) {
        let variant = Variant { base: *base, extensions: Extensions::NONE, ..own };
        found.extend(calibrate_once(setting, variant, spending, 0)?);
    }
    found.sort_by(|a, b| b.fit.log_likelihood.total_cmp(&a.fit.log_likelihood));
    Ok(found)
}
