//! Statements of the paper on collisions in validation.

use super::super::{Outcomes, Tried};
use super::{BASES, Claim, PAPERS_GOF, Reader, claim};
use crate::catalog::{Constraint, Dynamics, Variant};
use crate::statistics::spearman;

/// All but the IDM, which hardly ever collides.
const OTHERS: [&str; 4] = ["gipps", "l-cth", "l-idm", "l-gipps"];

impl Reader<'_> {
    /// Every statement about the collisions with the paper's goodness of fit.
    pub fn collisions(&self) -> Vec<Claim> {
        vec![
            self.idm_hardly_crashes(),
            self.second_fewest("Gipps-based variants are the second most robust (6.1)", "gipps"),
            self.fewest(
                "among linear controllers, the Gipps spacing policy is the most robust (6.1)",
                &["l-cth", "l-idm", "l-gipps"],
                "l-gipps",
            ),
            self.complexity(),
        ]
    }

    /// Share of validation runs of a base model that collide.
    fn rate(&self, base: &str) -> Option<f64> {
        let counts = self.own.class(base).into_iter().map(|i| self.own.collisions(i));
        let (collisions, runs) = counts.fold((0, 0), |sum, (collisions, _, runs)| (sum.0 + collisions, sum.1 + runs));
        (runs > 0).then(|| collisions as f64 / runs as f64)
    }

    fn rates<'b>(&self, bases: &[&'b str]) -> Vec<(&'b str, f64)> {
        bases.iter().filter_map(|base| Some((*base, self.rate(base)?))).collect()
    }

    /// The same by the platoon of the calibration: part of the rate comes from the drives.
    fn by_platoon(&self, bases: &[&str]) -> Vec<String> {
        let mut platoons: Vec<&str> = self.own.drives.iter().map(|drive| drive.platoon.as_str()).collect();
        platoons.dedup();
        let of = |platoon: &&str| {
            let is_own = |(drive, _): &(usize, _)| self.own.drives[*drive].platoon == **platoon;
            let class = bases.iter().flat_map(|base| self.own.class(base));
            let cells = class.flat_map(|v| self.own.cells[v].iter().enumerate().filter(is_own));
            let tried: Vec<&Tried> = cells.flat_map(|(_, cell)| &cell.tried).collect();
            let collisions = tried.iter().filter(|tried| ***tried == Tried::Collision).count();
            let share = 100.0 * collisions as f64 / tried.len() as f64;
            (!tried.is_empty()).then(|| format!("{platoon} {share:.0} %"))
        };
        let shares: Vec<String> = platoons.iter().filter_map(of).collect();
        vec![format!("colliding runs, by the platoon of the calibration: {}", shares.join(", "))]
    }

    fn idm_hardly_crashes(&self) -> Claim {
        let rate = self.rate("idm");
        let found: Vec<String> = rate.map(|rate| format!("{:.2} % of the runs", 100.0 * rate)).into_iter().collect();
        let paper = "IDM-based variants show almost no collision in validation (abstract, 6.1)";
        // "Almost zero": at most one run in a hundred.
        claim(paper, &found, rate.map(|r| r <= 0.01)).because(|| self.by_platoon(&["idm"]))
    }

    fn fewest(&self, paper: &'static str, bases: &[&str], expected: &str) -> Claim {
        Self::lowest(paper, &self.rates(bases), bases, expected, percent).because(|| self.by_platoon(bases))
    }

    /// The second of all base models; the first is the IDM.
    fn second_fewest(&self, paper: &'static str, expected: &str) -> Claim {
        let mut rates = self.rates(&BASES);
        let listed: Vec<String> = rates.iter().map(|(base, rate)| format!("{base} {}", percent(*rate))).collect();
        rates.sort_by(|a, b| a.1.total_cmp(&b.1));
        let tells = rates.len() == BASES.len() && rates[0].1 != rates[1].1 && rates[1].1 != rates[2].1;
        claim(paper, &listed, tells.then(|| rates[1].0 == expected)).because(|| self.by_platoon(&BASES))
    }

    /// More parts, more collisions: the sign of the rank correlation within each base model but the IDM.
    fn complexity(&self) -> Claim {
        let parts = |v: &Variant| {
            f64::from(
                u8::from(v.delay) + u8::from(v.dynamics != Dynamics::None) + u8::from(v.constraint != Constraint::None),
            )
        };
        let correlation = |base: &&'static str| {
            let counts = self.own.class(base).into_iter().map(|i| (i, self.own.collisions(i)));
            let pairs = counts
                .filter(|(_, (.., runs))| *runs > 0)
                .map(|(i, (collisions, _, runs))| (parts(&self.own.variants[i]), collisions as f64 / runs as f64));
            Some((*base, spearman(&pairs.collect::<Vec<_>>())?))
        };
        let found: Vec<(&str, f64)> = OTHERS.iter().filter_map(correlation).collect();
        let listed: Vec<String> = found.iter().map(|(base, rho)| format!("{base} {rho:+.2}")).collect();
        let paper = "but for the IDM, the more complex a model, the more it collides (6.1)";
        let mut claim =
            claim(paper, &listed, (found.len() == OTHERS.len()).then(|| found.iter().all(|(_, rho)| *rho > 0.0)));
        if !listed.is_empty() {
            claim.found = format!("rank correlation of collisions with the number of parts: {}", claim.found);
        }
        claim
    }
}

fn percent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

/// The statements about goodness-of-fit functions.
pub fn by_gof(all: &[Outcomes]) -> Vec<Claim> {
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
        rates.iter().map(|(rate, gof, collisions)| format!("{gof} {collisions} ({})", percent(*rate))).collect();
    let best = [PAPERS_GOF, "u-sva"];
    let rate = |gof: &str| rates.iter().find(|(_, name, _)| *name == gof).map(|(rate, ..)| *rate);
    let other = rates.iter().find(|(_, name, _)| !best.contains(name)).map(|(rate, ..)| *rate);
    let fewest = match (best.map(rate), other) {
        // A tie: a study cannot decide.
        ([Some(a), Some(b)], Some(other)) if a.max(b) != other => Some(a.max(b) < other),
        _ => None,
    };
    let (spacing, speed) = (rate("rmse-s"), rate("rmse-v"));
    let spacing_is_better = spacing.zip(speed).filter(|(s, v)| s != v).map(|(s, v)| s < v);
    vec![
        claim(
            "NRMSE(s,v,a) and Theil's U(s,v,a) give the fewest collisions of all goodness-of-fit functions (6.1)",
            &listed,
            fewest,
        ),
        claim(
            "of single measures, spacing is preferable to speed: RMSE(s) collides less than RMSE(v) (6.1)",
            &listed,
            spacing_is_better,
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::super::super::Cell;
    use super::*;

    /// One variant whose winners ran twenty times on other drives, or never.
    fn outcomes(gof: &str, collisions: usize, runs: usize) -> Outcomes {
        let tried = (0..runs).map(|i| if i < collisions { Tried::Collision } else { Tried::OtherEnd }).collect();
        let cell = Cell { tried, ..Cell::default() };
        let variants = vec!["idm".parse().expect("a variant")];
        Outcomes { gof: gof.to_owned(), drives: Vec::new(), variants, cells: vec![vec![cell]] }
    }

    fn agree(all: &[(&str, usize, usize)]) -> [Option<bool>; 2] {
        let all: Vec<Outcomes> = all.iter().map(|(gof, of, runs)| outcomes(gof, *of, *runs)).collect();
        let claims = by_gof(&all);
        [claims[0].agrees, claims[1].agrees]
    }

    #[test]
    fn collisions_by_gof_are_compared_only_where_there_are_any_to_compare() {
        let of = |all: &[(&str, usize, usize)]| agree(all)[0];
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
    fn spacing_alone_is_compared_with_speed_alone() {
        let of = |s: usize, v: usize| agree(&[("rmse-s", s, 20), ("rmse-v", v, 20)])[1];
        assert_eq!([of(3, 5), of(5, 3), of(4, 4)], [Some(true), Some(false), None]);
        assert_eq!(agree(&[("rmse-s", 3, 20)])[1], None, "without speed");
    }

    /// Twenty runs of each base model, with this many collisions.
    fn classes(collisions: [usize; 5]) -> Outcomes {
        let cell = |n: &usize| {
            let tried = (0..20).map(|i| if i < *n { Tried::Collision } else { Tried::OtherEnd }).collect();
            vec![Cell { tried, ..Cell::default() }]
        };
        let drive = super::super::super::DriveName { platoon: "P3".to_owned(), follower: 1, vehicle: "car".to_owned() };
        Outcomes {
            gof: PAPERS_GOF.to_owned(),
            drives: vec![drive],
            variants: BASES.iter().map(|base| base.parse().expect("a variant")).collect(),
            cells: collisions.iter().map(cell).collect(),
        }
    }

    #[test]
    fn second_is_second_of_all_and_a_difference_says_what_lies_behind() {
        let second = |collisions: [usize; 5]| {
            let own = classes(collisions);
            let of = Reader { own: &own, table4: &[], table5: &[] };
            of.second_fewest("", "gipps")
        };
        assert_eq!(second([0, 2, 9, 9, 8]).agrees, Some(true));
        assert_eq!(second([2, 0, 9, 9, 8]).agrees, Some(false), "the fewest is not the second fewest");
        assert_eq!(second([0, 2, 2, 9, 8]).agrees, None, "two are second");
        assert_eq!(second([0, 2, 9, 9, 8]).why, None);
        assert_eq!(
            second([0, 9, 2, 9, 8]).why.as_deref(),
            Some("colliding runs, by the platoon of the calibration: P3 28 %")
        );
    }
}
