//! Finds the model that describes the drives best. On the data of its fit, the larger of two nested models always does, so the comparison
//! uses other scores: those on held-back data, or those expected on other drives of the same drivers.
//!
//! Whether a difference is significant depends on the noise of the samples in its sum. They are dependent: the residuals of a free
//! simulation are autocorrelated. One drive counts as its equivalent number of independent samples.

use super::work::{Task, case, task};
use super::{Drive, Pair, Place, Row, Settings};
use crate::convention::Denominators;
use crate::evaluator::{Case, EvaluateError};
use crate::identify::{Optimism, student};
use crate::reference::Trace;
use crate::rescore;
use crate::score::{Accumulation, GoodnessOfFit, Measured, Measures};
use crate::statistics::{mean, sum_of_dependent};
use crate::study::outcome::{Behind, between};
use rayon::prelude::*;

/// The score on held-back data has no penalty.
const NONE: Optimism = Optimism { score: 0.0, noise: 0.0 };
/// Smallest number of pairs that a model needs for the comparison of means, as a share of those of the most successful
/// model.
const CONTENDS: f64 = 0.5;

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    /// By the score on held-back data.
    HeldBack,
    /// By the score that is expected on another drive of the same driver (Takeuchi's criterion, with autocorrelated noise).
    Expected,
    /// None: there are neither intervals nor held-back data.
    None,
}

impl Rule {
    /// The comparable measures.
    pub fn of(pairs: &[Pair], settings: &Settings) -> Rule {
        if pairs.iter().any(|pair| !pair.held.is_empty()) {
            Rule::HeldBack
        } else if settings.intervals {
            Rule::Expected
        } else {
            Rule::None
        }
    }
}

/// The score of a row by the rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HeldScore {
    /// The score; infinite if a run ends early.
    pub score: f64,
    /// RMSE of spacing \[m\], speed \[m/s\] and acceleration \[m/s²\], on held-back data.
    pub rmse: [Option<f64>; 3],
    /// NRMSE of spacing, speed and acceleration, on held-back data.
    pub nrmse: [Option<f64>; 3],
}

/// A model and measure beside the others of the measure.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ModelRank {
    /// Pairs on which it leads every other model by more than the noise.
    pub best: usize,
    /// Pairs on which a run on held-back data ends early.
    pub failed: usize,
    /// Distance from the lowest mean; 0 for that itself, `None` of a model that cannot be compared.
    pub behind: Option<Behind>,
    /// True for the one with the fewest searched parameters of those that cannot be distinguished from the lowest mean.
    pub chosen: bool,
}

/// Result of the comparison of the models.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    pub rule: Rule,
    /// One entry per row; `None` if there is nothing to compare.
    pub scores: Vec<Option<HeldScore>>,
    /// One entry per model and measure, measures first.
    pub ranks: Vec<ModelRank>,
}

/// Result of a row on the drives of the comparison.
struct Tested {
    model: usize,
    /// The score of the simulations, without the penalty.
    simulated: f64,
    own: HeldScore,
    /// For each drive: the terms of the three signals in the score, and the squares under their roots, sample by sample.
    drives: Vec<[Term; 3]>,
}

#[derive(Default)]
struct Term {
    /// Factor of the root of the sum of the squares in the score.
    weight: f64,
    squares: Vec<f64>,
}

/// Result of the comparison on one pair.
struct Compared {
    /// Scores by model.
    scores: Vec<(usize, HeldScore)>,
    /// The model that leads all others, if any.
    best: Option<usize>,
}

/// The logarithm of the ratio of two scores, its standard deviation by noise, and the number of independent pieces.
#[derive(Clone, Copy)]
struct Difference {
    value: f64,
    error: f64,
    pieces: f64,
}

impl Difference {
    fn half(&self) -> f64 {
        student(self.pieces - 1.0) * self.error
    }
}

/// Compares the models on each pair and over all. Fails when a simulation in f64 cannot run.
pub fn compare(pairs: &[Pair], settings: &Settings, rows: &[Row]) -> Result<Comparison, EvaluateError> {
    let rule = Rule::of(pairs, settings);
    let (models, measures) = (settings.models.len(), settings.measures.len());
    let mut comparison =
        Comparison { rule, scores: vec![None; rows.len()], ranks: vec![ModelRank::default(); models * measures] };
    let of_pair: Vec<&[Row]> = rows.chunk_by(|one, other| one.place.pair == other.place.pair).collect();
    for k in 0..measures {
        let ranks = &mut comparison.ranks[k * models..(k + 1) * models];
        // One entry per pair and model.
        let test = |own: &&[Row]| tested(rule, pairs, settings, own, k);
        let mut scores: Vec<Vec<Option<f64>>> = Vec::new();
        if rule != Rule::None {
            let found: Vec<Compared> = of_pair
                .par_iter()
                .map(|own| {
                    let all = test(own)?;
                    let counted = own.iter().filter(|row| row.place.measure == k && row.found.is_ok()).count();
                    let best = Some(&all).filter(|all| all.len() == counted).and_then(|all| best(all));
                    Ok(Compared { scores: all.iter().map(|one| (one.model, one.own)).collect(), best })
                })
                .collect::<Result<_, EvaluateError>>()?;
            let mut at = 0;
            for (own, Compared { scores: tested, best }) in of_pair.iter().zip(found) {
                let mut by_model = vec![None; models];
                for (model, score) in tested {
                    by_model[model] = Some(score.score);
                    ranks[model].failed += usize::from(score.score.is_infinite());
                    let row = own.iter().position(|row| row.place.model == model && row.place.measure == k);
                    comparison.scores[at + row.expect("it was tested")] = Some(score);
                }
                if let Some(best) = best {
                    ranks[best].best += 1;
                }
                at += own.len();
                scores.push(by_model);
            }
        }
        if let Some(lowest) = lowest(&scores, models) {
            let differences: Vec<Vec<Option<Difference>>> = of_pair
                .par_iter()
                .map(|own| {
                    let all = test(own)?;
                    let to = all.iter().find(|one| one.model == lowest);
                    let difference = |model| {
                        let one = all.iter().find(|one| one.model == model)?;
                        Some(one.minus(to?)).filter(|difference| difference.value.is_finite())
                    };
                    Ok((0..models).map(difference).collect())
                })
                .collect::<Result<_, EvaluateError>>()?;
            for (model, rank) in ranks.iter_mut().enumerate().filter(|(model, _)| contends(&scores, *model)) {
                let own: Vec<Difference> = differences.iter().filter_map(|pair| pair[model]).collect();
                rank.behind = behind(&own);
            }
        }
        choose(settings, ranks, rows, k);
    }
    Ok(comparison)
}

/// True if a model has scores on enough pairs.
fn contends(scores: &[Vec<Option<f64>>], model: usize) -> bool {
    let count = |model: usize| scores.iter().filter(|pair| pair[model].is_some_and(f64::is_finite)).count();
    let most = scores.first().map_or(0, |pair| (0..pair.len()).map(count).max().unwrap_or(0));
    count(model) > 0 && count(model) as f64 >= CONTENDS * most as f64
}

/// The model with the lowest mean logarithm of the score over the pairs on which all compared models have one.
fn lowest(scores: &[Vec<Option<f64>>], models: usize) -> Option<usize> {
    let contenders: Vec<usize> = (0..models).filter(|model| contends(scores, *model)).collect();
    let common: Vec<&Vec<Option<f64>>> =
        scores.iter().filter(|pair| contenders.iter().all(|model| pair[*model].is_some_and(f64::is_finite))).collect();
    let mean = |model: usize| mean(&common.iter().filter_map(|pair| pair[model].map(logarithm)).collect::<Vec<_>>());
    let means = contenders.into_iter().filter_map(|model| Some((mean(model)?, model)));
    means.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, model)| model)
}

/// The mean of differences with its interval.
fn behind(own: &[Difference]) -> Option<Behind> {
    let count = own.len() as f64;
    let values: Vec<f64> = own.iter().map(|one| one.value).collect();
    let mean = mean(&values)?;
    let within = own.iter().map(|one| one.error.powi(2)).sum::<f64>().sqrt() / count;
    let pieces: f64 = own.iter().map(|one| one.pieces).sum();
    let between = if own.len() > 1 { between(&values) } else { 0.0 };
    Some(Behind::around(mean, (student(pieces - 1.0) * within).max(between)))
}

/// The logarithm of a score, which may be 0 for a perfect fit.
fn logarithm(score: f64) -> f64 {
    score.clamp(f64::MIN_POSITIVE, f64::INFINITY).ln()
}

/// Marks the recommended model: of those that cannot be distinguished the one with the fewest searched parameters. Without a
/// comparison, the first of those that have most results.
fn choose(settings: &Settings, ranks: &mut [ModelRank], rows: &[Row], measure: usize) {
    let searched = |model: usize| {
        let model = &settings.models[model];
        let fixed = |name: &str| model.overrides.get(name).is_some_and(|[low, high]| low == high);
        model.variant.parameters().iter().filter(|symbol| !fixed(symbol.name())).count()
    };
    let results = |model: usize| {
        rows.iter().filter(|row| row.place.model == model && row.place.measure == measure && row.found.is_ok()).count()
    };
    let open = (0..ranks.len()).filter(|&m| ranks[m].behind.is_some_and(|behind| behind.is_open()));
    let mean = |m: usize| ranks[m].behind.map_or(0.0, |behind| behind.mean);
    let chosen = open
        .min_by(|&a, &b| searched(a).cmp(&searched(b)).then(mean(a).total_cmp(&mean(b))))
        .or_else(|| (0..ranks.len()).rev().max_by_key(|&m| results(m)));
    if let Some(chosen) = chosen {
        ranks[chosen].chosen = true;
    }
}

/// The model that leads every other one by more than the noise.
fn best(all: &[Tested]) -> Option<usize> {
    let lowest = all.iter().min_by(|a, b| a.own.score.total_cmp(&b.own.score))?;
    let is_ahead = |other: &Tested| {
        let difference = other.minus(lowest);
        difference.value > difference.half()
    };
    let mut others = all.iter().filter(|other| other.model != lowest.model);
    (lowest.own.score.is_finite() && all.len() > 1 && others.all(is_ahead)).then_some(lowest.model)
}

/// Results of the rows of a pair and measure on the drives of the comparison, without those that cannot be compared. All begin at the same sample.
fn tested(
    rule: Rule,
    pairs: &[Pair],
    settings: &Settings,
    rows: &[Row],
    measure: usize,
) -> Result<Vec<Tested>, EvaluateError> {
    let own = rows.iter().filter(|row| row.place.measure == measure);
    let found = own.filter_map(|row| {
        let found = row.found.as_ref().ok()?;
        let optimism = (rule == Rule::Expected).then_some(found.optimism);
        Some((task(pairs, settings, row.place).ok()?, found, optimism.map_or(Some(NONE), |optimism| optimism)?))
    });
    let found: Vec<_> = found.collect();
    // Every model uses the noise of the drive, because errors of one model would count as noise even if another model
    // explains them.
    let noise = found.iter().map(|(.., optimism)| optimism.noise).fold(f64::INFINITY, f64::min);
    let added = |optimism: &Optimism| optimism.score * if optimism.noise > 0.0 { noise / optimism.noise } else { 1.0 };
    let mut all: Vec<(Tested, Vec<Measures>, f64)> = found
        .iter()
        .map(|(task, _, optimism)| {
            let own = HeldScore { score: 0.0, rmse: [None; 3], nrmse: [None; 3] };
            (Tested { model: task.place.model, simulated: 0.0, own, drives: Vec::new() }, Vec::new(), added(optimism))
        })
        .collect();
    let Some(Place { pair, .. }) = found.first().map(|(task, ..)| task.place) else { return Ok(Vec::new()) };
    let drives: Vec<&Drive> =
        if rule == Rule::HeldBack { pairs[pair].held.iter().collect() } else { pairs[pair].drive.iter().collect() };
    let gof = &settings.measures[measure];
    let mut trace = Trace::default();
    let mut scored = 0;
    for drive in drives {
        let variant = |task: &Task| settings.models[task.place.model].variant;
        let cases = found.iter().map(|(task, ..)| case(drive, &task.space, &variant(task), settings.convention));
        // A held-back drive that is too short for one of the models is not used in the comparison.
        let Ok(cases) = cases.collect::<Result<Vec<Case>, _>>() else { continue };
        let parameters: Vec<_> =
            found.iter().map(|(task, found, _)| task.space.parameters(&found.parameters)).collect();
        let begin = cases.iter().zip(&parameters).map(|(case, own)| case.first_sample(case.delay(own))).max();
        let Some(earliest) = begin.filter(|begin| begin + 2 <= drive.trajectory.len()) else { continue };
        scored += 1;
        for ((case, parameters), (tested, measures, _)) in cases.into_iter().zip(&parameters).zip(&mut all) {
            let case = Case { earliest, ..case };
            match rescore::outcome(&case, parameters, &mut trace)?.result {
                Ok(own) => {
                    measures.push(own);
                    tested.drives.push(terms(&case, gof, earliest, &trace, &own));
                }
                Err(_) => tested.own.score = f64::INFINITY,
            }
        }
    }
    if scored == 0 {
        return Ok(Vec::new());
    }
    Ok(all
        .into_iter()
        .map(|(mut tested, measures, added)| {
            let scores: Vec<f64> = measures.iter().map(|measures| gof.of(measures)).collect();
            tested.simulated = mean(&scores).unwrap_or(f64::INFINITY);
            // The increase holds for small changes of the score; its squares add up unchanged. The score of a run that ends early stays infinite.
            if tested.own.score.is_finite() {
                tested.own.score = (tested.simulated.powi(2) + 2.0 * tested.simulated * added).sqrt();
            }
            let finite = |x: f64| x.is_finite().then_some(x);
            if let Some(mean) = Measures::mean(&measures).filter(|_| tested.own.score.is_finite()) {
                tested.own.rmse = mean.0.map(|signal| finite(signal.rmse));
                tested.own.nrmse = mean.0.map(|signal| finite(signal.nrmse));
            }
            tested
        })
        .collect())
}

/// The terms of a score.
fn terms(case: &Case, gof: &GoodnessOfFit, first: usize, trace: &Trace, measures: &Measures) -> [Term; 3] {
    let kind = gof.accumulation();
    let floored = [false, case.convention.denominators == Denominators::Floored, false];
    let signals = [(&trace.s, &case.s), (&trace.v, &case.v_f), (&trace.a, &case.a_f)];
    let norm = gof.norm(&[0, 1, 2].map(|k| Measured::of(&signals[k].1[first..], floored[k])));
    let mut terms: [Term; 3] = Default::default();
    for (k, (term, (simulated, observed))) in terms.iter_mut().zip(signals).enumerate() {
        if norm.per_count[k] <= 0.0 {
            continue;
        }
        term.weight = norm.weight[k];
        if kind == Accumulation::Theil {
            // Its denominator holds the size of the simulated signal, which hardly differs between models.
            let rmse = measures.0[k].rmse;
            term.weight *= if rmse > 0.0 { measures.0[k].u / rmse } else { 0.0 };
        }
        let square = |(simulated, observed): (&f64, &f64)| {
            kind.term(*simulated, *observed, floored[k]).powi(2) * norm.per_count[k]
        };
        term.squares = simulated[first..].iter().zip(&observed[first..]).map(square).collect();
    }
    terms
}

impl Tested {
    /// The difference of the scores. Its noise is that of the sum over the samples: √m - √n = Σ (m_t - n_t) / (√m + √n).
    fn minus(&self, other: &Tested) -> Difference {
        let value = logarithm(self.own.score) - logarithm(other.own.score);
        if self.drives.len() != other.drives.len() || !value.is_finite() {
            return Difference { value, error: 0.0, pieces: f64::INFINITY };
        }
        let count = self.drives.len() as f64;
        let (mut variance, mut pieces) = (0.0, 0.0);
        for (own, others) in self.drives.iter().zip(&other.drives) {
            let samples = own.iter().map(|term| term.squares.len()).max().unwrap_or(0);
            let mut series = vec![0.0; samples];
            for (own, others) in own.iter().zip(others) {
                let roots = [own, others].map(|term| term.squares.iter().sum::<f64>().sqrt());
                let factor = own.weight.midpoint(others.weight) / (roots[0] + roots[1]).max(f64::MIN_POSITIVE) / count;
                for (sum, (one, another)) in series.iter_mut().zip(own.squares.iter().zip(&others.squares)) {
                    *sum += (one - another) * factor;
                }
            }
            let (error, independent) = sum_of_dependent(&series);
            variance += error * error;
            pieces += independent;
        }
        let middle = self.simulated.midpoint(other.simulated).max(f64::MIN_POSITIVE);
        Difference { value, error: variance.sqrt() / middle, pieces }
    }
}
