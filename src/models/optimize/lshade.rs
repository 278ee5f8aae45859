//! L-SHADE: differential evolution with success-history based adaptation and linear population size reduction
//! (R. Tanabe and A. S. Fukunaga, "Improving the search performance of SHADE using linear population size reduction",
//! IEEE CEC 2014, pp. 1658-1665).

use super::stream::{cauchy, normal};
use super::{Ended, Member, Merit, Optimizer, Origin, SearchBox, keep_best};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Settings of L-SHADE; the defaults are those of the paper (Section V).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LshadeSettings {
    /// Members of the first generation.
    pub first_population: usize,
    /// Members of the last generation; at least 4, because a mutant needs four different points.
    pub last_population: usize,
    /// Number of evaluations over which the population shrinks, and after which the run ends.
    pub evaluations: u64,
    /// Slots of the memory of successful settings (H).
    pub memory: usize,
    /// Replaced parents that are remembered, per member of the population.
    pub archive_rate: f64,
    /// Share of the population that counts as its best (p), at the first and at the last evaluation; linear between them, as in jSO (J.
    /// Brest, M. S. Maučec and B. Bošković, "Single objective real-parameter optimization: algorithm jSO", IEEE CEC 2017, pp. 1311-1318).
    pub best_share: [f64; 2],
    /// The run ends early once all members are feasible and their values differ by no more than this share of the best; 0: never.
    pub tolerance: f64,
    /// The tolerance is a share of this if the best value is smaller, such as 0.
    pub floor: f64,
}

impl LshadeSettings {
    /// Those of the paper for this many dimensions and evaluations; fewer members if evaluations are scarce.
    #[must_use]
    pub fn new(dimensions: usize, evaluations: u64) -> LshadeSettings {
        // A member should be replaced some twenty times.
        let affordable = (evaluations / 20).max(8) as usize;
        LshadeSettings {
            first_population: (18 * dimensions).clamp(8, affordable),
            last_population: 4,
            evaluations,
            memory: 6,
            archive_rate: 2.6,
            best_share: [0.11; 2],
            tolerance: 0.0,
            floor: 0.0,
        }
    }
}

/// A child and the settings that made it.
#[derive(Debug, Clone)]
struct Trial {
    point: Vec<f64>,
    scale: f64,
    crossover: f64,
}

/// L-SHADE as an optimiser. Where the paper compares values, members are compared by rule: feasible ones by value, infeasible
/// ones by the time that they survived.
#[derive(Debug, Clone)]
pub struct Lshade {
    settings: LshadeSettings,
    space: SearchBox,
    origin: Origin,
    evaluations: u64,
    /// From best to worst.
    population: Vec<Member>,
    archive: Vec<Vec<f64>>,
    /// Successful scale factors F; a ring.
    scales: Vec<f64>,
    /// Successful crossover rates CR; `None` is the paper's terminal value, which is kept and means 0.
    crossovers: Vec<Option<f64>>,
    slot: usize,
    trials: Vec<Trial>,
    best: Option<Member>,
}

impl Lshade {
    /// A run on a box.
    #[must_use]
    pub fn new(space: SearchBox, settings: LshadeSettings, origin: Origin) -> Lshade {
        Lshade {
            settings,
            space,
            origin,
            evaluations: 0,
            population: Vec::new(),
            archive: Vec::new(),
            scales: vec![0.5; settings.memory],
            crossovers: vec![Some(0.5); settings.memory],
            slot: 0,
            trials: Vec::new(),
            best: None,
        }
    }

    /// The members, from best to worst.
    #[must_use]
    pub fn population(&self) -> &[Member] {
        &self.population
    }

    /// The stream that comes next.
    #[must_use]
    pub fn origin(&self) -> Origin {
        self.origin
    }

    /// Share of the evaluations that are spent.
    fn spent(&self) -> f64 {
        (self.evaluations as f64 / self.settings.evaluations as f64).min(1.0)
    }

    /// Share of the population that counts as its best now.
    fn best_share(&self) -> f64 {
        let [first, last] = self.settings.best_share;
        first + (last - first) * self.spent()
    }

    fn first_generation(&self) -> Vec<Trial> {
        let left = self.settings.evaluations.max(1) as usize;
        (0..self.settings.first_population.min(left))
            .map(|k| {
                let mut rng = self.origin.candidate(k);
                let point = (0..self.space.dimensions()).map(|i| self.space.along(i, rng.random())).collect();
                Trial { point, scale: 0.0, crossover: 0.0 }
            })
            .collect()
    }

    /// Scale factor and crossover rate around a slot of the memory.
    fn draw_settings(&self, rng: &mut ChaCha8Rng) -> (f64, f64) {
        let slot = rng.random_range(0..self.settings.memory);
        let crossover = self.crossovers[slot].map_or(0.0, |mean| (mean + 0.1 * normal(rng)).clamp(0.0, 1.0));
        loop {
            let scale = self.scales[slot] + 0.1 * cauchy(rng);
            if scale > 0.0 {
                return (scale.min(1.0), crossover);
            }
        }
    }

    /// current-to-pbest/1/bin with the archive; a coordinate outside goes halfway from the parent to the bound.
    fn child(&self, parent: usize) -> Trial {
        let mut rng = self.origin.candidate(parent);
        let (scale, crossover) = self.draw_settings(&mut rng);
        let size = self.population.len();
        let good = ((self.best_share() * size as f64).round() as usize).clamp(2, size);
        let p_best = &self.population[rng.random_range(0..good)].point;
        let other = |rng: &mut ChaCha8Rng, among: usize, not: &[usize]| loop {
            let k = rng.random_range(0..among);
            if !not.contains(&k) {
                return k;
            }
        };
        let first = other(&mut rng, size, &[parent]);
        let second = other(&mut rng, size + self.archive.len(), &[parent, first]);
        let one = &self.population[first].point;
        let two = if second < size { &self.population[second].point } else { &self.archive[second - size] };

        let x = &self.population[parent].point;
        let always = rng.random_range(0..x.len());
        let mut point = x.clone();
        for i in 0..x.len() {
            if i == always || rng.random::<f64>() < crossover {
                let mutant = x[i] + scale * (p_best[i] - x[i]) + scale * (one[i] - two[i]);
                let (lower, upper) = (self.space.lower[i], self.space.upper[i]);
                point[i] = if mutant < lower {
                    0.5 * (lower + x[i])
                } else if mutant > upper {
                    0.5 * (upper + x[i])
                } else {
                    mutant
                };
            }
        }
        Trial { point, scale, crossover }
    }

    /// Children replace parents that are not better; settings of children that are better are remembered.
    fn select(&mut self, trials: Vec<Trial>, merits: &[Merit]) {
        // (scale, crossover, gain); no gain if a value is missing on one side.
        let mut successes: Vec<(f64, f64, Option<f64>)> = Vec::new();
        for (k, (trial, &merit)) in trials.into_iter().zip(merits).enumerate() {
            let parent = &mut self.population[k];
            if parent.merit.beats(&merit) {
                continue;
            }
            if merit.beats(&parent.merit) {
                let gain = match (parent.merit, merit) {
                    (Merit::Feasible(before), Merit::Feasible(after)) => {
                        Some(before - after).filter(|gain| gain.is_finite())
                    }
                    _ => None,
                };
                successes.push((trial.scale, trial.crossover, gain));
                self.archive.push(parent.point.clone());
            }
            *parent = Member { point: trial.point, merit };
        }
        self.remember(&successes);
    }

    /// Weighted Lehmer means into the next slot; a success without a gain has the weight of the mean gain.
    fn remember(&mut self, successes: &[(f64, f64, Option<f64>)]) {
        if successes.is_empty() {
            return;
        }
        let gains: Vec<f64> = successes.iter().filter_map(|(.., gain)| *gain).collect();
        let mean = if gains.is_empty() { 1.0 } else { gains.iter().sum::<f64>() / gains.len() as f64 };
        let lehmer = |of: fn(&(f64, f64, Option<f64>)) -> f64| {
            let sums = successes.iter().fold((0.0, 0.0), |(square, linear), success| {
                let (x, weight) = (of(success), success.2.unwrap_or(mean));
                (square + weight * x * x, linear + weight * x)
            });
            if sums.1 > 0.0 { sums.0 / sums.1 } else { 0.0 }
        };
        self.scales[self.slot] = lehmer(|s| s.0);
        let all_zero = successes.iter().all(|s| s.1 == 0.0);
        let kept = self.crossovers[self.slot].filter(|_| !all_zero);
        self.crossovers[self.slot] = kept.map(|_| lehmer(|s| s.1));
        self.slot = (self.slot + 1) % self.settings.memory;
    }

    /// Linear in the evaluations, from the first to the last size.
    fn reduce(&mut self) {
        let (first, last) = (self.settings.first_population as f64, self.settings.last_population as f64);
        let size = (first + (last - first) * self.spent()).round() as usize;
        self.population.truncate(size.max(self.settings.last_population));
        let room = (self.settings.archive_rate * self.population.len() as f64).round() as usize;
        let mut rng = self.origin.whole();
        while self.archive.len() > room {
            self.archive.swap_remove(rng.random_range(0..self.archive.len()));
        }
    }

    /// True if all members are feasible and nearly equally good.
    fn is_flat(&self) -> bool {
        let (Some(first), Some(last)) = (self.population.first(), self.population.last()) else { return false };
        let LshadeSettings { tolerance, floor, .. } = self.settings;
        match (first.merit, last.merit) {
            (Merit::Feasible(best), Merit::Feasible(worst)) if tolerance > 0.0 => {
                worst - best <= tolerance * best.abs().max(floor)
            }
            _ => false,
        }
    }
}

impl Optimizer for Lshade {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        self.trials = if self.population.is_empty() {
            self.first_generation()
        } else {
            let left = self.settings.evaluations.saturating_sub(self.evaluations).max(1) as usize;
            (0..self.population.len().min(left)).map(|parent| self.child(parent)).collect()
        };
        self.trials.iter().map(|trial| trial.point.clone()).collect()
    }

    fn tell(&mut self, merits: &[Merit]) {
        assert_eq!(merits.len(), self.trials.len(), "one merit per candidate asked for");
        let trials = std::mem::take(&mut self.trials);
        self.evaluations += merits.len() as u64;
        if self.population.is_empty() {
            let told = trials.into_iter().zip(merits);
            self.population = told.map(|(trial, &merit)| Member { point: trial.point, merit }).collect();
        } else {
            self.select(trials, merits);
        }
        // Stable: equals keep their order.
        self.population.sort_by(|a, b| a.merit.order(&b.merit));
        keep_best(&mut self.best, &self.population[0]);
        self.reduce();
        self.origin.generation += 1;
    }

    fn best(&self) -> Option<&Member> {
        self.best.as_ref()
    }

    fn ended(&self) -> Option<Ended> {
        // Four points make a mutant; fewer evaluations than that are a random search.
        let too_small = !self.population.is_empty() && self.population.len() < self.settings.last_population;
        if self.is_flat() {
            Some(Ended::Converged)
        } else {
            (too_small || self.evaluations >= self.settings.evaluations).then_some(Ended::Spent)
        }
    }
}
