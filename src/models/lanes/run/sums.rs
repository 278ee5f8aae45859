//! Sums of a run, and the score that follows: `add` of shaders/sums.wgsl, `total` and `score` of shaders/kernel.wgsl.
#![allow(clippy::needless_range_loop, reason = "loops over rows of lanes, in the form that is vectorised")]

use super::real::Real;
use super::rows;
use super::simd::Lane;
use super::stream::{NormOf, Stream};
use crate::evaluator::{Observer, SIGNALS, Soft, Windows};
use crate::score::Accumulation;
use std::hint::select_unpredictable;

/// Kind of the sums.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Adding {
    /// Nothing: the caller reads the run sample by sample and computes its own sums.
    Nothing,
    /// For one goodness of fit.
    One(Accumulation),
    /// For all measures.
    All,
}

/// The observers of a block, one per lane, in the precision of a run.
#[derive(Debug)]
pub struct Observers<T, const L: usize> {
    gain: [Lane<T, L>; 6],
    whitening: [Lane<T, L>; 3],
}

impl<T: Real, const L: usize> Observers<T, L> {
    pub fn new() -> Self {
        Observers { gain: [Lane::ZERO; 6], whitening: [Lane::ZERO; 3] }
    }

    pub fn set(&mut self, lane: usize, observer: &Observer) {
        for (row, value) in self.gain.iter_mut().zip(observer.gain) {
            row.0[lane] = T::of(value);
        }
        for (row, value) in self.whitening.iter_mut().zip(observer.whitening) {
            row.0[lane] = T::of(value);
        }
    }
}

/// How runs add up.
#[derive(Debug, Clone, Copy)]
pub struct Settings {
    pub adding: Adding,
    pub compensated: bool,
    /// False if the number of touched acceleration bounds is not needed.
    pub counts: bool,
    /// Samples in a block of sums of whitened squares, if they are requested.
    pub block: Option<usize>,
    /// Where runs are reset to the measurement; `None`: never.
    pub windows: Option<Windows>,
    /// True if a run that fails continues from the measurement, with NaN as its residuals of that sample.
    pub goes_on: bool,
    /// Continuation of runs beyond a collision, if they continue.
    pub soft: Option<Soft>,
    /// True if such runs also pay where Gipps' radicand falls below the least value \[m²/s²\].
    pub reaches: bool,
}

/// The lanes that completed a step.
#[derive(Debug, Clone, Copy)]
pub struct Went<'a, T, const L: usize> {
    /// True if all did.
    pub all: bool,
    /// 1 in these lanes.
    pub row: &'a [T; L],
}

/// Sums of spacing, speed and acceleration, with their rounding errors.
#[derive(Debug, Clone)]
struct Triple<T, const L: usize> {
    high: [Lane<T, L>; 3],
    low: [Lane<T, L>; 3],
}

/// The sums of a block.
#[derive(Debug)]
pub struct Sums<T, const L: usize> {
    error2: Triple<T, L>,
    simulated2: Triple<T, L>,
    relative2: Triple<T, L>,
    floored2: Triple<T, L>,
    block: [Lane<T, L>; 2],
    pub observers: Observers<T, L>,
    /// Residuals of spacing and speed.
    pub residual: [Lane<T, L>; 2],
    /// Errors of spacing, speed and acceleration with the weights of the goodness of fit, and the shortfall of the spacing \[m\], to which
    /// a convention that rejects candidates at an acceleration bound adds the cut part \[m/s²\].
    pub weighted: [Lane<T, L>; SIGNALS],
    pub shortfall2: Lane<T, L>,
    /// False if all shortfalls of the last sample are 0.
    pub falls_short: bool,
    /// Per block of samples and lane; used with an observer only.
    pub blocks: Vec<[Lane<T, L>; 2]>,
}

impl<T: Real, const L: usize> Triple<T, L> {
    const ZERO: Self = Triple { high: [Lane::ZERO; 3], low: [Lane::ZERO; 3] };

    /// Adds the square of `term`.
    #[inline(always)]
    fn add_square(&mut self, k: usize, compensated: bool, term: &[T; L], went: Went<'_, T, L>) {
        if compensated {
            rows::add_square_compensated(term, went.row, &mut self.high[k].0, &mut self.low[k].0);
        } else if went.all {
            rows::add_square(term, T::ZERO, T::ONE, &mut self.high[k].0);
        } else {
            rows::add_square_where(term, T::ZERO, T::ONE, went.row, &mut self.high[k].0);
        }
    }

    /// Adds the square of (y - `measured`) `factor`.
    #[inline(always)]
    fn add_error(&mut self, k: usize, compensated: bool, y: &[T; L], [measured, factor]: [T; 2], went: Went<'_, T, L>) {
        if compensated {
            let mut term = [T::ZERO; L];
            rows::errors(y, measured, factor, &mut term);
            self.add_square(k, compensated, &term, went);
        } else if went.all {
            rows::add_square(y, measured, factor, &mut self.high[k].0);
        } else {
            rows::add_square_where(y, measured, factor, went.row, &mut self.high[k].0);
        }
    }

    fn total(&self, lane: usize, compensated: bool) -> [T; 3] {
        [0, 1, 2].map(|k| {
            let high = self.high[k].0[lane];
            if compensated { high + self.low[k].0[lane] } else { high }
        })
    }
}

impl<T: Real, const L: usize> Sums<T, L> {
    pub fn new() -> Self {
        let zero = Triple::ZERO;
        Sums {
            error2: zero.clone(),
            simulated2: zero.clone(),
            relative2: zero.clone(),
            floored2: zero,
            block: [Lane::ZERO; 2],
            observers: Observers::new(),
            residual: [Lane::ZERO; 2],
            weighted: [Lane::ZERO; SIGNALS],
            shortfall2: Lane::ZERO,
            falls_short: false,
            blocks: Vec::new(),
        }
    }

    pub fn begin(&mut self, settings: &Settings, samples: usize) {
        for sum in [&mut self.error2, &mut self.simulated2, &mut self.relative2, &mut self.floored2] {
            sum.high = [Lane::ZERO; 3];
            sum.low = [Lane::ZERO; 3];
        }
        self.weighted = [Lane::ZERO; SIGNALS];
        self.shortfall2 = Lane::ZERO;
        self.falls_short = false;
        self.block = [Lane::ZERO; 2];
        self.blocks.clear();
        if let Some(block) = settings.block {
            self.blocks.resize(samples.div_ceil(block), [Lane::ZERO; 2]);
        }
    }

    /// Adds sample t with the state in `rows`, in the lanes that continued.
    #[inline(always)]
    pub fn add(&mut self, settings: &Settings, stream: &Stream<T>, rows: [&[T; L]; 3], went: Went<'_, T, L>, t: usize) {
        if settings.adding == Adding::Nothing {
            return;
        }
        let compensated = settings.compensated;
        for k in 0..3 {
            let row = rows[k];
            let measured = stream.measured[k][t];
            let floored = if k == 1 { stream.v_denominator[t] } else { measured };
            let relative = || [measured, stream.per_denominator[k][t]];
            match settings.adding {
                Adding::One(Accumulation::Relative) => {
                    self.error2.add_error(k, compensated, row, relative(), went);
                }
                Adding::One(Accumulation::Floored) => {
                    self.error2.add_error(k, compensated, row, [floored, T::ONE], went);
                }
                _ => self.error2.add_error(k, compensated, row, [measured, T::ONE], went),
            }
            if matches!(settings.adding, Adding::All | Adding::One(Accumulation::Theil)) {
                self.simulated2.add_square(k, compensated, row, went);
            }
            if settings.adding == Adding::All {
                self.relative2.add_error(k, compensated, row, relative(), went);
                if k == 1 {
                    self.floored2.add_error(k, compensated, row, [floored, T::ONE], went);
                }
            }
        }
    }

    /// The errors of sample t that a goodness of fit squares, 0 in the lanes that have ended.
    #[inline(always)]
    pub fn weigh(
        &mut self,
        settings: &Settings,
        stream: &Stream<T>,
        rows: [&[T; L]; 3],
        went: Went<'_, T, L>,
        t: usize,
    ) {
        for k in 0..3 {
            let measured = stream.measured[k][t];
            let [measured, factor] = match settings.adding {
                Adding::One(Accumulation::Relative) => [measured, stream.per_denominator[k][t]],
                Adding::One(Accumulation::Floored) if k == 1 => [stream.v_denominator[t], T::ONE],
                _ => [measured, T::ONE],
            };
            let to = &mut self.weighted[k].0;
            if went.all {
                rows::errors(rows[k], measured, factor, to);
            } else {
                rows::errors_where(rows[k], measured, factor, went.row, to);
            }
        }
    }

    /// Shortfalls of a sample at which no lane has one.
    #[inline(always)]
    pub fn clear_shortfalls(&mut self) {
        if self.falls_short {
            self.weighted[3] = Lane::ZERO;
            self.falls_short = false;
        }
    }

    /// Corrects spacing, speed and missing acceleration by the residuals at sample t.
    #[inline(always)]
    pub fn observe(&mut self, stream: &Stream<T>, [s, v, d]: [&mut [T; L]; 3], t: usize) {
        let measured = [stream.measured[0][t], stream.measured[1][t]];
        let [r_s, r_v] = &mut self.residual;
        rows::observe(s, v, d, &mut r_s.0, &mut r_v.0, measured, &self.observers.gain);
    }

    /// Puts spacing and speed on their measured values at sample t.
    #[inline(never)]
    pub fn put_back(&mut self, stream: &Stream<T>, [s, v]: [&mut [T; L]; 2], t: usize) {
        s.fill(stream.measured[0][t]);
        v.fill(stream.measured[1][t].larger(T::ZERO));
    }

    /// Adds up the squares of the whitened residuals of sample t, in the lanes that continued.
    #[inline(always)]
    pub fn add_white(&mut self, block: usize, went: &[T; L], t: usize, end: usize) {
        let whitening = &self.observers.whitening;
        for i in 0..L {
            let error = [self.residual[0].0[i], self.residual[1].0[i]];
            let white = [whitening[0].0[i] * error[0], whitening[1].0[i] * error[0] + whitening[2].0[i] * error[1]];
            for k in 0..2 {
                let white = select_unpredictable(went[i] != T::ZERO, white[k], T::ZERO);
                self.block[k].0[i] = self.block[k].0[i] + white * white;
            }
        }
        if (t + 1).is_multiple_of(block) || t + 1 == end {
            let done = &mut self.blocks[t / block];
            for k in 0..2 {
                for i in 0..L {
                    done[k].0[i] = if went[i] != T::ZERO { self.block[k].0[i] } else { T::ZERO };
                }
            }
            self.block = [Lane::ZERO; 2];
        }
    }

    /// Totals of a lane: error2, simulated2, relative2, floored2.
    pub fn totals(&self, lane: usize, compensated: bool) -> [[T; 3]; 4] {
        [&self.error2, &self.simulated2, &self.relative2, &self.floored2].map(|sum| sum.total(lane, compensated))
    }

    /// The goodness of fit of a lane; NaN if it is undefined.
    pub fn score(&self, lane: usize, settings: &Settings, norm: &NormOf<T>) -> f64 {
        let [error2, simulated2, ..] = self.totals(lane, settings.compensated);
        let theil = settings.adding == Adding::One(Accumulation::Theil);
        let [s, v, a] = [0, 1, 2].map(|k| {
            let term = (error2[k] * norm.per_count[k]).sqrt() * norm.weight[k];
            if theil { term / ((simulated2[k] * norm.per_count[k]).sqrt() + norm.rms_measured[k]) } else { term }
        });
        let value = (s + v) + a;
        if Real::is_finite(value) { value.to_f64() } else { f64::NAN }
    }
}
