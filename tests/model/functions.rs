//! Standard test functions with known minima (M. Molga and C. Smutnicki, "Test functions for optimization needs", 2005; the first four as
//! in the CEC 2014 and BBOB-2009 collections). Functions with a minimum in the middle of the box are shifted, so that an optimiser that
//! favours the middle has no advantage.

use leadlag::internal::optimize::SearchBox;
use std::f64::consts::{PI, TAU};

/// A function of any number of dimensions, or of a fixed one.
pub struct Function {
    pub name: &'static str,
    formula: fn(&[f64]) -> f64,
    /// The box, the same in all dimensions.
    lower: f64,
    upper: f64,
    /// Fixed number of dimensions.
    only: Option<usize>,
    /// Position of the minimum in the formula, the same in all dimensions, or a list.
    at: &'static [f64],
    minimum: fn(usize) -> f64,
    /// Moves the minimum from there.
    shift: f64,
    /// Size of its values, by which an error is judged.
    pub scale: f64,
}

impl Function {
    /// Its own number of dimensions, otherwise the requested one.
    pub fn dimensions(&self, wanted: usize) -> usize {
        self.only.unwrap_or(wanted)
    }

    pub fn space(&self, n: usize) -> SearchBox {
        SearchBox { lower: vec![self.lower; n], upper: vec![self.upper; n] }
    }

    fn shifts(&self, n: usize) -> impl Iterator<Item = f64> {
        // Differently in every dimension.
        let shift = self.shift;
        (0..n).map(move |i| shift * (1.0 - 0.3 * (i % 3) as f64))
    }

    pub fn value(&self, x: &[f64]) -> f64 {
        let moved: Vec<f64> = x.iter().zip(self.shifts(x.len())).map(|(x, shift)| x - shift).collect();
        (self.formula)(&moved)
    }

    pub fn minimiser(&self, n: usize) -> Vec<f64> {
        let at = |i: usize| if self.at.len() == 1 { self.at[0] } else { self.at[i] };
        self.shifts(n).enumerate().map(|(i, shift)| at(i) + shift).collect()
    }

    pub fn minimum(&self, n: usize) -> f64 {
        (self.minimum)(n)
    }
}

fn sum(x: &[f64], term: impl Fn(usize, f64) -> f64) -> f64 {
    x.iter().enumerate().map(|(i, x)| term(i, *x)).sum()
}

const fn zero(_: usize) -> f64 {
    0.0
}

const fn function(name: &'static str, formula: fn(&[f64]) -> f64, half_width: f64, shift: f64) -> Function {
    Function {
        name,
        formula,
        lower: -half_width,
        upper: half_width,
        only: None,
        at: &[0.0],
        minimum: zero,
        shift,
        scale: 1.0,
    }
}

pub const SPHERE: Function = function("sphere", |x| sum(x, |_, x| x * x), 5.0, 1.3);

pub const ELLIPSOID: Function =
    function("ellipsoid", |x| sum(x, |i, y| 1e6f64.powf(i as f64 / (x.len() as f64 - 1.0)) * y * y), 5.0, 1.3);

pub const BENT_CIGAR: Function =
    function("bent cigar", |x| sum(x, |i, x| if i == 0 { x * x } else { 1e6 * x * x }), 5.0, 1.3);

pub const DISCUS: Function = function("discus", |x| sum(x, |i, x| if i == 0 { 1e6 * x * x } else { x * x }), 5.0, 1.3);

pub const ROSENBROCK: Function = Function {
    at: &[1.0],
    ..function(
        "Rosenbrock",
        |x| x.windows(2).map(|w| 100.0 * (w[1] - w[0] * w[0]).powi(2) + (1.0 - w[0]).powi(2)).sum(),
        5.0,
        0.0,
    )
};

pub const RASTRIGIN: Function =
    function("Rastrigin", |x| sum(x, |_, x| x * x - 10.0 * (TAU * x).cos() + 10.0), 5.12, 0.7);

pub const ACKLEY: Function = function(
    "Ackley",
    |x| {
        let n = x.len() as f64;
        let (square, cosine) = (sum(x, |_, x| x * x) / n, sum(x, |_, x| (TAU * x).cos()) / n);
        -20.0 * (-0.2 * square.sqrt()).exp() - cosine.exp() + 20.0 + std::f64::consts::E
    },
    32.0,
    5.0,
);

pub const GRIEWANK: Function = Function {
    // Its local minima are 0.0074 apart.
    scale: 1e3,
    ..function(
        "Griewank",
        |x| {
            let product: f64 = x.iter().enumerate().map(|(i, x)| (x / ((i + 1) as f64).sqrt()).cos()).product();
            sum(x, |_, x| x * x) / 4000.0 - product + 1.0
        },
        600.0,
        50.0,
    )
};

pub const SCHWEFEL: Function = Function {
    lower: -500.0,
    upper: 500.0,
    at: &[420.968_746_359_982],
    minimum: |n| -418.982_887_272_433_8 * n as f64,
    scale: 100.0,
    ..function("Schwefel", |x| sum(x, |_, x| -x * x.abs().sqrt().sin()), 500.0, 0.0)
};

pub const LEVY: Function = Function {
    at: &[1.0],
    ..function(
        "Levy",
        |x| {
            let w: Vec<f64> = x.iter().map(|x| 1.0 + (x - 1.0) / 4.0).collect();
            let last = w[w.len() - 1];
            let between = |w: f64| (w - 1.0).powi(2) * (1.0 + 10.0 * (PI * w + 1.0).sin().powi(2));
            (PI * w[0]).sin().powi(2)
                + w[..w.len() - 1].iter().map(|w| between(*w)).sum::<f64>()
                + (last - 1.0).powi(2) * (1.0 + (TAU * last).sin().powi(2))
        },
        10.0,
        0.0,
    )
};

pub const ZAKHAROV: Function = function(
    "Zakharov",
    |x| {
        let linear = sum(x, |i, x| 0.5 * (i + 1) as f64 * x);
        sum(x, |_, x| x * x) + linear.powi(2) + linear.powi(4)
    },
    10.0,
    1.1,
);

pub const DIFFERENT_POWERS: Function = function(
    "different powers",
    |x| sum(x, |i, y| y.abs().powf(2.0 + 4.0 * i as f64 / (x.len() as f64 - 1.0))).sqrt(),
    5.0,
    1.3,
);

pub const HARTMANN: Function = Function {
    lower: 0.0,
    upper: 1.0,
    only: Some(3),
    at: &[0.114_589_34, 0.555_648_85, 0.852_546_98],
    minimum: |_| -3.862_782_147_8,
    ..function("Hartmann", hartmann, 1.0, 0.0)
};

fn hartmann(x: &[f64]) -> f64 {
    const ALPHA: [f64; 4] = [1.0, 1.2, 3.0, 3.2];
    const A: [[f64; 3]; 4] = [[3.0, 10.0, 30.0], [0.1, 10.0, 35.0], [3.0, 10.0, 30.0], [0.1, 10.0, 35.0]];
    const P: [[f64; 3]; 4] =
        [[0.3689, 0.1170, 0.2673], [0.4699, 0.4387, 0.7470], [0.1091, 0.8732, 0.5547], [0.0381, 0.5743, 0.8828]];
    let exponent = |k: usize| sum(x, |j, x| A[k][j] * (x - P[k][j]).powi(2));
    -(0..4).map(|k| ALPHA[k] * (-exponent(k)).exp()).sum::<f64>()
}

pub const BRANIN: Function = Function {
    lower: -5.0,
    upper: 15.0,
    only: Some(2),
    at: &[PI, 2.275],
    minimum: |_| 0.397_887_357_729_738_2,
    ..function(
        "Branin",
        |x| {
            let bow = x[1] - 5.1 / (4.0 * PI * PI) * x[0] * x[0] + 5.0 / PI * x[0] - 6.0;
            bow * bow + 10.0 * (1.0 - 1.0 / (8.0 * PI)) * x[0].cos() + 10.0
        },
        10.0,
        0.0,
    )
};

/// All of them.
pub const ALL: &[Function] = &[
    SPHERE,
    ELLIPSOID,
    BENT_CIGAR,
    DISCUS,
    ROSENBROCK,
    RASTRIGIN,
    ACKLEY,
    GRIEWANK,
    SCHWEFEL,
    LEVY,
    ZAKHAROV,
    DIFFERENT_POWERS,
    HARTMANN,
    BRANIN,
];
