//! The measurements and their order.

use super::contender::has_hardware;
use super::generation::Generation;
use super::measure::{Measurement, median};
use super::{BenchError, Contender, Drive, Machine, Row};
use crate::catalog::Variant;
use crate::evaluator::EvaluateError;
use crate::reference::knows;
use serde_json::{Value, json};

/// Amount of measurements.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Effort {
    /// Three variants; well under a minute.
    Quick,
    /// Several population sizes, and all ninety variants on `lanes` and on a hardware GPU; some minutes.
    Full,
    /// One variant, several population sizes.
    Variant(Variant),
}

/// IDM, Gipps with delay, linear dynamics and constant bounds, and the linear law with constant time headway: a power
/// function, square roots, and neither.
const VARIANTS: [u32; 3] = [1, 32, 37];

/// Candidates by default.
pub(super) const POPULATION: usize = 4096;

/// Candidates of the scalar reference, whose speed does not depend on their number.
const POPULATION_OF_REFERENCE: usize = 64;

/// Candidates for a hardware GPU in addition: some thousands leave most of a large one idle.
const LARGE: [usize; 2] = [32_768, MANY];

/// Candidates that keep all of a large GPU busy.
pub(super) const MANY: usize = 262_144;

/// All measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    pub machine: Machine,
    /// The GPU, or the software driver in its place.
    pub adapter: Option<String>,
    /// The drive.
    pub data: String,
    /// Names of the variants that the text shows line by line.
    pub shown: Vec<String>,
    /// Contenders on variants.
    pub rows: Vec<Row>,
    /// Cost of a generation beside simulating.
    pub generations: Vec<Generation>,
    /// Measurements left out, and why.
    pub left_out: Vec<String>,
}

impl Report {
    /// As documented for `leadlag bench --json`.
    pub fn json(&self) -> Value {
        let goals: Vec<Value> = self.goals().iter().map(super::Goal::json).collect();
        json!({
            "schema_version": 1, "machine": self.machine.to_string(), "load": self.machine.load, "adapter": self.adapter,
            "data": self.data, "rows": self.rows, "generations": self.generations, "goals": goals,
            "left_out": self.left_out,
        })
    }

    /// The row of a contender on a variant of Table 1.
    pub(super) fn row_of(&self, evaluator: &str, precision: &str, id: u32, population: usize) -> Option<&Row> {
        self.row(evaluator, precision, &Variant::from_id(id).ok()?.name(), population)
    }

    /// The row of a contender.
    pub(super) fn row(&self, evaluator: &str, precision: &str, variant: &str, population: usize) -> Option<&Row> {
        let is = |r: &&Row| {
            (r.evaluator, r.precision, r.variant.as_str(), r.population) == (evaluator, precision, variant, population)
        };
        self.rows.iter().find(is)
    }
}

/// The variants that are measured by every contender: by default IDM first.
fn shown(effort: Effort) -> Vec<Variant> {
    match effort {
        Effort::Variant(variant) => vec![variant],
        Effort::Quick | Effort::Full => VARIANTS.map(|id| Variant::from_id(id).expect("of Table 1")).to_vec(),
    }
}

/// Contender, variant and number of candidates of everything that is timed, none twice.
fn plan(effort: Effort, has_hardware: bool) -> Vec<(Contender, Variant, usize)> {
    let mut plan = Vec::new();
    let mut add = |contender: Contender, variant: Variant, population| {
        let can = match contender {
            Contender::Reference => knows(&variant),
            _ => !contender.is_native() || variant.id() == 1,
        };
        if can && !plan.contains(&(contender, variant, population)) {
            plan.push((contender, variant, population));
        }
    };
    let populations: &[usize] = if effort == Effort::Quick { &[POPULATION] } else { &[100, 1024, POPULATION] };
    let shown = shown(effort);
    let (first, others) = (shown[0], &shown[1..]);
    for &contender in Contender::ALL {
        if contender == Contender::Reference {
            add(contender, first, POPULATION_OF_REFERENCE);
            others.iter().for_each(|&variant| add(contender, variant, POPULATION_OF_REFERENCE));
            continue;
        }
        let on_hardware = has_hardware && contender.is_gpu();
        let large = if on_hardware { LARGE.as_slice() } else { &[] };
        populations.iter().chain(large).for_each(|&population| add(contender, first, population));
        if contender.precision() != "plain" {
            continue;
        }
        for &variant in others {
            [POPULATION].iter().chain(large).for_each(|&population| add(contender, variant, population));
        }
        if effort == Effort::Full && (on_hardware || contender.evaluator() == "lanes") {
            let population = if on_hardware { MANY } else { POPULATION };
            Variant::all().for_each(|variant| add(contender, variant, population));
        }
    }
    plan
}

/// Runs the measurements. `progress` receives the name of each step.
pub fn run(drive: &Drive, effort: Effort, progress: &mut dyn FnMut(&str)) -> Result<Report, BenchError> {
    let machine = Machine::here();
    let mut measurements = Vec::new();
    // A hardware GPU separately: between turns of the CPU it would idle, and it is slow at first after idling.
    let has_hardware = has_hardware();
    let (by_itself, in_turns): (Vec<_>, Vec<_>) =
        plan(effort, has_hardware).into_iter().partition(|(contender, ..)| has_hardware && contender.is_gpu());
    for (k, &(contender, variant, population)) in in_turns.iter().enumerate() {
        progress(&format!("warming up {} of {}", k + 1, in_turns.len()));
        measurements.extend(Measurement::new(contender, variant, drive, population)?);
    }
    let rounds = if effort == Effort::Quick { 5 } else { 9 };
    for round in 1..=rounds {
        progress(&format!("round {round} of {rounds}"));
        measurements.iter_mut().try_for_each(Measurement::repeat)?;
    }
    let mut rows: Vec<Row> = measurements.iter().map(Measurement::row).collect();
    let mut adapter = measurements.iter().find_map(Measurement::adapter);
    let mut left_out = Vec::new();
    // One after the other, because a small GPU could not hold all large populations at once.
    for (k, &(contender, variant, population)) in by_itself.iter().enumerate() {
        progress(&format!("on the GPU, {} of {}", k + 1, by_itself.len()));
        if expected_s(&rows, population).is_some_and(|expected| expected > LONGEST_S) {
            let reason = format!("{population} candidates on the GPU: more than {LONGEST_S} s a repetition");
            if !left_out.contains(&reason) {
                left_out.push(reason);
            }
            continue;
        }
        let measured = || -> Result<Option<Measurement>, BenchError> {
            let measurement = Measurement::new(contender, variant, drive, population)?;
            let Some(mut measurement) = measurement else { return Ok(None) };
            measurement.wake()?;
            (0..rounds).try_for_each(|_| measurement.repeat())?;
            Ok(Some(measurement))
        };
        match measured() {
            Ok(measurement) => {
                adapter = adapter.or_else(|| measurement.as_ref().and_then(Measurement::adapter));
                rows.extend(measurement.as_ref().map(Measurement::row));
            }
            // For example too little memory; the other measurements are kept.
            Err(BenchError::Evaluate(error @ (EvaluateError::Device { .. } | EvaluateError::Memory { .. }))) => {
                left_out.push(format!("variant {variant} on gpu, {population} candidates: {error}"));
            }
            Err(error) => return Err(error),
        }
    }
    let mut generations = Vec::new();
    let with_generations = !matches!(effort, Effort::Variant(_));
    for &contender in Contender::ALL.iter().filter(|c| with_generations && !c.is_native()) {
        progress("generations of an optimiser");
        generations.extend(Generation::measure(contender, drive)?);
    }
    let data = format!("{}, {} samples", drive.name, drive.samples());
    let shown = shown(effort).iter().map(Variant::name).collect();
    Ok(Report { machine, adapter, data, shown, rows, generations, left_out })
}

/// A longer repetition \[s\] is left out: a small GPU would take hours over ninety large populations.
const LONGEST_S: f64 = 1.0;

/// Time \[s\] of this many candidates on the GPU, from the times of fewer with the first variant; `None` before those are measured.
fn expected_s(rows: &[Row], population: usize) -> Option<f64> {
    let fewer = |row: &&Row| row.evaluator == "gpu" && row.precision == "plain" && row.variant == rows[0].variant;
    let largest = rows.iter().filter(fewer).max_by_key(|row| row.population)?;
    Some(median(&largest.wall_s) * population as f64 / largest.population as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn hardware_gets_populations_that_fill_it_and_all_variants() {
        let plain = |plan: &[(Contender, Variant, usize)], gpu: bool| -> Vec<(u32, usize)> {
            let all = plan.iter().filter(|(c, ..)| c.is_gpu() == gpu && c.precision() == "plain");
            all.map(|(_, variant, population)| (variant.id(), *population)).collect()
        };
        let (without, with) = (plan(Effort::Full, false), plan(Effort::Full, true));
        assert_eq!(plain(&without, false), plain(&with, false), "the plans of the CPU are equal");
        assert!(plain(&without, true).iter().all(|(_, population)| *population <= POPULATION));
        let on_hardware = plain(&with, true);
        assert!((1..=Variant::COUNT).all(|id| on_hardware.contains(&(id, MANY))), "{on_hardware:?}");
        assert!(plain(&plan(Effort::Quick, true), true).contains(&(1, MANY)));
        let once: HashSet<_> = with.iter().collect();
        assert_eq!(once.len(), with.len(), "nothing twice");
    }
}
