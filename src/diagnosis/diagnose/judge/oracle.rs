//! The evidence if the search had found the truth: distinguishes failures of the search from lack of evidence.

use super::Judgement;
use super::evidence::need;
use super::holdout::transfers;
use crate::diagnose::likelihood::fit::{Plan, Point};
use crate::diagnose::likelihood::model::LEAD;
use crate::diagnose::question::{DiagnoseError, Question};
use crate::diagnose::search::base::calibrate_base;
use crate::diagnose::search::fitted_model::{Context, FittedModel};
use crate::diagnose::search::observers::first_noise;
use crate::diagnose::search::search_budget::SearchBudget;
use crate::extension::Extension;
use crate::wgsl::extension_named;
use serde::{Deserialize, Serialize};

/// The planted causes, fitted from the planted values.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Known {
    /// Log-likelihood of the base without causes, and with them \[nats\].
    pub log_likelihoods: [f64; 2],
    /// Evidence \[nats\] as the decision counts it, and the threshold.
    pub evidence: f64,
    /// See `evidence`.
    pub threshold: f64,
    /// Held-out gain of each fold \[nats\].
    pub folds: [f64; 2],
    /// Share of the bootstraps of the hold-out in which the causes gain.
    pub transfers: f64,
    /// Remaining missing acceleration \[m/s²\], and its time constant \[s\].
    pub noise: [f64; 2],
    /// Why the causes would not have been named; empty if they would.
    pub objection: String,
    /// For several causes, by name: the gain of each beside the others on all training data \[nats\]; empty for one cause.
    #[serde(default)]
    pub parts: Vec<f64>,
    /// Estimates by name.
    pub estimates: Vec<(String, f64)>,
}

/// Fits the base of a question without causes, as a diagnosis does, and with causes from known values, by parameter name. The order of the
/// causes does not matter.
///
/// # Errors
/// As [`crate::diagnose::infer()`].
pub fn known(
    question: &Question<'_>,
    causes: &[&'static Extension],
    values: &[(String, f64)],
) -> Result<Option<Known>, DiagnoseError> {
    let mut causes = causes.to_vec();
    causes.sort_by(|a, b| a.name.cmp(&b.name));
    let causes = &causes[..];
    let setting = Context::new(question, extension_named(LEAD));
    let spending = SearchBudget::of(question.effort);
    let Some(base) = calibrate_base(&setting, question.base, &spending)? else { return Ok(None) };
    let base = base.candidate;
    let Some(truth) = fitted_from(&setting, &base, causes, values)? else { return Ok(None) };
    let mut parts = Vec::new();
    for part in causes.iter().filter(|_| causes.len() > 1) {
        let others: Vec<&'static Extension> = causes.iter().copied().filter(|cause| cause != part).collect();
        let without = fitted_from(&setting, &base, &others, values)?;
        let least = without.map_or(base.fit.log_likelihood, |without| without.fit.log_likelihood);
        parts.push(truth.fit.log_likelihood - least.max(base.fit.log_likelihood));
    }
    let inflation = truth.inflation(&setting)?;
    let threshold = need(&setting, inflation, [&base.fit.point.noise, &truth.fit.point.noise], 0.0);
    let (held, base_held) = (truth.cross_fit(&setting)?, base.cross_fit(&setting)?);
    let lead = [extension_named(LEAD).expect("a tool of the library")];
    let judged = if causes.is_empty() { &lead[..] } else { causes };
    // The exemptions of an event do not apply to a cause beside it: the smallest evidence counts, and the first objection to any of them.
    let of =
        |cause: &&'static Extension| Judgement::of(&setting, cause, (&truth, &held), (&base, &base_held), threshold);
    let mut each: Vec<Judgement<'_>> = judged.iter().map(of).collect();
    each.sort_by(|a, b| a.evidence.counts().total_cmp(&b.evidence.counts()));
    let mut alone = None;
    let share = match question.holdout.is_empty() {
        true => 1.0,
        false => transfers(&setting, &truth, judged[0], &base, &mut alone)?.0,
    };
    for judgement in &mut each {
        judgement.ask_holdout(&setting, &mut alone)?;
    }
    let objection = each.iter().find_map(|judgement| judgement.objection.as_ref());
    let evidence = &each[0].evidence;
    Ok(Some(Known {
        log_likelihoods: [base.fit.log_likelihood, truth.fit.log_likelihood],
        evidence: evidence.counts(),
        threshold,
        folds: evidence.folds,
        transfers: share,
        noise: [truth.fit.point.noise.sigma_d, truth.fit.point.noise.tau_d],
        objection: objection.map_or_else(String::new, ToString::to_string),
        parts,
        estimates: truth
            .model
            .symbols
            .iter()
            .zip(&truth.fit.point.values)
            .map(|(symbol, value)| (symbol.name().to_owned(), *value))
            .collect(),
    }))
}

/// The base with causes, fitted from known values.
fn fitted_from(
    setting: &Context<'_>,
    base: &FittedModel,
    causes: &[&'static Extension],
    values: &[(String, f64)],
) -> Result<Option<FittedModel>, DiagnoseError> {
    let mut variant = setting.question.base;
    for cause in causes {
        variant = variant.with(cause)?;
    }
    let model = setting.model(variant, &[])?;
    let calibrated = model.adopt(&base.model, &base.fit.point.values);
    // Two starts: all parameters as planted, and the planted causes added to the calibrated base.
    let (mut planted, mut added) = (calibrated.clone(), calibrated);
    for (name, value) in values {
        if let Some(k) = model.symbols.iter().position(|symbol| symbol.name() == name) {
            planted[k] = value.clamp(model.axes[k].lower, model.axes[k].upper);
            if !model.variant.is_of_base(model.symbols[k]) {
                added[k] = planted[k];
            }
        }
    }
    let strong = first_noise(setting.question.train);
    let free = strong.nearly_free();
    let from =
        |values: &Vec<f64>| [strong, free, base.fit.point.noise].map(|noise| Point { values: values.clone(), noise });
    let starts = [from(&planted), from(&added)].concat();
    let plan = Plan { select: starts.len(), rough: 4, keep: 2, fine: 40, tolerance: 0.1, least: [0.0; 2] };
    FittedModel::fitted(setting, variant, causes, model, &starts, plan)
}
