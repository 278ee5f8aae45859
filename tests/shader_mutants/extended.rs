//! Tests whether the text of an extension, or the common text of all extensions, computes the results of the reference.

use crate::common::extended::{BASES, WHOLE_RUN, WHOLE_RUN_PERIODIC, case, spread, with};
use leadlag::internal::evaluator::{Case, Evaluator, Job, Outcome, Population};
use leadlag::internal::lanes::{Lanes, LanesPrecision};
use leadlag::internal::reference::{Reference, knows};
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::wgsl::extension_named;

/// Candidates of a judge.
const CANDIDATES: usize = 12;

/// A model with an extension, and its correct results.
pub struct Judge {
    case: Case,
    population: Population,
    /// By the reference; by the unchanged text, where the reference has no transcription.
    expected: Vec<Outcome>,
    tolerance: f64,
}

/// True for the files that are judged here.
pub fn judges_file(file: &str) -> bool {
    ["shaders/extension/", "shaders/equilibrium/", LAW].iter().any(|part| file.starts_with(part))
}

/// Common start of all laws.
const LAW: &str = "shaders/controller/law.wgsl";

/// The judges of a file.
pub fn judges(file: &str) -> Vec<Judge> {
    if file == LAW {
        return vec![Judge::new("krauss", "grade")];
    }
    let name = file.strip_prefix("shaders/extension/").and_then(|name| name.strip_suffix(".wgsl"));
    let names: Vec<&str> = match name {
        Some(name) => vec![name],
        None => vec!["dead_zone", "aero_drag", "headway_mode_change"],
    };
    let mut judges = Vec::new();
    for base in BASES {
        for name in &names {
            judges.push(Judge::new(base, name));
        }
    }
    judges
}

impl Judge {
    fn new(base: &str, name: &str) -> Judge {
        let variant = with(base, &[extension_named(name).expect("built in")]);
        let case = case(variant);
        let population = spread(variant, CANDIDATES);
        let jobs = [Job { case: 0, population: &population }];
        let expected = if knows(&variant) {
            Reference::new(vec![case.clone()], GoodnessOfFit::default()).outcomes(&jobs).expect("it runs")
        } else {
            lanes(&case, &|_, _| None).expect("valid").outcomes(&jobs).expect("short delays")
        };
        let tolerance = if name == "periodic" { WHOLE_RUN_PERIODIC } else { WHOLE_RUN };
        Judge { case, population, expected, tolerance }
    }

    /// Differences that are detected with other texts in place of files.
    pub fn verdict(&self, replace: &dyn Fn(&str, &str) -> Option<String>) -> Result<(), String> {
        let mut lanes = lanes(&self.case, replace).map_err(|e| e.to_string())?;
        let jobs = [Job { case: 0, population: &self.population }];
        let found = lanes.outcomes(&jobs).map_err(|e| e.to_string())?;
        for (i, (found, expected)) in found.iter().zip(&self.expected).enumerate() {
            let (found, expected) = match (&found.result, &expected.result) {
                (Ok(found), Ok(expected)) => (found, expected),
                (found, expected) if found.is_ok() == expected.is_ok() => continue,
                _ => return Err(format!("candidate {i} ends otherwise")),
            };
            for (a, b) in found.values().into_iter().zip(expected.values()) {
                if (a - b).abs() > self.tolerance * b.abs() {
                    return Err(format!("candidate {i}: {a} not {b}"));
                }
            }
        }
        Ok(())
    }
}

fn lanes(
    case: &Case,
    replace: &dyn Fn(&str, &str) -> Option<String>,
) -> Result<Lanes, leadlag::internal::evaluator::EvaluateError> {
    Lanes::with_texts(vec![case.clone()], GoodnessOfFit::default(), LanesPrecision::F64, replace)
}
