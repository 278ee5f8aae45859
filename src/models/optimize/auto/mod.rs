//! The search by scores alone: a global search and a local polish, twice in parallel, and more of them until enough agree.
//!
//! A round is [`Lshade`](super::Lshade) until its population has nearly one value or its evaluations are spent, then
//! [`Descent`](super::Descent) from its best member with the shape of its population, at last on exact merits. Rounds draw from different
//! streams and are independent, so that their agreement is evidence; if they disagree, the surface has several basins, and more rounds
//! follow. Two run in parallel, because an evaluator takes hardly more time for two generations than for one.

mod round;

use super::{DescentSettings, Ended, Member, Merit, Optimizer, Origin, SearchBox, keep_best};
use round::Round;

/// Settings of the default optimiser.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AutoSettings {
    /// Evaluations of all rounds together; not exceeded.
    pub evaluations: u64,
    /// Evaluations of the global search of one round.
    pub search: u64,
    /// Evaluations of both polishes of one round.
    pub polish: u64,
    /// Of these, those reserved for the polish on exact merits.
    pub finish: u64,
    /// Members of the first generation of a global search.
    pub population: usize,
    /// Share of the population that counts as its best, at the beginning and at the end of a global search.
    pub best_share: [f64; 2],
    /// Candidates of a generation of a polish.
    pub descent_population: usize,
    /// A global search ends once its values differ by no more than this share of the best.
    pub hand_over: f64,
    /// The polish on rough merits ends when values differ by no more than this share of the best.
    pub polished: f64,
    /// The polish on exact merits ends when values differ by no more than this share of the best.
    pub finished: f64,
    /// Rounds agree if their values differ by no more than this share.
    pub agreement: f64,
    /// All four are shares of this if the best value is smaller, because a search near 0 never reaches a share of the
    /// value.
    pub floor: f64,
    /// Number of rounds that have to agree if none ended elsewhere.
    pub rounds: usize,
}

/// On some surfaces one round in three ends in the same wrong basin (IDM on the first 150 s of the first follower of platoon 3, 6 %
/// too high), so that two rounds met there in one calibration of eight.
const ROUNDS: usize = 4;

impl AutoSettings {
    /// For this many dimensions, within this many evaluations.
    #[must_use]
    pub fn new(dimensions: usize, evaluations: u64) -> AutoSettings {
        // The shares were chosen on calibrations with seeds 1 to 10 (`leadlag bench optimizers`), none of them finely tuned.
        let n = dimensions.max(1) as u64;
        let polish = (500 * n).min(evaluations / 8);
        // Two rounds fit, or three searches that end early.
        let search = (3000 * n).min(evaluations / 2 - polish);
        AutoSettings {
            evaluations,
            search,
            polish,
            finish: polish / 3,
            // A larger population loses fewer narrow basins, if it has the generations to settle in one.
            population: ((search / 50) as usize).clamp(20 * dimensions, 60 * dimensions.max(1)),
            // A round that follows few of its best settles in one basin early, and then four rounds may meet in the wrong one: with the
            // 0.11 of L-SHADE, a round on the widest basins of platoon 5 (variant 62 on follower 2) found the lowest one in 3 cases of 8.
            best_share: [0.4, 0.2],
            // 32: number of candidates that evaluators simulate in the time of one.
            descent_population: (2 * DescentSettings::population_for(dimensions))
                .max(32)
                .min((polish / 8).max(4) as usize),
            hand_over: 1e-3,
            polished: 2e-6,
            finished: 1e-8,
            agreement: 1e-4,
            floor: 0.0,
            rounds: ROUNDS,
        }
    }
}

/// The default optimiser.
#[derive(Debug, Clone)]
pub struct Auto {
    settings: AutoSettings,
    space: SearchBox,
    origin: Origin,
    /// Rounds under way.
    rounds: Vec<Round>,
    /// Started rounds.
    begun: u64,
    /// Best of each round that has ended, by exact merits, the best first.
    found: Vec<Member>,
    /// Requested candidates, per round under way.
    asked: Vec<Vec<Vec<f64>>>,
    /// Evaluations not assigned to a round.
    left: u64,
    /// Best of all rounds by exact and by rough merits.
    exact: Option<Member>,
    rough: Option<Member>,
}

/// Largest number of generations of a round: the distance between the streams of rounds.
const STREAMS_OF_A_ROUND: u64 = 1 << 40;

/// Rounds at the same time.
const SIDE_BY_SIDE: usize = 2;

impl Auto {
    /// A run on a box.
    #[must_use]
    pub fn new(space: SearchBox, settings: AutoSettings, origin: Origin) -> Auto {
        let mut auto = Auto {
            settings,
            space,
            origin,
            rounds: Vec::new(),
            begun: 0,
            found: Vec::new(),
            asked: Vec::new(),
            left: settings.evaluations,
            exact: None,
            rough: None,
        };
        auto.begin();
        auto
    }

    /// Starts as many rounds as there is room for.
    fn begin(&mut self) {
        while self.rounds.len() < SIDE_BY_SIDE {
            let search = self.settings.search.min(self.left.saturating_sub(self.settings.polish));
            // Half a search is not worth its cost, but there must be one.
            if self.begun > 0 && 2 * search < self.settings.search || self.left == 0 {
                return;
            }
            // A round without evaluations would start again endlessly.
            let all = self.left.min(search + self.settings.polish).max(1);
            let origin = Origin { generation: self.origin.generation + self.begun * STREAMS_OF_A_ROUND, ..self.origin };
            self.rounds.push(Round::new(self.space.clone(), self.settings, [search.max(1), all], origin));
            self.left -= all;
            self.begun += 1;
        }
    }

    /// True if enough rounds agree with the best: one more for each that ended elsewhere, because such a surface has several basins, and
    /// rounds may well meet in the wrong one.
    fn is_settled(&self) -> bool {
        let Some(Merit::Feasible(best)) = self.found.first().map(|member| member.merit) else { return false };
        let limit = best + self.settings.agreement * best.abs().max(self.settings.floor);
        let agree = |member: &&Member| matches!(member.merit, Merit::Feasible(value) if value <= limit);
        let agreeing = self.found.iter().filter(agree).count();
        agreeing >= self.settings.rounds + (self.found.len() - agreeing)
    }

    /// Takes the results of ended rounds, and starts others unless enough agree.
    fn collect(&mut self) {
        if self.rounds.iter().any(|round| !round.is_ended()) {
            return;
        }
        for round in self.rounds.drain(..) {
            self.left += round.left();
            self.found.extend(round.exact().or(round.rough()).cloned());
        }
        self.found.sort_by(|a, b| a.merit.order(&b.merit));
        if !self.is_settled() {
            self.begin();
        }
    }

    fn note(&mut self) {
        for round in &self.rounds {
            round.exact().into_iter().for_each(|member| keep_best(&mut self.exact, member));
            round.rough().into_iter().for_each(|member| keep_best(&mut self.rough, member));
        }
    }
}

fn is_feasible(member: &&Member) -> bool {
    matches!(member.merit, Merit::Feasible(_))
}

impl Optimizer for Auto {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        let exact = self.wants_exact();
        let wanted = |round: &mut Round| if round.wants_exact() == exact { round.ask() } else { Vec::new() };
        self.asked = self.rounds.iter_mut().map(wanted).collect();
        self.asked.concat()
    }

    fn tell(&mut self, merits: &[Merit]) {
        let asked = std::mem::take(&mut self.asked);
        assert_eq!(merits.len(), asked.iter().map(Vec::len).sum::<usize>(), "one merit per candidate asked for");
        let mut rest = merits;
        for (round, points) in self.rounds.iter_mut().zip(&asked).filter(|(_, points)| !points.is_empty()) {
            let (own, others) = rest.split_at(points.len());
            round.tell(points, own);
            rest = others;
        }
        self.note();
        self.collect();
    }

    /// By exact merits as soon as one of them is feasible, and then only by these; before, by approximate ones.
    fn best(&self) -> Option<&Member> {
        let (exact, rough) = (self.exact.as_ref(), self.rough.as_ref());
        exact.filter(is_feasible).or(rough.filter(is_feasible)).or(exact).or(rough)
    }

    /// The best of the rounds under way that have no feasible exact merit yet.
    fn rival(&self) -> Option<&Member> {
        let best = self.best()?;
        let untold = self.rounds.iter().filter(|round| !round.exact().is_some_and(|member| is_feasible(&member)));
        let better = untold.filter_map(Round::rough).filter(|member| member.merit.beats(&best.merit));
        better.min_by(|a, b| a.merit.order(&b.merit))
    }

    fn ended(&self) -> Option<Ended> {
        let ended = if self.is_settled() { Ended::Converged } else { Ended::Spent };
        self.rounds.is_empty().then_some(ended)
    }

    /// Rounds wait for each other: none starts on exact merits before all have reached them.
    fn wants_exact(&self) -> bool {
        let mut going = self.rounds.iter().filter(|round| !round.is_ended());
        going.all(Round::wants_exact)
    }
}
