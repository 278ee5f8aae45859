//! Calibrates the pairs, some at a time on one evaluator; on a CPU several evaluators run in parallel.

use super::{Drive, Found, Pair, Place, Row, Settings};
use crate::batch::{Journal, JournalError, NoThread, in_batches};
use crate::calibrate::{self, CalibrateError, Replicate, SearchSpace, bound_times, calibrate_each};
use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::{Case, CaseError, Course, EvaluateError, Evaluator};
use crate::identify::{Exactly, identify_on};
use crate::lanes::{Lanes, LanesPrecision};
use crate::reference::Trace;
use crate::rescore;
use crate::select::{Kind, Work};
use crate::text::option::in_file;
use std::ops::ControlFlow;
use std::sync::{Mutex, PoisonError};

/// Pairs that share an evaluator on the CPU: making one takes as long as a hundredth of their searches. Pairs under way are lost with the
/// process.
const ON_THE_CPU: usize = 16;
/// On a device, which should have tens of thousands of candidates at a time.
const ON_A_DEVICE: usize = 1024;
/// Candidates of a generation of a search, for the choice of the evaluator: too few for `auto` to take a GPU, with any number of pairs. Drives
/// of a minute are simulated in less time than optimisers and intervals take, which run on the CPU.
const GENERATION: usize = 100;

/// A fleet that could not be calibrated.
#[derive(Debug, thiserror::Error)]
pub enum FleetError {
    #[error(transparent)]
    Evaluate(#[from] EvaluateError),
    #[error(transparent)]
    Journal(#[from] JournalError),
    #[error(transparent)]
    Threads(#[from] NoThread),
}

/// One calibration that can be done.
pub(super) struct Task {
    pub(super) place: Place,
    pub(super) case: Case,
    pub(super) space: SearchSpace,
}

/// Calibrates all pairs with all models and measures: the rows in order of [`Settings::places`], or `None` for those that `stop` has left out. Rows
/// of the journal are reused, and others added. `tell` receives the number of finished rows from time to time. Fails when the evaluator fails or the
/// journal cannot be written; finished rows are in it.
pub fn run(
    pairs: &[Pair],
    settings: &Settings,
    journal: Journal<Row>,
    stop: &(dyn Fn() -> bool + Sync),
    tell: &mut dyn FnMut(usize),
    warn: fn(&str),
) -> Result<Vec<Option<Row>>, FleetError> {
    let places: Vec<Place> = settings.places(pairs.len()).collect();
    let (size, threads) = match settings.selection.kind {
        Kind::Gpu => (ON_A_DEVICE, 1),
        _ => (ON_THE_CPU, rayon::current_num_threads()),
    };
    let is_open = |place: &&Place| journal.get(place).is_none();
    let mut open: Vec<Place> = places.iter().filter(is_open).copied().collect();
    open.sort_by_key(|place| (place.model, place.measure));
    let journal = Mutex::new(journal);
    for open in open.chunk_by(|one, other| (one.model, one.measure) == (other.model, other.measure)) {
        let parts = open.chunks(size);
        let (threads, parts) = (threads.min(parts.len()), Mutex::new(parts));
        let next = || parts.lock().unwrap_or_else(PoisonError::into_inner).next();
        let work = |places: &[Place], stop: &(dyn Fn() -> bool + Sync)| {
            let found = together(pairs, settings, places, stop, warn)?;
            let mut journal = journal.lock().unwrap_or_else(PoisonError::into_inner);
            Ok::<(), FleetError>(found.into_iter().try_for_each(|row| journal.keep(row))?)
        };
        let mut idle = || tell(journal.lock().unwrap_or_else(PoisonError::into_inner).count());
        in_batches(threads, stop, &next, &work, &mut idle)?;
    }
    let mut journal = journal.into_inner().unwrap_or_else(PoisonError::into_inner);
    Ok(places.iter().map(|place| journal.take(place)).collect())
}

fn build(
    settings: &Settings,
    cases: Vec<Case>,
    place: Place,
    warn: fn(&str),
) -> Result<Box<dyn Evaluator>, EvaluateError> {
    let work = Work { candidates: GENERATION, precision: LanesPrecision::Plain };
    settings.selection.build(cases, settings.measures[place.measure], work, warn)
}

/// The calibration at a place, or why there is none.
pub(super) fn task(pairs: &[Pair], settings: &Settings, place: Place) -> Result<Task, String> {
    let (pair, model) = (&pairs[place.pair], &settings.models[place.model]);
    let drive = pair.drive.as_ref().map_err(Clone::clone)?;
    let Drive { trajectory, vehicle } = drive;
    let vehicle = vehicle.as_ref();
    let mut overrides = model.overrides.clone();
    let ends = trajectory.t.first().zip(trajectory.t.last());
    bound_times(&model.variant, ends.map_or([0.0; 2], |(first, last)| [*first, *last]), &mut overrides);
    let made = SearchSpace::new(&model.variant, vehicle, settings.convention, &overrides).map_err(anyhow::Error::from);
    let made = made.and_then(|space| {
        let case = case(drive, &space, &model.variant, settings.convention)?;
        case.check_clock().and_then(|()| Course::new(&case))?;
        Ok(Task { place, case, space })
    });
    // The table must not depend on the front end.
    made.map_err(|error| in_file(|| error.to_string()))
}

/// A drive for a model, with the delays that a space allows.
pub(super) fn case(
    Drive { trajectory, vehicle }: &Drive,
    space: &SearchSpace,
    variant: &Variant,
    convention: Convention,
) -> Result<Case, CaseError> {
    let delays = (space.tau_p_upper(), space.extension_delay_upper());
    Case::within(trajectory, *variant, vehicle.as_ref(), convention, delays)
}

/// Calibrates some places of one model and measure on one evaluator. After a stop, only those that have finished.
fn together(
    pairs: &[Pair],
    settings: &Settings,
    places: &[Place],
    stop: &(dyn Fn() -> bool + Sync),
    warn: fn(&str),
) -> Result<Vec<Row>, FleetError> {
    let (mut tasks, mut rows) = (Vec::new(), Vec::new());
    for place in places {
        match task(pairs, settings, *place) {
            Ok(task) => tasks.push(task),
            Err(reason) => rows.push(Row { place: *place, found: Err(reason) }),
        }
    }
    let Some(place) = tasks.first().map(|task| task.place) else { return Ok(rows) };
    let cases = tasks.iter().map(|task| task.case.clone()).collect();
    let mut evaluator = build(settings, cases, place, warn)?;
    let mut calibration = settings.calibration;
    calibration.stop.max_evaluations = settings.most_evaluations(&tasks[0].space);
    let search = |case: usize| calibrate::Task { space: &tasks[case].space, cases: case..case + 1, number: 0 };
    let searches: Vec<calibrate::Task> = (0..tasks.len()).map(search).collect();
    let mut go_on = |_, _| if stop() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    let replicates = match calibrate_each(evaluator.as_mut(), &searches, &calibration, &mut go_on) {
        Err(CalibrateError::Evaluate(error)) => return Err(error.into()),
        Err(_) => return Ok(rows),
        Ok(replicates) => replicates,
    };
    let exact = || Lanes::new(evaluator.cases().to_vec(), *evaluator.gof(), LanesPrecision::F64);
    let exact = settings.intervals.then(exact).transpose()?;
    for (case, (task, replicate)) in tasks.iter().zip(replicates).enumerate() {
        // The next process repeats the search of interrupted pairs.
        if stop() {
            break;
        }
        let found = match replicate {
            Ok(replicate) if replicate.score.is_finite() => {
                let exactly = exact.as_ref().map(|lanes| Exactly { lanes, first: case, count: 1 });
                Ok(found(exactly, task, replicate)?)
            }
            Ok(_) => Err("no candidate that passes in f32 passes in f64: they lie on the edge of a crash".to_owned()),
            Err(CalibrateError::Evaluate(error)) => return Err(error.into()),
            Err(error) => Err(in_file(|| error.to_string())),
        };
        rows.push(Row { place: task.place, found });
    }
    Ok(rows)
}

/// Result of a search, measured in f64, with intervals.
fn found(exactly: Option<Exactly<'_>>, task: &Task, replicate: Replicate) -> Result<Found, EvaluateError> {
    let Replicate { candidate, score, evaluations, stop, .. } = replicate;
    let measures = rescore::outcome(&task.case, &task.space.parameters(&candidate), &mut Trace::default())?.result;
    // The NRMSE of a signal that does not vary is infinite or NaN, which JSON cannot hold.
    let finite = |x: f64| x.is_finite().then_some(x);
    let signals = measures
        .map_or([[None; 2]; 3], |measures| measures.0.map(|signal| [finite(signal.rmse), finite(signal.nrmse)]));
    let known = exactly.map(|exactly| identify_on(exactly, &task.space, &candidate, &mut || false)).transpose()?;
    let optimism = known.as_ref().and_then(|known| known.optimism);
    let intervals = known.map(|known| {
        let of =
            |symbol| known.parameters.iter().find(|one| one.symbol == symbol && one.determined).map(|one| one.interval);
        task.space.symbols.iter().map(|symbol| of(*symbol)).collect()
    });
    Ok(Found {
        score,
        rmse: signals.map(|[rmse, _]| rmse),
        nrmse: signals.map(|[_, nrmse]| nrmse),
        at_bound: task.space.at_bound(&candidate).iter().map(|symbol| symbol.name().to_owned()).collect(),
        parameters: candidate,
        intervals,
        optimism,
        evaluations,
        stop: stop.to_string(),
    })
}
