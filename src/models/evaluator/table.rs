//! Look-up tables in constant time: cells of equal width with at most one node each.
//!
//! A cell knows the curve on both sides of its node as a line, and the value at the node itself. So curves may jump at a node (the
//! authors' look-up in MFC curves does), and no binary search, which is slow on a GPU, is needed.

use super::course::CourseError;
use crate::convention::{GradeLookup, MfcLookup};
use crate::trajectory::Grade;
use crate::vehicle::Mfc;

/// A straight line c + m (x - node).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Value at the cell's node.
    pub c: f64,
    /// Slope.
    pub m: f64,
}

/// A curve within one cell: the value is `at` where x equals the node, else on the line of its side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cell {
    /// Value at the node.
    pub at: f64,
    /// Line below the node.
    pub below: Line,
    /// Line above the node.
    pub above: Line,
}

/// Curves over one variable: cell k begins at `origin` + k/`per_width`; values outside belong to the first or last cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Where the first cell begins.
    pub origin: f64,
    /// Cells per unit of the variable.
    pub per_width: f64,
    /// The node of each cell; the middle of a cell that has none.
    pub node: Vec<f64>,
    /// Each curve, cell by cell.
    pub curves: Vec<Vec<Cell>>,
}

/// Largest number of cells of a table: 50 MB with two curves. The kernels clip an index into a table at this number, too.
const MAX_CELLS: f64 = 1_000_000.0;

/// Distance of a node from the line between its neighbours, in the sine of the grade, up to which it counts as lying on it: 1e-5 m/s², a
/// thousandth of the resolution of any survey of a road.
const ON_A_LINE: f64 = 1e-6;

/// A curve as intervals between nodes: `interval(k)` is (x, value at x, slope) of the line from node k to k + 1; k = -1 lies
/// below all nodes, k = n - 1 above all.
struct Curve<'a> {
    at: &'a dyn Fn(usize) -> f64,
    interval: &'a dyn Fn(isize) -> (f64, f64, f64),
}

impl Table {
    /// Sine of the grade over the position, after taking it modulo a closed track. Fails if nodes lie so close together that the table would not fit.
    pub fn grade(grade: &Grade, rule: GradeLookup) -> Result<Table, CourseError> {
        let (x, y) = thinned(&grade.x, &grade.sin);
        let last = x.len() - 1;
        let held = rule == GradeLookup::Held && x.len() >= 4;
        let value = |k: usize| match k {
            0 if held => y[1],
            k if held && k == last => y[last - 1],
            k => y[k],
        };
        let interval = |k: isize| match usize::try_from(k) {
            Ok(k) if k < last => (x[k], value(k), (value(k + 1) - value(k)) / (x[k + 1] - x[k])),
            Ok(_) => (x[last], value(last), 0.0),
            Err(_) => (x[0], value(0), 0.0),
        };
        Table::build("grade", &x, &[Curve { at: &value, interval: &interval }])
    }

    /// (a_dp, a_ap) over the speed.
    pub fn mfc(mfc: &Mfc, rule: MfcLookup) -> Result<Table, CourseError> {
        let (v, last) = (&mfc.v, mfc.v.len() - 1);
        // The segment whose line is read in interval k.
        let segment = |k: usize| match rule {
            MfcLookup::Linear => k,
            MfcLookup::Bisection => last_of_bisection(v.len(), k),
        };
        let line = |y: &[f64], k: isize| {
            let Ok(k) = usize::try_from(k) else { return (v[0], y[0], 0.0) };
            let k = segment(k);
            if k >= last { (v[last], y[last], 0.0) } else { (v[k], y[k], (y[k + 1] - y[k]) / (v[k + 1] - v[k])) }
        };
        let (a_dp, a_ap) = (&mfc.a_dp, &mfc.a_ap);
        let curves = [
            Curve { at: &|k| a_dp[k], interval: &|k| line(a_dp, k) },
            Curve { at: &|k| a_ap[k], interval: &|k| line(a_ap, k) },
        ];
        Table::build("MFC", v, &curves)
    }

    fn build(what: &'static str, nodes: &[f64], curves: &[Curve]) -> Result<Table, CourseError> {
        let spacings = nodes.windows(2).map(|w| w[1] - w[0]);
        let (least, most) = spacings.fold((f64::INFINITY, 0.0_f64), |(a, b), d| (a.min(d), b.max(d)));
        let width = match nodes.len() {
            1 => 1.0,
            // Equal spacings (up to rounding): one node in the middle of each cell.
            _ if most - least <= 1e-6 * least => (nodes[nodes.len() - 1] - nodes[0]) / (nodes.len() - 1) as f64,
            // A little narrower than the closest two nodes, so that no cell holds both.
            _ => 0.9 * least,
        };
        let origin = nodes[0] - 0.5 * width;
        let cells = ((nodes[nodes.len() - 1] - origin) / width).floor() + 1.0;
        if cells > MAX_CELLS {
            return Err(CourseError::Table { what, cells, limit: MAX_CELLS, closest: least });
        }
        let mut table =
            Table { origin, per_width: 1.0 / width, node: Vec::new(), curves: vec![Vec::new(); curves.len()] };
        let mut next = 0;
        for cell in 0..cells as usize {
            let own = next < nodes.len() && table.place_of(nodes[next]) == cell as f64;
            // The middle of a cell without a node is a good place to anchor its line.
            let node = if own { nodes[next] } else { origin + (cell as f64 + 0.5) * width };
            table.node.push(node);
            for (i, curve) in curves.iter().enumerate() {
                let anchored = |k: isize| {
                    let (x, value, m) = (curve.interval)(k);
                    Line { c: value + m * (node - x), m }
                };
                let below = anchored(next as isize - 1);
                let above = if own { anchored(next as isize) } else { below };
                let at = if own { (curve.at)(next) } else { below.c };
                table.curves[i].push(Cell { at, below, above });
            }
            next += usize::from(own);
        }
        debug_assert_eq!(next, nodes.len(), "every node has a cell of its own");
        Ok(table)
    }

    /// Distance of `x` from the origin in cells; 0 below it.
    fn place_of(&self, x: f64) -> f64 {
        ((x - self.origin) * self.per_width).floor().max(0.0)
    }

    /// The cell that `x` belongs to.
    pub fn cell_of(&self, x: f64) -> usize {
        (self.place_of(x) as usize).min(self.node.len() - 1)
    }
}

/// Drops nodes that are too close to their neighbour for a table and on a line with it: a grade recorded over time has nodes millimetres
/// apart while the car crept.
fn thinned(x: &[f64], y: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let last = x.len() - 1;
    // Half of the cells for the span leaves room for cells narrower than the closest nodes.
    let closest = (x[last] - x[0]) / (0.5 * MAX_CELLS);
    let (mut kept_x, mut kept_y) = (vec![x[0]], vec![y[0]]);
    for k in 1..=last {
        let (x_0, y_0) = (kept_x[kept_x.len() - 1], kept_y[kept_y.len() - 1]);
        if k < last && x[k] - x_0 < closest {
            let between = y_0 + (y[k + 1] - y_0) * (x[k] - x_0) / (x[k + 1] - x_0);
            if (y[k] - between).abs() < ON_A_LINE {
                continue;
            }
        }
        kept_x.push(x[k]);
        kept_y.push(y[k]);
    }
    (kept_x, kept_y)
}

/// The last node that a bisection visits for a value strictly between nodes k and k + 1 of `n`, or above the last.
fn last_of_bisection(n: usize, k: usize) -> usize {
    let (mut low, mut high, mut middle) = (0, n, 0);
    while low < high {
        middle = usize::midpoint(low, high);
        if middle <= k {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    middle
}
