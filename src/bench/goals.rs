//! Goals of the evaluators on one core (3.8 GHz, AVX-512, Sapphire Rapids class), beside the measured values. Printed, never asserted: a figure depends
//! more on the machine than on the program.

use super::measure::{is_software, median};
use super::plan::{POPULATION, Report};
use serde_json::{Value, json};

/// A goal and the measured value.
#[derive(Debug, Clone, PartialEq)]
pub struct Goal {
    /// The goal, in words.
    pub what: String,
    pub unit: &'static str,
    /// The value to reach.
    pub wanted: f64,
    /// True if lower is better.
    pub at_most: bool,
    /// The measured value; `None` if it was not measured.
    pub found: Option<f64>,
}

/// Evaluator, precision, variant, Mcs per core-second. The goals of `gpu` are for lavapipe, software Vulkan.
const SPEEDS: [(&str, &str, u32, f64); 7] = [
    ("lanes", "plain", 1, 700.0),
    ("lanes", "f64", 1, 250.0),
    ("lanes", "plain", 32, 440.0),
    ("lanes", "plain", 37, 1500.0),
    ("gpu", "plain", 1, 105.0),
    ("gpu", "compensated", 1, 75.0),
    ("gpu", "plain", 37, 200.0),
];

impl Goal {
    /// Whether it was met; `None` without a measurement.
    pub fn is_met(&self) -> Option<bool> {
        self.found.map(|found| if self.at_most { found <= self.wanted } else { found >= self.wanted })
    }

    pub(super) fn json(&self) -> Value {
        json!({
            "goal": self.what, "unit": self.unit, "wanted": self.wanted, "at_most": self.at_most, "found": self.found,
            "met": self.is_met(),
        })
    }
}

impl Report {
    /// The goals of the project, with the measured values.
    pub fn goals(&self) -> Vec<Goal> {
        let software = self.adapter.as_deref().is_some_and(is_software);
        let mut goals: Vec<Goal> = SPEEDS
            .iter()
            .map(|&(evaluator, precision, id, wanted)| {
                let row = self.row_of(evaluator, precision, id, POPULATION).filter(|_| evaluator != "gpu" || software);
                let on = if evaluator == "gpu" { " on lavapipe" } else { "" };
                Goal {
                    what: format!("{evaluator} {precision}{on}, variant {id}"),
                    unit: "Mcs/core-s",
                    wanted,
                    at_most: false,
                    found: row.map(|row| row.mcs_per_core_second),
                }
            })
            .collect();
        for precision in ["plain", "f64"] {
            let rate =
                |evaluator, precision| Some(self.row_of(evaluator, precision, 1, POPULATION)?.mcs_per_core_second);
            let native = rate("native", if precision == "f64" { "f64" } else { "f32" });
            goals.push(Goal {
                what: format!("lanes {precision}, variant 1: share of the hand-written loop"),
                unit: "%",
                wanted: 60.0,
                at_most: false,
                found: rate("lanes", precision).zip(native).map(|(lanes, native)| 100.0 * lanes / native),
            });
        }
        goals.push(Goal {
            what: "slowest of the ninety on lanes: times slower than variant 1".to_owned(),
            unit: "x",
            wanted: 4.0,
            at_most: true,
            found: self.slowest("lanes", POPULATION).map(|(_, ratio)| ratio),
        });
        let lanes =
            self.generations.iter().find(|g| (g.evaluator, g.precision, g.population) == ("lanes", "plain", 100));
        goals.push(Goal {
            what: "lanes, a generation of 100 besides simulation".to_owned(),
            unit: "ms",
            wanted: 0.2,
            at_most: true,
            found: lanes.map(|g| 1e3 * median(&g.wall_s)),
        });
        goals
    }

    /// Id of the slowest variant on an evaluator and its ratio to variant 1; `None` unless all ninety were measured.
    pub(super) fn slowest(&self, evaluator: &str, population: usize) -> Option<(u32, f64)> {
        let rate = |id| Some(self.row_of(evaluator, "plain", id, population)?.mcs_per_core_second);
        let base = rate(1)?;
        let ratio = |id| Some((id, base / rate(id)?));
        let all: Option<Vec<(u32, f64)>> = (1..=crate::catalog::Variant::COUNT).map(ratio).collect();
        all?.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))
    }
}
