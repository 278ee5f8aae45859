//! A course in the precision of a run.

use super::real::Real;
use crate::convention::BoundRule;
use crate::evaluator::{Case, Course, Line, Table};
use crate::score::GoodnessOfFit;
use std::any::TypeId;

/// A table as in shaders/kernel.wgsl: C values per cell, the node first, and S values per side of the node, below and above by
/// turns.
#[derive(Debug, Clone)]
pub struct Cells<T, const C: usize, const S: usize> {
    pub origin: T,
    pub per_width: T,
    pub cells: Vec<[T; C]>,
    pub sides: Vec<[T; S]>,
}

/// Sine of the grade: node, value at the node; slope.
#[derive(Debug, Clone)]
pub struct GradeTable<T> {
    pub cells: Cells<T, 2, 1>,
    /// Length of a closed track and its inverse, 0 for an open road.
    pub period: T,
    pub per_period: T,
}

/// a_dp and a_ap over the speed: node, values at the node; line of a_dp (value at the node, slope), line of a_ap.
pub type MfcTable<T> = Cells<T, 3, 4>;

/// Coefficients of a score in the sums.
#[derive(Debug, Clone, Copy)]
pub struct NormOf<T> {
    pub per_count: [T; 3],
    pub weight: [T; 3],
    pub rms_measured: [T; 3],
}

/// World of extensions at each sample.
#[derive(Debug, Clone)]
pub struct WorldOf<T> {
    pub t: Vec<T>,
    /// a_l, v_l2, s_l2.
    pub ahead: [Vec<T>; 3],
    /// Length of a closed track and its inverse, 0 for an open road.
    pub period: T,
    pub per_period: T,
}

/// Data of a case that runs read.
#[derive(Debug, Clone)]
pub struct Stream<T> {
    pub job: [T; 3],
    pub v_l: Vec<T>,
    pub dx_l: Vec<T>,
    pub x_road: Vec<T>,
    pub s_start: Vec<T>,
    /// Measured spacing, speed and acceleration.
    pub measured: [Vec<T>; 3],
    pub v_denominator: Vec<T>,
    pub per_denominator: [Vec<T>; 3],
    pub grade: Option<GradeTable<T>>,
    pub mfc: Option<MfcTable<T>>,
    pub world: Option<WorldOf<T>>,
    /// By first sample.
    pub norms: Vec<NormOf<T>>,
    /// Longest delay in samples that can be remembered.
    pub longest: usize,
    /// True if a touched acceleration bound rejects a candidate.
    pub rejects: bool,
}

fn all<T: Real>(values: &[f64]) -> Vec<T> {
    values.iter().map(|x| T::of(*x)).collect()
}

impl<T: Real> Stream<T> {
    pub fn new(case: &Case, course: &Course, gof: &GoodnessOfFit) -> Stream<T> {
        let norm = |first: usize| {
            let norm = course.norm(gof, first);
            let of = |values: [f64; 3]| values.map(T::of);
            NormOf { per_count: of(norm.per_count), weight: of(norm.weight), rms_measured: of(norm.rms_measured) }
        };
        let dx_l = if TypeId::of::<T>() == TypeId::of::<f32>() {
            course.dx_l_f32().iter().map(|x| T::of(f64::from(*x))).collect()
        } else {
            all(&course.dx_l)
        };
        let per_period = if course.period > 0.0 { 1.0 / course.period } else { 0.0 };
        Stream {
            job: [course.m_0, course.phi_f, course.dt].map(T::of),
            v_l: all(&course.v_l),
            dx_l,
            x_road: all(&course.x_road),
            s_start: all(&course.s_start),
            measured: [&course.s, &course.v_f, &course.a_f].map(|y| all(y)),
            v_denominator: all(&course.v_denominator),
            per_denominator: [0, 1, 2].map(|i| all(&course.per_denominator[i])),
            grade: course.grade.as_ref().map(|table| grade(table, course.period, per_period)),
            mfc: course.mfc.as_ref().map(mfc),
            world: course.world.as_ref().map(|world| WorldOf {
                t: all(&world.t),
                ahead: [&world.a_l, &world.v_l2, &world.s_l2].map(|y| all(y)),
                period: T::of(course.period),
                per_period: T::of(per_period),
            }),
            norms: (0..course.firsts()).map(norm).collect(),
            longest: course.ring - 2,
            rejects: case.convention.bounds == BoundRule::Reject,
        }
    }

    pub fn samples(&self) -> usize {
        self.v_l.len()
    }
}

fn grade<T: Real>(table: &Table, period: f64, per_period: f64) -> GradeTable<T> {
    let nodes = table.node.iter().zip(&table.curves[0]);
    GradeTable {
        cells: Cells {
            origin: T::of(table.origin),
            per_width: T::of(table.per_width),
            cells: nodes.map(|(node, cell)| [*node, cell.at].map(T::of)).collect(),
            sides: table.curves[0].iter().flat_map(|cell| [[T::of(cell.below.m)], [T::of(cell.above.m)]]).collect(),
        },
        period: T::of(period),
        per_period: T::of(per_period),
    }
}

fn mfc<T: Real>(table: &Table) -> MfcTable<T> {
    let curves = || table.curves[0].iter().zip(&table.curves[1]);
    let lines = |dp: Line, ap: Line| [dp.c, dp.m, ap.c, ap.m].map(T::of);
    Cells {
        origin: T::of(table.origin),
        per_width: T::of(table.per_width),
        cells: table.node.iter().zip(curves()).map(|(node, (dp, ap))| [*node, dp.at, ap.at].map(T::of)).collect(),
        sides: curves().flat_map(|(dp, ap)| [lines(dp.below, ap.below), lines(dp.above, ap.above)]).collect(),
    }
}
