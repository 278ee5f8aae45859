//! A calibration: model, objective, bounds and search.

use super::bounds::{checked_single, origin, read_bounds, unknown};
use super::drive::Drive;
use super::error::{Error, Usage, refuse, usage};
use super::extension::extend;
use super::fit::Fit;
use super::folds;
use super::loading::Loaded;
use super::once::once;
use crate::calibrate::{
    self, Apart, BoundSet, OptimizerKind, Overrides, Progress as SearchProgress, SearchSpace, apart_until, best,
    bound_times, calibrate,
};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::{Case, Evaluator};
use crate::identify::identify;
use crate::lanes::LanesPrecision;
use crate::optimize::GaSettings;
use crate::reference::Reference;
use crate::result::assemble::{Calibrated, scores_on};
use crate::result::{ComparedEntry, ResultFile};
use crate::score::GoodnessOfFit;
use crate::select::{Selection, Work};
use crate::symbols::Symbol;
use crate::text::option::{FIX, HISTORY, JOINT, MAX_EVALUATIONS, OPTIMIZER, PRECISION, REPLICATES, SEED, VEHICLE};
use crate::trajectory::Trajectory;
use crate::vehicle::Vehicle;
use crate::wgsl::read_extension;
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};

/// A calibration to be made. Every setting has a default; the same settings find the same parameters, to the bit, on any number of threads.
///
/// ```no_run
/// let drive = leadlag::read("platoon.csv")?.follower(1)?;
/// let fit = leadlag::Calibration::of("idm+linear")?.bounds("human").seed(1).run(&drive)?;
/// println!("{fit}");
/// # Ok::<(), leadlag::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Calibration {
    pub(crate) model: Variant,
    /// Names of sets and files.
    pub(crate) bounds: Vec<String>,
    /// Bounds of single parameters, which replace those of sets and files.
    pub(crate) single: Overrides,
    pub(crate) fixed: Vec<(String, f64)>,
    pub(crate) gof: GoodnessOfFit,
    pub(crate) convention: Convention,
    pub(crate) search: calibrate::Calibration,
    pub(crate) selection: Selection,
    pub(crate) intervals: bool,
    /// Time at the start of each drive in which the car is the measured one \[s\], if requested.
    pub(crate) history_s: Option<f64>,
    /// Names of the own parameters of the drivers.
    pub(crate) own: Vec<String>,
    /// Number of folds of a cross-validation, if requested.
    pub(crate) folds: Option<u64>,
    /// Largest number of simulations of a replicate, if requested.
    pub(crate) evaluations: Option<u64>,
    pub(crate) warn: fn(&str),
}

/// Program and state of its searches, such as `leadlag 0.1.0+search8`: with the same one, a seed gives the same result.
#[must_use]
pub fn program() -> &'static str {
    &calibrate::PROGRAM
}

/// Search space and scores of a calibration.
pub(crate) struct Prepared {
    pub(crate) space: SearchSpace,
    pub(crate) reference: Reference,
}

/// A calibration that is done.
pub(crate) struct Whole {
    pub(crate) result: ResultFile,
    /// Its cases.
    #[cfg_attr(not(feature = "cli"), expect(dead_code, reason = "the command line draws them"))]
    pub(crate) reference: Reference,
    /// Why a part of the result is missing.
    pub(crate) lost: Option<String>,
}

impl Calibration {
    /// A calibration of a model by name or id: `idm`, `gipps+delay+linear+mfc`, `31`, or by the file of your own law: `my_law.wgsl+delay`.
    ///
    /// # Errors
    /// For an unknown model, or a faulty text of a law.
    pub fn of(model: &str) -> Result<Calibration, Error> {
        Ok(Calibration::of_variant(super::model::model(model)?))
    }

    pub(crate) fn of_variant(model: Variant) -> Calibration {
        Calibration {
            model,
            bounds: Vec::new(),
            single: Overrides::new(),
            fixed: Vec::new(),
            gof: GoodnessOfFit::NRMSE_SVA,
            convention: Convention::PAPER,
            search: calibrate::Calibration::default(),
            selection: Selection::default(),
            intervals: true,
            history_s: None,
            own: Vec::new(),
            folds: None,
            evaluations: None,
            warn: |_| {},
        }
    }

    /// Adds an extension: the name of a built-in cause, such as `actuation_lag`, or your own WGSL file.
    ///
    /// # Errors
    /// For an unknown name, or a faulty text.
    pub fn extend(mut self, extension: &str) -> Result<Calibration, Error> {
        self.model = extend(self.model, &[extension.to_owned()])?;
        Ok(self)
    }

    /// Adds your own extension by its WGSL text; `name` is what its functions begin with.
    ///
    /// # Errors
    /// When the text is faulty, or the model has the extension already.
    pub fn extend_text(mut self, name: &str, text: &str) -> Result<Calibration, Error> {
        let own = read_extension(&format!("{name}.wgsl"), text).map_err(anyhow::Error::from)?;
        self.model = self.model.with(own).map_err(usage)?;
        Ok(self)
    }

    /// Adds bounds: `acc` (the paper's, the default), `human`, or a TOML file. Later ones replace earlier ones.
    #[must_use]
    pub fn bounds(mut self, bounds: &str) -> Calibration {
        self.bounds.push(bounds.to_owned());
        self
    }

    /// Bounds of one parameter, in its unit.
    #[must_use]
    pub fn bound(mut self, parameter: &str, lower: f64, upper: f64) -> Calibration {
        self.single.insert(parameter.to_owned(), [lower, upper]);
        self
    }

    /// Fixes a parameter.
    #[must_use]
    pub fn fix(mut self, parameter: &str, value: f64) -> Calibration {
        self.fixed.push((parameter.to_owned(), value));
        self
    }

    /// The measure to minimise: `nrmse-sva` (the default), `rmse-s`, `u-sv`, ...
    ///
    /// # Errors
    /// For an unknown measure.
    pub fn minimise(mut self, measure: &str) -> Result<Calibration, Error> {
        self.gof = measure.parse().map_err(usage)?;
        Ok(self)
    }

    /// The convention: `paper` (the default) or `authors`, with single rows changed behind a comma.
    ///
    /// # Errors
    /// For an unknown convention.
    pub fn convention(mut self, convention: &str) -> Result<Calibration, Error> {
        self.convention = convention.parse().map_err(usage)?;
        Ok(self)
    }

    /// The optimiser: `auto` (the default), `ga` (the paper's), `lshade` or `cmaes`.
    ///
    /// # Errors
    /// For an unknown optimiser.
    pub fn optimizer(mut self, name: &str) -> Result<Calibration, Error> {
        self.search.optimizer = name.parse::<OptimizerKind>().map_err(usage)?;
        Ok(self)
    }

    /// Seed of all random numbers; 1 by default.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Calibration {
        self.search.seed = seed;
        self
    }

    /// Independent repetitions, 1 to 100,000; 1 by default.
    #[must_use]
    pub fn replicates(mut self, replicates: u64) -> Calibration {
        self.search.replicates = replicates;
        self
    }

    /// Largest number of simulations of a replicate; at least 100.
    #[must_use]
    pub fn max_evaluations(mut self, simulations: u64) -> Calibration {
        self.search.stop.max_evaluations = simulations;
        self.evaluations = Some(simulations);
        self
    }

    /// Whether intervals of the parameters are estimated; they are by default.
    #[must_use]
    pub fn intervals(mut self, wanted: bool) -> Calibration {
        self.intervals = wanted;
        self
    }

    /// Time at the start of each drive \[s\] in which the car is the measured one; the simulation and the score begin after it. A delay is at
    /// most as long, so that models with and without a delay are scored on the same samples. Without it, a delay itself is the history.
    #[must_use]
    pub fn history(mut self, seconds: f64) -> Calibration {
        self.history_s = Some(seconds);
        self
    }

    /// Cross-validation of one parameter set for several drives: each driver is left out of one of this many further calibrations, and
    /// scored with its parameters. Without it, no driver is left out.
    #[must_use]
    pub fn folds(mut self, folds: u64) -> Calibration {
        self.folds = Some(folds);
        self
    }

    /// The evaluator: `auto` (the default), `lanes`, `gpu` or `reference`.
    ///
    /// # Errors
    /// For an unknown evaluator.
    pub fn evaluator(mut self, name: &str) -> Result<Calibration, Error> {
        self.selection.kind = name.parse().map_err(usage)?;
        self.selection.check().map_err(usage)?;
        Ok(self)
    }

    /// The precision of `lanes` and `gpu`: `plain` (f32, the default), `compensated` or `f64`.
    ///
    /// # Errors
    /// For an unknown precision, or one that the evaluator does not have.
    pub fn precision(mut self, name: &str) -> Result<Calibration, Error> {
        let precision: LanesPrecision = name.parse().map_err(usage)?;
        self.selection.precision = Some(precision);
        self.selection.check().map_err(usage)?;
        Ok(self)
    }

    /// Called when `auto` replaces an evaluator by another one; no call by default.
    #[must_use]
    pub fn warn(mut self, warn: fn(&str)) -> Calibration {
        self.warn = warn;
        self
    }

    /// Largest number of simulations of all replicates.
    #[must_use]
    pub fn most_evaluations(&self) -> u64 {
        self.search.stop.max_evaluations.saturating_mul(self.search.replicates)
    }

    /// The model, by its name.
    #[must_use]
    pub fn model(&self) -> String {
        self.model.to_string()
    }

    /// The parameters of the model, each with its column in the table of a [`crate::Fleet`], such as `("v_0", "v_0_mps")`.
    #[must_use]
    pub fn columns(&self) -> Vec<(&'static str, String)> {
        self.model.parameters().iter().map(|symbol| (symbol.name(), symbol.column())).collect()
    }

    /// Calibrates on a drive.
    ///
    /// # Errors
    /// When a bound is invalid, the drive lacks a signal of the model, drives share samples, or no candidate is feasible.
    pub fn run(&self, drive: &Drive) -> Result<Fit, Error> {
        self.run_on(&[drive], &mut |_| ControlFlow::Continue(()))
    }

    /// Calibrates one parameter set on several drives together. `progress` receives the progress of the search. If it breaks, the result is the
    /// best found so far, without intervals.
    ///
    /// # Errors
    /// As [`Calibration::run`].
    ///
    /// # Panics
    /// Without a drive.
    pub fn run_on(
        &self,
        drives: &[&Drive],
        progress: &mut (dyn FnMut(SearchProgress) -> ControlFlow<()> + Send),
    ) -> Result<Fit, Error> {
        let whole = self.on(&self.loaded(drives)?, &[], |_| Ok(()), progress)?;
        Ok(Fit::of(whole.result)?.with_warning(whole.lost))
    }

    /// The drives for the model.
    pub(super) fn loaded(&self, drives: &[&Drive]) -> anyhow::Result<Vec<Loaded>> {
        drives.iter().map(|drive| drive.for_model(&self.model)).collect()
    }

    /// A calibration with all that belongs to it, and the scores on held-back drives. `begin` is called after all checks, before the search, with the
    /// warning that the drives hardly have one driver.
    pub(crate) fn on(
        &self,
        loaded: &[Loaded],
        held: &[Loaded],
        begin: impl FnOnce(Option<&str>) -> anyhow::Result<()>,
        progress: &mut (dyn FnMut(SearchProgress) -> ControlFlow<()> + Send),
    ) -> anyhow::Result<Whole> {
        once(loaded.iter().chain(held).map(|one| &one.trajectory))?;
        self.fold_of(loaded)?;
        self.own_drivers(loaded)?;
        let prepared = self.prepare(loaded)?;
        let held_cases = if held.is_empty() { None } else { Some(self.prepare(held)?.reference) };
        let mut evaluator = self.build(&prepared.reference)?;
        // Work beside the search stops with the search, and reports no progress.
        let mut last = SearchProgress { replicate: 0, evaluations: 0, best: None };
        let asked = Mutex::new(&mut *progress);
        let stop = || asked.lock().unwrap_or_else(PoisonError::into_inner)(last).is_break();
        let drivers = self.apart(&prepared, loaded, &stop)?;
        begin(drivers.as_deref())?;
        let mut result = self.search(evaluator.as_mut(), &prepared, loaded, &mut |step| {
            last = step;
            progress(step)
        })?;
        result.drivers = drivers;
        if let Some(reference) = held_cases {
            let trajectories: Vec<&Trajectory> = held.iter().map(|one| &one.trajectory).collect();
            let parameters = result.calibrated_variant()?.parameters;
            result.held_back = Some(scores_on(&reference, &parameters, &trajectories, &self.gof));
        }
        // The calibration is done, and must not be lost.
        let lost = match self.left_out(loaded, progress) {
            Ok(Some(scores)) => {
                result.held_back = Some(scores);
                None
            }
            Ok(None) => None,
            Err(error) => Some(folds::lost(&error)),
        };
        result.compared = self.compared(loaded, &mut |_| progress(last));
        Ok(Whole { result, reference: prepared.reference, lost })
    }

    /// Warnings about this calibration on these drives, one line each.
    ///
    /// # Errors
    /// For an invalid bound, or a drive that lacks data of the model.
    pub fn warnings(&self, drives: &[&Drive]) -> Result<Vec<String>, Error> {
        let loaded = self.loaded(drives)?;
        let Some(first) = drives.first() else { return Ok(Vec::new()) };
        let trajectories: Vec<&Trajectory> = loaded.iter().map(|one| &one.trajectory).collect();
        Ok(super::warnings::of(
            &first.recording.reading,
            &self.model,
            self.convention,
            &self.overrides()?,
            &trajectories,
        ))
    }

    /// Bounds of the sets and files, of single parameters, then fixed values, which must lie within those that were given.
    pub(crate) fn overrides(&self) -> anyhow::Result<Overrides> {
        let known = self.model.parameters();
        let single = checked_single(&self.single, &self.model, &known)?;
        let mut overrides = read_bounds(&self.bounds, &self.model)?;
        // A set is only a starting point; a file, or the bounds of one parameter, are a deliberate choice.
        let is_file = |given: &&String| given.parse::<BoundSet>().is_err();
        let files: Vec<String> = self.bounds.iter().filter(is_file).cloned().collect();
        let mut meant = read_bounds(&files, &self.model)?;
        meant.extend(single.clone());
        overrides.extend(single);
        for (k, (name, value)) in self.fixed.iter().enumerate() {
            if !known.iter().any(|symbol| symbol.name() == name) {
                return Err(unknown(&format!("{FIX} {name}"), name, &self.model, &known).into());
            }
            if let Some((_, before)) = self.fixed[..k].iter().find(|(other, _)| other == name) {
                refuse!("{FIX} {name} is given twice, as {before} and as {value}");
            }
            overrides.insert(name.clone(), [*value, *value]);
            if let Some([lower, upper]) = meant.get(name)
                && !(lower..=upper).contains(&value)
            {
                let source = if self.single.contains_key(name) { format!("bound {name}") } else { files.join(", ") };
                let says = if lower == upper { format!("{lower}") } else { format!("[{lower}, {upper}]") };
                refuse!(
                    "{FIX} {name}={value} contradicts {source}, which says {name} = {says}; fix it within its bounds, or \
                     change one of the two"
                );
            }
        }
        Ok(overrides)
    }

    /// The search space and the cases. Road loads of a joint calibration are bounded by one vehicle, so there must be one.
    pub(crate) fn prepare(&self, loaded: &[Loaded]) -> anyhow::Result<Prepared> {
        self.check_numbers()?;
        let model = self.model;
        let vehicle = loaded[0].vehicle();
        if let Some(other) = loaded.iter().find(|l| l.vehicle().map(|v| &v.slug) != vehicle.map(|v| &v.slug))
            && model.needs_vehicle()
        {
            let name = |v: Option<&Vehicle>| v.map_or("unknown".to_owned(), |v| v.slug.clone());
            let (one, two) = (name(vehicle), name(other.vehicle()));
            refuse!("{JOINT}: variant {model} needs one vehicle, found {one} and {two}; give {VEHICLE}");
        }
        let mut overrides = self.overrides()?;
        let ends = |of: fn(&[f64]) -> Option<&f64>| loaded.iter().filter_map(move |l| of(&l.trajectory.t)).copied();
        let window =
            [ends(<[f64]>::first).fold(f64::INFINITY, f64::min), ends(<[f64]>::last).fold(f64::NEG_INFINITY, f64::max)];
        bound_times(&model, window, &mut overrides);
        self.bound_delays(vehicle, &mut overrides)?;
        let space = SearchSpace::new(&model, vehicle, self.convention, &overrides)?;
        let mut cases = Vec::new();
        let delays = (space.tau_p_upper(), space.extension_delay_upper());
        for l in loaded {
            let case = Case::within(&l.trajectory, model, l.vehicle(), self.convention, delays)?;
            cases.push(case.with_history(self.history_s)?);
        }
        let prepared = Prepared { space, reference: Reference::new(cases, self.gof) };
        self.own_positions(&prepared)?;
        Ok(prepared)
    }

    /// Limits the delays together to the history.
    fn bound_delays(&self, vehicle: Option<&Vehicle>, overrides: &mut Overrides) -> Result<(), Usage> {
        let Some(history) = self.history_s else { return Ok(()) };
        let own = self.model.delay.then_some(Symbol::tau_p);
        let delays: Vec<Symbol> = own.into_iter().chain(self.model.extensions.delay()).collect();
        let most = history / delays.len().max(1) as f64;
        for symbol in delays {
            let name = symbol.name();
            let known = overrides.get(name).copied().or_else(|| Case::bounds(symbol, vehicle, self.convention));
            let Some([lower, upper]) = known else { continue };
            if lower > most {
                refuse!(
                    "{HISTORY} {history}: {name} is at least {lower} s, and may be at most {most} s; give a longer history or other bounds"
                );
            }
            overrides.insert(name.to_owned(), [lower, upper.min(most)]);
        }
        Ok(())
    }

    /// Refuses invalid numbers of replicates and simulations.
    pub(crate) fn check_numbers(&self) -> anyhow::Result<()> {
        if let Some(seconds) = self.history_s
            && !(seconds.is_finite() && seconds >= 0.0)
        {
            refuse!("{HISTORY} {seconds}: expected a time in seconds, at least 0");
        }
        let (replicates, simulations) = (self.search.replicates, self.search.stop.max_evaluations);
        let (most, least) = (calibrate::REPLICATES_MAX, calibrate::EVALUATIONS_MIN);
        let message = match (replicates, simulations) {
            (found, _) if !(1..=most).contains(&found) => format!("{REPLICATES} {found}: expected 1 to {most}"),
            (_, found) if found < least => format!("{MAX_EVALUATIONS} {found}: expected at least {least}"),
            _ => return Ok(()),
        };
        Err(Usage(message).into())
    }

    /// The evaluator that simulates the candidates; the reference scores the best ones again.
    pub(crate) fn build(&self, reference: &Reference) -> anyhow::Result<Box<dyn Evaluator>> {
        let cases = reference.cases().to_vec();
        let generation = GaSettings::default().population_size * self.search.replicates as usize;
        let work = Work { candidates: generation * cases.len(), precision: LanesPrecision::Plain };
        Ok(self.selection.build(cases, self.gof, work, self.warn)?)
    }

    /// A warning that the drives hardly have one driver.
    pub(crate) fn apart(
        &self,
        prepared: &Prepared,
        loaded: &[Loaded],
        stop: &(dyn Fn() -> bool + Sync),
    ) -> anyhow::Result<Option<String>> {
        // Own parameters expect that drivers differ.
        if !self.own.is_empty() {
            return Ok(None);
        }
        let Prepared { space, reference } = prepared;
        let labels: Vec<&str> = loaded.iter().map(|one| one.trajectory.label.as_str()).collect();
        let found: Option<Apart> = apart_until(reference.cases(), space, self.search.seed, stop)?;
        Ok(found.map(|apart| apart.told(space, &labels)))
    }

    /// The same calibration with the faults of the data corrected, or uncorrected if they are corrected here; `None` if that makes no
    /// difference, or without faults.
    pub(crate) fn compared(
        &self,
        loaded: &[Loaded],
        progress: &mut (dyn FnMut(SearchProgress) -> ControlFlow<()> + Send),
    ) -> Option<ComparedEntry> {
        let twin = loaded.iter().find_map(|one| one.twin.as_ref())?;
        let others = loaded.iter().map(|one| Loaded {
            trajectory: one.twin.as_ref().unwrap_or(&one.trajectory).clone(),
            vehicle: one.vehicle.clone(),
            twin: None,
        });
        let (others, search) = (others.collect::<Vec<_>>(), calibrate::Calibration { replicates: 1, ..self.search });
        let calibration = Calibration { intervals: false, search, ..self.clone() };
        let mut stopped = progress(SearchProgress { replicate: 0, evaluations: 0, best: None }).is_break();
        if stopped {
            return None;
        }
        let prepared = calibration.prepare(&others).ok()?;
        let mut evaluator = calibration.build(&prepared.reference).ok()?;
        let found = calibration.search(evaluator.as_mut(), &prepared, &others, &mut |step| {
            let flow = progress(step);
            stopped |= flow.is_break();
            flow
        });
        let found = found.ok().filter(|_| !stopped)?;
        let corrected = twin.findings().any(|finding| finding.correction.is_some());
        Some(ComparedEntry { corrected, parameters: found.parameters })
    }

    /// The search, and the intervals unless `progress` has asked to stop.
    pub(crate) fn search(
        &self,
        evaluator: &mut dyn Evaluator,
        prepared: &Prepared,
        loaded: &[Loaded],
        progress: &mut (dyn FnMut(SearchProgress) -> ControlFlow<()> + Send),
    ) -> anyhow::Result<ResultFile> {
        let Prepared { space, reference } = prepared;
        let (mut stopped, mut last) = (false, None);
        let replicates = calibrate(evaluator, space, &self.search, &mut |step| {
            let flow = progress(step);
            stopped |= flow.is_break();
            last = Some(step);
            flow
        })?;
        let Some(winner) = best(&replicates).filter(|winner| winner.score.is_finite()) else {
            anyhow::bail!(
                "no replicate found a candidate that passes in f64; those that pass in f32 lie on the edge of a crash; try \
                 {OPTIMIZER} auto, {PRECISION} compensated or another {SEED}"
            );
        };
        let mut stop = || {
            stopped |= last.is_some_and(|step| progress(step).is_break());
            stopped
        };
        let asked = Mutex::new(&mut stop);
        let asks = || asked.lock().unwrap_or_else(PoisonError::into_inner)();
        let own = self.own_fit(prepared, loaded, &winner.candidate, &asks)?;
        // The intervals are those of one candidate for all drives.
        let wanted = self.intervals && !space.free().is_empty() && !stop() && self.own.is_empty();
        let knowledge = wanted.then(|| identify(evaluator, space, &winner.candidate, &mut stop)).transpose()?;
        let knowledge = knowledge.filter(|_| !stopped);
        let trajectories: Vec<&Trajectory> = loaded.iter().map(|l| &l.trajectory).collect();
        let calibrated = Calibrated {
            evaluator,
            reference,
            trajectories: &trajectories,
            vehicle: loaded[0].vehicle.as_ref().map(|(v, from)| (v, from.as_str())),
            space,
            bounds_from: origin(
                &self.bounds,
                loaded.iter().map(|l| (l.trajectory.name.as_str(), l.trajectory.driver())),
            ),
            gof: self.gof,
            settings: &self.search,
            replicates,
            knowledge,
            own,
        };
        Ok(ResultFile { history_s: self.history_s, ..calibrated.into_result() })
    }
}
