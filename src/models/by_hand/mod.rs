//! A loop to compare with: IDM without extensions, written by hand as one fused loop over blocks of candidates.
//!
//! It interprets no text, checks only the spacing, and supports no other variant: an upper limit for the speed of an evaluator that runs
//! any text. It consists of plain arrays and loops, which the compiler vectorises; the function is compiled for several instruction sets,
//! and the processor chooses at run time.

mod real;

use crate::evaluator::{Case, Course, EvaluateError, Failure, FailureKind, Population, Score};
use crate::score::{GoodnessOfFit, Norm};
use crate::symbols::Parameters;
use rayon::prelude::*;
use real::Real;

/// Candidates that advance together: enough independent work to hide the latency of an operation.
const LANES: usize = 64;

type Lanes<T> = [T; LANES];

/// The values of one measured sample that the loop needs.
#[derive(Debug, Clone, Copy)]
struct Sample<T> {
    v_l_before: T,
    dx_l: T,
    s: T,
    v_f: T,
    a_f: T,
}

/// The measured drive in the precision of the loop.
#[derive(Debug, Clone)]
struct Road<T> {
    dt: T,
    start: [T; 2],
    samples: Vec<Sample<T>>,
}

/// A block of candidates, one array per parameter (reciprocals where Eq. 2 and 3 divide).
#[derive(Debug, Clone)]
struct Block<T> {
    delta: Lanes<T>,
    per_v_0: Lanes<T>,
    d_0: Lanes<T>,
    t_h: Lanes<T>,
    a_max: Lanes<T>,
    brake: Lanes<T>,
}

/// Sums of squared residuals of s, v, a and the lowest spacing of each candidate.
#[derive(Debug, Clone)]
struct Sums<T> {
    square: [Lanes<T>; 3],
    lowest: Lanes<T>,
}

/// The hand-written loop on one case.
#[derive(Debug, Clone)]
pub struct ByHand(Precise);

#[derive(Debug, Clone)]
enum Precise {
    F32(Native<f32>),
    F64(Native<f64>),
}

impl ByHand {
    /// Lays out a case of variant 1 (`idm`) in f32. Panics if the case belongs to another variant.
    pub fn f32(case: &Case, gof: &GoodnessOfFit) -> Result<ByHand, EvaluateError> {
        Native::new(case, gof).map(|native| ByHand(Precise::F32(native)))
    }

    /// The same in f64. Panics if the case belongs to another variant.
    pub fn f64(case: &Case, gof: &GoodnessOfFit) -> Result<ByHand, EvaluateError> {
        Native::new(case, gof).map(|native| ByHand(Precise::F64(native)))
    }

    /// One score per candidate. A failure does not keep its step, and has the last one.
    pub fn evaluate(&self, population: &Population, scores: &mut [Score]) -> Result<(), EvaluateError> {
        match &self.0 {
            Precise::F32(native) => native.evaluate(population, scores),
            Precise::F64(native) => native.evaluate(population, scores),
        }
    }
}

/// The loop in one precision.
#[derive(Debug, Clone)]
struct Native<T> {
    road: Road<T>,
    norm: Norm,
}

impl<T: Real> Native<T> {
    fn new(case: &Case, gof: &GoodnessOfFit) -> Result<Native<T>, EvaluateError> {
        assert_eq!(case.variant.id(), 1, "the hand-written loop is IDM without extensions");
        let course = Course::new(case)?;
        let of = T::of;
        let sample = |i: usize| Sample {
            v_l_before: of(course.v_l[i - 1]),
            dx_l: of(course.dx_l[i]),
            s: of(course.s[i]),
            v_f: of(course.v_f[i]),
            a_f: of(course.a_f[i]),
        };
        let road = Road {
            dt: of(course.dt),
            start: [of(course.s_start[0]), of(course.v_f[0])],
            samples: (1..course.samples()).map(sample).collect(),
        };
        Ok(Native { road, norm: course.norm(gof, 1) })
    }

    fn evaluate(&self, population: &Population, scores: &mut [Score]) -> Result<(), EvaluateError> {
        if scores.len() != population.len() {
            return Err(EvaluateError::Room { candidates: population.len(), scores: scores.len() });
        }
        scores.par_chunks_mut(LANES).enumerate().for_each(|(k, scores)| {
            let sums = fastest(&self.road, &block(population, k * LANES));
            for (lane, score) in scores.iter_mut().enumerate() {
                *score = self.score(&sums, lane);
            }
        });
        Ok(())
    }

    fn score(&self, sums: &Sums<T>, lane: usize) -> Score {
        // Also NaN: a lowest spacing of NaN is not above 0.
        if sums.lowest[lane].into() <= 0.0 || sums.lowest[lane].into().is_nan() {
            return Score::Failed(Failure { kind: FailureKind::Crash, step: self.road.samples.len() });
        }
        let term = |i: usize| (sums.square[i][lane].into() * self.norm.per_count[i]).sqrt() * self.norm.weight[i];
        Score::Value(term(0) + term(1) + term(2))
    }
}

/// Candidates from `first` on; the last one again where the population ends.
fn block<T: Real>(population: &Population, first: usize) -> Block<T> {
    let one = |lane: usize| population.parameters((first + lane).min(population.len() - 1));
    let lanes = |value: &dyn Fn(Parameters) -> f64| std::array::from_fn(|lane| T::of(value(one(lane))));
    Block {
        delta: lanes(&|p| p.delta),
        per_v_0: lanes(&|p| 1.0 / p.v_0),
        d_0: lanes(&|p| p.d_0),
        t_h: lanes(&|p| p.t_h),
        a_max: lanes(&|p| p.a_max),
        brake: lanes(&|p| 1.0 / (2.0 * (-p.a_max * p.a_min).sqrt())),
    }
}

/// The whole drive of one block: Eqs. 2 and 3, Eq. 1, the sums.
#[inline(always)]
fn drive<T: Real, const FUSED: bool>(road: &Road<T>, p: &Block<T>) -> Sums<T> {
    let (zero, one) = (T::of(0.0), T::of(1.0));
    let (half_dt, per_dt) = (T::of(0.5) * road.dt, one / road.dt);
    let mut s = [road.start[0]; LANES];
    let mut v = [road.start[1]; LANES];
    let mut lowest = s;
    let mut square = [[zero; LANES]; 3];
    for sample in &road.samples {
        // Stage by stage: within a stage no operation waits for another one, so that the processor can work on many lanes at once.
        let mut share = [zero; LANES];
        for i in 0..LANES {
            share[i] = v[i] * p.per_v_0[i];
        }
        let power = T::power::<LANES, FUSED>(&share, &p.delta);
        for i in 0..LANES {
            let dv = sample.v_l_before - v[i];
            let s_des = p.d_0[i] + (p.t_h[i] * v[i] - v[i] * dv * p.brake[i]).max(zero);
            let closeness = s_des / s[i];
            let a_cmd = p.a_max[i] * (one - power[i] - closeness * closeness);
            let v_next = (v[i] + a_cmd * road.dt).max(zero);
            let a = (v_next - v[i]) * per_dt;
            s[i] = s[i] + (sample.dx_l - (v[i] + v_next) * half_dt);
            v[i] = v_next;
            lowest[i] = lowest[i].min(s[i]);
            let (e_s, e_v, e_a) = (s[i] - sample.s, v_next - sample.v_f, a - sample.a_f);
            square[0][i] = square[0][i] + e_s * e_s;
            square[1][i] = square[1][i] + e_v * e_v;
            square[2][i] = square[2][i] + e_a * e_a;
        }
    }
    Sums { square, lowest }
}

/// The loop with fused multiply-adds, to be compiled for one instruction set after the other.
struct Fused<'a, T> {
    road: &'a Road<T>,
    block: &'a Block<T>,
}

impl<T: Real> pulp::WithSimd for Fused<'_, T> {
    type Output = Sums<T>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Sums<T> {
        drive::<T, true>(self.road, self.block)
    }
}

/// The loop with the best vector instructions of the processor. Without fused multiply-adds they would be library
/// calls, so the loop does not use them there.
fn fastest<T: Real>(road: &Road<T>, block: &Block<T>) -> Sums<T> {
    match pulp::Arch::new() {
        pulp::Arch::Scalar => drive::<T, false>(road, block),
        arch => arch.dispatch(Fused { road, block }),
    }
}
