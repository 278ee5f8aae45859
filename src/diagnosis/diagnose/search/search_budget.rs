//! How much a diagnosis may search.

use crate::diagnose::likelihood::fit::Plan;
use crate::diagnose::question::Effort;

/// What an effort buys.
#[derive(Debug, Clone, Copy)]
pub struct SearchBudget {
    /// Search of one cause.
    pub plan: Plan,
    /// Hints per cause and drive that are followed.
    pub hints: usize,
    /// Random candidates for the base, and its search.
    pub population: usize,
    /// Search of the base.
    pub base: Plan,
    /// Causes that are cross-fitted.
    pub short_list: usize,
    /// Simulations after which no further round begins, if there are two causes already.
    pub enough: u64,
}

impl SearchBudget {
    /// For further rounds, in which most of what there was is found.
    #[must_use]
    pub fn further(&self) -> SearchBudget {
        let plan = Plan { select: (self.plan.select - 1).max(1), keep: 1, ..self.plan };
        SearchBudget { plan, ..*self }
    }

    /// What an effort buys.
    #[must_use]
    pub fn of(effort: Effort) -> SearchBudget {
        let plan = |select, rough, keep, fine| Plan { select, rough, keep, fine, tolerance: 0.1, least: [0.0; 2] };
        match effort {
            Effort::Quick => SearchBudget {
                // Whether a cause has half a nat more decides nothing; an adopted one is fitted again in the next round, if there is one.
                plan: Plan { tolerance: 0.5, ..plan(2, 2, 1, 8) },
                hints: 3,
                population: 96,
                base: plan(8, 6, 2, 20),
                short_list: 5,
                enough: 150_000,
            },
            Effort::Normal => SearchBudget {
                plan: plan(3, 3, 2, 12),
                hints: 5,
                population: 256,
                base: plan(12, 8, 3, 30),
                short_list: 6,
                enough: 650_000,
            },
            Effort::Thorough => SearchBudget {
                plan: plan(6, 4, 4, 25),
                hints: 8,
                population: 768,
                base: plan(32, 8, 6, 40),
                short_list: 9,
                enough: u64::MAX,
            },
        }
    }
}
