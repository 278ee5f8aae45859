//! Jobs laid out for a device: candidates by case, in parts that fit the limits.

use super::kernel::{Kernel, WORKGROUP};
use super::tables::Tables;
use crate::evaluator::{Case, Course, EvaluateError, Job, Observer, Pace};
use crate::symbols::{Parameters, Symbol};

/// Candidates of one dispatch at most, whatever the limits: a chunk of 16 samples of them takes about 0.1 s on a slow adapter.
const MOST_CANDIDATES: u64 = 1 << 19;

/// Candidates that share a bind group.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    /// Index into the groups of tables.
    pub(super) group: usize,
    /// Number of candidates.
    pub(super) count: u32,
    /// Samples of the longest of their trajectories.
    pub(super) samples: u32,
    /// Where the samples of their trajectory begin, if it is only one.
    pub(super) begin: Option<u32>,
}

/// What is to be simulated, kept on the host until it is done, so that it can be repeated on another device.
#[derive(Debug, Default)]
pub(super) struct Plan {
    /// Neighbours share a trajectory as far as possible.
    pub(super) parts: Vec<Part>,
    /// The contents of `candidates` of one part after the other.
    pub(super) words: Vec<u32>,
    /// Position in the jobs of the candidates of one part after the other.
    pub(super) positions: Vec<usize>,
    /// Jobs by case.
    order: Vec<usize>,
    /// Position of the first candidate of each job.
    begins: Vec<usize>,
}

impl Plan {
    /// Replaces the plan; memory is kept. Where there are observers, there is one job, and one for each of its candidates.
    #[allow(clippy::too_many_arguments, reason = "what a plan is made of, each of another owner")]
    pub(super) fn make(
        &mut self,
        jobs: &[Job],
        observers: &[Observer],
        cases: &[Case],
        courses: &[Course],
        groups: &[Tables],
        kernel: &Kernel,
        most: u32,
    ) -> Result<(), EvaluateError> {
        self.parts.clear();
        self.words.clear();
        self.positions.clear();
        self.order.clear();
        self.order.extend(0..jobs.len());
        self.order.sort_by_key(|k| jobs[*k].case);
        self.begins.clear();
        let mut begin = 0;
        for job in jobs {
            self.begins.push(begin);
            begin += job.population.len();
        }
        let mut at = 0;
        let symbols = cases[0].variant.parameters();
        let width = kernel.candidate_words() as usize;
        for (group, tables) in groups.iter().enumerate() {
            let until = self.order[at..].iter().position(|k| jobs[*k].case >= tables.cases.end);
            let until = until.map_or(self.order.len(), |n| at + n);
            let total: usize = self.order[at..until].iter().map(|k| jobs[*k].population.len()).sum();
            let mut candidates =
                self.order[at..until].iter().flat_map(|k| (0..jobs[*k].population.len()).map(move |i| (*k, i)));
            for first in (0..total).step_by(most as usize) {
                let count = (total - first).min(most as usize);
                let begin = self.words.len();
                self.words.resize(begin + count * width, 0);
                let (mut samples, mut begins) = (0, [u32::MAX, 0]);
                for (i, (k, candidate)) in candidates.by_ref().take(count).enumerate() {
                    let Job { case, population } = jobs[k];
                    let parameters = population.parameters(candidate);
                    let pace = pace(&cases[case], &courses[case], &parameters, kernel)?;
                    let job = (case - tables.cases.start) as u32;
                    let looks_back = kernel.looks_back().then_some(pace.look_back);
                    let own = row(&symbols, &parameters, &pace, job);
                    let own = own.chain(looks_back.into_iter().flatten().flat_map(looked_back));
                    let own = own.chain(observers.get(candidate).into_iter().flat_map(observer));
                    for (word, value) in own.enumerate() {
                        self.words[begin + word * count + i] = value;
                    }
                    samples = samples.max(courses[case].samples() as u32);
                    let begin = tables.begins[job as usize];
                    begins = [begins[0].min(begin), begins[1].max(begin)];
                    self.positions.push(self.begins[k] + candidate);
                }
                self.parts.push(Part {
                    group,
                    count: count as u32,
                    samples,
                    begin: (begins[0] == begins[1]).then_some(begins[0]),
                });
            }
            at = until;
        }
        Ok(())
    }
}

/// The words of one candidate.
fn row<'a>(symbols: &'a [Symbol], parameters: &'a Parameters, pace: &Pace, job: u32) -> impl Iterator<Item = u32> + 'a {
    let rest = [pace.back as u32, (pace.fraction as f32).to_bits(), pace.first as u32, job];
    symbols.iter().map(|symbol| (parameters.get(*symbol) as f32).to_bits()).chain(rest)
}

fn looked_back((back, fraction): (i32, f64)) -> [u32; 2] {
    [back as u32, (fraction as f32).to_bits()]
}

fn observer(observer: &Observer) -> impl Iterator<Item = u32> + use<> {
    let Observer { gain, whitening, decay } = *observer;
    gain.into_iter().chain(whitening).chain([decay]).map(|x| (x as f32).to_bits())
}

/// When a candidate perceives; an error if it would look back beyond what is remembered.
fn pace(case: &Case, course: &Course, parameters: &Parameters, kernel: &Kernel) -> Result<Pace, EvaluateError> {
    let pace = case.pace(parameters);
    let remembered = pace.back < kernel.ring as usize && pace.back < pace.first;
    if remembered && pace.first <= course.ring.min(course.samples() - 1) {
        return Ok(pace);
    }
    Err(EvaluateError::Delay { name: case.delay_name(), upper: case.longest_delay(), found: case.delay(parameters) })
}

/// Candidates that one part may have.
pub(super) fn most_candidates(kernel: &Kernel, blocks: u32, limits: &super::Limits) -> u32 {
    let words = kernel.candidate_words().max(kernel.state_words()).max(kernel.result_words()).max(2 * blocks);
    let by_bytes = limits.binding.min(limits.buffer) / (4 * u64::from(words));
    let by_workgroups = u64::from(limits.workgroups).pow(2).saturating_mul(u64::from(WORKGROUP));
    by_bytes.min(by_workgroups).clamp(1, MOST_CANDIDATES) as u32
}
