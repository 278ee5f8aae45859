//! A course in the precision of a run.

use super::real::Real;
use crate::convention::BoundRule;
use crate::evaluator::{Case, Course, Table};
use crate::score::GoodnessOfFit;
use std::any::TypeId;

/// Sine of the grade: cells as in shaders/kernel.wgsl.
#[derive(Debug, Clone)]
pub struct GradeTable<T> {
    pub origin: T,
    pub per_width: T,
    pub node: Vec<T>,
    pub at: Vec<T>,
    /// Slopes below and above the node, cell by cell.
    pub slope: Vec<T>,
    /// Length of a closed track and its inverse, 0 for an open road.
    pub period: T,
    pub per_period: T,
}

/// a_dp and a_ap over the speed.
#[derive(Debug, Clone)]
pub struct MfcTable<T> {
    pub origin: T,
    pub per_width: T,
    pub node: Vec<T>,
    pub at: [Vec<T>; 2],
    /// Value at the node and slope of the lines below and above it, cell by cell, per curve.
    pub c: [Vec<T>; 2],
    pub m: [Vec<T>; 2],
}

/// How a score follows from the sums.
#[derive(Debug, Clone, Copy)]
pub struct NormOf<T> {
    pub per_count: [T; 3],
    pub weight: [T; 3],
    pub rms_measured: [T; 3],
}

/// What runs read of a case.
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
        let count = course.samples();
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
            norms: (0..=course.ring.min(count - 1)).map(norm).collect(),
            longest: course.ring - 2,
            rejects: case.convention.bounds == BoundRule::Reject,
        }
    }

    pub fn samples(&self) -> usize {
        self.v_l.len()
    }
}

fn grade<T: Real>(table: &Table, period: f64, per_period: f64) -> GradeTable<T> {
    let cells = &table.curves[0];
    GradeTable {
        origin: T::of(table.origin),
        per_width: T::of(table.per_width),
        node: all(&table.node),
        at: cells.iter().map(|cell| T::of(cell.at)).collect(),
        slope: cells.iter().flat_map(|cell| [cell.below.m, cell.above.m]).map(T::of).collect(),
        period: T::of(period),
        per_period: T::of(per_period),
    }
}

fn mfc<T: Real>(table: &Table) -> MfcTable<T> {
    let curves = [&table.curves[0], &table.curves[1]];
    MfcTable {
        origin: T::of(table.origin),
        per_width: T::of(table.per_width),
        node: all(&table.node),
        at: curves.map(|cells| cells.iter().map(|cell| T::of(cell.at)).collect()),
        c: curves.map(|cells| cells.iter().flat_map(|cell| [cell.below.c, cell.above.c]).map(T::of).collect()),
        m: curves.map(|cells| cells.iter().flat_map(|cell| [cell.below.m, cell.above.m]).map(T::of).collect()),
    }
}
