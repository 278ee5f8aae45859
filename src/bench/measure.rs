//! One contender on one variant with one population: warmed up once, then timed several times.

use super::{BenchError, Contender, Drive, candidates, contender::Runner};
use crate::catalog::Variant;
use crate::evaluator::{Population, Score};
use crate::score::GoodnessOfFit;
use cpu_time::ProcessTime;
use serde::Serialize;
use std::time::{Duration, Instant};

/// For a tenth of a second after a pause of some seconds, an NVIDIA H200 ran at a quarter of its speed.
const AWAKE: Duration = Duration::from_millis(300);

/// Measurements of one contender; every single time is kept.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Row {
    /// `native`, `reference`, `lanes` or `gpu`.
    pub evaluator: &'static str,
    /// `f32`, `f64`, `plain` or `compensated`.
    pub precision: &'static str,
    /// Id of Table 1.
    pub model_id: u32,
    /// Its name.
    pub variant: String,
    /// Number of candidates.
    pub population: usize,
    /// Samples of the drive.
    pub steps: usize,
    /// Jobs in one call: populations on one drive each.
    pub jobs: usize,
    /// Wall time of every repetition \[s\].
    pub wall_s: Vec<f64>,
    /// CPU time of the whole process in every repetition \[s\].
    pub cpu_s: Vec<f64>,
    /// Million candidate-steps per second of wall time, from the median.
    pub mcs_wall: f64,
    /// Million candidate-steps per second of CPU time, from the median; on a hardware GPU per second of wall time.
    pub mcs_per_core_second: f64,
    /// Unit of the line above: `cpu`, or `device` for a hardware GPU, on which the CPU waits.
    pub core_second_of: &'static str,
    /// Moving candidates and scores, per repetition \[s\].
    pub transfer_s: f64,
    /// The first dispatch, in which a driver compiles \[s\]; not part of the times above.
    pub first_dispatch_s: f64,
    /// Share of the candidate-steps that were really simulated: crashed candidates end early.
    pub executed: f64,
}

/// A contender ready to be timed.
pub(super) struct Measurement {
    contender: Contender,
    variant: Variant,
    runner: Runner,
    population: Population,
    scores: Vec<Score>,
    steps: usize,
    wall_s: Vec<f64>,
    cpu_s: Vec<f64>,
    /// Transfer time before the first timed repetition \[s\].
    transfer_before: f64,
}

impl Measurement {
    /// Makes the evaluator, draws the candidates and runs once. `None` if the machine has no device for it.
    pub fn new(
        contender: Contender,
        variant: Variant,
        drive: &Drive,
        count: usize,
    ) -> Result<Option<Measurement>, BenchError> {
        let case = drive.case(variant)?;
        let Some(mut runner) = contender.runner(&case, GoodnessOfFit::NRMSE_SVA)? else { return Ok(None) };
        let population = candidates(&drive.space(variant)?, count);
        let mut scores = vec![Score::Rejected; count];
        runner.run(&population, &mut scores)?;
        let transfer_before = runner.timings().transfer_s;
        let (wall_s, cpu_s) = (Vec::new(), Vec::new());
        let steps = case.s.len();
        Ok(Some(Measurement { contender, variant, runner, population, scores, steps, wall_s, cpu_s, transfer_before }))
    }

    /// The device, if any.
    pub fn adapter(&self) -> Option<String> {
        self.runner.adapter()
    }

    /// Repeats without timing until an idle GPU has reached its full speed.
    pub fn wake(&mut self) -> Result<(), BenchError> {
        let began = Instant::now();
        while began.elapsed() < AWAKE {
            self.runner.run(&self.population, &mut self.scores)?;
        }
        self.transfer_before = self.runner.timings().transfer_s;
        Ok(())
    }

    /// One timed repetition.
    pub fn repeat(&mut self) -> Result<(), BenchError> {
        let (wall, cpu) = (Instant::now(), ProcessTime::now());
        self.runner.run(&self.population, &mut self.scores)?;
        self.cpu_s.push(cpu.elapsed().as_secs_f64());
        self.wall_s.push(wall.elapsed().as_secs_f64());
        Ok(())
    }

    /// The result.
    pub fn row(&self) -> Row {
        let mcs = (self.population.len() * self.steps) as f64 / 1e6;
        let on_device = self.contender.evaluator() == "gpu" && !self.adapter().is_some_and(|name| is_software(&name));
        let (wall, cpu) = (median(&self.wall_s), median(&self.cpu_s));
        let executed = self.scores.iter().map(|score| match score {
            Score::Failed(failure) => failure.step,
            _ => self.steps,
        });
        let timings = self.runner.timings();
        Row {
            evaluator: self.contender.evaluator(),
            precision: self.contender.precision(),
            model_id: self.variant.id(),
            variant: self.variant.name(),
            population: self.population.len(),
            steps: self.steps,
            jobs: 1,
            mcs_wall: mcs / wall,
            mcs_per_core_second: mcs / if on_device { wall } else { cpu },
            core_second_of: if on_device { "device" } else { "cpu" },
            transfer_s: (timings.transfer_s - self.transfer_before) / self.wall_s.len() as f64,
            first_dispatch_s: timings.first_dispatch_s,
            executed: executed.sum::<usize>() as f64 / (self.population.len() * self.steps) as f64,
            wall_s: self.wall_s.clone(),
            cpu_s: self.cpu_s.clone(),
        }
    }
}

/// True for a Vulkan driver that computes on the CPU: its work is CPU time of this process.
pub(super) fn is_software(adapter: &str) -> bool {
    ["llvmpipe", "lavapipe", "swiftshader"].iter().any(|name| adapter.to_ascii_lowercase().contains(name))
}

/// The middle value; the mean of the middle two.
pub(super) fn median(values: &[f64]) -> f64 {
    crate::statistics::median(values).unwrap_or(f64::NAN)
}

#[cfg(test)]
mod tests {
    use super::is_software;

    #[test]
    fn software_adapters_are_told_by_name() {
        assert!(is_software("llvmpipe (LLVM 15.0.6, 256 bits)") && !is_software("NVIDIA GeForce RTX 4090"));
    }
}
