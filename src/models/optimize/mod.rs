//! Optimisers without knowledge of cars: they request the merits of a whole generation and receive them.

mod auto;
mod cmaes;
mod ga;
mod lshade;
mod stream;

pub use auto::{Auto, AutoSettings};
pub use cmaes::{Cmaes, CmaesSettings, Descent, DescentSettings, Start};
pub use ga::{Ga, GaSettings};
pub use lshade::{Lshade, LshadeSettings};
pub use stream::{Origin, normal, stream};

use std::cmp::Ordering;

/// Quality of a candidate. Feasible ones come first, by value; infeasible ones follow, by the time that they survived.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Merit {
    /// Value of the objective; lower is better. An infinite or undefined value is worse than every finite one.
    Feasible(f64),
    /// No value; the more steps survived, the better.
    Infeasible {
        /// Steps before it failed.
        survived: usize,
    },
}

impl Merit {
    /// The order from best to worst.
    #[must_use]
    pub fn order(&self, other: &Merit) -> Ordering {
        match (self, other) {
            // Finite ones first: in the total order, NaN with the sign bit set and -inf come before all numbers.
            (Merit::Feasible(a), Merit::Feasible(b)) => b.is_finite().cmp(&a.is_finite()).then(a.total_cmp(b)),
            (Merit::Feasible(_), Merit::Infeasible { .. }) => Ordering::Less,
            (Merit::Infeasible { .. }, Merit::Feasible(_)) => Ordering::Greater,
            (Merit::Infeasible { survived: a }, Merit::Infeasible { survived: b }) => b.cmp(a),
        }
    }

    /// True if better than the other.
    #[must_use]
    pub fn beats(&self, other: &Merit) -> bool {
        self.order(other) == Ordering::Less
    }
}

/// A box in which an optimiser searches.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchBox {
    /// Lower bounds.
    pub lower: Vec<f64>,
    /// Upper bounds, each above its lower bound.
    pub upper: Vec<f64>,
}

impl SearchBox {
    /// Number of dimensions.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        self.lower.len()
    }

    /// The point a fraction 0..1 of the way along dimension `i`.
    pub(crate) fn along(&self, i: usize, fraction: f64) -> f64 {
        // The upper bound itself, because lower + 1 * (upper - lower) may round to beyond it.
        (self.lower[i] + fraction * (self.upper[i] - self.lower[i])).min(self.upper[i])
    }

    /// Position of a point, as fractions 0..1 along each dimension.
    fn fractions(&self, point: &[f64]) -> Vec<f64> {
        let bounds = self.lower.iter().zip(&self.upper);
        point.iter().zip(bounds).map(|(x, (lower, upper))| (x - lower) / (upper - lower)).collect()
    }
}

/// A candidate with its merit.
#[derive(Debug, Clone, PartialEq)]
pub struct Member {
    /// Its coordinates.
    pub point: Vec<f64>,
    pub merit: Merit,
}

/// Requests whole generations: `ask`, evaluate, `tell`, and again.
pub trait Optimizer {
    /// The candidates of the next generation that need a merit.
    fn ask(&mut self) -> Vec<Vec<f64>>;
    /// Their merits, in the requested order.
    ///
    /// # Panics
    /// Unless there is one merit per requested candidate.
    fn tell(&mut self, merits: &[Merit]);
    /// The best candidate so far; `None` before the first `tell`.
    fn best(&self) -> Option<&Member>;
    /// A candidate with a better but less exact merit than the best one, in a search without a feasible exact merit so far: a caller that
    /// ends the run now should determine which of the two is better.
    fn rival(&self) -> Option<&Member> {
        None
    }
    /// Why it requests no more; `None` while it continues, as optimisers without a stopping rule always do.
    fn ended(&self) -> Option<Ended> {
        None
    }
    /// True if the merits of the next generation should be as exact as possible: differences within it are small.
    fn wants_exact(&self) -> bool {
        false
    }
}

/// Why an optimiser has ended without a request.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ended {
    /// It expects no more gain.
    Converged,
    /// Its evaluations are spent.
    Spent,
}

/// Replaces the best one by a better member.
fn keep_best(best: &mut Option<Member>, member: &Member) {
    if best.as_ref().is_none_or(|best| member.merit.beats(&best.merit)) {
        *best = Some(member.clone());
    }
}
