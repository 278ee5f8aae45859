//! How to search for a cause: one strategy for each kind.

mod event;
mod harmonic;
mod hold;
mod integral;
mod limit;
mod scan;
mod size;
mod steps;
mod stretch;

pub use size::sizes;

use super::fitted_model::{Context, FittedModel};
use super::observers::softened;
use super::search_budget::SearchBudget;
use super::skipped::Untried;
use super::textbook::with_textbook_values;
use crate::catalog::Variant;
use crate::diagnose::likelihood::fit::{Plan, Point, profiled};
use crate::diagnose::likelihood::model::{Event, Model};
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::likelihood::space::Axis;
use crate::diagnose::question::DiagnoseError;
use crate::evaluator::CaseError;
use crate::extension::Extension;
use crate::symbols::SearchKind;
use scan::highest;
use std::sync::atomic::Ordering;

/// The strategy for one kind of cause.
pub trait Search: Sync {
    /// The scopes of a cause, with the starts of their fits.
    ///
    /// # Errors
    /// [`Stop`].
    fn starts(&self, task: &Task<'_>) -> Result<Vec<Scope>, Stop>;

    /// The best fit from the starts of a scope.
    fn refine(&self, task: &Task<'_>, scope: Scope) -> Result<Option<FittedModel>, DiagnoseError> {
        task.fitted(scope, 1.0)
    }
}

/// The strategy of a kind.
fn strategy(kind: SearchKind) -> &'static dyn Search {
    match kind {
        SearchKind::Size => &size::Size,
        SearchKind::Limit => &limit::Limit,
        SearchKind::Steps => &steps::Steps,
        SearchKind::Event => &event::AtATime,
        SearchKind::Stretch => &stretch::Stretch,
        SearchKind::Harmonic => &harmonic::Harmonic,
        SearchKind::Integral => &integral::Integral,
    }
}

/// The reason why a search ended without a fit.
#[derive(Debug)]
pub enum Stop {
    /// The cause cannot be tried here.
    Untried(Untried),
    /// The diagnosis cannot continue.
    Failed(DiagnoseError),
}

impl From<DiagnoseError> for Stop {
    fn from(error: DiagnoseError) -> Stop {
        Stop::Failed(error)
    }
}

/// Values of some parameters, by their positions in a model.
pub type Values = Vec<(usize, f64)>;

/// A cause to be tried on top of the present model.
pub struct Task<'a> {
    /// Data and question.
    pub setting: &'a Context<'a>,
    /// The present model.
    pub current: &'a FittedModel,
    pub cause: &'static Extension,
    /// The variant of the present model with the cause.
    pub variant: Variant,
    /// The missing acceleration of the present model, per drive \[m/s²\].
    pub missing: &'a [Vec<f64>],
    pub budget: &'a SearchBudget,
    /// The largest speed of the follower \[m/s\].
    pub fastest: f64,
}

/// The scope of a cause, with the starts of its fits.
#[derive(Debug)]
pub struct Scope {
    /// The model with the cause, over all drives.
    pub model: Model,
    /// Where its fits start.
    pub starts: Vec<Point>,
    /// Fits of the rest with a fixed size. Under a strong observer they are compared only with each other.
    pub held: Vec<Point>,
    /// True if these starts must not compete with those of other scopes, which would be ahead at first.
    pub alone: bool,
    /// Log-likelihood that it promises under the present observer and under a nearly free one \[nats\].
    pub promise: [f64; 2],
}

impl Task<'_> {
    /// The model with the cause, over all drives or as an event of one.
    ///
    /// # Errors
    /// [`Stop`].
    pub fn model(&self, drive: Option<usize>) -> Result<Model, Stop> {
        let own = drive.map(|drive| Event { extension: self.cause, drive });
        let events: Vec<Event> = self.current.model.events.iter().copied().chain(own).collect();
        match self.setting.model(self.variant, &events) {
            Err(DiagnoseError::Case(error @ (CaseError::Missing { .. } | CaseError::TooShort { .. }))) => {
                Err(Stop::Untried(Untried::Data(error)))
            }
            model => Ok(model?),
        }
    }

    /// The present model as a point of a model with the cause.
    #[must_use]
    pub fn present(&self, model: &Model) -> Point {
        let Point { values, noise } = &self.current.fit.point;
        Point { values: model.adopt(&self.current.model, values), noise: *noise }
    }

    /// Position of the only parameter of the cause.
    #[must_use]
    pub fn only(&self, model: &Model) -> usize {
        model.positions(self.cause)[0]
    }

    /// A scope over all drives with starts at these sizes.
    #[must_use]
    pub fn scope(&self, model: Model, sizes: &[Values], held: Vec<Point>) -> Scope {
        let starts = self.around(&model, sizes);
        Scope { model, starts, held, alone: false, promise: [0.0; 2] }
    }

    /// Starts at these sizes on top of each of [`Task::rests`].
    #[must_use]
    pub fn around(&self, model: &Model, sizes: &[Values]) -> Vec<Point> {
        let rests = self.rests(model, self.current.fit.point.noise);
        let at = |size| rests.iter().map(move |rest| Point { values: moved(model, &rest.values, size), ..*rest });
        sizes.iter().flat_map(at).collect()
    }

    /// Points for the rest of the model: the present parameters under this observer and under a nearly free simulation, because the
    /// observer may hide an effect in its missing acceleration; if the model may be far off, also textbook values under a strong observer.
    #[must_use]
    pub fn rests(&self, model: &Model, noise: Noise) -> Vec<Point> {
        let Point { values, .. } = self.present(model);
        let textbook = with_textbook_values(model, &values, self.fastest);
        let far_off = noise.is_astray().then_some(Point { values: textbook, noise: noise.strong() });
        let present = [noise, noise.freer()].map(|noise| Point { values: values.clone(), noise });
        present.into_iter().chain(far_off).collect()
    }

    /// The most promising of changes of the cause at a point, at least `apart` positions from each other: the predicted gain \[nats\] and
    /// the values after a step along each, in which its size and all other parameters move.
    ///
    /// # Errors
    /// As [`profiled`].
    pub fn promised(
        &self,
        model: &Model,
        at: &Point,
        changes: &[Values],
        (apart, most): (usize, usize),
    ) -> Result<Vec<(f64, Vec<f64>)>, DiagnoseError> {
        let own = model.positions(self.cause);
        let axis = |k: usize| if own.contains(&k) { Axis::held(at.values[k]) } else { model.axes[k] };
        let axes: Vec<Axis> = (0..at.values.len()).map(axis).collect();
        let changed: Vec<Vec<f64>> = changes.iter().map(|change| moved(model, &at.values, change)).collect();
        let steps = profiled(model, &axes, &self.setting.whole, at, &changed)?;
        let gains: Vec<f64> = steps.iter().map(|step| if step.gain > 0.0 { step.gain } else { f64::NAN }).collect();
        let step = |i: usize| {
            let size = |k: usize| match model.symbols[k].neutral() {
                Some(_) => at.values[k] + steps[i].share * (changed[i][k] - at.values[k]),
                None => changed[i][k],
            };
            (gains[i], moved(model, &steps[i].values, &own.iter().map(|&k| (k, size(k))).collect()))
        };
        Ok(highest(&gains, apart, most).into_iter().map(step).collect())
    }

    /// The best fit from the starts of a scope. If sensors are precise, the likelihood is so rugged that a search stops beside the cause.
    /// Then fits with the noise of ordinary sensors, times `factor`, give further starts.
    ///
    /// # Errors
    /// As [`FittedModel::fitted`].
    pub fn fitted(&self, scope: Scope, factor: f64) -> Result<Option<FittedModel>, DiagnoseError> {
        let Scope { model, mut starts, .. } = scope;
        let plan = self.budget.plan;
        let noise = self.current.fit.point.noise;
        let Some(soft) = softened(&noise, factor) else { return self.from(model, &starts, plan) };
        // Only the final point matters.
        let smooth = Plan { least: [soft.r_s, soft.r_v], fine: plan.fine.div_ceil(2), ..plan };
        let Some(FittedModel { model, fit, .. }) = self.from(model, &starts, smooth)? else { return Ok(None) };
        // Starts with this noise have led here. A larger factor may hide what they had found.
        starts.retain(|start| factor > 1.0 || start.noise.r_s < soft.r_s || start.noise.r_v < soft.r_v);
        let found = Noise { r_s: noise.r_s, r_v: noise.r_v, ..fit.point.noise };
        let there = |noise| Point { values: fit.point.values.clone(), noise };
        starts.extend([noise, noise.freer(), found].map(there));
        self.from(model, &starts, plan)
    }

    fn from(&self, model: Model, starts: &[Point], plan: Plan) -> Result<Option<FittedModel>, DiagnoseError> {
        let causes: Vec<&'static Extension> = self.current.causes.iter().copied().chain([self.cause]).collect();
        FittedModel::fitted(self.setting, self.variant, &causes, model, starts, plan)
    }

    /// The likelier of a fit and one that starts from fixed sizes.
    fn set_free(&self, found: FittedModel, held: &[Point]) -> Result<FittedModel, DiagnoseError> {
        if held.is_empty() {
            return Ok(found);
        }
        let model = self.setting.model(found.variant, &found.model.events)?;
        let other = self.from(model, held, self.budget.plan)?;
        let better = other.filter(|other| other.fit.log_likelihood > found.fit.log_likelihood);
        Ok(better.unwrap_or(found))
    }
}

/// Values with some of them replaced, within their bounds.
#[must_use]
pub fn moved(model: &Model, values: &[f64], by: &Values) -> Vec<f64> {
    let mut moved = values.to_vec();
    for &(k, value) in by {
        moved[k] = value.clamp(model.axes[k].lower, model.axes[k].upper);
    }
    moved
}

/// The model with one more cause, fitted: the best of its scopes.
///
/// # Errors
/// [`Stop`].
pub fn explain(task: &Task<'_>) -> Result<FittedModel, Stop> {
    let search = strategy(task.cause.search());
    let mut best: Option<FittedModel> = None;
    let scopes = search.starts(task)?;
    let simulated: u64 = scopes.iter().map(|scope| scope.model.simulations()).sum();
    task.setting.simulations.fetch_add(simulated, Ordering::Relaxed);
    let scopes = promising(scopes);
    let without_start = scopes.iter().all(|scope| scope.starts.is_empty());
    for mut scope in scopes.into_iter().filter(|scope| !scope.starts.is_empty()) {
        if let Some(best) = best.as_ref().filter(|_| !scope.alone) {
            // An event of one drive may happen in all of them.
            let values = scope.model.adopt(&best.model, &best.fit.point.values);
            let noises = [best.fit.point.noise, task.current.fit.point.noise];
            scope.starts.extend(noises.map(|noise| Point { values: values.clone(), noise }));
        }
        let held = std::mem::take(&mut scope.held);
        let Some(found) = search.refine(task, scope)? else { continue };
        let found = task.set_free(found, &held)?;
        if best.as_ref().is_none_or(|best| found.fit.log_likelihood > best.fit.log_likelihood) {
            best = Some(found);
        }
    }
    let open = task.cause.parameters.iter().filter(|symbol| symbol.neutral().is_none());
    let no_start = || Untried::NoStart { parameters: open.map(|symbol| symbol.name().to_owned()).collect() };
    best.ok_or_else(|| Stop::Untried(if without_start { no_start() } else { Untried::NotFinite }))
}

/// The scopes that promise most under one of the observers, separately for those that compete and those that do not.
fn promising(mut scopes: Vec<Scope>) -> Vec<Scope> {
    let most = |alone: bool, k: usize| {
        let alike = scopes.iter().filter(|scope| scope.alone == alone);
        alike.map(|scope| scope.promise[k]).fold(f64::NEG_INFINITY, f64::max)
    };
    let most = [false, true].map(|alone| [most(alone, 0), most(alone, 1)]);
    scopes.retain(|scope| (0..2).any(|k| scope.promise[k] >= most[usize::from(scope.alone)][k]));
    scopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::diagnose::made_up;

    /// The distance at standstill is 1 m off, and the car has no dead zone: a step along a dead zone mends the distance.
    #[test]
    fn other_parameters_move_along() {
        let drives = [made_up::linear_driver("made_up.csv", [0.12, 0.5, 2.2, 1.5], 15.0, 0.0)];
        let (bounds, cause) = (Overrides::new(), made_up::cause("dead_zone"));
        let question = made_up::question(&drives, &[], &bounds);
        let setting = Context::new(&question, None);
        let mut current = made_up::candidate(&drives, &[]);
        for (name, value) in [("k_s", 0.12), ("k_v", 0.5), ("d_0", 3.2), ("t_h", 1.5), ("v_0", 50.0)] {
            let k = current.model.symbols.iter().position(|symbol| symbol.name() == name).expect("of the law");
            current.fit.point.values[k] = value;
        }
        let variant = current.variant.with(cause).expect("they go together");
        let budget = SearchBudget::of(question.effort);
        let task =
            Task { setting: &setting, current: &current, cause, variant, missing: &[], budget: &budget, fastest: 20.0 };
        let model = task.model(None).expect("a model");
        let found = task.promised(&model, &task.present(&model), &sizes(&model, cause), (0, 1)).expect("it runs");
        // The drive determines the distance at its mean speed.
        let distance = |values: &[f64]| {
            let of =
                |name: &str| values[model.symbols.iter().position(|symbol| symbol.name() == name).expect("of the law")];
            of("d_0") + 15.0 * of("t_h")
        };
        let off = [&task.present(&model).values, &found[0].1].map(|values| distance(values) - 24.7);
        assert!((off[0] - 1.0).abs() < 1e-9 && off[1].abs() < 0.5, "{off:?}");
    }
}
