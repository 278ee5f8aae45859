//! What the paper says, and whether a study says the same.

use super::statistics::{mean, median};
use super::{Outcomes, Table4Row};
use crate::catalog::{Constraint, Dynamics, Variant};

/// A statement of the paper beside what a study finds.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    /// The paper's words, in short, with the section.
    pub paper: &'static str,
    /// What was found, with numbers.
    pub found: String,
    /// Whether that is the same; `None` if the study cannot tell.
    pub agrees: Option<bool>,
}

/// The five base models, by name.
const BASES: [&str; 5] = ["idm", "gipps", "l-cth", "l-idm", "l-gipps"];

/// Every statement, in the order of the paper. `all` are the outcomes of every goodness of fit of the study, `own` those that Table 4 is made
/// of.
#[must_use]
pub fn claims(own: &Outcomes, table4: &[Table4Row], all: &[Outcomes]) -> Vec<Claim> {
    let of = Reader { own, table4 };
    vec![
        of.replicates(),
        of.per_base("linear dynamics lower the median error of every base model (5.3)", "+linear", |change| {
            change < 0.0
        }),
        of.per_base("perception delay lowers the median error of every base model (5.3)", "+delay", |change| {
            change < 0.0
        }),
        of.linear_beats_nonlinear(),
        of.constraints_matter_least(),
        of.less_than_the_sum(),
        of.best_class("Gipps-based variants have the lowest errors in calibration (abstract, 5.3)", &BASES, "gipps"),
        of.best_class(
            "among linear controllers, those with the Gipps spacing policy are the best (5.3)",
            &["l-cth", "l-idm", "l-gipps"],
            "l-gipps",
        ),
        of.idm_hardly_crashes(),
        of.fewest_collisions(
            "Gipps-based variants are the second most robust (6.1)",
            &["gipps", "l-cth", "l-idm", "l-gipps"],
            "gipps",
        ),
        of.fewest_collisions(
            "among linear controllers, the Gipps spacing policy is the most robust (6.1)",
            &["l-cth", "l-idm", "l-gipps"],
            "l-gipps",
        ),
        least_collisions_by_gof(all),
    ]
}

struct Reader<'a> {
    own: &'a Outcomes,
    table4: &'a [Table4Row],
}

impl Reader<'_> {
    fn index(&self, name: &str) -> Option<usize> {
        self.own.variants.iter().position(|v| v.name() == name)
    }

    fn change(&self, name: &str) -> Option<f64> {
        self.table4[self.index(name)?].change
    }

    fn class_median(&self, base: &str) -> Option<f64> {
        let class = self.own.class(base);
        median(&class.iter().filter_map(|&i| self.table4[i].median).collect::<Vec<_>>())
    }

    fn replicates(&self) -> Claim {
        let all: Vec<f64> = (0..self.own.variants.len()).flat_map(|i| self.own.variations(i)).collect();
        let worst = all.iter().copied().reduce(f64::max);
        Claim {
            paper: "the coefficient of variation over replicates is always below 3 % (5.1)",
            found: match (worst, median(&all)) {
                (Some(worst), Some(median)) => {
                    format!("median {:.3} %, largest {:.2} % of {}", 100.0 * median, 100.0 * worst, all.len())
                }
                _ => "fewer than two replicates".to_owned(),
            },
            agrees: worst.map(|worst| worst < 0.03),
        }
    }

    fn per_base(&self, paper: &'static str, extension: &str, holds: impl Fn(f64) -> bool) -> Claim {
        let changes: Vec<(&str, f64)> =
            BASES.iter().filter_map(|base| Some((*base, self.change(&format!("{base}{extension}"))?))).collect();
        let listed: Vec<String> = changes.iter().map(|(base, change)| format!("{base} {change:+.0} %")).collect();
        claim(paper, &listed, every_base(&changes).then(|| changes.iter().all(|(_, change)| holds(*change))))
    }

    fn linear_beats_nonlinear(&self) -> Claim {
        let pairs: Vec<(&str, f64, f64)> = BASES
            .iter()
            .filter_map(|base| {
                let change = |dynamics: &str| self.change(&format!("{base}+{dynamics}"));
                Some((*base, change("linear")?, change("nonlinear")?))
            })
            .collect();
        let listed: Vec<String> =
            pairs.iter().map(|(base, l, n)| format!("{base} {l:+.0} % against {n:+.0} %")).collect();
        let paper = "nonlinear dynamics help less than linear ones (5.3)";
        claim(paper, &listed, every_base(&pairs).then(|| pairs.iter().all(|(_, l, n)| l < n)))
    }

    /// Mean size of the change that one part makes, everything else being equal.
    fn effect(&self, without: impl Fn(&Variant) -> Option<Variant>) -> Option<f64> {
        let size = |i: usize| {
            let other = without(&self.own.variants[i])?;
            let other = self.table4[self.index(&other.name())?].median?;
            Some((self.table4[i].median? - other).abs())
        };
        mean(&(0..self.own.variants.len()).filter_map(size).collect::<Vec<_>>())
    }

    fn constraints_matter_least(&self) -> Claim {
        let constraint = self
            .effect(|v| (v.constraint != Constraint::None).then_some(Variant { constraint: Constraint::None, ..*v }));
        let dynamics =
            self.effect(|v| (v.dynamics != Dynamics::None).then_some(Variant { dynamics: Dynamics::None, ..*v }));
        let delay = self.effect(|v| v.delay.then_some(Variant { delay: false, ..*v }));
        let paper = "acceleration constraints matter less than dynamics and delay (5.3)";
        let Some(((c, d), p)) = constraint.zip(dynamics).zip(delay) else { return claim(paper, &[], None) };
        let found = format!("mean change of the median error: constraints {c:.4}, dynamics {d:.4}, delay {p:.4}");
        claim(paper, &[found], Some(c < d && c < p))
    }

    fn less_than_the_sum(&self) -> Claim {
        let triples: Vec<(&str, f64, f64)> = BASES
            .iter()
            .filter_map(|base| {
                let change = |extension: &str| self.change(&format!("{base}{extension}"));
                Some((*base, change("+delay+linear")?, change("+delay")? + change("+linear")?))
            })
            .collect();
        let listed: Vec<String> =
            triples.iter().map(|(base, both, sum)| format!("{base} {both:+.0} % against {sum:+.0} %")).collect();
        let paper = "delay and linear dynamics together give less than the sum of both (5.3)";
        claim(paper, &listed, every_base(&triples).then(|| triples.iter().all(|(_, both, sum)| both > sum)))
    }

    fn best_class(&self, paper: &'static str, bases: &[&str], expected: &str) -> Claim {
        let medians: Vec<(&str, f64)> =
            bases.iter().filter_map(|base| Some((*base, self.class_median(base)?))).collect();
        self.lowest(paper, medians, bases, expected, |x| format!("{x:.3}"))
    }

    /// Share of validation runs of a base model that collide.
    fn collision_rate(&self, base: &str) -> Option<f64> {
        let counts: Vec<(usize, usize, usize)> =
            self.own.class(base).into_iter().map(|i| self.own.collisions(i)).collect();
        let runs: usize = counts.iter().map(|(_, _, runs)| runs).sum();
        (runs > 0).then(|| counts.iter().map(|(collisions, ..)| collisions).sum::<usize>() as f64 / runs as f64)
    }

    fn idm_hardly_crashes(&self) -> Claim {
        let rate = self.collision_rate("idm");
        let found: Vec<String> = rate.map(|rate| format!("{:.2} % of the runs", 100.0 * rate)).into_iter().collect();
        // "Almost zero": at most one run in a hundred.
        claim(
            "IDM-based variants show almost no collision in validation (abstract, 6.1)",
            &found,
            rate.map(|r| r <= 0.01),
        )
    }

    fn fewest_collisions(&self, paper: &'static str, bases: &[&str], expected: &str) -> Claim {
        let rates: Vec<(&str, f64)> =
            bases.iter().filter_map(|base| Some((*base, self.collision_rate(base)?))).collect();
        self.lowest(paper, rates, bases, expected, |x| format!("{:.1} %", 100.0 * x))
    }

    fn lowest(
        &self,
        paper: &'static str,
        values: Vec<(&str, f64)>,
        bases: &[&str],
        expected: &str,
        shown: impl Fn(f64) -> String,
    ) -> Claim {
        let listed: Vec<String> = values.iter().map(|(base, x)| format!("{base} {}", shown(*x))).collect();
        let lowest = values.iter().min_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| values.len() == bases.len());
        let ties = lowest.is_some_and(|low| values.iter().filter(|(_, x)| *x == low.1).count() > 1);
        claim(paper, &listed, lowest.filter(|_| !ties).map(|(base, _)| *base == expected))
    }
}

/// What the paper says of all base models a study of some of them cannot tell.
fn every_base<T>(values: &[T]) -> bool {
    values.len() == BASES.len()
}

fn claim(paper: &'static str, found: &[String], agrees: Option<bool>) -> Claim {
    let found = if found.is_empty() { "not in this study".to_owned() } else { found.join(", ") };
    Claim { paper, found, agrees }
}

fn least_collisions_by_gof(all: &[Outcomes]) -> Claim {
    let paper = "NRMSE(s,v,a) and Theil's U(s,v,a) give the fewest collisions of all goodness-of-fit functions (6.1)";
    let total = |outcomes: &Outcomes, of: &dyn Fn((usize, usize, usize)) -> usize| -> usize {
        (0..outcomes.variants.len()).map(|i| of(outcomes.collisions(i))).sum()
    };
    let mut rates: Vec<(f64, &str, usize)> = all
        .iter()
        .filter_map(|outcomes| {
            let (collisions, runs) = (total(outcomes, &|of| of.0), total(outcomes, &|of| of.2));
            (runs > 0).then(|| (collisions as f64 / runs as f64, outcomes.gof.as_str(), collisions))
        })
        .collect();
    rates.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(b.1)));
    let listed: Vec<String> =
        rates.iter().map(|(rate, gof, collisions)| format!("{gof} {collisions} ({:.1} %)", 100.0 * rate)).collect();
    let best = ["nrmse-sva", "u-sva"];
    let rate = |gof: &str| rates.iter().find(|(_, name, _)| *name == gof).map(|(rate, ..)| *rate);
    let other = rates.iter().find(|(_, name, _)| !best.contains(name)).map(|(rate, ..)| *rate);
    let agrees = match (best.map(rate), other) {
        // As many as another one has: a study cannot tell.
        ([Some(a), Some(b)], Some(other)) if a.max(b) != other => Some(a.max(b) < other),
        _ => None,
    };
    claim(paper, &listed, agrees)
}

#[cfg(test)]
mod tests {
    use super::super::{Cell, Tried};
    use super::*;

    /// One variant whose winners ran twenty times on other drives, or never.
    fn outcomes(gof: &str, collisions: usize, runs: usize) -> Outcomes {
        let tried = (0..runs).map(|i| if i < collisions { Tried::Collision } else { Tried::OtherEnd }).collect();
        let cell = Cell { tried, ..Cell::default() };
        let variants = vec!["idm".parse().expect("a variant")];
        Outcomes { gof: gof.to_owned(), drives: Vec::new(), variants, cells: vec![vec![cell]] }
    }

    #[test]
    fn collisions_by_gof_are_compared_only_where_there_are_any_to_compare() {
        let of = |all: &[(&str, usize, usize)]| {
            let all: Vec<Outcomes> = all.iter().map(|(gof, of, runs)| outcomes(gof, *of, *runs)).collect();
            least_collisions_by_gof(&all).agrees
        };
        let (first, third) = (("nrmse-sva", 1, 20), ("rmse-s", 5, 20));
        assert_eq!(of(&[first, ("u-sva", 2, 20), third]), Some(true));
        assert_eq!(of(&[first, ("u-sva", 6, 20), third]), Some(false));
        assert_eq!(of(&[first, ("u-sva", 5, 20), third]), None, "as many as the third");
        assert_eq!(of(&[first, ("u-sva", 9, 20), third, ("rmse-v", 5, 20)]), Some(false), "two others are alike");
        assert_eq!(of(&[("nrmse-sva", 0, 0), ("u-sva", 0, 0), ("rmse-s", 0, 0)]), None, "no run");
        assert_eq!(of(&[first, ("u-sv", 2, 20), third]), None, "one that the paper names is missing");
        assert_eq!(of(&[("nrmse-sva", 2, 40), ("u-sva", 1, 20), ("rmse-s", 2, 20)]), Some(true), "rates, not numbers");
    }

    #[test]
    fn what_the_paper_says_of_every_base_one_base_cannot_tell() {
        let own = outcomes("nrmse-sva", 0, 0);
        let row = |change: f64| Table4Row { median: None, change: Some(change) };
        let own = Outcomes { variants: vec!["idm+linear".parse().expect("a variant")], ..own };
        let claim = Reader { own: &own, table4: &[row(-5.0)] }.per_base("", "+linear", |change| change < 0.0);
        assert_eq!((claim.found.as_str(), claim.agrees), ("idm -5 %", None));
    }
}
