//! A study beside the paper: Tables 4 and 5 and Figures 4 to 7 as tables and pictures, and a text on their agreement.

mod figures;
mod matrix;
mod page;
mod summary;
mod tables;

use crate::catalog::Variant;
use crate::study::PastRuns;
use crate::study::folder::StudyFile;
use crate::study::inventory::Inventory;
use crate::study::outcome::claims::{Claim, PAPERS_GOF, claims};
use crate::study::outcome::{Outcomes, Table4Row, Table5Row, compare};
use crate::study::paper::{Printed, printed};
use std::collections::BTreeMap;

/// Everything the report is made of.
struct Material<'a> {
    /// The planned study.
    study: &'a StudyFile,
    /// The outcomes of the goodness of fit that the tables are about.
    own: &'a Outcomes,
    /// The outcomes of every goodness of fit.
    all: &'a [Outcomes],
    four: Vec<Table4Row>,
    five: Vec<Table5Row>,
    claims: Vec<Claim>,
    /// The printed values of the paper; none for a goodness of fit other than its own.
    paper: BTreeMap<u32, Printed>,
    /// Number of missing tasks.
    missing: usize,
}

impl<'a> Material<'a> {
    fn new(study: &'a StudyFile, all: &'a [Outcomes], missing: usize) -> Material<'a> {
        let own = all.iter().find(|outcomes| outcomes.gof == PAPERS_GOF).unwrap_or(&all[0]);
        let (four, five) = compare(own);
        let claims = claims(own, &four, &five, all);
        let paper = if own.gof == PAPERS_GOF { printed() } else { BTreeMap::new() };
        Material { study, own, all, four, five, claims, paper, missing }
    }

    /// The statements of the paper that the study agrees with or contradicts.
    fn judged(&self) -> Vec<&Claim> {
        self.claims.iter().filter(|claim| claim.agrees.is_some()).collect()
    }

    /// Sentence on the statements that the study cannot judge; empty if the study judges no statement and so is not about the
    /// paper.
    fn open(&self) -> Option<String> {
        let judged = self.judged().len();
        let count = self.claims.len() - judged;
        let are = if count == 1 { "statement cannot" } else { "statements cannot" };
        let text = format!("{count} further {are} be judged by this study: it has too few variants or measures.");
        (judged > 0 && count > 0).then_some(text)
    }

    /// The paper's numbers, if they are shown beside those of the study.
    fn printed(&self, variant: &Variant) -> Option<&Printed> {
        self.paper.get(&variant.id()).filter(|_| self.is_beside_paper())
    }

    fn is_beside_paper(&self) -> bool {
        !self.paper.is_empty() && !self.judged().is_empty()
    }
}

/// The same as one HTML page with its numbers in it; `past` is the log of the runs on the study's folder. Panics without outcomes.
pub fn page(study: &StudyFile, all: &[Outcomes], inventory: &Inventory, past: &PastRuns) -> String {
    page::write(&Material::new(study, all, inventory.missing.len()), inventory, past)
}

/// The files of a report, by name. `all` has the outcomes of every goodness of fit, the first one for Tables 4 and 5; `missing` is the number of
/// missing tasks. Panics without outcomes.
pub fn files(study: &StudyFile, all: &[Outcomes], missing: usize) -> Vec<(&'static str, String)> {
    let material = Material::new(study, all, missing);
    let csv = |table| String::from_utf8(super::csv::write(&table)).expect("names and numbers are UTF-8");
    vec![
        ("report.md", summary::write(&material)),
        ("table4.csv", csv(tables::four(&material))),
        ("table5.csv", csv(tables::five(&material))),
        ("figure4.csv", csv(tables::variations(&material))),
        ("figure4.svg", figures::variations(&material)),
        ("figure5.csv", csv(tables::trajectories(&material))),
        ("figure5.svg", figures::trajectories(&material)),
        ("figure6.csv", csv(tables::boxes(&material))),
        ("figure6.svg", figures::boxes(&material)),
        ("figure7.csv", csv(tables::collisions(&material))),
        ("figure7.svg", figures::collisions(&material)),
    ]
}
