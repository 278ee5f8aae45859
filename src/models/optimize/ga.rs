//! The paper's genetic algorithm, as documented by the PyPI package `geneticalgorithm` 1.0.2 (R. Solgi, MIT licence):
//! elitism, roulette-wheel selection, uniform crossover, one mutation over the whole range and one between the parents.

use super::{Member, Merit, Optimizer, SearchBox, stream};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Settings of the genetic algorithm; the defaults are those of the package and of the paper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GaSettings {
    /// Members of a generation.
    pub population_size: usize,
    /// Probability that one coordinate of a child mutates.
    pub mutation_probability: f64,
    /// Share of the population that survives as elite; at least one member if above 0.
    pub elit_ratio: f64,
    /// Probability that a selected parent takes part in crossover.
    pub crossover_probability: f64,
    /// Share of the population that is selected as parents and carried over.
    pub parents_portion: f64,
}

impl Default for GaSettings {
    fn default() -> Self {
        GaSettings {
            population_size: 100,
            mutation_probability: 0.1,
            elit_ratio: 0.01,
            crossover_probability: 0.5,
            parents_portion: 0.3,
        }
    }
}

/// The genetic algorithm.
///
/// It differs from the package in one point: infeasible members have no penalty value. They are sorted by the time that they survived, and
/// have no weight in the roulette wheel, whose worst member is the worst feasible one. A penalty would be worse than that one, and give the
/// feasible ones nearly the same weight.
#[derive(Debug, Clone)]
pub struct Ga {
    settings: GaSettings,
    space: SearchBox,
    seed: u64,
    replicate: u64,
    generation: u64,
    /// Members with a merit; after `ask`, the parents of the generation to come.
    population: Vec<Member>,
    asked: Vec<Vec<f64>>,
    best: Option<Member>,
}

/// Stream of the draws for a whole generation; children count from 0.
const SELECTION: u64 = u64::MAX;

impl Ga {
    /// A genetic algorithm on a box; all its randomness comes from (`seed`, `replicate`).
    #[must_use]
    pub fn new(space: SearchBox, settings: GaSettings, seed: u64, replicate: u64) -> Ga {
        let (population, asked) = (Vec::new(), Vec::new());
        Ga { settings, space, seed, replicate, generation: 0, population, asked, best: None }
    }

    fn stream(&self, candidate: u64) -> ChaCha8Rng {
        stream(self.seed, self.replicate, self.generation, candidate)
    }

    fn first_generation(&self) -> Vec<Vec<f64>> {
        let point = |k: usize| {
            let mut rng = self.stream(k as u64);
            (0..self.space.dimensions()).map(|i| self.space.along(i, rng.random())).collect()
        };
        (0..self.settings.population_size).map(point).collect()
    }

    /// The elite, then members drawn by the roulette wheel; they are carried over unchanged.
    fn select_parents(&self) -> Vec<Member> {
        let size = self.settings.population_size;
        let mut count = (self.settings.parents_portion * size as f64) as usize;
        // Children come in pairs.
        count += (size - count) % 2;
        let elite_share = size as f64 * self.settings.elit_ratio;
        let elite = if self.settings.elit_ratio > 0.0 { (elite_share as usize).max(1) } else { 0 };

        let mut rng = self.stream(SELECTION);
        let cumulative = cumulative_weights(&self.population);
        let total = cumulative.last().copied().unwrap_or(0.0);
        let mut parents: Vec<Member> = self.population[..elite.min(count)].to_vec();
        while parents.len() < count {
            let at: f64 = rng.random::<f64>() * total;
            let k = cumulative.partition_point(|c| *c < at);
            parents.push(self.population[k.min(self.population.len() - 1)].clone());
        }
        parents
    }

    /// The parents that take part in crossover, at least one.
    fn select_breeders<'a>(&self, parents: &'a [Member]) -> Vec<&'a Member> {
        let mut rng = self.stream(SELECTION - 1);
        loop {
            let takes_part = |_: &&Member| rng.random::<f64>() <= self.settings.crossover_probability;
            let breeders: Vec<&Member> = parents.iter().filter(takes_part).collect();
            if !breeders.is_empty() {
                return breeders;
            }
        }
    }

    /// Two children of two breeders: uniform crossover, then one mutation each.
    fn breed(&self, breeders: &[&Member], pair: u64) -> [Vec<f64>; 2] {
        let mut rng = self.stream(pair);
        let one = &breeders[rng.random_range(0..breeders.len())].point;
        let two = &breeders[rng.random_range(0..breeders.len())].point;
        let (mut first, mut second) = (one.clone(), two.clone());
        for i in 0..first.len() {
            if rng.random::<f64>() < 0.5 {
                std::mem::swap(&mut first[i], &mut second[i]);
            }
        }
        for (i, x) in first.iter_mut().enumerate() {
            if rng.random::<f64>() < self.settings.mutation_probability {
                *x = self.space.along(i, rng.random());
            }
        }
        for (i, x) in second.iter_mut().enumerate() {
            if rng.random::<f64>() < self.settings.mutation_probability {
                let fraction: f64 = rng.random();
                let (low, high) = (one[i].min(two[i]), one[i].max(two[i]));
                *x = if low < high { low + fraction * (high - low) } else { self.space.along(i, fraction) };
            }
        }
        [first, second]
    }
}

/// Running sums of the roulette weights, largest objective minus objective plus 1, over a sorted population.
fn cumulative_weights(population: &[Member]) -> Vec<f64> {
    let value = |member: &Member| match member.merit {
        Merit::Feasible(value) if value.is_finite() => Some(value),
        _ => None,
    };
    let worst = population.iter().filter_map(value).reduce(f64::max);
    let weight = |member: &Member| match (value(member), worst) {
        (Some(value), Some(worst)) => worst - value + 1.0,
        (None, Some(_)) => 0.0,
        // No member is feasible: all are equal.
        (_, None) => 1.0,
    };
    let mut sum = 0.0;
    population
        .iter()
        .map(|member| {
            sum += weight(member);
            sum
        })
        .collect()
}

impl Optimizer for Ga {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        if self.population.is_empty() {
            self.asked = self.first_generation();
            return self.asked.clone();
        }
        let parents = self.select_parents();
        let breeders = self.select_breeders(&parents);
        let pairs = (self.settings.population_size - parents.len()) / 2;
        self.asked = (0..pairs as u64).flat_map(|pair| self.breed(&breeders, pair)).collect();
        self.population = parents;
        self.asked.clone()
    }

    fn tell(&mut self, merits: &[Merit]) {
        assert_eq!(merits.len(), self.asked.len(), "one merit per candidate asked for");
        let asked = std::mem::take(&mut self.asked);
        let told = asked.into_iter().zip(merits).map(|(point, &merit)| Member { point, merit });
        self.population.extend(told);
        // Stable: of equals, the older one stays ahead.
        self.population.sort_by(|a, b| a.merit.order(&b.merit));
        let first = &self.population[0];
        if self.best.as_ref().is_none_or(|best| first.merit.beats(&best.merit)) {
            self.best = Some(first.clone());
        }
        self.generation += 1;
    }

    fn best(&self) -> Option<&Member> {
        self.best.as_ref()
    }
}
