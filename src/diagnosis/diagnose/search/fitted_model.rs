//! A fitted model, with the data that all fits, scores and comparisons share.

use super::textbook::{fastest, with_textbook_values};
use crate::catalog::Variant;
use crate::diagnose::drive::Drive;
use crate::diagnose::likelihood::fit::{Fit, Plan, Point, Predictor, Prior, fit, fit_with};
use crate::diagnose::likelihood::fold::{folds, whole};
use crate::diagnose::likelihood::model::{Event, LEAD, Model};
use crate::diagnose::likelihood::observer::{Noise, design};
use crate::diagnose::likelihood::robust::{Mask, block_length, blocks, inflation};
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::policy::POLICY;
use crate::diagnose::question::{DiagnoseError, Question};
use crate::extension::Extension;
use crate::symbols::{SearchKind, Symbol};
use std::sync::atomic::{AtomicU64, Ordering};

/// Data, masks and the question; all threads share them.
pub struct Context<'a> {
    pub question: &'a Question<'a>,
    /// All training samples except the first ones of each drive.
    pub whole: Vec<Mask>,
    /// The two folds.
    pub folds: [Vec<Mask>; 2],
    /// The same for the hold-out.
    pub holdout: Vec<Mask>,
    /// The nuisance lead of every model.
    pub lead: Option<&'static Extension>,
    /// Number of simulated candidates so far.
    pub simulations: AtomicU64,
    /// Whether to continue; asked before each fit.
    pub go_on: &'a (dyn Fn() -> Result<(), DiagnoseError> + Sync),
}

impl<'a> Context<'a> {
    /// The context of a question.
    #[must_use]
    pub fn new(question: &'a Question<'a>, lead: Option<&'static Extension>) -> Context<'a> {
        let sizes = |drives: &[Drive]| -> (Vec<usize>, Vec<f64>) {
            (drives.iter().map(Drive::samples).collect(), drives.iter().map(Drive::dt).collect())
        };
        let (samples, dt) = sizes(question.train);
        let (held, held_dt) = sizes(question.holdout);
        Context {
            question,
            whole: whole(&samples, &dt),
            folds: folds(&samples, &dt),
            holdout: whole(&held, &held_dt),
            lead,
            simulations: AtomicU64::new(0),
            go_on: &|| Ok(()),
        }
    }

    /// A model of the training drives, with the nuisance lead.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn model(&self, variant: Variant, events: &[Event]) -> Result<Model, DiagnoseError> {
        Model::new(self.with_lead(variant)?, self.question.train, self.question.bounds, events)
    }

    /// The same over the hold-out drives; there, an event of one recording happens only in the held-back end of this recording.
    pub fn held_out(&self, variant: Variant, events: &[Event]) -> Result<Model, DiagnoseError> {
        let Question { train, holdout, bounds, .. } = *self.question;
        let there = |event: &Event| {
            let own = train.get(event.drive).map(Drive::recording);
            let end = holdout.iter().position(|drive| own.as_ref().is_some_and(|own| *own == drive.recording()));
            Event { drive: end.unwrap_or(usize::MAX), ..*event }
        };
        let events: Vec<Event> = events.iter().map(there).collect();
        Model::new(self.with_lead(variant)?, holdout, bounds, &events)
    }

    /// Number of simulated candidates so far, over one drive each.
    #[must_use]
    pub fn simulated(&self) -> u64 {
        self.simulations.load(Ordering::Relaxed)
    }

    fn with_lead(&self, variant: Variant) -> Result<Variant, DiagnoseError> {
        Ok(match self.lead {
            Some(lead) if variant.extensions.get(&lead.name).is_none() => variant.with(lead)?,
            _ => variant,
        })
    }
}

/// A base with some causes, fitted to all training data.
#[derive(Debug)]
pub struct FittedModel {
    /// The base with the causes, without the nuisance lead.
    pub variant: Variant,
    /// The causes, in the order of adoption.
    pub causes: Vec<&'static Extension>,
    /// The model over the training drives.
    pub model: Model,
    /// The fit to all training data.
    pub fit: Fit,
}

/// Log-likelihood of a candidate on folds that it was not fitted to.
#[derive(Debug, Clone, PartialEq)]
pub struct CrossValidated {
    /// Per fold, drive and block of 30 s.
    pub folds: [Vec<Vec<f64>>; 2],
}

impl CrossValidated {
    /// Gain over another candidate, per fold, and all blocks.
    #[must_use]
    pub fn gain(&self, other: &CrossValidated) -> ([f64; 2], Vec<f64>) {
        let mut folds = [0.0; 2];
        let mut blocks = Vec::new();
        for (k, sum) in folds.iter_mut().enumerate() {
            let pairs = self.folds[k].iter().flatten().zip(other.folds[k].iter().flatten());
            // If both runs fail, the gain is 0; if one fails, the other gains the score of a failed block.
            let gains = pairs.map(|(mine, theirs)| if mine == theirs { 0.0 } else { mine - theirs });
            for gain in gains {
                *sum += gain;
                blocks.push(gain);
            }
        }
        (folds, blocks)
    }
}

/// Score of a block in which a run failed \[nats\]: finite, so that one failed block cannot decide.
const FAILED_BLOCK: f64 = -1e4;
/// Iterations on a fold, from the optimum of all data.
const FOLD_PLAN: Plan = Plan { select: 2, rough: 0, keep: 2, fine: 8, tolerance: 0.1, least: [0.0; 2] };
/// Iterations on data that the model was not fitted to.
pub(crate) const ELSEWHERE: Plan = Plan { select: 2, rough: 4, keep: 2, fine: 12, tolerance: 0.1, least: [0.0; 2] };

impl FittedModel {
    /// Fits a variant from some starts.
    ///
    /// # Errors
    /// As [`fit`]; `None` if every start fails.
    pub fn fitted(
        setting: &Context<'_>,
        variant: Variant,
        causes: &[&'static Extension],
        model: Model,
        starts: &[Point],
        plan: Plan,
    ) -> Result<Option<FittedModel>, DiagnoseError> {
        (setting.go_on)()?;
        let axes = model.axes.clone();
        let before = model.simulations();
        let fits = fit(&model, &axes, &setting.whole, starts, plan)?;
        setting.simulations.fetch_add(model.simulations() - before, Ordering::Relaxed);
        let best = fits.into_iter().next();
        Ok(best.map(|fit| FittedModel { variant, causes: causes.to_vec(), model, fit }))
    }

    /// The log-likelihood of each fold under the fit to the other one. Times of events stay at the fit to all data. So do all parameters of
    /// a cause that acts in one stretch only: it happens once, so it cannot be held out.
    ///
    /// # Errors
    /// As [`fit`].
    pub fn cross_fit(&self, setting: &Context<'_>) -> Result<CrossValidated, DiagnoseError> {
        let mut axes = self.model.axes.clone();
        let local = self.causes.iter().filter(|cause| is_local(cause)).flat_map(|cause| self.model.positions(cause));
        let times = (0..axes.len()).filter(|&k| self.model.symbols[k].is_time());
        for k in times.chain(local) {
            let value = self.fit.point.values[k];
            axes[k] = Axis::held(value);
        }
        let prior = self.prior();
        let before = self.model.simulations();
        let mut held = [Vec::new(), Vec::new()];
        for (fold, held) in held.iter_mut().enumerate() {
            (setting.go_on)()?;
            let start = [self.fit.point.clone()];
            let fits = fit_with(&self.model, &axes, &setting.folds[1 - fold], &start, FOLD_PLAN, prior.as_ref())?;
            let point = fits.first().map_or(&self.fit.point, |fit| &fit.point).clone();
            let point = with_own_noise(&self.model, point, &setting.folds[fold])?;
            *held = scored(&self.model, &point, &setting.folds[fold])?;
        }
        setting.simulations.fetch_add(self.model.simulations() - before, Ordering::Relaxed);
        Ok(CrossValidated { folds: held })
    }

    /// The prior of a fold from all data. If the fold hardly determines a parameter of the base, the prior keeps it near its value;
    /// otherwise the parameter would run away and the other fold would show only that. Causes have no prior.
    fn prior(&self) -> Option<Prior> {
        let information = &self.fit.information;
        if information.is_empty() {
            return None;
        }
        let lead = |k: usize| matches!(self.model.symbols[k], Symbol::Extension(row) if row.extension == LEAD);
        let borrows = |k: usize| self.model.symbols.get(k).is_none_or(|s| self.model.variant.is_of_base(*s) || lead(k));
        let weight =
            |j: usize, k: usize| if borrows(j) && borrows(k) { POLICY.borrowed * information[(j, k)] } else { 0.0 };
        let information = nalgebra::DMatrix::from_fn(information.nrows(), information.ncols(), weight);
        Some(Prior { centre: self.fit.coordinates.clone(), information })
    }

    /// The model on the hold-out: causes as trained, base and noise refitted. A base parameter that training leaves open, such as a set
    /// speed that no training drive reaches, then does not count against a cause; a base that absorbs the cause does. The search also
    /// starts from textbook values of free driving, and from the fit of another model: a model must not lose because its optimum was
    /// missed.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn transfer(&self, setting: &Context<'_>, other: Option<&Transferred>) -> Result<Transferred, DiagnoseError> {
        let model = setting.held_out(self.variant, &self.model.events)?;
        let point = &self.fit.point;
        let mut axes = model.axes.clone();
        let mut starts = elsewhere(point).to_vec();
        let fastest = fastest(setting.question.holdout);
        let noise = point.noise.strong();
        starts.push(Point { values: with_textbook_values(&model, &point.values, fastest), noise });
        if let Some(Transferred { model: theirs, point }) = other {
            let values = model.adopt(theirs, &point.values);
            starts.extend(elsewhere(&Point { values, noise: point.noise }));
        }
        for k in self.causes.iter().flat_map(|cause| model.positions(cause)) {
            axes[k] = Axis::held(point.values[k]);
            starts.iter_mut().for_each(|start| start.values[k] = point.values[k]);
        }
        let plan = Plan { select: starts.len(), keep: starts.len(), ..ELSEWHERE };
        let fits = fit(&model, &axes, &setting.holdout, &starts, plan)?;
        let point = fits.into_iter().next().map_or_else(|| point.clone(), |fit| fit.point);
        setting.simulations.fetch_add(model.simulations(), Ordering::Relaxed);
        Ok(Transferred { model, point })
    }

    /// Inflation of thresholds by the correlation of the innovations.
    ///
    /// # Errors
    /// As [`Predictor::residuals`].
    pub fn inflation(&self, setting: &Context<'_>) -> Result<f64, DiagnoseError> {
        let (mut residuals, mut designs) = (Vec::new(), Vec::new());
        for (drive, (samples, dt)) in self.model.drives().into_iter().enumerate() {
            let designed = design(&self.fit.point.noise, dt);
            let run = self.model.runs(drive, std::slice::from_ref(&self.fit.point.values), &[designed])?.remove(0);
            residuals.push(run.unwrap_or_else(|| vec![[0.0; 2]; samples]));
            designs.push(designed);
        }
        Ok(inflation(&residuals, &designs, &setting.whole))
    }

    /// Fitted value of a parameter.
    #[must_use]
    pub fn value(&self, name: &str) -> Option<f64> {
        let k = self.model.symbols.iter().position(|symbol| symbol.name() == name)?;
        Some(self.fit.point.values[k])
    }
}

/// True for a cause that acts in one stretch only, that is, has a start and a length.
#[must_use]
pub fn is_local(cause: &Extension) -> bool {
    cause.search() == SearchKind::Stretch
}

/// A candidate on the hold-out.
#[derive(Debug)]
pub struct Transferred {
    model: Model,
    point: Point,
}

impl Transferred {
    /// Log-likelihood per drive and block.
    ///
    /// # Errors
    /// As [`Predictor::residuals`].
    pub fn scores(&self, setting: &Context<'_>) -> Result<Vec<Vec<f64>>, DiagnoseError> {
        scored(&self.model, &self.point, &setting.holdout)
    }

    /// Change by a cause there \[nats\], per block: its expected gain if it is real. A cap that the hold-out never reaches changes nothing,
    /// whatever the truth. Infinite if a run fails.
    pub fn changed_by(&self, setting: &Context<'_>, cause: &Extension) -> Result<Vec<f64>, DiagnoseError> {
        let Transferred { model, point } = self;
        let mut without = point.values.clone();
        for k in model.positions(cause) {
            let Axis { lower, upper, .. } = model.axes[k];
            without[k] = model.symbols[k].neutral().unwrap_or(without[k]).clamp(lower, upper);
        }
        let mut changes = Vec::new();
        for (drive, ((samples, dt), mask)) in model.drives().into_iter().zip(&setting.holdout).enumerate() {
            let designed = design(&point.noise, dt);
            let runs = model.runs(drive, &[point.values.clone(), without.clone()], &[designed, designed])?;
            let length = block_length(dt);
            let mut sums = vec![0.0; samples.div_ceil(length)];
            match &runs[..] {
                [Some(with), Some(without)] => {
                    for (t, (a, b)) in with.iter().zip(without).enumerate().filter(|(t, _)| mask[*t]) {
                        let z = designed.white([a[0] - b[0], a[1] - b[1]]);
                        sums[t / length] += 0.5 * (z[0] * z[0] + z[1] * z[1]);
                    }
                }
                _ => sums.fill(f64::INFINITY),
            }
            changes.append(&mut sums);
        }
        Ok(changes)
    }
}

/// The same parameters with the noise of other data. A complete model is close to a free simulation, which other data punish for every
/// small error of a parameter; an incomplete model benefits from a strong observer.
fn with_own_noise(model: &Model, point: Point, masks: &[Mask]) -> Result<Point, DiagnoseError> {
    let axes: Vec<Axis> = point.values.iter().map(|value| Axis::held(*value)).collect();
    let fits = fit(model, &axes, masks, &elsewhere(&point), ELSEWHERE)?;
    Ok(fits.into_iter().next().map_or(point, |fit| fit.point))
}

/// Starts on other data: with the fitted noise, and with a strong observer, because a search that starts with almost no noise converges
/// slowly.
fn elsewhere(point: &Point) -> [Point; 2] {
    let noise = Noise { sigma_d: point.noise.sigma_d.max(0.1), tau_d: 2.0, ..point.noise };
    [point.clone(), Point { noise, ..point.clone() }]
}

/// Robust log-likelihood per drive and block of 30 s at a point.
pub(crate) fn scored(model: &Model, point: &Point, masks: &[Mask]) -> Result<Vec<Vec<f64>>, DiagnoseError> {
    let mut all = Vec::new();
    for (drive, ((samples, dt), mask)) in model.drives().into_iter().zip(masks).enumerate() {
        let designed = design(&point.noise, dt);
        let run = model.runs(drive, std::slice::from_ref(&point.values), &[designed])?.remove(0);
        let failed = || blocks(&vec![[0.0; 2]; samples], &designed, mask, dt).iter().map(|_| FAILED_BLOCK).collect();
        all.push(run.map_or_else(failed, |run| blocks(&run, &designed, mask, dt)));
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::diagnose::{Effort, made_up};
    use crate::wgsl::extension_named;

    /// A recording with a held-back end, and another file.
    #[test]
    fn an_event_happens_in_the_held_back_end_of_its_recording_only() {
        let train = [made_up::drive("other.csv", 0.0), made_up::drive("mine.csv", 0.0)];
        let holdout = [made_up::drive("third.csv", 0.0), made_up::drive("mine.csv", 120.0)];
        let cause = extension_named("headway_mode_change").expect("in the library");
        let base: Variant = "l-cth".parse().expect("a base");
        let (bounds, causes) = (Overrides::new(), [cause]);
        let question = Question {
            train: &train,
            holdout: &holdout,
            base,
            effort: Effort::Quick,
            seed: 1,
            causes: &causes,
            bounds: &bounds,
        };
        let setting = Context::new(&question, None);
        let drive = |of: usize| {
            let events = [Event { extension: cause, drive: of }];
            setting.held_out(base.with(cause).expect("they go together"), &events).expect("a model").events[0].drive
        };
        assert_eq!([drive(1), drive(0)], [1, usize::MAX]);
    }
}
