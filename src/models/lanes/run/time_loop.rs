//! The time loop of shaders/kernel.wgsl, operation for operation, over a block of lanes.
//!
//! All lanes of a block step together. A lane that has failed or has not started continues to compute, unread: no operation reads another
//! lane, and its sums, counts and status are closed. A block can stop at any sample and continue from there.

use super::real::Real;
use super::rows;
use super::simd::{InstructionSet, Instructions, Lane, Registers};
use super::stream::{Stream, WorldOf};
use super::sums::{Settings, Sums, Went};
use super::tables::Lookups;
use crate::evaluator::{Job, Observer, status};
use crate::extension::{Initial, Signal};
use crate::lanes::compile::code::Row;
use crate::lanes::compile::model::Model;

/// A model ready for blocks of L lanes.
#[derive(Debug, Clone)]
pub struct Program<T, const L: usize> {
    pub model: Model,
    literals: Vec<(T, Row)>,
    /// Initial values of the memory, where they are numbers.
    memory: Vec<T>,
    prologue: Instructions<T, L>,
    steps: [Instructions<T, L>; 2],
    start: Instructions<T, L>,
}

impl<T: Real, const L: usize> Program<T, L> {
    pub fn new(model: &Model, set: InstructionSet) -> Self {
        let ready = |steps: &[_]| Instructions::new(steps, set, model.rows);
        let initial = |initial: &Initial| match *initial {
            Initial::Value(value) => T::literal(value),
            Initial::Measured(_) => T::ZERO,
        };
        Program {
            literals: model.literals.iter().map(|(value, row)| (T::literal(*value), *row)).collect(),
            memory: model.memory.iter().map(initial).collect(),
            prologue: ready(&model.prologue),
            steps: [ready(&model.steps[0].code), ready(&model.steps[1].code)],
            start: ready(&model.start),
            model: model.clone(),
        }
    }
}

/// One candidate of a block.
#[derive(Debug, Clone, Copy)]
pub struct Candidate {
    /// Its job, and its position in the population of the job.
    pub job: usize,
    pub index: usize,
    /// When it perceives and starts.
    pub back: usize,
    pub fraction: f64,
    pub first: usize,
    pub look_back: [(i32, f64); 2],
}

/// Input of a block.
pub struct Run<'a, T> {
    pub settings: &'a Settings,
    pub stream: &'a Stream<T>,
    pub jobs: &'a [Job<'a>],
    /// For each job, the column of each of the model's parameters in its population.
    pub columns: &'a [Vec<Option<usize>>],
    /// At least one.
    pub candidates: &'a [Candidate],
    /// The run begins at this sample, with these states at the samples from there to its first, instead of the measured ones.
    pub history: Option<(usize, &'a [[T; 3]])>,
    /// Added to the state at the sample before the first one of each candidate; may be empty.
    pub kicks: &'a [[T; 3]],
    /// One past the last sample.
    pub end: usize,
    /// Receives the states of all candidates, sample by sample.
    pub trace: Option<&'a mut Vec<[f64; 3]>>,
    /// One per candidate of the population; empty without.
    pub observers: &'a [Observer],
    /// Receives every lane's residuals of s and v, corrected s, v and d, and acceleration, sample by sample.
    pub record: Option<&'a mut Vec<[f64; 6]>>,
    /// Receives the residuals of s of all lanes, then those of v, sample by sample.
    pub residuals: Option<&'a mut Vec<f64>>,
    /// Receives the residuals that the goodness of fit squares: the errors of s, v and a of all lanes, and the shortfall of s, sample by sample.
    pub weighted: Option<&'a mut Vec<f64>>,
}

/// Progress of a block.
#[derive(Debug, Clone, Copy)]
struct Progress {
    /// The next sample.
    t: usize,
    /// The home of the present state.
    here: usize,
    /// Lanes that have not failed.
    running: usize,
}

/// Memory of a block, reused.
#[derive(Debug)]
pub struct Workspace<T, const L: usize> {
    pub registers: Registers<T, L>,
    /// Past spacing and speed, by sample modulo the length, a power of two.
    ring: Vec<[Lane<T, L>; 2]>,
    back: [usize; L],
    /// `back` as a number, to compare whole rows.
    back_row: Lane<T, L>,
    /// The delays of each chunk, each once.
    backs: Vec<Vec<usize>>,
    fraction: Lane<T, L>,
    first: [usize; L],
    /// 1 while a lane runs.
    alive: Lane<T, L>,
    /// 1 if a lane completed this step.
    went: Lane<T, L>,
    /// Samples at which lanes look up the speed of the preceding vehicle.
    look_back: [[(i32, T); L]; 2],
    lookups: Lookups<T, L>,
    pub sums: Sums<T, L>,
    pub status: [u32; L],
    /// Lanes that failed at this sample and continue from the measurement.
    fallen: Vec<usize>,
    pub cut_acc: [u32; L],
    pub cut_dec: [u32; L],
    progress: Progress,
    /// Room for the residuals of a stretch of samples.
    pub leaving: Vec<f64>,
}

impl<T: Real, const L: usize> Workspace<T, L> {
    pub fn new(program: &Program<T, L>, longest: usize) -> Self {
        let mut registers = Registers::new(program.model.rows);
        program.literals.iter().for_each(|(value, row)| registers.row_mut(*row).fill(*value));
        Workspace {
            registers,
            ring: vec![[Lane::ZERO; 2]; (longest + 2).next_power_of_two()],
            back: [0; L],
            back_row: Lane::ZERO,
            backs: vec![Vec::new(); L / rows::CHUNK],
            fraction: Lane::ZERO,
            first: [0; L],
            alive: Lane::ZERO,
            went: Lane::ZERO,
            look_back: [[(0, T::ZERO); L]; 2],
            lookups: Lookups::new(),
            sums: Sums::new(),
            status: [0; L],
            fallen: Vec::new(),
            cut_acc: [0; L],
            cut_dec: [0; L],
            progress: Progress { t: 0, here: 0, running: 0 },
            leaving: Vec::new(),
        }
    }

    /// Makes a block ready for its first sample.
    pub fn begin(&mut self, program: &Program<T, L>, what: &Run<'_, T>) {
        self.load(program, what);
        self.sums.begin(what.settings, what.end);
        self.registers.execute(&program.prologue);
        let running = self.status.iter().filter(|status| **status == 0).count();
        self.progress = Progress { t: what.history.map_or(0, |(begin, _)| begin), here: 0, running };
    }

    /// True at the end of a run, or when all of its lanes have failed.
    pub fn is_done(&self, what: &Run<'_, T>) -> bool {
        self.progress.running == 0 || self.progress.t >= what.end
    }

    /// Rows of the block's candidates. Lanes beyond them repeat the last, unread: a step takes less time if no lane is closed.
    fn load(&mut self, program: &Program<T, L>, what: &Run<'_, T>) {
        for (value, row) in what.stream.job.iter().zip(program.model.job) {
            self.registers.row_mut(row).fill(*value);
        }
        self.lookups.forget();
        self.cut_acc = [0; L];
        self.cut_dec = [0; L];
        self.alive = Lane::ZERO;
        for lane in 0..L {
            let candidate = what.candidates[lane.min(what.candidates.len() - 1)];
            let values = what.jobs[candidate.job].population.values(candidate.index);
            for ((_, row), column) in program.model.parameters.iter().zip(&what.columns[candidate.job]) {
                self.registers.row_mut(*row)[lane] = T::of(column.map_or(f64::NAN, |column| values[column]));
            }
            if let Some(observer) = what.observers.get(candidate.index) {
                self.sums.observers.set(lane, observer);
                if let Some(row) = program.model.decay {
                    self.registers.row_mut(row)[lane] = T::of(observer.decay);
                }
            }
            for k in 0..2 {
                let (back, fraction) = candidate.look_back[k];
                self.look_back[k][lane] = (back, T::of(fraction));
            }
            self.back[lane] = candidate.back;
            self.back_row.0[lane] = T::of(candidate.back as f64);
            self.fraction.0[lane] = T::of(candidate.fraction);
            self.first[lane] = candidate.first;
            // A minimum would hide NaN, so NaN must not reach it.
            let finite = values.iter().all(|value| Real::is_finite(T::of(*value)));
            let failed = status::FAILED | status::NOT_FINITE | candidate.first as u32;
            self.status[lane] = if finite { 0 } else { failed };
        }
        for (backs, of_chunk) in self.backs.iter_mut().zip(self.back.chunks(rows::CHUNK)) {
            backs.clear();
            backs.extend(of_chunk);
            backs.sort_unstable();
            backs.dedup();
        }
    }
}

/// Runs a block that has started up to a sample, or until all of its lanes have failed.
#[inline(always)]
pub fn run<T: Real, const L: usize>(
    program: &Program<T, L>,
    w: &mut Workspace<T, L>,
    what: &mut Run<'_, T>,
    until: usize,
) {
    let model = &program.model;
    let Run { settings, stream, .. } = *what;
    let mask = w.ring.len() - 1;
    let (begin, all_begun) = (*w.first.iter().min().unwrap_or(&0), *w.first.iter().max().unwrap_or(&0));
    let (nearest, farthest) = (*w.back.iter().min().unwrap_or(&0), *w.back.iter().max().unwrap_or(&0));
    let delayed = !model.undelayed;
    let Progress { mut t, mut here, mut running } = w.progress;
    let until = until.min(what.end);
    while t < until && running > 0 {
        if t >= begin {
            if t <= all_begun {
                for lane in 0..L {
                    w.alive.0[lane] = if w.status[lane] == 0 && t >= w.first[lane] { T::ONE } else { T::ZERO };
                }
                w.went = w.alive;
            }
            // Both rows then contain only 1.
            let whole = running == L && t >= all_begun;
            if delayed {
                perceive(w, stream, model.perceived, [nearest, farthest], t, mask);
            } else if model.reads_v_l {
                w.registers.row_mut(model.perceived[2]).fill(stream.v_l[t - 1]);
            }
            if let Some(table) = &stream.grade {
                w.lookups.go_to_place(table, stream.x_road[t - 1], w.registers.row(model.homes[here][0]));
                w.lookups.sin_grade(w.registers.row_mut(model.road[0]));
            }
            if let Some(table) = &stream.mfc {
                w.lookups.go_to_speed(table, w.registers.row(model.homes[here][1]));
                w.lookups.mfc_bound(0, w.registers.row_mut(model.road[1]));
                w.lookups.mfc_bound(1, w.registers.row_mut(model.road[2]));
            }
            if let Some(world) = &stream.world {
                give(w, model, stream, world, here, t);
            }
            let dx_l = w.registers.row_mut(model.dx_l);
            if model.dx_l_is_shared {
                dx_l[0] = stream.dx_l[t];
            } else {
                dx_l.fill(stream.dx_l[t]);
            }
            w.registers.execute(&program.steps[here]);
            let step = &model.steps[here];
            here = 1 - here;

            let home = &model.homes[here];
            let (a_free, s) = (w.registers.row(step.a_free), w.registers.row(home[0]));
            // Before any clamp: a minimum or maximum would hide a NaN.
            let feasible = step.feasible.map(|row| w.registers.row(row));
            // Most soft runs have no shortfall at most samples.
            let clear = match (settings.soft, step.reaching) {
                (Some(_), _) if !whole || stream.rejects => false,
                (Some(soft), Some(number)) if settings.reaches => {
                    let least = T::of(soft.least);
                    rows::all_clear(a_free, s, least) && rows::all_reach(w.registers.row(number), least)
                }
                (Some(soft), _) => rows::all_clear(a_free, s, T::of(soft.least)),
                (None, _) => false,
            };
            let all = whole
                && match settings.soft {
                    Some(_) => clear || rows::all_finite(a_free, s),
                    None => rows::all_fine(a_free, s) && feasible.is_none_or(rows::all_true),
                };
            let failing = !all
                && match feasible {
                    _ if settings.soft.is_some() => rows::went_finite(a_free, s, &w.alive.0, &mut w.went.0),
                    None => rows::went(a_free, s, &w.alive.0, &mut w.went.0),
                    Some(feasible) => rows::went_where(a_free, s, feasible, &w.alive.0, &mut w.went.0),
                };
            if settings.counts && step.a != step.a_free {
                rows::count(w.registers.row(step.a), a_free, &w.went.0, &mut w.cut_acc, &mut w.cut_dec);
            }
            if failing && settings.goes_on {
                put_back(w, stream, [home[0], home[1], home[2]], t);
            } else if failing {
                running -= close(w, program, 1 - here, t);
            }
            let rows = [w.registers.row(home[0]), w.registers.row(home[1]), w.registers.row(home[2])];
            let went = Went { all, row: &w.went.0 };
            // Who receives the errors computes the sums.
            match what.weighted {
                Some(_) => w.sums.weigh(settings, stream, rows, went, t),
                None => w.sums.add(settings, stream, rows, went, t),
            }
            if clear {
                w.sums.clear_shortfalls();
            } else if let Some(soft) = settings.soft {
                w.sums.falls_short = true;
                let shortfall = &mut w.sums.weighted[3].0;
                rows::shortfalls(rows[0], T::of(soft.least), &w.went.0, shortfall);
                if let Some(number) = step.reaching.filter(|_| settings.reaches) {
                    rows::add_shortfalls(w.registers.row(number), T::of(soft.least), &w.went.0, shortfall);
                }
                if stream.rejects && step.a != step.a_free {
                    let (a, a_free) = (w.registers.row(step.a), w.registers.row(step.a_free));
                    rows::add_cuts(a, a_free, &w.went.0, shortfall);
                }
                rows::add_square(shortfall, T::ZERO, T::ONE, &mut w.sums.shortfall2.0);
            }
            if let Some(missing) = model.missing {
                w.sums.observe(stream, w.registers.rows_mut([home[0], home[1], home[missing]]), t);
                if settings.windows.is_some_and(|windows| windows.holds(t)) {
                    w.sums.put_back(stream, w.registers.rows_mut([home[0], home[1]]), t);
                }
                for lane in w.fallen.drain(..) {
                    w.sums.residual[0].0[lane] = T::literal(f32::NAN);
                    w.sums.residual[1].0[lane] = T::literal(f32::NAN);
                }
                if let Some(block) = settings.block {
                    w.sums.add_white(block, &w.went.0, t, what.end);
                }
            }
        }
        if t < all_begun {
            running -= start(w, program, what, here, t);
        }
        if delayed {
            let home = &model.homes[here];
            let past = &mut w.ring[t & mask];
            past[0].0.copy_from_slice(w.registers.row(home[0]));
            past[1].0.copy_from_slice(w.registers.row(home[1]));
        }
        if let Some(trace) = what.trace.as_deref_mut() {
            let home = &model.homes[here];
            let state = |lane: usize| [0, 1, 2].map(|k| w.registers.row(home[k])[lane].to_f64());
            trace.extend((0..what.candidates.len()).map(state));
        }
        if let Some(record) = what.record.as_deref_mut() {
            let home = &model.homes[here];
            let missing = model.missing.map_or(home[2], |missing| home[missing]);
            for lane in 0..what.candidates.len() {
                let [r_s, r_v] = [0, 1].map(|k| w.sums.residual[k].0[lane]);
                let [s, v, d, a] = [home[0], home[1], missing, home[2]].map(|row| w.registers.row(row)[lane]);
                record.push([r_s, r_v, s, v, d, a].map(T::to_f64));
            }
        }
        if let Some(residuals) = what.residuals.as_deref_mut() {
            for row in &w.sums.residual {
                T::append(&row.0, residuals);
            }
        }
        if let Some(weighted) = what.weighted.as_deref_mut() {
            for row in &w.sums.weighted {
                T::append(&row.0, weighted);
            }
        }
        t += 1;
    }
    w.progress = Progress { t, here, running };
}

/// The time loop's look-ups for extensions, at the sample before `t`.
#[inline(never)]
fn give<T: Real, const L: usize>(
    w: &mut Workspace<T, L>,
    model: &Model,
    stream: &Stream<T>,
    world: &WorldOf<T>,
    home: usize,
    t: usize,
) {
    let given = &model.given;
    if let Some(row) = given.t {
        w.registers.row_mut(row).fill(world.t[t - 1]);
    }
    if let Some(row) = given.x_f {
        let s = *w.registers.row(model.homes[home][0]);
        let x_f = w.registers.row_mut(row);
        for i in 0..L {
            let x = stream.x_road[t - 1] - s[i];
            x_f[i] = if world.period > T::ZERO { x - world.period * (x * world.per_period).floor() } else { x };
        }
    }
    for (row, signal) in given.ahead.iter().zip(&world.ahead) {
        let Some(row) = row else { continue };
        let to = w.registers.row_mut(*row);
        if model.undelayed {
            to.fill(signal[t - 1]);
            continue;
        }
        for i in 0..L {
            let older = (t - 1).saturating_sub(w.back[i]);
            let younger = (older + 1).min(t - 1);
            to[i] = signal[older] + (signal[younger] - signal[older]) * w.fraction.0[i];
        }
    }
    for (row, look_back) in given.look_back.iter().zip(&w.look_back) {
        let Some(row) = row else { continue };
        let to = w.registers.row_mut(*row);
        let last = stream.v_l.len() as i32 - 1;
        for i in 0..L {
            let (back, fraction) = look_back[i];
            let at = t as i32 - 1 - back;
            let older = stream.v_l[at.clamp(0, last) as usize];
            let younger = stream.v_l[(at + 1).clamp(0, last) as usize];
            to[i] = older + (younger - older) * fraction;
        }
    }
}

/// Signals as perceived: between the samples t - 1 - back and the next, but no later than t - 1.
#[inline(always)]
fn perceive<T: Real, const L: usize>(
    w: &mut Workspace<T, L>,
    stream: &Stream<T>,
    to: [u16; 3],
    [nearest, farthest]: [usize; 2],
    t: usize,
    mask: usize,
) {
    let samples = |back: usize| {
        // A lane that has not started yet may ask for samples before the first.
        let older = (t - 1).saturating_sub(back);
        [older, (older + 1).min(t - 1)]
    };
    if nearest == farthest {
        let [older, younger] = samples(nearest);
        for signal in 0..2 {
            let (old, new) = (&w.ring[older & mask][signal].0, &w.ring[younger & mask][signal].0);
            rows::between(old, new, &w.fraction.0, w.registers.row_mut(to[signal]));
        }
        rows::leader(stream.v_l[older], stream.v_l[younger], &w.fraction.0, w.registers.row_mut(to[2]));
        return;
    }
    for (k, backs_of_chunk) in w.backs.iter().enumerate() {
        let mut perceived = [[T::ZERO; rows::CHUNK]; 3];
        let (fraction, backs) = (rows::chunk(&w.fraction.0, k), rows::chunk(&w.back_row.0, k));
        for &back in backs_of_chunk {
            let [older, younger] = samples(back);
            let past = |signal: usize| [older, younger].map(|at| rows::chunk(&w.ring[at & mask][signal].0, k));
            let ahead = [stream.v_l[older], stream.v_l[younger]];
            rows::between_where([past(0), past(1)], ahead, fraction, backs, T::of(back as f64), &mut perceived);
        }
        for (row, perceived) in to.into_iter().zip(&perceived) {
            w.registers.row_mut(row).as_chunks_mut().0[k] = *perceived;
        }
    }
}

/// Resets the lanes that failed in a step to the measurement, from which they continue.
#[cold]
#[inline(never)]
fn put_back<T: Real, const L: usize>(w: &mut Workspace<T, L>, stream: &Stream<T>, home: [u16; 3], t: usize) {
    for lane in 0..L {
        if w.alive.0[lane] == T::ZERO || w.went.0[lane] != T::ZERO {
            continue;
        }
        for (row, measured) in home.iter().zip(&stream.measured) {
            w.registers.row_mut(*row)[lane] = measured[t];
        }
        w.went.0[lane] = T::ONE;
        w.fallen.push(lane);
    }
}

/// Closes the lanes that failed in the step from home `from`; returns their number. Failures are rare, so the loop goes
/// lane by lane.
#[cold]
#[inline(never)]
fn close<T: Real, const L: usize>(w: &mut Workspace<T, L>, program: &Program<T, L>, from: usize, t: usize) -> usize {
    let step = &program.model.steps[from];
    let mut closed = 0;
    for lane in 0..L {
        if w.alive.0[lane] == T::ZERO || w.went.0[lane] != T::ZERO {
            continue;
        }
        let (a_free, a) = (w.registers.row(step.a_free)[lane], w.registers.row(step.a)[lane]);
        let kind = if !Real::is_finite(a_free) {
            status::NOT_FINITE
        } else {
            w.cut_acc[lane] += u32::from(a < a_free);
            w.cut_dec[lane] += u32::from(a > a_free);
            let feasible = step.feasible.is_none_or(|row| w.registers.row(row)[lane] != T::ZERO);
            if feasible { status::CRASH } else { status::RADICAND }
        };
        w.status[lane] = status::FAILED | kind | t as u32;
        w.alive.0[lane] = T::ZERO;
        closed += 1;
    }
    closed
}

/// The state at a sample before the first simulated one; returns the number of lanes that crash there.
#[inline(never)]
fn start<T: Real, const L: usize>(
    w: &mut Workspace<T, L>,
    program: &Program<T, L>,
    what: &Run<'_, T>,
    home: usize,
    t: usize,
) -> usize {
    let (model, stream) = (&program.model, what.stream);
    let x = [stream.s_start[t], stream.measured[1][t], stream.v_l[t]];
    for (row, value) in model.perceived.iter().zip(x) {
        w.registers.row_mut(*row).fill(value);
    }
    w.registers.execute(&program.start);
    let measured = [0, 1, 2].map(|k| stream.measured[k][t]);
    let history = what.history.map(|(begin, states)| states[t - begin]);
    let homes = &model.homes[home];
    let (motion, memory) = homes.split_at(homes.len() - model.memory.len());
    let waits = w.first.map(|first| t < first);
    for ((row, initial), number) in memory.iter().zip(&model.memory).zip(&program.memory) {
        let value = match initial {
            Initial::Value(_) => *number,
            Initial::Measured(Signal::S) => measured[0],
            Initial::Measured(Signal::Vf) => measured[1],
            Initial::Measured(Signal::Vl) => stream.v_l[t],
            Initial::Measured(Signal::Af) => measured[2],
        };
        let lanes = w.registers.row_mut(*row).iter_mut().zip(waits);
        lanes.filter(|(_, waits)| *waits).for_each(|(lane, _)| *lane = value);
    }
    let mut closed = 0;
    for lane in (0..L).filter(|lane| waits[*lane]) {
        let mut state = history.unwrap_or([w.registers.row(model.start_s)[lane], measured[1], measured[2]]);
        if let Some(kick) = what.kicks.get(lane).filter(|_| t + 1 == w.first[lane]) {
            state = [0, 1, 2].map(|k| state[k] + kick[k]);
        }
        for (k, row) in motion.iter().enumerate() {
            w.registers.row_mut(*row)[lane] = state.get(k).copied().unwrap_or(T::ZERO);
        }
        w.sums.residual[0].0[lane] = T::ZERO;
        w.sums.residual[1].0[lane] = T::ZERO;
        if w.status[lane] == 0 && state[0] <= T::ZERO {
            w.status[lane] = status::FAILED | status::CRASH | t as u32;
            closed += 1;
        }
    }
    closed
}
