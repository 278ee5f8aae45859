//! Statements of the paper on errors in calibration and validation.

use super::{BASES, Claim, Reader, claim, every_base};
use crate::catalog::{Constraint, Dynamics, Variant};
use crate::statistics::{mean, median};
use crate::text::shown::{NAMED, first};
use std::collections::BTreeMap;

/// Parameters of the parts that the paper adds.
const OF_PARTS: [&str; 6] = ["tau_p", "tau_a", "m_load", "f_0", "f_1", "f_2"];

impl Reader<'_> {
    /// Every statement about errors in calibration.
    pub fn errors(&self) -> Vec<Claim> {
        vec![
            self.replicates(),
            self.lowers("linear dynamics lower the median error of every base model (5.3)", "+linear"),
            self.lowers("perception delay lowers the median error of every base model (5.3)", "+delay"),
            self.linear_beats_nonlinear(),
            self.constraints_matter_least(),
            self.less_than_the_sum(),
            self.best_class(
                "Gipps-based variants have the lowest errors in calibration (abstract, 5.3)",
                &BASES,
                "gipps",
            ),
            self.best_class(
                "among linear controllers, those with the Gipps spacing policy are the best (5.3)",
                &["l-cth", "l-idm", "l-gipps"],
                "l-gipps",
            ),
        ]
    }

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
        let found = match (worst, median(&all)) {
            (Some(worst), Some(median)) => {
                format!("median {:.3} %, largest {:.2} % of {}", 100.0 * median, 100.0 * worst, all.len())
            }
            _ => "fewer than two replicates".to_owned(),
        };
        let paper = "the coefficient of variation over replicates is always below 3 % (5.1)";
        claim(paper, &[found], worst.map(|worst| worst < 0.03)).because(|| {
            let wide = |i: &usize| self.own.variations(*i).iter().any(|cv| *cv >= 0.03);
            let names: Vec<String> =
                (0..self.own.variants.len()).filter(wide).map(|i| self.own.variants[i].name()).collect();
            vec![format!("3 % or more with {}", first(&names, NAMED))]
        })
    }

    fn lowers(&self, paper: &'static str, extension: &str) -> Claim {
        let changes: Vec<(&str, f64)> =
            BASES.iter().filter_map(|base| Some((*base, self.change(&format!("{base}{extension}"))?))).collect();
        let listed: Vec<String> = changes.iter().map(|(base, change)| format!("{base} {change:+.0} %")).collect();
        let agrees = every_base(&changes).then(|| changes.iter().all(|(_, change)| *change < 0.0));
        claim(paper, &listed, agrees).because(|| {
            let others = changes.iter().filter(|(_, change)| *change >= 0.0);
            others.filter_map(|(base, _)| self.pair(&format!("{base}{extension}"), base)).collect()
        })
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
        claim(paper, &listed, every_base(&pairs).then(|| pairs.iter().all(|(_, l, n)| l < n))).because(|| {
            let others = pairs.iter().filter(|(_, l, n)| l >= n);
            let named =
                |(base, ..): &(&str, f64, f64)| self.pair(&format!("{base}+nonlinear"), &format!("{base}+linear"));
            others.filter_map(named).collect()
        })
    }

    /// Number of trajectories on which a variant has a lower error than another, and the parameters of its parts that its winners have on a bound.
    fn pair(&self, name: &str, other: &str) -> Option<String> {
        let (own, other_cells) = (&self.own.cells[self.index(name)?], &self.own.cells[self.index(other)?]);
        let scores: Vec<(f64, f64)> =
            own.iter().zip(other_cells).filter_map(|(own, other)| Some((own.score?, other.score?))).collect();
        let lower = scores.iter().filter(|(own, other)| own < other).count();
        let mut on_bound: BTreeMap<&str, usize> = BTreeMap::new();
        for symbol in own.iter().flat_map(|cell| &cell.at_bound).filter(|symbol| OF_PARTS.contains(&symbol.as_str())) {
            *on_bound.entry(symbol).or_default() += 1;
        }
        let bounds: Vec<String> = on_bound.iter().map(|(symbol, count)| format!("{symbol} {count}")).collect();
        let bounds = match bounds.is_empty() {
            true => String::new(),
            false => format!(" (winners on a bound: {})", bounds.join(", ")),
        };
        Some(format!("{name} is better than {other} on {lower} of {} trajectories{bounds}", scores.len()))
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
        Self::lowest(paper, &medians, bases, expected, |x| format!("{x:.3}")).because(|| {
            let best = |drive: usize| {
                let scored = bases.iter().flat_map(|base| self.own.class(base).into_iter().map(move |v| (*base, v)));
                let scores = scored.filter_map(|(base, v)| Some((base, self.own.cells[v][drive].score?)));
                scores.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(base, _)| base)
            };
            let best: Vec<&str> = (0..self.own.drives.len()).filter_map(best).collect();
            let count = |base: &str| best.iter().filter(|b| **b == base).count();
            let counts = bases.iter().map(|base| format!("{base} {}", count(base)));
            let counts: Vec<String> = counts.collect();
            vec![format!("trajectories by the base model of their best variant: {}", counts.join(", "))]
        })
    }

    /// Medians of Table 5, over all variants but the base models.
    pub fn less_in_validation(&self) -> Claim {
        let both: Vec<(f64, f64)> =
            self.table5.iter().filter_map(|row| Some((row.calibration[3]?, row.validation[3]?))).collect();
        let (calibration, validation): (Vec<f64>, Vec<f64>) = both.iter().copied().unzip();
        let paper = "the physical extensions lower the errors less in validation than in calibration (6.2)";
        let Some((c, v)) = median(&calibration).zip(median(&validation)) else { return claim(paper, &[], None) };
        let found = format!("median change of NRMSE(s,v,a) over {} variants: {c:+.1} % against {v:+.1} %", both.len());
        claim(paper, &[found], Some(c < v))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Cell, DriveName, Outcomes, Table4Row};
    use super::super::{PAPERS_GOF, claims};
    use super::*;

    /// Variants with a score and the parameters on a bound, on one trajectory.
    fn outcomes(gof: &str, variants: &[(&str, f64, &[&str])]) -> (Outcomes, Vec<Table4Row>) {
        let cell = |(_, score, on_bound): &(&str, f64, &[&str])| {
            let at_bound = on_bound.iter().map(|symbol| (*symbol).to_owned()).collect();
            vec![Cell { score: Some(*score), at_bound, ..Cell::default() }]
        };
        let own = Outcomes {
            gof: gof.to_owned(),
            drives: vec![DriveName { platoon: "P3".to_owned(), follower: 1, vehicle: "car".to_owned() }],
            variants: variants.iter().map(|(name, ..)| name.parse().expect("a variant")).collect(),
            cells: variants.iter().map(cell).collect(),
        };
        let base = |name: &str| name.split('+').next().unwrap_or(name).to_owned();
        let of_base = |name: &str| variants.iter().find(|(other, ..)| *other == base(name)).map_or(1.0, |v| v.1);
        let row = |(name, score, _): &(&str, f64, &[&str])| Table4Row {
            median: Some(*score),
            change: name.contains('+').then(|| 100.0 * (score / of_base(name) - 1.0)),
        };
        let rows = variants.iter().map(row).collect();
        (own, rows)
    }

    #[test]
    fn what_the_paper_says_of_every_base_one_base_cannot_tell() {
        let (own, table4) = outcomes(PAPERS_GOF, &[("idm", 1.0, &[]), ("idm+linear", 0.95, &[])]);
        let claim = Reader { own: &own, table4: &table4, table5: &[] }.lowers("", "+linear");
        assert_eq!((claim.found.as_str(), claim.agrees), ("idm -5 %", None));
    }

    /// Linear dynamics lower the error of every base model, except the last one, as given.
    fn linear(last: f64) -> Vec<(&'static str, f64, &'static [&'static str])> {
        let bases = BASES.iter().map(|base| (*base, 1.0, &[] as &[&str]));
        let names = ["idm+linear", "gipps+linear", "l-cth+linear", "l-idm+linear", "l-gipps+linear"];
        let score = |name: &str| if name == "l-gipps+linear" { last } else { 0.9 };
        bases.chain(names.map(|name| (name, score(name), &["tau_a", "v_0"] as &[&str]))).collect()
    }

    #[test]
    fn a_difference_says_what_lies_behind_it() {
        let of = |last: f64| {
            let (own, table4) = outcomes(PAPERS_GOF, &linear(last));
            let claim = Reader { own: &own, table4: &table4, table5: &[] }.lowers("", "+linear");
            (claim.agrees, claim.why)
        };
        assert_eq!(of(0.9), (Some(true), None));
        let why = "l-gipps+linear is better than l-gipps on 0 of 1 trajectories (winners on a bound: tau_a 1)";
        assert_eq!(of(1.1), (Some(false), Some(why.to_owned())));
    }

    #[test]
    fn another_goodness_of_fit_is_not_judged_by_what_the_paper_says_of_its_own() {
        let judged = |gof: &str| {
            let (own, table4) = outcomes(gof, &linear(1.1));
            let all = [own.clone()];
            claims(&own, &table4, &[], &all).iter().filter(|claim| claim.agrees.is_some()).count()
        };
        assert!(judged(PAPERS_GOF) > 0);
        assert_eq!(judged("rmse-s"), 0);
    }
}
