//! Other base models without causes: a chain of large causes can imitate another law, and only this comparison shows it.

use crate::catalog::{BASES, Base, Variant};
use crate::diagnose::question::DiagnoseError;
use crate::diagnose::search::base::calibrate_once;
use crate::diagnose::search::fitted_model::{Context, FittedModel};
use crate::diagnose::search::search_budget::SearchBudget;
use crate::extension::Extensions;
use rayon::prelude::*;

/// The other base models with the same delay, dynamics and constraint, each calibrated once; the likeliest comes first.
///
/// # Errors
/// As [`calibrate_once`].
pub fn others(setting: &Context<'_>, spending: &SearchBudget) -> Result<Vec<FittedModel>, DiagnoseError> {
    let own = setting.question.base;
    let calibrated = |base: &&Base| {
        let variant = Variant { base: **base, extensions: Extensions::NONE, ..own };
        calibrate_once(setting, variant, spending, 0)
    };
    let bases: Vec<&Base> = BASES.iter().filter(|base| **base != own.base).collect();
    let found: Result<Vec<Option<FittedModel>>, DiagnoseError> = bases.par_iter().map(calibrated).collect();
    let mut found: Vec<FittedModel> = found?.into_iter().flatten().collect();
    found.sort_by(|a, b| b.fit.log_likelihood.total_cmp(&a.fit.log_likelihood));
    Ok(found)
}
