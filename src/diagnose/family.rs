//! Other base models, without any cause: a chain of large causes can imitate another law, and only this comparison shows it.

use super::base::calibrate_once;
use super::candidate::{Candidate, Setting};
use super::spending::Spending;
use super::verdict::DiagnoseError;
use crate::catalog::{BASES, Base, Variant};
use crate::extension::Extensions;
use rayon::prelude::*;

/// The other base models with the same delay, dynamics and constraint, calibrated once; the likeliest comes first.
///
/// # Errors
/// As [`calibrate_once`].
pub fn others(setting: &Setting<'_>, spending: &Spending) -> Result<Vec<Candidate>, DiagnoseError> {
    let own = setting.question.base;
    let calibrated = |base: &&Base| {
        let variant = Variant { base: **base, extensions: Extensions::NONE, ..own };
        calibrate_once(setting, variant, spending, 0)
    };
    let bases: Vec<&Base> = BASES.iter().filter(|base| **base != own.base).collect();
    let found: Result<Vec<Option<Candidate>>, DiagnoseError> = bases.par_iter().map(calibrated).collect();
    let mut found: Vec<Candidate> = found?.into_iter().flatten().collect();
    found.sort_by(|a, b| b.fit.log_likelihood.total_cmp(&a.fit.log_likelihood));
    Ok(found)
}
