//! Calibrates the base model with its noise. The search is global, because a bad calibration of the base leads to false names.

use super::fitted_model::{Context, FittedModel};
use super::observers::{first_noise, softened};
use super::screen::own_share;
use super::search_budget::SearchBudget;
use super::textbook::{fastest, with_textbook_values};
use crate::catalog::Variant;
use crate::diagnose::likelihood::fit::{Plan, Point};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::policy::POLICY;
use crate::diagnose::question::DiagnoseError;
use crate::optimize::stream;
use crate::symbols::Symbol;
use rand::RngExt;

/// Largest number of replicates; fewer if two agree.
const REPLICATES: u64 = 4;
/// Replicates agree if their likelihoods are this close \[nats\].
const AGREE: f64 = 5.0;

/// A calibrated base.
#[derive(Debug)]
pub struct Calibrated {
    /// The likeliest fit.
    pub candidate: FittedModel,
    /// Log-likelihoods of the replicates, the best first.
    pub replicates: Vec<f64>,
}

/// Fits a variant without causes, first from random populations under a strong observer, then with its noise free, from the best of these
/// and from a nearly free simulation. `None` if every candidate fails.
///
/// # Errors
/// As [`FittedModel::fitted`].
pub fn calibrate_base(
    setting: &Context<'_>,
    variant: Variant,
    spending: &SearchBudget,
) -> Result<Option<Calibrated>, DiagnoseError> {
    let mut best: Option<FittedModel> = None;
    let mut replicates = Vec::new();
    for replicate in 0..REPLICATES {
        let Some(found) = calibrate_once(setting, variant, spending, replicate)? else { continue };
        replicates.push(found.fit.log_likelihood);
        if best.as_ref().is_none_or(|best| found.fit.log_likelihood > best.fit.log_likelihood) {
            best = Some(found);
        }
        replicates.sort_by(|a, b| b.total_cmp(a));
        if replicates.len() > 1 && replicates[0] - replicates[1] < AGREE {
            break;
        }
    }
    Ok(best.map(|candidate| Calibrated { candidate, replicates }))
}

/// One replicate of [`calibrate_base`].
///
/// # Errors
/// As [`FittedModel::fitted`].
pub fn calibrate_once(
    setting: &Context<'_>,
    variant: Variant,
    spending: &SearchBudget,
    replicate: u64,
) -> Result<Option<FittedModel>, DiagnoseError> {
    let noise = first_noise(setting.question.train);
    let model = match setting.model(variant, &[]) {
        // Another base may need data that this follower lacks.
        Err(DiagnoseError::Case(_)) if variant.base != setting.question.base.base => return Ok(None),
        model => model?,
    };
    let starts = population(&model, &noise, setting.question.seed, replicate, spending.population);
    // Precise sensors make the likelihood rugged: use ordinary noise in the rough search, and the real noise in the refinement.
    let least = softened(&noise, 1.0).map_or([0.0; 2], |soft| [soft.r_s, soft.r_v]);
    let rough = FittedModel::fitted(setting, variant, &[], model, &starts, Plan { least, ..spending.base })?;
    rough.map(|rough| refined(setting, rough, spending)).transpose()
}

/// Random candidates within the bounds; the draws depend on the seed only.
fn population(model: &Model, noise: &Noise, seed: u64, replicate: u64, count: usize) -> Vec<Point> {
    let point = |i: usize| {
        let mut rng = stream(seed, replicate, 0, i as u64);
        // Away from the bounds, where derivatives are one-sided.
        let values = model.axes.iter().map(|axis| axis.value(0.02 + 0.96 * rng.random::<f64>())).collect();
        Point { values, noise: *noise }
    };
    (0..count).map(point).collect()
}

fn refined(setting: &Context<'_>, rough: FittedModel, spending: &SearchBudget) -> Result<FittedModel, DiagnoseError> {
    let FittedModel { variant, causes, model, fit } = rough;
    let measured = first_noise(setting.question.train);
    let noise = match softened(&measured, 1.0) {
        Some(_) => Noise { r_s: measured.r_s, r_v: measured.r_v, ..fit.point.noise },
        None => fit.point.noise,
    };
    let free = noise.freer();
    // A slow and large missing acceleration compensates for all errors of the rough fit; with textbook values it cannot.
    let fastest = fastest(setting.question.train);
    let generic = with_textbook_values(&model, &fit.point.values, fastest);
    let strong = noise.strong();
    let mut starts = [noise, free].map(|noise| Point { noise, ..fit.point.clone() }).to_vec();
    starts.extend([strong, free].map(|noise| Point { values: generic.clone(), noise }));
    let plan = Plan { select: starts.len(), rough: 6, keep: 2, ..spending.base };
    let found = FittedModel::fitted(setting, variant, &causes, model, &starts, plan)?;
    match found {
        Some(found) => Ok(found),
        // Under a noise other than that of its fit, a model that is far off may fail.
        None => Ok(FittedModel { variant, causes, model: setting.model(variant, &[])?, fit }),
    }
}

/// Why a calibrated base cannot be trusted: parameters that the data contradict. `None` if none does.
#[must_use]
pub fn contradiction(setting: &Context<'_>, candidate: &FittedModel) -> Option<String> {
    let mut speeds: Vec<f64> = setting.question.train.iter().flat_map(|d| d.trajectory.v_f.iter().copied()).collect();
    speeds.sort_by(f64::total_cmp);
    let seen = speeds[((1.0 - POLICY.faster) * (speeds.len() - 1) as f64) as usize];
    if let Some(v_0) = candidate.value("v_0")
        && v_0 < seen - POLICY.faster_by
    {
        let axis = candidate.model.position(Symbol::v_0).map(|k| candidate.model.axes[k]);
        let advice = match axis.filter(|axis| axis.upper > seen && !axis.is_fixed()) {
            Some(axis) => format!(", though its bounds {} to {} m/s allow more; take", axis.lower, axis.upper),
            None => "; widen the bounds of v_0, or take".to_owned(),
        };
        return Some(format!(
            "the calibrated desired speed v_0 = {v_0:.2} m/s lies below speeds that the follower drives ({seen:.2} m/s){advice} another \
             base model"
        ));
    }
    for (k, axis) in candidate.model.axes.iter().enumerate() {
        let symbol = candidate.model.symbols[k];
        // The decision checks bounds of causes; the time of an event does not concern the base.
        if !candidate.model.variant.is_of_base(symbol)
            || !axis.at_bound(candidate.fit.point.values[k])
            || candidate.fit.gradient.is_empty()
        {
            continue;
        }
        let outwards = if candidate.fit.coordinates[k] < 0.5 { 1.0 } else { -1.0 };
        let promise = behind(candidate, k, candidate.fit.gradient[k] * outwards);
        if promise > POLICY.promise {
            return Some(format!(
                "{} lies on its bound {} {}, and the fit improves beyond it ({promise:.0} nats within a tenth of its range); widen its \
                 bounds, or take another base model",
                symbol.name(),
                candidate.fit.point.values[k],
                symbol.unit()
            ));
        }
    }
    None
}

/// Gain of a parameter on its bound within a tenth of its range beyond the bound \[nats\], with the others refitted; `slope` is that of the
/// log-likelihood there.
fn behind(candidate: &FittedModel, k: usize, slope: f64) -> f64 {
    let curvature = candidate.fit.information[(k, k)] * own_share(candidate, &[], k).0;
    let step = (slope / curvature.max(f64::MIN_POSITIVE)).clamp(0.0, 0.1);
    step * (slope - 0.5 * curvature * step)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::diagnose::likelihood::space::Axis;
    use crate::diagnose::made_up;

    #[test]
    fn bounds_are_to_be_widened_only_where_they_hold_the_speed_back() {
        let drives = [made_up::drive("a.csv", 0.0)];
        let bounds = Overrides::new();
        let question = made_up::question(&drives, &[], &bounds);
        let setting = Context::new(&question, None);
        let advice = |[lower, upper]: [f64; 2]| {
            let mut candidate = made_up::candidate(&drives, &[]);
            let k = candidate.model.position(Symbol::v_0).expect("it has one");
            candidate.model.space.axes[k] = Axis::linear(lower, upper);
            candidate.fit.point.values[k] = 12.0;
            contradiction(&setting, &candidate).expect("the follower drives up to 23 m/s")
        };
        let held = advice([8.0, 12.0]);
        assert!(held.ends_with("; widen the bounds of v_0, or take another base model"), "{held}");
        let free = advice([5.0, 60.0]);
        assert!(free.ends_with(", though its bounds 5 to 60 m/s allow more; take another base model"), "{free}");
    }

    /// A slope of 500 nats per range promises 50 within a tenth of it, but 2.5 if the optimum is a hundredth beyond the bound.
    #[test]
    fn an_optimum_just_behind_a_bound_promises_little() {
        let drives = [made_up::drive("a.csv", 0.0)];
        let mut candidate = made_up::candidate(&drives, &[]);
        let n = candidate.model.axes.len();
        let mut promise = |curvature: f64| {
            candidate.fit.information = nalgebra::DMatrix::identity(n, n) * curvature;
            behind(&candidate, 0, 500.0)
        };
        assert!((promise(1e-6) - 50.0).abs() < 1e-6);
        assert!((promise(5e4) - 2.5).abs() < 1e-6);
    }
}
