//! Search budgets of the efforts.

use crate::diagnose::likelihood::fit::Plan;
use crate::diagnose::question::Effort;

/// The search budget of an effort.
#[derive(Debug, Clone, Copy)]
pub struct SearchBudget {
    /// Search of one cause.
    pub plan: Plan,
    /// Number of starts per cause and drive.
    pub hints: usize,
    /// Number of random candidates for the base.
    pub population: usize,
    /// Search of the base.
    pub base: Plan,
    /// Causes that are cross-fitted.
    pub short_list: usize,
    /// Number of simulations after which no further round begins, if there are two causes already.
    pub enough: u64,
}

impl SearchBudget {
    /// The budget of further rounds, which start from a model that has most of the effects.
    #[must_use]
    pub fn further(&self) -> SearchBudget {
        let plan = Plan { select: (self.plan.select - 1).max(1), keep: 1, ..self.plan };
        SearchBudget { plan, ..*self }
    }

    /// The budget of an effort.
    #[must_use]
    pub fn of(effort: Effort) -> SearchBudget {
        let plan = |select, rough, keep, fine| Plan { select, rough, keep, fine, tolerance: 0.1, least: [0.0; 2] };
        match effort {
            Effort::Quick => SearchBudget {
                // Half a nat decides nothing, and the next round, if any, fits an adopted cause again.
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
