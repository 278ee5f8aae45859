//! The evaluator: cases and candidates in, scores out.

use super::compile::error::LanesError;
use super::compile::model::Model;
use super::run::core::{Core, Finished, History, Observing, Traces};
use super::run::products::Bins;
use super::run::real::Real;
use super::run::simd::InstructionSet;
use super::run::stream::Stream;
use super::run::sums::{Adding, Settings};
use crate::convention::BoundRule;
use crate::evaluator::{
    BufferSet, Case, Course, Differences, EvaluateError, Evaluator, Failure, Innovations, Job, Observed, Observer,
    Outcome, Population, Products, Pull, Raw, Residuals, SIGNALS, Score, Slopes, Windows,
};
use crate::score::GoodnessOfFit;
use crate::symbols::Parameters;
use crate::text::spelling::UnknownWord;
use crate::wgsl::{Precision, Recipe, Source, check};
use std::sync::OnceLock;

/// Precision of a run on the CPU, by its name on the command line and in results.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, Hash, Default, strum::EnumString, strum::IntoStaticStr, strum::VariantNames,
)]
#[strum(const_into_str, serialize_all = "snake_case", parse_err_ty = UnknownWord, parse_err_fn = unknown)]
pub enum LanesPrecision {
    /// f32, one word per state and sum.
    #[default]
    Plain,
    /// f32, two words for spacing, speed and every sum.
    Compensated,
    /// f64, of the plain text.
    F64,
}

fn unknown(found: &str) -> UnknownWord {
    UnknownWord::of::<LanesPrecision>("precision", found)
}

#[derive(Debug)]
enum Engine {
    F32(Box<Core<f32, 128, 32>>),
    F64(Box<Core<f64, 64, { Lanes::TRACES }>>),
}

impl Engine {
    /// Blocks of the model of the cases' variant; with `observed` they carry a missing acceleration.
    fn new(
        cases: &[Case],
        courses: &[Course],
        gof: &GoodnessOfFit,
        (precision, set): (LanesPrecision, InstructionSet),
        observed: bool,
        replace: &dyn Fn(&str, &str) -> Option<String>,
    ) -> Result<Engine, EvaluateError> {
        let text = match precision {
            LanesPrecision::Plain | LanesPrecision::F64 => Precision::Plain,
            LanesPrecision::Compensated => Precision::Compensated,
        };
        let (variant, radicand) = (cases[0].variant, cases[0].convention.radicand);
        let recipe = Recipe { variant, precision: text, radicand, observed };
        let source = Source::model_with(&recipe, replace);
        let checked = check(&source).map_err(LanesError::from)?;
        let model = Model::compile(&source, &checked, &recipe)?;
        Ok(match precision {
            LanesPrecision::F64 => Engine::F64(Box::new(Core::new(streams(cases, courses, gof), model, false, set))),
            LanesPrecision::Plain | LanesPrecision::Compensated => {
                let compensated = precision == LanesPrecision::Compensated;
                Engine::F32(Box::new(Core::new(streams(cases, courses, gof), model, compensated, set)))
            }
        })
    }
}

impl Engine {
    /// The same with another instruction set and blocks of at most this many lanes.
    fn with(self, set: InstructionSet, only: Option<usize>) -> Engine {
        match self {
            Engine::F32(core) => Engine::F32(Box::new(core.with(set, only))),
            Engine::F64(core) => Engine::F64(Box::new(core.with(set, only))),
        }
    }
}

/// Does the same with either engine.
macro_rules! with_engine {
    ($engine:expr, $core:ident => $body:expr) => {
        match $engine {
            Engine::F32($core) => $body,
            Engine::F64($core) => $body,
        }
    };
}

/// The WGSL text of one variant on the CPU, over one or several cases.
#[derive(Debug)]
pub struct Lanes {
    cases: Vec<Case>,
    courses: Vec<Course>,
    gof: GoodnessOfFit,
    precision: LanesPrecision,
    set: InstructionSet,
    /// Only blocks of at most this many lanes, for tests.
    only: Option<usize>,
    engine: Engine,
    /// The same model with an observer; made at its first use.
    observing: OnceLock<Engine>,
    finished: [Vec<Finished>; 2],
}

impl Lanes {
    /// An evaluator of these cases; the score is the mean of `gof` over them.
    ///
    /// # Errors
    /// [`EvaluateError::Course`] if a case cannot be laid out; [`EvaluateError::Model`] if the text cannot run.
    ///
    /// # Panics
    /// Without cases, or if they were prepared for different variants or conventions of the start.
    pub fn new(cases: Vec<Case>, gof: GoodnessOfFit, precision: LanesPrecision) -> Result<Lanes, EvaluateError> {
        Lanes::with_texts(cases, gof, precision, &|_, _| None)
    }

    /// As [`Lanes::new`], but `replace` may replace the text of a file, given its path and its text; for mutation tests.
    ///
    /// # Errors
    /// As [`Lanes::new`].
    ///
    /// # Panics
    /// As [`Lanes::new`].
    #[doc(hidden)]
    pub fn with_texts(
        cases: Vec<Case>,
        gof: GoodnessOfFit,
        precision: LanesPrecision,
        replace: &dyn Fn(&str, &str) -> Option<String>,
    ) -> Result<Lanes, EvaluateError> {
        let first = cases.first().expect("at least one case");
        let (variant, radicand) = (first.variant, first.convention.radicand);
        assert!(cases.iter().all(|c| c.variant == variant), "cases of one variant");
        assert!(cases.iter().all(|c| c.convention.radicand == radicand), "cases that start alike");
        if precision != LanesPrecision::F64 {
            cases.iter().try_for_each(Case::check_clock)?;
        }
        let courses: Vec<Course> = cases.iter().map(Course::new).collect::<Result<_, _>>()?;
        let set = InstructionSet::best();
        let engine = Engine::new(&cases, &courses, &gof, (precision, set), false, replace)?;
        let (only, observing, finished) = (None, OnceLock::new(), [Vec::new(), Vec::new()]);
        Ok(Lanes { cases, courses, gof, precision, set, only, engine, observing, finished })
    }

    /// The same with another instruction set, for tests: all give the same bits.
    ///
    /// # Panics
    /// If this processor does not have it.
    #[must_use]
    pub fn with_instructions(self, set: InstructionSet) -> Lanes {
        let only = self.only;
        self.rebuilt(set, only)
    }

    /// The same with blocks of at most this many lanes, for tests: all give the same bits.
    #[must_use]
    pub fn with_lanes(self, lanes: usize) -> Lanes {
        let set = self.set;
        self.rebuilt(set, Some(lanes))
    }

    fn rebuilt(self, set: InstructionSet, only: Option<usize>) -> Lanes {
        Lanes { set, only, engine: self.engine.with(set, only), observing: OnceLock::new(), ..self }
    }

    /// Status, cuts and all sums of each candidate, in the order of the jobs.
    ///
    /// # Errors
    /// [`EvaluateError::Delay`].
    pub fn raw(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Raw>, EvaluateError> {
        let mut finished = Vec::new();
        self.run(jobs, Adding::All, &mut finished)?;
        Ok(finished.into_iter().map(|f| f.raw).collect())
    }

    /// Runs that are corrected towards the measurement, one observer per candidate, and their sums over blocks of samples.
    ///
    /// # Errors
    /// [`EvaluateError::Delay`], [`EvaluateError::Model`].
    ///
    /// # Panics
    /// Unless there is one observer per candidate, and at least one sample in a block.
    pub fn observed(
        &self,
        job: &Job<'_>,
        observers: &[Observer],
        block: usize,
    ) -> Result<Vec<Observed>, EvaluateError> {
        assert_eq!(job.population.len(), observers.len(), "one observer per candidate");
        assert!(block > 0, "blocks of at least one sample");
        let settings = settings(Adding::All, self.compensated(), true, Some(block));
        with_engine!(self.observing()?, core => core.observed(self.of(job, &settings, observers)))
    }

    /// Runs that are corrected towards the measurement, sample by sample, one observer per candidate.
    ///
    /// # Errors
    /// [`EvaluateError::Delay`], [`EvaluateError::Model`].
    ///
    /// # Panics
    /// Unless there is one observer per candidate.
    pub fn innovations(&self, job: &Job<'_>, observers: &[Observer]) -> Result<Vec<Innovations>, EvaluateError> {
        assert_eq!(job.population.len(), observers.len(), "one observer per candidate");
        let settings = settings(Adding::Nothing, self.compensated(), false, None);
        with_engine!(self.observing()?, core => core.innovations(self.of(job, &settings, observers)))
    }

    /// The residuals of the same runs alone, the same numbers in less time and memory: `each` receives stretches of samples in order, up to
    /// the last one or until all candidates have failed. Returns where runs ended early.
    ///
    /// # Errors
    /// [`EvaluateError::Delay`], [`EvaluateError::Model`].
    ///
    /// # Panics
    /// Unless there is one observer per candidate.
    pub fn residuals(
        &self,
        job: &Job<'_>,
        observers: &[Observer],
        each: &mut dyn FnMut(&Residuals),
    ) -> Result<Vec<Option<Failure>>, EvaluateError> {
        assert_eq!(job.population.len(), observers.len(), "one observer per candidate");
        let settings = settings(Adding::Nothing, self.compensated(), false, None);
        with_engine!(self.observing()?, core => core.residuals(self.of(job, &settings, observers), each))
    }

    /// The residuals of free simulations, as [`Lanes::residuals`]. `windows` resets them to the measurement, and so does a failure: the
    /// residuals of that sample are NaN. The memory of a model continues.
    ///
    /// # Errors
    /// [`EvaluateError::Delay`], [`EvaluateError::Model`].
    pub fn free_residuals(
        &self,
        job: &Job<'_>,
        windows: Option<Windows>,
        each: &mut dyn FnMut(&Residuals),
    ) -> Result<Vec<Option<Failure>>, EvaluateError> {
        let settings =
            Settings { windows, goes_on: true, ..settings(Adding::Nothing, self.compensated(), false, None) };
        let free = vec![Observer::NONE; job.population.len()];
        with_engine!(self.observing()?, core => core.residuals(self.of(job, &settings, &free), each))
    }

    /// Scores of pulled runs, and the sums of squares of their shortfalls \[m²\].
    ///
    /// # Errors
    /// [`EvaluateError::Delay`], [`EvaluateError::Model`].
    pub fn pulled(&self, job: &Job<'_>, pull: Pull) -> Result<Vec<(Score, f64)>, EvaluateError> {
        let (engine, settings, observers) = self.pulling(job, pull)?;
        let settings = Settings { reaches: true, ..settings };
        with_engine!(engine, core => core.soft_scores(self.of(job, &settings, &observers)))
    }

    /// Scores of pulled runs with their derivatives, by finite differences; in the order of `differences`.
    ///
    /// # Errors
    /// [`EvaluateError::Delay`], [`EvaluateError::Model`].
    ///
    /// # Panics
    /// If differences name missing candidates.
    pub fn slopes(&self, job: &Job<'_>, differences: &[Differences], pull: Pull) -> Result<Vec<Slopes>, EvaluateError> {
        let (engine, settings, observers) = self.pulling(job, pull)?;
        let settings = Settings { reaches: true, ..settings };
        with_engine!(engine, core => core.slopes(self.of(job, &settings, &observers), differences))
    }

    /// Sums of products of the errors of pulled runs and of their derivatives, bin by bin; in the order of `differences`, `None` where a
    /// run fails.
    ///
    /// # Errors
    /// [`EvaluateError::Delay`], [`EvaluateError::Model`].
    ///
    /// # Panics
    /// If differences name missing candidates.
    pub fn products<'a>(
        &self,
        job: &Job<'_>,
        pull: Pull,
        differences: &'a [Differences],
        bins: Bins<'a>,
    ) -> Result<Vec<Option<Products<'a>>>, EvaluateError> {
        let (engine, settings, observers) = self.pulling(job, pull)?;
        with_engine!(engine, core => core.products(self.of(job, &settings, &observers), (differences, bins)))
    }

    /// Sums of squares of the errors of pulled runs, bin by bin: of spacing, speed, acceleration, and shortfall; `None` for a run that
    /// fails.
    ///
    /// # Errors
    /// [`EvaluateError::Delay`], [`EvaluateError::Model`].
    pub fn squares(
        &self,
        job: &Job<'_>,
        pull: Pull,
        bins: Bins<'_>,
    ) -> Result<Vec<Option<Vec<[f64; SIGNALS]>>>, EvaluateError> {
        let (engine, settings, observers) = self.pulling(job, pull)?;
        with_engine!(engine, core => core.squares(self.of(job, &settings, &observers), bins))
    }

    /// Residuals of free runs whose squares add up to the score, one vector per candidate: those of spacing, then of speed, then of
    /// acceleration, one per sample of the drive; 0 before the first simulated sample and for a signal that is not compared. The vector of
    /// a run that fails is undefined.
    ///
    /// # Errors
    /// [`EvaluateError::Delay`], [`EvaluateError::Model`].
    pub fn norm_residuals(&self, job: &Job<'_>) -> Result<Vec<Vec<f64>>, EvaluateError> {
        let (engine, settings, observers) = self.pulling(job, Pull::NONE)?;
        with_engine!(engine, core => core.norm_residuals(self.of(job, &settings, &observers)))
    }

    fn of<'a>(&'a self, job: &'a Job<'a>, settings: &'a Settings, observers: &'a [Observer]) -> Observing<'a> {
        Observing { cases: &self.cases, job, settings, observers }
    }

    /// Runs without a pull need no observer.
    fn pulling(&self, job: &Job<'_>, pull: Pull) -> Result<(&Engine, Settings, Vec<Observer>), EvaluateError> {
        let adding = Adding::One(self.gof.accumulation());
        let counts = self.cases[job.case].convention.bounds == BoundRule::Reject;
        let settings = Settings { soft: pull.soft, ..settings(adding, self.compensated(), counts, None) };
        if pull.share == 0.0 {
            return Ok((&self.engine, settings, Vec::new()));
        }
        let observer = Observer { gain: [pull.share, 0.0, 0.0, pull.share, 0.0, 0.0], ..Observer::NONE };
        Ok((self.observing()?, settings, vec![observer; job.population.len()]))
    }

    fn observing(&self) -> Result<&Engine, EvaluateError> {
        if let Some(engine) = self.observing.get() {
            return Ok(engine);
        }
        let how = (self.precision, self.set);
        let engine = Engine::new(&self.cases, &self.courses, &self.gof, how, true, &|_, _| None)?;
        let engine = if self.only.is_some() { engine.with(self.set, self.only) } else { engine };
        // Another thread may have been faster; both results are the same.
        Ok(self.observing.get_or_init(|| engine))
    }

    /// The states (spacing, speed, acceleration) of one candidate at the samples from `from` to `to` - 1; `history` has its spacing, speed
    /// and acceleration at the samples before `from`. Ends early if the run fails.
    ///
    /// # Errors
    /// [`EvaluateError::Delay`].
    ///
    /// # Panics
    /// If `from` is 0, or the history is shorter.
    pub fn trace(
        &self,
        case: usize,
        parameters: &Parameters,
        history: [&[f64]; 3],
        from: usize,
        to: usize,
    ) -> Result<Vec<[f64; 3]>, EvaluateError> {
        self.traces(case, parameters, history, Traces { from: &[from], kicks: &[], to })
            .map(|mut traces| traces.remove(0))
    }

    /// The same from each of several samples, with a kick added to spacing, speed and acceleration at the previous sample. Samples that are
    /// close to each other share a block of [`Lanes::TRACES`].
    ///
    /// # Errors
    /// [`EvaluateError::Delay`].
    ///
    /// # Panics
    /// If a sample is 0, or the history is shorter.
    pub fn kicked(
        &self,
        case: usize,
        parameters: &Parameters,
        history: [&[f64]; 3],
        (from, kicks): (&[usize], &[[f64; 3]]),
        to: usize,
    ) -> Result<Vec<Vec<[f64; 3]>>, EvaluateError> {
        assert_eq!(from.len(), kicks.len(), "one kick per sample");
        self.traces(case, parameters, history, Traces { from, kicks, to })
    }

    /// Traces that share a block.
    pub const TRACES: usize = 16;

    fn traces(
        &self,
        case: usize,
        parameters: &Parameters,
        history: History<'_>,
        traces: Traces<'_>,
    ) -> Result<Vec<Vec<[f64; 3]>>, EvaluateError> {
        assert!(traces.from.iter().all(|from| *from > 0), "a step needs a state to start from");
        let symbols = self.cases[case].variant.parameters();
        let mut population = Population::new(&symbols);
        population.push(&symbols.iter().map(|symbol| parameters.get(*symbol)).collect::<Vec<_>>());
        let compensated = self.compensated();
        with_engine!(&self.engine, core => {
            let settings = settings(Adding::All, compensated, true, None);
            core.traces(&self.cases[case], case, &population, &settings, history, traces)
        })
    }

    fn compensated(&self) -> bool {
        self.precision == LanesPrecision::Compensated
    }

    fn run(&mut self, jobs: &[Job<'_>], adding: Adding, results: &mut Vec<Finished>) -> Result<(), EvaluateError> {
        let compensated = self.compensated();
        with_engine!(&mut self.engine, core => {
            let counts = adding == Adding::All || core.streams.iter().any(|stream| stream.rejects);
            core.run(&self.cases, jobs, &settings(adding, compensated, counts, None), results)
        })
    }
}

fn streams<T: Real>(cases: &[Case], courses: &[Course], gof: &GoodnessOfFit) -> Vec<Stream<T>> {
    cases.iter().zip(courses).map(|(case, course)| Stream::new(case, course, gof)).collect()
}

fn settings(adding: Adding, compensated: bool, counts: bool, block: Option<usize>) -> Settings {
    Settings { adding, compensated, counts, block, windows: None, goes_on: false, soft: None, reaches: false }
}

impl Evaluator for Lanes {
    fn cases(&self) -> &[Case] {
        &self.cases
    }

    fn gof(&self) -> &GoodnessOfFit {
        &self.gof
    }

    fn name(&self) -> &'static str {
        "lanes"
    }

    fn precision(&self) -> &'static str {
        self.precision.into_str()
    }

    fn submit(&mut self, set: BufferSet, jobs: &[Job<'_>]) -> Result<(), EvaluateError> {
        let mut finished = std::mem::take(&mut self.finished[set as usize]);
        let result = self.run(jobs, Adding::One(self.gof.accumulation()), &mut finished);
        self.finished[set as usize] = finished;
        result
    }

    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError> {
        let finished = &self.finished[set as usize];
        if scores.len() != finished.len() {
            return Err(EvaluateError::Room { candidates: finished.len(), scores: scores.len() });
        }
        for (score, finished) in scores.iter_mut().zip(finished) {
            *score = finished.score;
        }
        Ok(())
    }

    fn outcomes(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Outcome>, EvaluateError> {
        let raw = self.raw(jobs)?;
        Ok(Raw::outcomes(&raw, jobs, &self.cases, &self.courses))
    }
}
