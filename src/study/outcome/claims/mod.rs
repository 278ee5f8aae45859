//! Statements of the paper, and whether a study agrees.

mod collisions;
mod errors;

use super::{Outcomes, Table4Row, Table5Row};

/// A statement of the paper beside the result of a study.
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    /// The paper's statement in short, with the section.
    pub paper: &'static str,
    /// The result, with numbers.
    pub found: String,
    /// Whether that agrees; `None` if the study cannot decide.
    pub agrees: Option<bool>,
    /// The reason for a difference in the study; `None` without one.
    pub why: Option<String>,
}

/// The goodness of fit that the paper's Tables 4 and 5 are about.
pub const PAPERS_GOF: &str = "nrmse-sva";

/// The five base models, by name.
const BASES: [&str; 5] = ["idm", "gipps", "l-cth", "l-idm", "l-gipps"];

/// Every statement. `all` are the outcomes of every goodness of fit of the study, `own` those that the tables
/// are made of. Outcomes of another goodness of fit cannot decide statements of the paper about its own.
pub fn claims(own: &Outcomes, table4: &[Table4Row], table5: &[Table5Row], all: &[Outcomes]) -> Vec<Claim> {
    let of = Reader { own, table4, table5 };
    let mut claims = of.errors();
    claims.extend(of.collisions());
    claims.push(of.less_in_validation());
    if own.gof != PAPERS_GOF {
        for claim in &mut claims {
            (claim.agrees, claim.why) = (None, None);
        }
    }
    claims.extend(collisions::by_gof(all));
    claims
}

struct Reader<'a> {
    own: &'a Outcomes,
    table4: &'a [Table4Row],
    table5: &'a [Table5Row],
}

impl Reader<'_> {
    /// Of several base models the one with the lowest value, if all are present and the lowest is unique.
    fn lowest(
        paper: &'static str,
        values: &[(&str, f64)],
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

/// A study of some base models cannot decide statements about all of them.
fn every_base<T>(values: &[T]) -> bool {
    values.len() == BASES.len()
}

fn claim(paper: &'static str, found: &[String], agrees: Option<bool>) -> Claim {
    let found = if found.is_empty() { "not in this study".to_owned() } else { found.join(", ") };
    Claim { paper, found, agrees, why: None }
}

impl Claim {
    /// Adds the reason for a difference, if there is one.
    fn because(self, why: impl FnOnce() -> Vec<String>) -> Claim {
        let why = if self.agrees == Some(false) { why() } else { Vec::new() };
        Claim { why: (!why.is_empty()).then(|| why.join("; ")), ..self }
    }
}
