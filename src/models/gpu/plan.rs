//! Prepares jobs for a device: candidates by case, in parts that fit the limits.

use super::kernel::{Kernel, OBSERVER_WORDS, SMALLEST_WORKGROUP, STRETCH};
use super::tables::Tables;
use crate::evaluator::{Case, Course, EvaluateError, Job, Observer, Pace, Population};
use crate::symbols::{Parameters, Symbol};
use rayon::prelude::*;
use std::ops::Range;

/// Work of one buffer set.
#[derive(Debug)]
pub(super) struct Work {
    pub(super) kernel: Kernel,
    pub(super) plan: Plan,
    pub(super) leaves: Leaves,
}

/// What runs leave beside their results, in `blocks` of shaders/kernel.wgsl.
#[derive(Debug)]
pub(super) enum Leaves {
    Nothing,
    /// Two sums of each block: samples in a block, and blocks of the longest trajectory.
    Blocks {
        samples: u32,
        count: u32,
    },
    /// The errors of a stretch of samples, for the products of these groups.
    Errors(Groups),
}

impl Leaves {
    /// Words of one candidate.
    pub(super) fn words(&self) -> u32 {
        match self {
            Leaves::Nothing => 0,
            Leaves::Blocks { count, .. } => 2 * count,
            Leaves::Errors(_) => 3 * STRETCH,
        }
    }

    /// Samples in a block; 0 without blocks.
    pub(super) fn block(&self) -> u32 {
        if let Leaves::Blocks { samples, .. } = self { *samples } else { 0 }
    }

    pub(super) fn groups(&self) -> Option<&Groups> {
        if let Leaves::Errors(groups) = self { Some(groups) } else { None }
    }
}

/// Words of a pair of candidates: three sums, and what rounding takes from each.
pub(super) const PAIR_WORDS: u32 = 6;

/// Candidates with their copies, in shaders/products.wgsl.
#[derive(Debug, Default)]
pub(super) struct Groups {
    /// First candidate of each, and number of candidates.
    pub(super) of: Vec<[u32; 2]>,
    /// Candidates of the largest.
    pub(super) rows: u32,
}

impl Groups {
    /// Words of all sums.
    pub(super) fn words(&self) -> u32 {
        self.of.len() as u32 * pairs(self.rows) * PAIR_WORDS
    }
}

/// Pairs of candidates of a group of this many.
pub(super) fn pairs(rows: u32) -> u32 {
    rows * (rows + 1) / 2
}

/// Largest number of candidates of one dispatch, whatever the limits: a chunk of 16 samples of them takes about 0.1 s on a slow adapter.
const MOST_CANDIDATES: u64 = 1 << 19;

/// Number of words from which several threads prepare them: some tens of microseconds of work.
const WORTH_SHARING: usize = 1 << 16;

/// Candidates that share a bind group.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    /// Index into the groups of tables.
    pub(super) group: usize,
    /// Number of candidates.
    pub(super) count: u32,
    /// Samples of the longest of their trajectories.
    pub(super) samples: u32,
    /// Start of the samples of their trajectory, if there is only one.
    pub(super) begin: Option<u32>,
}

/// Work to simulate, kept on the host until it is done, so that it can be repeated on another device.
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
    /// Replaces the plan; the memory of words and positions is reused. With observers there is one job, and an observer for each of its
    /// candidates.
    #[allow(clippy::too_many_arguments, reason = "the inputs of a plan, each with a different owner")]
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
        let words = words(kernel);
        let symbols = cases[0].variant.parameters();
        // Not cleared, because filling with zeros would take as long as preparing the words.
        self.words.resize(begin * words.len(), 0);
        let mut free = self.words.as_mut_slice();
        let mut at = 0;
        for (group, tables) in groups.iter().enumerate() {
            let until = self.order[at..].iter().position(|k| jobs[*k].case >= tables.cases.end);
            let until = until.map_or(self.order.len(), |n| at + n);
            for stretches in split(&self.order[at..until], jobs, most as usize) {
                let count: usize = stretches.iter().map(|stretch| stretch.candidates.len()).sum();
                let (mut samples, mut begins) = (0, [u32::MAX, 0]);
                let mut sources = Vec::new();
                for Stretch { job: k, candidates } in stretches {
                    let Job { case, population } = jobs[k];
                    let job = (case - tables.cases.start) as u32;
                    let columns = symbols.iter().map(|symbol| population.column_of(*symbol)).collect();
                    let paces = paces(&cases[case], &courses[case], population, candidates.clone(), kernel)?;
                    samples = samples.max(courses[case].samples() as u32);
                    let begin = tables.begins[job as usize];
                    begins = [begins[0].min(begin), begins[1].max(begin)];
                    self.positions.extend(candidates.clone().map(|candidate| self.begins[k] + candidate));
                    sources.push(Source { population, candidates, columns, paces, job, observers });
                }
                let (own, others) = std::mem::take(&mut free).split_at_mut(count * words.len());
                free = others;
                let fill = |(column, word): (&mut [u32], &Word)| fill(column, *word, &sources);
                if own.len() < WORTH_SHARING {
                    own.chunks_exact_mut(count).zip(&words).for_each(fill);
                } else {
                    own.par_chunks_exact_mut(count).zip(&words).for_each(fill);
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

/// Neighbouring candidates of one job.
#[derive(Debug, Clone)]
struct Stretch {
    job: usize,
    candidates: Range<usize>,
}

/// The candidates of these jobs in parts of at most `most`.
fn split(order: &[usize], jobs: &[Job], most: usize) -> Vec<Vec<Stretch>> {
    let mut parts = Vec::new();
    let mut room = 0;
    for &job in order {
        let (mut from, until) = (0, jobs[job].population.len());
        while from < until {
            if room == 0 {
                parts.push(Vec::new());
                room = most;
            }
            let to = until.min(from + room);
            parts.last_mut().expect("pushed above at the latest").push(Stretch { job, candidates: from..to });
            room -= to - from;
            from = to;
        }
    }
    parts
}

/// Source of the words of a stretch.
struct Source<'a> {
    population: &'a Population,
    candidates: Range<usize>,
    /// Index of each parameter of the variant in the population, if it is there.
    columns: Vec<Option<usize>>,
    /// One per candidate, or one for all.
    paces: Vec<Pace>,
    job: u32,
    /// One per candidate of the whole job, or none.
    observers: &'a [Observer],
}

/// Meaning of a word of a candidate.
#[derive(Debug, Clone, Copy)]
enum Word {
    /// A parameter, by its index in the variant.
    Parameter(usize),
    Back,
    Fraction,
    First,
    Job,
    /// Reach of the whole and the half look-back.
    LookBack(usize),
    LookBackFraction(usize),
    Observer(usize),
}

/// The words of a candidate in their order: `candidates` in shaders/kernel.wgsl.
fn words(kernel: &Kernel) -> Vec<Word> {
    let mut words: Vec<Word> = (0..kernel.recipe.variant.parameters().len()).map(Word::Parameter).collect();
    words.extend([Word::Back, Word::Fraction, Word::First, Word::Job]);
    if kernel.looks_back() {
        words.extend([0, 1].into_iter().flat_map(|way| [Word::LookBack(way), Word::LookBackFraction(way)]));
    }
    if kernel.recipe.observed {
        words.extend((0..OBSERVER_WORDS as usize).map(Word::Observer));
    }
    debug_assert_eq!(words.len(), kernel.candidate_words() as usize);
    words
}

/// One word of each candidate.
fn fill(mut column: &mut [u32], word: Word, sources: &[Source]) {
    for source in sources {
        let (own, others) = column.split_at_mut(source.candidates.len());
        column = others;
        let mut by_pace = |word: fn(&Pace) -> u32| match source.paces.as_slice() {
            [one] => own.fill(word(one)),
            each => own.iter_mut().zip(each).for_each(|(to, pace)| *to = word(pace)),
        };
        match word {
            Word::Parameter(place) => match source.columns[place] {
                Some(place) => {
                    let values = source.population.column(place).skip(source.candidates.start);
                    own.iter_mut().zip(values).for_each(|(to, value)| *to = (value as f32).to_bits());
                }
                None => own.fill(f32::NAN.to_bits()),
            },
            Word::Back => by_pace(|pace| pace.back as u32),
            Word::Fraction => by_pace(|pace| (pace.fraction as f32).to_bits()),
            Word::First => by_pace(|pace| pace.first as u32),
            Word::Job => own.fill(source.job),
            Word::LookBack(0) => by_pace(|pace| pace.look_back[0].0 as u32),
            Word::LookBack(_) => by_pace(|pace| pace.look_back[1].0 as u32),
            Word::LookBackFraction(0) => by_pace(|pace| (pace.look_back[0].1 as f32).to_bits()),
            Word::LookBackFraction(_) => by_pace(|pace| (pace.look_back[1].1 as f32).to_bits()),
            Word::Observer(k) => {
                let observers = &source.observers[source.candidates.clone()];
                own.iter_mut().zip(observers).for_each(|(to, observer)| *to = observer_word(observer, k));
            }
        }
    }
}

/// Word k of an observer: six gains, three whitening factors, the decay.
fn observer_word(observer: &Observer, k: usize) -> u32 {
    let Observer { gain, whitening, decay } = observer;
    let value = gain.iter().chain(whitening).chain([decay]).nth(k).expect("as many as OBSERVER_WORDS");
    (*value as f32).to_bits()
}

/// Start and perceived samples of candidates: one for all if they do not depend on the parameters.
fn paces(
    case: &Case,
    course: &Course,
    population: &Population,
    candidates: Range<usize>,
    kernel: &Kernel,
) -> Result<Vec<Pace>, EvaluateError> {
    let variant = &kernel.recipe.variant;
    let base = variant.delay.then_some(Symbol::tau_p);
    let read = base.into_iter().chain(variant.extensions.delay()).chain(variant.extensions.look_back());
    // The start depends on these only, and writing all parameters of a candidate would take most of the time.
    let read: Vec<(Symbol, usize)> = read.filter_map(|symbol| Some((symbol, population.column_of(symbol)?))).collect();
    let of = |parameters: &mut Parameters, candidate: usize| {
        read.iter().for_each(|(symbol, place)| parameters.set(*symbol, population.values(candidate)[*place]));
        case.pace(parameters)
    };
    let mut parameters = Parameters::NONE;
    let paces: Vec<Pace> = if read.is_empty() {
        vec![of(&mut parameters, candidates.start)]
    } else if candidates.len() < WORTH_SHARING / 16 {
        candidates.clone().map(|candidate| of(&mut parameters, candidate)).collect()
    } else {
        let several = candidates.clone().into_par_iter().with_min_len(1024);
        several.map_with(parameters, of).collect()
    };
    for (pace, candidate) in paces.iter().zip(candidates) {
        let remembered = pace.back < kernel.ring as usize && pace.back < pace.first;
        if !(remembered && pace.first <= course.ring.min(course.samples() - 1)) {
            let found = case.delay(&population.parameters(candidate));
            return Err(EvaluateError::Delay { name: case.delay_name(), upper: case.longest_delay(), found });
        }
    }
    Ok(paces)
}

/// Largest number of candidates of a part.
pub(super) fn most_candidates(kernel: &Kernel, leaves: &Leaves, limits: &super::Limits) -> u32 {
    let words = kernel.candidate_words().max(kernel.state_words()).max(kernel.result_words()).max(leaves.words());
    let by_bytes = limits.binding.min(limits.buffer) / (4 * u64::from(words));
    let by_workgroups = u64::from(limits.workgroups).pow(2).saturating_mul(u64::from(SMALLEST_WORKGROUP));
    by_bytes.min(by_workgroups).clamp(1, MOST_CANDIDATES) as u32
}
