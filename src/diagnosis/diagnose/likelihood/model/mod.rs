//! A variant over drives, as the fits use it.

use super::fit::Predictor;
use super::observer::{KalmanGain, Noise, design};
use super::space::Axis;
use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::diagnose::drive::Drive;
use crate::diagnose::question::DiagnoseError;
use crate::evaluator::{
    Case, CaseError, Differences, Failure, Innovations, Job, Observer, Population, Products, Pull, Residuals, SIGNALS,
};
use crate::extension::Extension;
use crate::lanes::{Bins, Lanes, LanesPrecision};
use crate::score::GoodnessOfFit;
use crate::symbols::{Bounds, Parameters, Scale, SearchKind, Symbol};
use crate::vehicle::Vehicle;
use std::ops::Deref;
use std::sync::atomic::{AtomicU64, Ordering};

/// Bounds of the base models in a diagnosis: wide, because a parameter on a bound can suggest a wrong cause. `true`: logarithmic scale.
const WIDE: &[(Symbol, f64, f64, bool)] = &[
    (Symbol::delta, 0.5, 20.0, true),
    (Symbol::k_s, 0.002, 5.0, true),
    (Symbol::k_v, 0.005, 5.0, true),
    (Symbol::k_0, 0.005, 5.0, true),
    (Symbol::theta, 0.0, 3.0, false),
    (Symbol::v_0, 5.0, 60.0, false),
    (Symbol::d_0, 0.0, 15.0, false),
    (Symbol::t_h, 0.1, 5.0, false),
    (Symbol::a_max, 0.1, 10.0, true),
    (Symbol::a_min, -15.0, -0.1, true),
    (Symbol::a_hat_min, -15.0, -0.1, true),
    (Symbol::tau_p, 0.0, 0.8, false),
    (Symbol::tau_a, 0.0, 2.5, false),
];

/// Finite-difference steps of parameters on which innovations depend in jumps or with many kinks: for the size of `steps` as a share of
/// the range in the file, for times of stretches \[s\], for times of events \[s\].
const JUMPS: [f64; 3] = [1.0 / 120.0, 0.1, 0.5];

/// Lower bound of an offset of time \[s\]: no car sees another in advance, and a small negative value is enough to show an apparent
/// foresight.
const FORESIGHT: f64 = -0.1;

/// The family of causes that act late: all of them shift the phase.
pub const PHASE: &str = "phase";
/// Name of the nuisance lead.
pub const LEAD: &str = "lead";

/// An event that happens in the recording of one drive only, instead of in every drive at that time of its file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Event {
    /// The cause.
    pub extension: &'static Extension,
    /// Index of the drive.
    pub drive: usize,
}

/// Every observed run begins here \[s\], where runs with a delay of the library begin, because these need as much past: a later start
/// leaves less of the initial transient to explain.
const BEGIN_S: f64 = 3.0;

fn begun(case: Case) -> Case {
    Case { earliest: (BEGIN_S / case.dt).ceil() as usize + 1, ..case }
}

/// A variant with its axes.
#[derive(Debug, Clone)]
pub struct Space {
    pub variant: Variant,
    /// Its parameters.
    pub symbols: Vec<Symbol>,
    /// Their bounds.
    pub axes: Vec<Axis>,
}

/// A variant over drives. It holds a copy of all of them in the form of the evaluator.
#[derive(Debug)]
pub struct Model {
    /// The variant with its axes.
    pub space: Space,
    /// Events of one drive only.
    pub events: Vec<Event>,
    lanes: Lanes,
    simulations: AtomicU64,
    drives: Vec<(usize, f64)>,
    recordings: Vec<String>,
    /// Indices of the perception delay, of the base or of a cause, and of the nuisance lead.
    delay: Option<usize>,
    lead: Option<usize>,
}

impl Space {
    /// Index of a parameter.
    #[must_use]
    pub fn position(&self, symbol: Symbol) -> Option<usize> {
        self.symbols.iter().position(|s| *s == symbol)
    }

    /// Indices of the parameters of an extension.
    #[must_use]
    pub fn positions(&self, extension: &Extension) -> Vec<usize> {
        extension.parameters.iter().filter_map(|symbol| self.position(*symbol)).collect()
    }

    /// Values by name.
    #[must_use]
    pub fn parameters(&self, values: &[f64]) -> Parameters {
        let mut parameters = Parameters::NONE;
        self.symbols.iter().zip(values).for_each(|(symbol, value)| parameters.set(*symbol, *value));
        parameters
    }

    /// The values of another model where both have the parameter, and neutral values elsewhere.
    #[must_use]
    pub fn adopt(&self, other: &Space, values: &[f64]) -> Vec<f64> {
        let value = |(symbol, axis): (&Symbol, &Axis)| match other.position(*symbol) {
            Some(k) => values[k].clamp(axis.lower, axis.upper),
            None => symbol.neutral().unwrap_or(0.5 * (axis.lower + axis.upper)).clamp(axis.lower, axis.upper),
        };
        self.symbols.iter().zip(&self.axes).map(value).collect()
    }
}

impl Deref for Model {
    type Target = Space;

    fn deref(&self) -> &Space {
        &self.space
    }
}

impl Model {
    /// Prepares the drives for a variant.
    ///
    /// # Errors
    /// [`DiagnoseError::Case`], [`DiagnoseError::Evaluate`], [`DiagnoseError::Bounds`].
    pub fn new(
        variant: Variant,
        drives: &[Drive],
        overrides: &Overrides,
        events: &[Event],
    ) -> Result<Model, DiagnoseError> {
        let case = |drive: &Drive| Ok(begun(drive.case(variant, overrides)?));
        let cases: Vec<Case> = drives.iter().map(case).collect::<Result<_, CaseError>>()?;
        let symbols = variant.parameters();
        let vehicle = drives.first().and_then(|drive| drive.vehicle.as_deref());
        let looks_back = variant.extensions.look_back();
        let axis = |symbol: &Symbol| axis(*symbol, Some(*symbol) == looks_back, vehicle, drives, overrides);
        let mut axes: Vec<Axis> = symbols.iter().map(axis).collect::<Result<_, _>>()?;
        hold_lead(variant, &symbols, &mut axes, drives);
        let lanes = Lanes::new(cases, GoodnessOfFit::NRMSE_SVA, LanesPrecision::F64)?;
        let recordings = drives.iter().map(Drive::recording).collect();
        let drives = drives.iter().map(|drive| (drive.samples(), drive.dt())).collect();
        let position = |wanted: &dyn Fn(&Symbol) -> bool| symbols.iter().position(wanted);
        let delay = variant.extensions.delay().unwrap_or(Symbol::tau_p);
        let (delay, lead) = (position(&|symbol| *symbol == delay), position(&|symbol| is_lead(*symbol)));
        Ok(Model {
            space: Space { variant, symbols, axes },
            simulations: AtomicU64::new(0),
            events: events.to_vec(),
            lanes,
            drives,
            recordings,
            delay,
            lead,
        })
    }

    /// Number of simulated candidates so far, over one drive each.
    #[must_use]
    pub fn simulations(&self) -> u64 {
        self.simulations.load(Ordering::Relaxed)
    }

    /// The case of a drive under this model.
    ///
    /// # Errors
    /// As [`Case::new`].
    pub fn case(&self, drive: &Drive) -> Result<Case, CaseError> {
        let [base, extension] = [Some(Symbol::tau_p), self.variant.extensions.delay()]
            .map(|delay| delay.and_then(|symbol| self.position(symbol)).map(|k| self.axes[k].upper));
        Ok(begun(drive.case_within(self.variant, base, extension)?))
    }

    /// The observed run of one candidate on all drives.
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`].
    pub fn innovations(&self, values: &[f64], noise: &Noise) -> Result<Vec<Innovations>, DiagnoseError> {
        let mut all = Vec::new();
        for drive in 0..self.drives.len() {
            let designed = design(noise, self.drives[drive].1);
            let (population, observers) = self.population(drive, &[values.to_vec()], &[designed]);
            all.append(&mut self.lanes.innovations(&Job { case: drive, population: &population }, &observers)?);
        }
        Ok(all)
    }

    /// Time step of a drive \[s\].
    #[must_use]
    pub fn dt(&self, drive: usize) -> f64 {
        self.drives[drive].1
    }

    /// See [`Lanes::squares`].
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`].
    pub fn squares(
        &self,
        drive: usize,
        candidates: &[Vec<f64>],
        pull: Pull,
        bins: Bins<'_>,
    ) -> Result<Vec<Option<Vec<[f64; SIGNALS]>>>, DiagnoseError> {
        let (population, _) = self.population(drive, candidates, &[]);
        Ok(self.lanes.squares(&Job { case: drive, population: &population }, pull, bins)?)
    }

    /// See [`Lanes::products`].
    ///
    /// # Errors
    /// [`DiagnoseError::Evaluate`].
    pub fn products<'a>(
        &self,
        drive: usize,
        candidates: &[Vec<f64>],
        pull: Pull,
        differences: &'a [Differences],
        bins: Bins<'a>,
    ) -> Result<Vec<Option<Products<'a>>>, DiagnoseError> {
        let (population, _) = self.population(drive, candidates, &[]);
        Ok(self.lanes.products(&Job { case: drive, population: &population }, pull, differences, bins)?)
    }

    /// With a delay tp and a lead, the model reads the past at tp - lead, where no extrapolation by a slope is needed.
    fn read_ahead(&self, values: &mut [f64]) {
        if let [Some(delay), Some(lead)] = [self.delay, self.lead] {
            let known = values[delay].min(values[lead]);
            values[delay] -= known;
            values[lead] -= known;
        }
    }

    /// Candidates as the evaluator takes them; on a drive, events of other recordings do nothing.
    fn population(
        &self,
        drive: usize,
        candidates: &[Vec<f64>],
        observers: &[KalmanGain],
    ) -> (Population, Vec<Observer>) {
        let mut population = Population::new(&self.symbols);
        let absent: Vec<(usize, f64)> = (0..self.symbols.len())
            .filter(|&k| !self.acts(drive, k))
            .filter_map(|k| self.symbols[k].neutral().map(|neutral| (k, neutral)))
            .collect();
        for candidate in candidates {
            let mut values = candidate.clone();
            absent.iter().for_each(|(k, neutral)| values[*k] = *neutral);
            self.read_ahead(&mut values);
            population.push(&values);
        }
        let observer = |designed: &KalmanGain| Observer {
            gain: designed.gain,
            whitening: designed.whitening,
            decay: designed.decay,
        };
        self.simulations.fetch_add(candidates.len() as u64, Ordering::Relaxed);
        (population, observers.iter().map(observer).collect())
    }
}

impl Predictor for Model {
    type Error = DiagnoseError;

    fn drives(&self) -> Vec<(usize, f64)> {
        self.drives.clone()
    }

    fn acts(&self, drive: usize, parameter: usize) -> bool {
        let elsewhere = |event: &&Event| self.recordings.get(event.drive) != Some(&self.recordings[drive]);
        let mut absent = self.events.iter().filter(elsewhere).flat_map(|event| self.positions(event.extension));
        !absent.any(|k| k == parameter)
    }

    fn residuals(
        &self,
        drive: usize,
        candidates: &[Vec<f64>],
        observers: &[KalmanGain],
        each: &mut dyn FnMut(&Residuals),
    ) -> Result<Vec<Option<Failure>>, DiagnoseError> {
        let (population, observers) = self.population(drive, candidates, observers);
        Ok(self.lanes.residuals(&Job { case: drive, population: &population }, &observers, each)?)
    }
}

/// Holds the nuisance lead at half a step if the model has a delay, an offset of time, a lag or a filter: an acceleration that holds for a
/// step is late by as much. A free lead would absorb a part of these, because it acts like a negative delay.
fn hold_lead(variant: Variant, symbols: &[Symbol], axes: &mut [Axis], drives: &[Drive]) {
    let extensions = variant.extensions;
    let late = extensions.list().iter().any(|extension| extension.family() == PHASE);
    if !(variant.delay || extensions.delay().is_some() || extensions.look_back().is_some() || late) {
        return;
    }
    let mut steps: Vec<f64> = drives.iter().map(Drive::dt).collect();
    steps.sort_by(f64::total_cmp);
    let step = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    for (symbol, axis) in symbols.iter().zip(axes) {
        if is_lead(*symbol) {
            let half = (0.5 * step).clamp(axis.lower, axis.upper);
            *axis = Axis::linear(half, half);
        }
    }
}

/// True for the nuisance lead.
#[must_use]
pub fn is_lead(symbol: Symbol) -> bool {
    matches!(symbol, Symbol::Extension(row) if row.extension == LEAD)
}

/// User bounds change the ends of an axis, and keep its scale.
fn axis(
    symbol: Symbol,
    looks_back: bool,
    vehicle: Option<&Vehicle>,
    drives: &[Drive],
    overrides: &Overrides,
) -> Result<Axis, DiagnoseError> {
    let own = overrides.get(symbol.name()).copied();
    let [lower, upper] = own.map_or_else(|| bounds(symbol, looks_back, vehicle, drives), Ok)?;
    if lower >= upper {
        return Ok(Axis::linear(lower, upper));
    }
    // Logarithmic scales need bounds of one sign.
    let one_sign = lower > 0.0 || upper < 0.0;
    let mut axis = if has_ratios(symbol) && one_sign { Axis::log(lower, upper) } else { Axis::linear(lower, upper) };
    if let Some(step) = jump(symbol) {
        axis.step = step / (axis.upper - axis.lower);
    }
    Ok(axis)
}

/// Bounds of a diagnosis.
fn bounds(
    symbol: Symbol,
    looks_back: bool,
    vehicle: Option<&Vehicle>,
    drives: &[Drive],
) -> Result<[f64; 2], DiagnoseError> {
    if let Some((_, lower, upper, _)) = WIDE.iter().find(|row| row.0 == symbol) {
        return Ok([*lower, *upper]);
    }
    let fixed = match (symbol.bounds(), symbol) {
        (Bounds::Fixed(lower, upper), _) => Some([lower, upper]),
        _ => Case::bounds(symbol, vehicle, Convention::PAPER),
    };
    let [mut lower, mut upper] = fixed.ok_or(crate::calibrate::BoundsError::Vehicle(symbol.name()))?;
    if symbol.is_time() {
        // Times lie within the files at hand; durations are at most as long as the longest of them.
        let first = drives.iter().map(|d| d.trajectory.t[0]).fold(f64::INFINITY, f64::min);
        let last = drives.iter().map(|d| d.trajectory.t[d.samples() - 1]).fold(f64::NEG_INFINITY, f64::max);
        (lower, upper) =
            if symbol.is_length_of_time() { (4.0, last - first) } else { symbol.begins_within([first, last]).into() };
    }
    if looks_back {
        lower = lower.max(FORESIGHT);
    }
    Ok([lower, upper])
}

fn has_ratios(symbol: Symbol) -> bool {
    match symbol {
        Symbol::Extension(row) => row.scale == Scale::Ratio && !symbol.is_time(),
        _ => WIDE.iter().any(|(known, _, _, ratios)| *known == symbol && *ratios),
    }
}

/// Step of a finite difference in the parameter's unit, see [`JUMPS`].
fn jump(symbol: Symbol) -> Option<f64> {
    let Symbol::Extension(row) = symbol else { return None };
    let [size, stretch, event] = JUMPS;
    match (row.search, symbol.is_time()) {
        (SearchKind::Steps, false) => Some(size * (row.upper - row.lower)),
        (SearchKind::Stretch, true) => Some(stretch),
        (SearchKind::Event, true) => Some(event),
        _ => None,
    }
}

/// True for parameters on which innovations depend in jumps.
#[must_use]
pub fn is_stepped(symbol: Symbol) -> bool {
    jump(symbol).is_some()
}

/// True for a cause with a size on which innovations depend in jumps.
#[must_use]
pub fn is_rugged(cause: &Extension) -> bool {
    cause.search() == SearchKind::Steps
}

#[cfg(test)]
mod tests;
