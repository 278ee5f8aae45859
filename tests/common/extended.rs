//! Models with extensions on a drive that has everything an extension may read.

use super::cars;
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Case, Population};
use leadlag::internal::extension::Extension;
use leadlag::internal::symbols::{Bounds, Symbol};
use leadlag::internal::trajectory::Trajectory;
use std::sync::LazyLock;

/// All base models, one with delay.
pub const BASES: [&str; 5] = ["idm", "gipps", "l-cth", "l-idm", "l-gipps+delay"];

/// Largest relative difference of a sum of squares between lanes in f64 and the reference: a run of 900 steps accumulates
/// the rounding errors of both. The sine of `periodic` is a polynomial, good to 1e-7.
pub const WHOLE_RUN: f64 = 1e-9;
pub const WHOLE_RUN_PERIODIC: f64 = 1e-5;

/// A drive with everything that an extension may read; made once, because it takes longer than any simulation of it.
static DRIVE: LazyLock<Trajectory> = LazyLock::new(|| {
    let mut trajectory = cars::drive(90.0);
    let count = trajectory.len();
    let ahead = |i: usize| trajectory.v_l[(i + 12).min(count - 1)];
    trajectory.v_l2 = Some((0..count).map(ahead).collect());
    trajectory.s_l2 = Some((0..count).map(|i| 20.0 + 0.01 * i as f64).collect());
    trajectory.t.iter_mut().for_each(|t| *t += 100.0);
    trajectory
});

/// That drive for a variant.
pub fn case(variant: Variant) -> Case {
    cars::case(&DRIVE, variant, Convention::PAPER)
}

/// Bounds of an extension's parameter.
pub fn bounds(symbol: Symbol) -> [f64; 2] {
    match symbol.bounds() {
        Bounds::Fixed(lower, upper) => [lower, upper],
        Bounds::PerVehicle => panic!("{} has no bounds of its own", symbol.name()),
    }
}

/// Sensible values of a base model's parameter: a calm car, whose run does not depend on the last digit.
fn calm(symbol: Symbol) -> [f64; 2] {
    match symbol {
        Symbol::delta => [2.0, 5.0],
        Symbol::k_s => [0.05, 0.2],
        Symbol::k_v => [0.3, 0.8],
        Symbol::k_0 => [0.2, 0.6],
        Symbol::theta => [0.2, 0.6],
        Symbol::v_0 => [30.0, 34.0],
        Symbol::d_0 => [2.0, 4.0],
        Symbol::t_h => [1.0, 1.8],
        Symbol::a_max => [1.0, 2.0],
        Symbol::a_min => [-2.5, -1.5],
        Symbol::a_hat_min => [-2.6, -2.0],
        Symbol::tau_p => [0.1, 0.4],
        Symbol::tau_a => [0.3, 0.5],
        // A law's own: the middle of its bounds.
        Symbol::Extension(row) => [0.4, 0.6].map(|share| row.lower + (row.upper - row.lower) * share),
        other => panic!("{} is not a parameter of these bases", other.name()),
    }
}

/// Candidates with sensible values, and the extensions' parameters spread over a part of their bounds around the neutral value.
pub fn spread(variant: Variant, count: usize) -> Population {
    let mut random = cars::Random(5);
    let mut population = Population::new(&variant.parameters());
    for i in 0..count {
        let value = |symbol: &Symbol| {
            let [lower, upper] = calm(*symbol);
            lower + (upper - lower) * random.next()
        };
        let of_base = |symbol: &&Symbol| variant.is_of_base(**symbol);
        let mut candidate: Vec<f64> = variant.parameters().iter().filter(of_base).map(value).collect();
        for (k, symbol) in variant.parameters()[candidate.len()..].iter().enumerate() {
            let [lower, upper] = bounds(*symbol);
            // A number between 0 and 1 that differs from candidate to candidate and from parameter to parameter.
            let share = ((i * 7 + k * 3) % 10) as f64 / 9.0;
            let value = match (symbol.name(), symbol.neutral()) {
                // Start and duration, within the drive.
                ("t0" | "t1" | "dur", _) => 10.0 + 150.0 * share,
                // Low enough to act from the start of a stretch.
                ("vlim", _) => 2.0 + 16.0 * share,
                ("road_x", _) => 3000.0 * share,
                (_, Some(neutral)) => {
                    // Limits bind only far from their neutral values.
                    let (end, most) = match (i % 2, neutral == 0.0) {
                        (0, true) => (upper, 0.3),
                        (_, true) => (lower, 0.3),
                        _ => (lower, 1.0),
                    };
                    neutral + most * share * (end - neutral)
                }
                (_, None) => lower.max(-2.0) + share * (upper.min(20.0) - lower.max(-2.0)),
            };
            candidate.push(value);
        }
        population.push(&candidate);
    }
    population
}

/// A base model with extensions.
pub fn with(base: &str, extensions: &[&'static Extension]) -> Variant {
    let base: Variant = base.parse().expect("a variant");
    extensions.iter().fold(base, |variant, extension| variant.with(extension).expect("no conflict"))
}
