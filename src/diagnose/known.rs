//! What the evidence would have been, had the search found the truth: tells failures of search from failures of evidence.

use super::base::calibrate_base;
use super::candidate::{Candidate, LEAD, Setting};
use super::decide::{Evidence, gate, need, proxy, transfers};
use super::fit::{Plan, Point};
use super::screen::Spending;
use super::start::{NEARLY_FREE, first_noise};
use super::verdict::{DiagnoseError, Question};
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
    /// Without the two best blocks.
    pub trimmed: f64,
    /// Share of the bootstraps of the hold-out in which the causes gain.
    pub transfers: f64,
    /// Missing acceleration that is left \[m/s²\], and its time constant \[s\].
    pub noise: [f64; 2],
    /// Why the causes would not have been named; empty if they would.
    pub objection: String,
    /// Estimates by name.
    pub estimates: Vec<(String, f64)>,
}

/// Fits the base of a question without causes, as a diagnosis does, and with them from known values, by the parameter's name.
///
/// # Errors
/// As [`super::infer`].
pub fn known(
    question: &Question<'_>,
    causes: &[&'static Extension],
    values: &[(String, f64)],
) -> Result<Option<Known>, DiagnoseError> {
    let setting = Setting::new(question, extension_named(LEAD));
    let spending = Spending::of(question.effort);
    let Some(base) = calibrate_base(&setting, question.base, &spending)? else { return Ok(None) };
    let mut base = base.candidate;
    let mut variant = question.base;
    for cause in causes {
        variant = variant.with(cause)?;
    }
    let model = setting.model(variant, &[])?;
    let mut start = model.adopt(&base.model, &base.fit.point.values);
    for (name, value) in values {
        if let Some(k) = model.symbols.iter().position(|symbol| symbol.name() == name) {
            start[k] = value.clamp(model.axes[k].lower, model.axes[k].upper);
        }
    }
    let strong = first_noise(question.train);
    let free = super::observer::Noise { sigma_d: NEARLY_FREE.0, tau_d: NEARLY_FREE.1, ..strong };
    let starts = [strong, free, base.fit.point.noise].map(|noise| Point { values: start.clone(), noise });
    let plan = Plan { select: 3, kinds: 1, rough: 4, keep: 2, fine: 40, tolerance: 0.1, least: [0.0; 2] };
    let Some(mut truth) = Candidate::fitted(&setting, variant, causes, model, &starts, plan)? else { return Ok(None) };
    let inflation = truth.inflation(&setting)?;
    let threshold = need(&setting, inflation, &base.fit.point.noise, 0);
    let (held, base_held) = (truth.cross_fit(&setting)?, base.cross_fit(&setting)?);
    let cause = causes.first().copied().unwrap_or_else(|| extension_named(LEAD).expect("a tool of the library"));
    let evidence = Evidence::of(&setting, &truth, cause, &held, &base, &base_held);
    let (share, _) = transfers(&setting, &truth, cause, &base)?;
    let objection = match evidence.objection(threshold).or_else(|| proxy(&truth, cause)) {
        Some(objection) => objection,
        None => gate(&setting, &truth, cause, &base)?.unwrap_or_default(),
    };
    Ok(Some(Known {
        log_likelihoods: [base.fit.log_likelihood, truth.fit.log_likelihood],
        evidence: evidence.counts(),
        threshold,
        folds: evidence.folds,
        trimmed: evidence.trimmed,
        transfers: share,
        noise: [truth.fit.point.noise.sigma_d, truth.fit.point.noise.tau_d],
        objection,
        estimates: truth
            .model
            .symbols
            .iter()
            .zip(&truth.fit.point.values)
            .map(|(symbol, value)| (symbol.name().to_owned(), *value))
            .collect(),
    }))
}
