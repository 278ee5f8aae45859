//! One round: a global search, then a local polish of its result, first on approximate merits and then on exact ones.

use super::super::{Descent, DescentSettings, Ended, Lshade, LshadeSettings, Member, Merit, Optimizer, Origin};
use super::super::{SearchBox, Start, keep_best};
use super::AutoSettings;

#[derive(Debug, Clone)]
enum Phase {
    Search(Box<Lshade>),
    Polish(Box<Descent>),
    /// The best members, to be scored exactly.
    Exact(Vec<Vec<f64>>),
    Finish(Box<Descent>),
    /// The polished point with coordinates put on the bounds that they are close to.
    Snap(Vec<Vec<f64>>),
    Ended,
}

/// A round of the default optimiser.
#[derive(Debug, Clone)]
pub(super) struct Round {
    settings: AutoSettings,
    space: SearchBox,
    phase: Phase,
    origin: Origin,
    /// Evaluations that are left.
    left: u64,
    /// Candidates that took part in the latest phase and are good; they give the next one its shape.
    near: Vec<Member>,
    rough: Option<Member>,
    exact: Option<Member>,
}

/// Candidates that are scored exactly before the last polish.
const TOLD_EXACTLY: usize = 8;

/// Candidates that give a descent its shape, per dimension.
const SHAPE: usize = 8;

/// Share of the box within which a coordinate is tried on the bound itself.
const CLOSE: f64 = 1e-3;

impl Round {
    /// A round that may spend this many evaluations in its search, and this many in all.
    pub(super) fn new(space: SearchBox, settings: AutoSettings, [search, all]: [u64; 2], origin: Origin) -> Round {
        let lshade = LshadeSettings {
            first_population: settings.population.min((search / 20).max(8) as usize),
            tolerance: settings.hand_over,
            floor: settings.floor,
            best_share: settings.best_share,
            ..LshadeSettings::new(space.dimensions(), search)
        };
        let phase = Phase::Search(Box::new(Lshade::new(space.clone(), lshade, origin)));
        Round { settings, space, phase, origin, left: all, near: Vec::new(), rough: None, exact: None }
    }

    pub(super) fn is_ended(&self) -> bool {
        matches!(self.phase, Phase::Ended)
    }

    pub(super) fn wants_exact(&self) -> bool {
        matches!(self.phase, Phase::Exact(_) | Phase::Finish(_) | Phase::Snap(_))
    }

    /// Its unused evaluations.
    pub(super) fn left(&self) -> u64 {
        self.left
    }

    /// Its best by exact merits, as soon as there is one.
    pub(super) fn exact(&self) -> Option<&Member> {
        self.exact.as_ref()
    }

    /// Its best by rough merits.
    pub(super) fn rough(&self) -> Option<&Member> {
        self.rough.as_ref()
    }

    pub(super) fn ask(&mut self) -> Vec<Vec<f64>> {
        match &mut self.phase {
            Phase::Search(search) => search.ask(),
            Phase::Polish(descent) | Phase::Finish(descent) => descent.ask(),
            Phase::Exact(points) | Phase::Snap(points) => points.clone(),
            Phase::Ended => Vec::new(),
        }
    }

    /// The merits, and the candidates again.
    pub(super) fn tell(&mut self, points: &[Vec<f64>], merits: &[Merit]) {
        self.left = self.left.saturating_sub(merits.len() as u64);
        match &mut self.phase {
            Phase::Search(search) => search.tell(merits),
            Phase::Polish(descent) | Phase::Finish(descent) => descent.tell(merits),
            _ => {}
        }
        let best = if self.wants_exact() { &mut self.exact } else { &mut self.rough };
        for (point, &merit) in points.iter().zip(merits) {
            keep_best(best, &Member { point: point.clone(), merit });
        }
        match &self.phase {
            Phase::Search(search) => {
                self.near.clear();
                self.near.extend_from_slice(search.population());
            }
            _ => {
                self.near.extend(points.iter().zip(merits).map(|(p, &merit)| Member { point: p.clone(), merit }));
                self.near.sort_by(|a, b| a.merit.order(&b.merit));
                self.near.truncate(SHAPE * self.space.dimensions());
            }
        }
        self.advance();
    }

    /// Starts the next phase when the one under way has ended.
    fn advance(&mut self) {
        // Skips a phase without candidates.
        loop {
            self.phase = match std::mem::replace(&mut self.phase, Phase::Ended) {
                Phase::Search(search) if ended(search.as_ref()) => {
                    self.origin = search.origin();
                    let keep = self.settings.finish;
                    match self.descent(self.rough.clone(), self.settings.polished, keep) {
                        Some(descent) => Phase::Polish(descent),
                        None => self.told_exactly(),
                    }
                }
                Phase::Polish(descent) if ended(descent.as_ref()) => {
                    self.origin = descent.origin();
                    self.told_exactly()
                }
                Phase::Exact(_) => {
                    let tolerance = self.settings.finished;
                    self.descent(self.exact.clone(), tolerance, 0).map_or_else(|| self.snapped(), Phase::Finish)
                }
                Phase::Finish(descent) if ended(descent.as_ref()) => {
                    self.origin = descent.origin();
                    self.snapped()
                }
                Phase::Snap(_) => Phase::Ended,
                other => other,
            };
            let empty = matches!(&self.phase, Phase::Exact(points) | Phase::Snap(points) if points.is_empty());
            if !empty {
                return;
            }
        }
    }

    /// A descent from a point, within the remaining budget minus this many evaluations; none if there is no room for a generation.
    fn descent(&self, from: Option<Member>, tolerance: f64, keep: u64) -> Option<Box<Descent>> {
        let population = self.settings.descent_population;
        let room = self.left.saturating_sub(keep);
        // Whole generations only.
        let evaluations = room - room % population as u64;
        let middle = from.filter(|_| evaluations > 0)?.point;
        let feasible = self.near.iter().filter(|m| matches!(m.merit, Merit::Feasible(_)));
        let points = feasible.map(|m| m.point.clone()).collect();
        let settings = DescentSettings { population, evaluations, tolerance, floor: self.settings.floor };
        let start = Start::Population { middle, points };
        Some(Box::new(Descent::new(self.space.clone(), start, settings, self.origin)))
    }

    /// The best of the available ones, the best one first.
    fn told_exactly(&self) -> Phase {
        let mut points: Vec<Vec<f64>> = self.rough.iter().map(|m| m.point.clone()).collect();
        for member in &self.near {
            if !points.contains(&member.point) {
                points.push(member.point.clone());
            }
        }
        points.truncate(TOLD_EXACTLY.min(self.left as usize));
        Phase::Exact(points)
    }

    /// The best with each coordinate close to a bound put on it, and with all of them.
    fn snapped(&self) -> Phase {
        let Some(best) = &self.exact else { return Phase::Ended };
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
        points.truncate(self.left as usize);
        Phase::Snap(points)
    }
}

fn ended(optimizer: &dyn Optimizer) -> bool {
    matches!(optimizer.ended(), Some(Ended::Converged | Ended::Spent))
}
