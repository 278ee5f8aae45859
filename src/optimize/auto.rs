//! What users get by default: a global search, a local polish of what it found, and again until two rounds agree.
//!
//! A round is [`Lshade`] until its population is nearly of one value or its evaluations are spent, then [`Descent`] from its best
//! member with the shape of its population, on exact merits. Rounds draw from different streams and know nothing of each other, so
//! that their agreement means something; where they disagree the surface has several basins, and more rounds follow.

use super::{Descent, DescentSettings, Ended, Lshade, LshadeSettings, Member, Merit, Optimizer, Origin, SearchBox, Start, keep_best};

/// Settings of the default optimiser.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AutoSettings {
    /// Evaluations of all rounds together; not exceeded.
    pub evaluations: u64,
    /// Evaluations of the global search of one round.
    pub search: u64,
    /// Members of the first generation of a global search.
    pub population: usize,
    /// A global search hands over to the polish once its values differ by less than this share of the best.
    pub hand_over: f64,
    /// Evaluations of the polish of one round.
    pub polish: u64,
    /// A polish ends when values differ by less than this share of the best.
    pub polished: f64,
    /// Two rounds agree if their values differ by less than this share.
    pub agreement: f64,
}

impl AutoSettings {
    /// For so many dimensions, within so many evaluations.
    #[must_use]
    pub fn new(dimensions: usize, evaluations: u64) -> AutoSettings {
        let n = dimensions.max(1) as u64;
        // Chosen on standard functions and on calibrations with seeds 1 to 10: see `leadlag bench optimizers`.
        let polish = (400 * n).min(evaluations / 5);
        let search = (3000 * n).min((evaluations - polish) / 10 * 9);
        AutoSettings {
            evaluations,
            search,
            population: (20 * dimensions).clamp(8, (search / 20).max(8) as usize),
            hand_over: 1e-3,
            polish,
            polished: 1e-9,
            agreement: 1e-4,
        }
    }
}

#[derive(Debug, Clone)]
enum Phase {
    Search(Box<Lshade>),
    /// The best members of a search, to be told exactly.
    Exact { points: Vec<Vec<f64>>, population: Vec<Vec<f64>>, origin: Origin },
    Polish(Box<Descent>),
    /// The polished point with coordinates put on the bounds that they are close to.
    Snap { points: Vec<Vec<f64>>, origin: Origin },
    Finished,
}

/// The default optimiser.
#[derive(Debug, Clone)]
pub struct Auto {
    settings: AutoSettings,
    space: SearchBox,
    phase: Phase,
    evaluations: u64,
    /// Best of the round under way by exact merits, and of the rounds before.
    round: Option<Member>,
    rounds: Vec<Member>,
    /// Best by rough merits; counts only until there is an exact one.
    rough: Option<Member>,
    exact: Option<Member>,
}

/// Members of a search that are told exactly before one is polished.
const TOLD_EXACTLY: usize = 8;

/// Share of the box within which a coordinate is tried on the bound itself.
const CLOSE: f64 = 1e-3;

impl Auto {
    /// A run on a box.
    #[must_use]
    pub fn new(space: SearchBox, settings: AutoSettings, origin: Origin) -> Auto {
        let search = search(&space, &settings, settings.search, origin);
        let (phase, rounds) = (Phase::Search(Box::new(search)), Vec::new());
        Auto { settings, space, phase, evaluations: 0, round: None, rounds, rough: None, exact: None }
    }

    /// True if the two best rounds agree on the value.
    fn found_twice(&self) -> bool {
        match self.rounds[..] {
            [Member { merit: Merit::Feasible(a), .. }, Member { merit: Merit::Feasible(b), .. }, ..] => {
                b - a <= self.settings.agreement * a.abs()
            }
            _ => false,
        }
    }

    fn left(&self) -> u64 {
        self.settings.evaluations.saturating_sub(self.evaluations)
    }

    /// Goes on to the next phase where the one under way has ended.
    fn advance(&mut self) {
        self.phase = match std::mem::replace(&mut self.phase, Phase::Finished) {
            Phase::Search(search) if search.ended().is_some() => {
                let best = search.population().iter().take(TOLD_EXACTLY.min(self.left() as usize));
                let points = best.map(|m| m.point.clone()).collect();
                let feasible = |m: &&Member| matches!(m.merit, Merit::Feasible(_));
                let population = search.population().iter().filter(feasible).map(|m| m.point.clone()).collect();
                Phase::Exact { points, population, origin: search.origin() }
            }
            Phase::Polish(descent) if descent.ended().is_some() => self.snap(descent.origin()),
            other => other,
        };
        let nothing_to_tell = match &self.phase {
            Phase::Exact { points, .. } | Phase::Snap { points, .. } => points.is_empty(),
            _ => false,
        };
        if nothing_to_tell {
            self.after_told();
        }
    }

    /// After the exact merits of a search's best come the polish; after those of the snapped points, the next round.
    fn after_told(&mut self) {
        self.phase = match std::mem::replace(&mut self.phase, Phase::Finished) {
            Phase::Exact { population, origin, .. } => match &self.round {
                Some(best) => self.polish(best.point.clone(), population, origin),
                None => Phase::Finished,
            },
            Phase::Snap { origin, .. } => self.next_round(origin),
            other => other,
        };
    }

    fn polish(&self, middle: Vec<f64>, points: Vec<Vec<f64>>, origin: Origin) -> Phase {
        let population = 2 * DescentSettings::population_for(self.space.dimensions());
        let most = self.settings.polish.min(self.left());
        if (most as usize) < population {
            return Phase::Finished;
        }
        // Whole generations only.
        let evaluations = most - most % population as u64;
        let settings = DescentSettings { population, evaluations, tolerance: self.settings.polished };
        Phase::Polish(Box::new(Descent::new(self.space.clone(), Start::Population { middle, points }, settings, origin)))
    }

    /// The best of the round with each coordinate close to a bound put on it, and with all of them.
    fn snap(&self, origin: Origin) -> Phase {
        let Some(best) = &self.round else { return Phase::Finished };
        let fractions = self.space.fractions(&best.point);
        let bound = |i: usize| match fractions[i] {
            0.0 | 1.0 => None,
            x if x < CLOSE => Some(self.space.lower[i]),
            x if x > 1.0 - CLOSE => Some(self.space.upper[i]),
            _ => None,
        };
        let close: Vec<(usize, f64)> = (0..fractions.len()).filter_map(|i| Some((i, bound(i)?))).collect();
        let with = |changes: &[(usize, f64)]| {
            let mut point = best.point.clone();
            changes.iter().for_each(|&(i, x)| point[i] = x);
            point
        };
        let mut points = if close.len() > 1 { vec![with(&close)] } else { Vec::new() };
        points.extend(close.iter().map(|&change| with(&[change])));
        points.truncate(self.left() as usize);
        Phase::Snap { points, origin }
    }

    /// Another round, unless two agree on the best value or there is no room for one.
    fn next_round(&mut self, origin: Origin) -> Phase {
        self.rounds.extend(self.round.take());
        self.rounds.sort_by(|a, b| a.merit.order(&b.merit));
        let room = self.left().saturating_sub(self.settings.polish).min(self.settings.search);
        // Half a search finds less than it costs.
        if self.found_twice() || room < self.settings.search / 2 {
            return Phase::Finished;
        }
        let origin = Origin { generation: origin.generation + 1, ..origin };
        Phase::Search(Box::new(search(&self.space, &self.settings, room, origin)))
    }
}

fn search(space: &SearchBox, settings: &AutoSettings, evaluations: u64, origin: Origin) -> Lshade {
    let lshade = LshadeSettings {
        first_population: settings.population,
        tolerance: settings.hand_over,
        ..LshadeSettings::new(space.dimensions(), evaluations)
    };
    Lshade::new(space.clone(), lshade, origin)
}

impl Optimizer for Auto {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        match &mut self.phase {
            Phase::Search(search) => search.ask(),
            Phase::Polish(descent) => descent.ask(),
            Phase::Exact { points, .. } | Phase::Snap { points, .. } => points.clone(),
            Phase::Finished => Vec::new(),
        }
    }

    fn tell(&mut self, merits: &[Merit]) {
        self.evaluations += merits.len() as u64;
        match &mut self.phase {
            Phase::Search(search) => {
                search.tell(merits);
                if let Some(member) = search.best() {
                    keep_best(&mut self.rough, member);
                }
            }
            Phase::Polish(descent) => {
                descent.tell(merits);
                if let Some(member) = descent.best() {
                    keep_best(&mut self.round, member);
                }
            }
            Phase::Exact { points, .. } | Phase::Snap { points, .. } => {
                for (point, &merit) in points.iter().zip(merits) {
                    keep_best(&mut self.round, &Member { point: point.clone(), merit });
                }
                self.after_told();
            }
            Phase::Finished => {}
        }
        if let Some(member) = &self.round {
            keep_best(&mut self.exact, member);
        }
        self.advance();
        // The last round's best has moved to the others.
        if let Some(member) = self.rounds.first() {
            keep_best(&mut self.exact, member);
        }
    }

    fn best(&self) -> Option<&Member> {
        self.exact.as_ref().or(self.rough.as_ref())
    }

    fn ended(&self) -> Option<Ended> {
        let ended = if self.found_twice() { Ended::Converged } else { Ended::Spent };
        matches!(self.phase, Phase::Finished).then_some(ended)
    }

    fn wants_exact(&self) -> bool {
        !matches!(self.phase, Phase::Search(_))
    }
}
