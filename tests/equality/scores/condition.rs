//! Sensitivity of a score to its parameters, in f64.

use super::{ending, lanes};
use crate::common::cars::Random;
use crate::common::gpu::scores;
use leadlag::internal::evaluator::{Case, Population, Score};
use leadlag::internal::lanes::LanesPrecision;
use leadlag::internal::reference::{Reference, Trace};
use leadlag::internal::symbols::{Parameters, Symbol};

/// Relative changes of the parameters: far above the roundings of f64, and five roundings of f32.
const CHANGES: [f64; 2] = [1e-9, 3e-7];
/// Patterns of signs per change.
const PATTERNS: usize = 8;

/// Copies of a candidate whose parameters are changed by `change` of themselves, up or down.
fn push_changed(into: &mut Population, case: &Case, candidate: &[f64], change: f64, random: &mut Random) {
    let symbols = into.symbols().to_vec();
    for _ in 0..PATTERNS {
        let value = |(symbol, value): (&Symbol, &f64)| {
            let changed = value * (1.0 + if random.next() < 0.5 { change } else { -change });
            if *symbol == Symbol::tau_p { changed.min(case.tau_p_upper) } else { changed }
        };
        into.push(&symbols.iter().zip(candidate).map(value).collect::<Vec<f64>>());
    }
}

/// Scores in f64, and condition numbers: relative change of the score over that of the parameters, the largest one found;
/// infinite if the run ends otherwise.
pub fn scores_and_conditions(case: &Case, population: &Population) -> (Vec<Score>, Vec<f64>) {
    let mut all = population.clone();
    for i in 0..population.len() {
        let mut random = Random(1 + i as u64);
        for change in CHANGES {
            push_changed(&mut all, case, population.values(i), change, &mut random);
        }
    }
    let mut exact = scores(&mut lanes(case, LanesPrecision::F64), &all);
    let changed = exact.split_off(population.len());
    let condition = |(score, changed): (&Score, &[Score])| {
        let ratios = changed.chunks_exact(PATTERNS).zip(CHANGES).flat_map(|(group, change)| {
            group.iter().map(move |other| match (score, other) {
                (Score::Value(f), Score::Value(other)) => ((other - f) / f).abs() / change,
                (a, b) if ending(a) == ending(b) => 0.0,
                _ => f64::INFINITY,
            })
        });
        ratios.fold(0.0, f64::max)
    };
    let conditions = exact.iter().zip(changed.chunks_exact(PATTERNS * CHANGES.len())).map(condition).collect();
    (exact, conditions)
}

/// The smallest relative change of the parameters, of a few tried, at which the run ends otherwise in f64; infinite if none.
pub fn distance(case: &Case, symbols: &[Symbol], candidate: &[f64]) -> f64 {
    let changes: Vec<f64> = (2..=16).map(|half_decades| 10.0_f64.powf(-10.0 + 0.5 * f64::from(half_decades))).collect();
    let mut population = Population::new(symbols);
    population.push(candidate);
    let mut random = Random(1);
    for change in &changes {
        push_changed(&mut population, case, candidate, *change, &mut random);
    }
    let exact = scores(&mut lanes(case, LanesPrecision::F64), &population);
    let ends_otherwise = |group: &[Score]| group.iter().any(|score| ending(score) != ending(&exact[0]));
    let mut found = exact[1..].chunks_exact(PATTERNS).zip(&changes).filter(|(group, _)| ends_otherwise(group));
    found.next().map_or(f64::INFINITY, |(_, change)| *change)
}

/// The smallest spacing of the reference's run [m].
pub fn smallest_spacing(case: &Case, parameters: &Parameters) -> f64 {
    let mut trace = Trace::default();
    let _ = Reference::outcome(case, parameters, &mut trace);
    trace.s.iter().copied().fold(f64::INFINITY, f64::min)
}
