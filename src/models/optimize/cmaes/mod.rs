//! CMA-ES with restarts in two regimes, BIPOP (N. Hansen, "Benchmarking a BI-population CMA-ES on the BBOB-2009 function
//! testbed", GECCO 2009 workshop, pp. 2389-2396): large populations that double from restart to restart, and in between
//! small ones with small steps, whichever regime has used fewer evaluations.

mod descent;

pub use descent::{Descent, DescentSettings, Start};

use super::{Ended, Member, Merit, Optimizer, Origin, SearchBox, keep_best};
use rand::RngExt;

/// Settings of CMA-ES with restarts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CmaesSettings {
    /// Number of evaluations after which no descent starts.
    pub evaluations: u64,
    /// A descent ends when values differ by no more than this share of the best one.
    pub tolerance: f64,
    /// The tolerance is a share of this if the best value is smaller, such as 0.
    pub floor: f64,
}

/// The paper's first step size, 2 of a box of side 10, as a share of the box.
const FIRST_STEP: f64 = 0.2;

/// CMA-ES with restarts as an optimiser.
#[derive(Debug, Clone)]
pub struct Cmaes {
    settings: CmaesSettings,
    space: SearchBox,
    descent: Descent,
    /// Whether the present descent belongs to the regime with small populations.
    small: bool,
    /// Population of the large regime.
    large_population: usize,
    /// Evaluations of the latest descent of the large regime.
    last_large: u64,
    /// Evaluations of the large and of the small regime.
    used: [u64; 2],
    best: Option<Member>,
}

impl Cmaes {
    /// A run on a box.
    #[must_use]
    pub fn new(space: SearchBox, settings: CmaesSettings, origin: Origin) -> Cmaes {
        let population = DescentSettings::population_for(space.dimensions());
        let descent = start(&space, &settings, population, FIRST_STEP, u64::MAX, origin);
        // The population of the first descent is that of the large regime before it doubles, but its evaluations count as those of the small
        // one, as in pycma: the first restart is a large one.
        let (small, used, best) = (true, [0, 0], None);
        Cmaes { settings, space, descent, small, large_population: population, last_large: 0, used, best }
    }

    /// The next descent, in the regime that has used fewer evaluations.
    fn restart(&mut self) {
        let mut origin = self.descent.origin();
        if !self.small {
            self.last_large = self.descent.evaluations();
        }
        self.small = self.used[1] < self.used[0];
        let default = DescentSettings::population_for(self.space.dimensions());
        if self.small {
            let mut rng = origin.whole();
            let (u, w): (f64, f64) = (rng.random(), rng.random());
            // From the default to half of the latest large one, which has doubled at least once.
            let ratio = self.large_population as f64 / default as f64;
            let population = (default as f64 * (0.5 * ratio).powf(u * u)) as usize;
            let step = FIRST_STEP * 10f64.powf(-2.0 * w);
            origin.generation += 1;
            let most = (self.last_large / 2).max(1);
            self.descent = start(&self.space, &self.settings, population, step, most, origin);
        } else {
            self.large_population *= 2;
            self.descent = start(&self.space, &self.settings, self.large_population, FIRST_STEP, u64::MAX, origin);
        }
    }
}

/// A descent from a point drawn anywhere in the box.
fn start(
    space: &SearchBox,
    settings: &CmaesSettings,
    population: usize,
    step: f64,
    evaluations: u64,
    origin: Origin,
) -> Descent {
    let mut rng = origin.whole();
    let middle = (0..space.dimensions()).map(|i| space.along(i, rng.random())).collect();
    let origin = Origin { generation: origin.generation + 1, ..origin };
    let descent = DescentSettings { population, evaluations, tolerance: settings.tolerance, floor: settings.floor };
    Descent::new(space.clone(), Start::Round { middle, step }, descent, origin)
}

impl Optimizer for Cmaes {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        if self.descent.ended().is_some() {
            self.restart();
        }
        self.descent.ask()
    }

    fn tell(&mut self, merits: &[Merit]) {
        self.descent.tell(merits);
        self.used[usize::from(self.small)] += merits.len() as u64;
        if let Some(member) = self.descent.best() {
            keep_best(&mut self.best, member);
        }
    }

    fn best(&self) -> Option<&Member> {
        self.best.as_ref()
    }

    fn ended(&self) -> Option<Ended> {
        (self.used[0] + self.used[1] >= self.settings.evaluations).then_some(Ended::Spent)
    }
}
