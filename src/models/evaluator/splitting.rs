//! An evaluator that gets less work at a time after its device has run out of memory.

use super::{BufferSet, Differences, EvaluateError, Evaluator, Job, Outcome, Population, Score, Slopes, Timings};

/// Gives an evaluator whatever fits at once, and the rest afterwards. No score depends on the candidates simulated together.
pub struct Splitting {
    inner: Box<dyn Evaluator>,
    /// Largest number of candidates that it gets at once.
    most: usize,
    sets: [Set; 2],
}

/// Work on a piece of the jobs that begins with this candidate.
type Each<'a> = dyn FnMut(&mut dyn Evaluator, &[Job<'_>], usize) -> Result<(), EvaluateError> + 'a;

/// Jobs that own their populations.
#[derive(Default)]
pub(super) struct OwnJobs(Vec<(usize, Population)>);

impl OwnJobs {
    /// Copies jobs, reusing the memory of the previous ones.
    pub(super) fn keep(&mut self, jobs: &[Job<'_>]) {
        self.0.resize_with(jobs.len(), || (0, Population::new(&[])));
        for (kept, job) in self.0.iter_mut().zip(jobs) {
            kept.0 = job.case;
            kept.1.clone_from(job.population);
        }
    }

    pub(super) fn borrowed(&self) -> Vec<Job<'_>> {
        self.0.iter().map(|(case, population)| Job { case: *case, population }).collect()
    }
}

/// Jobs submitted with a buffer set.
#[derive(Default)]
struct Set {
    jobs: OwnJobs,
    /// True if the evaluator has all of it; false if it gets it in pieces.
    under_way: bool,
}

impl Splitting {
    /// Gives `inner` everything at once until its memory is too small.
    pub fn new(inner: Box<dyn Evaluator>) -> Splitting {
        Splitting { inner, most: usize::MAX, sets: Default::default() }
    }

    /// Half of the work that did not fit; the error if that was one candidate, or if it had another cause.
    fn halve(&mut self, candidates: usize, error: EvaluateError) -> Result<(), EvaluateError> {
        if candidates < 2 || !matches!(error, EvaluateError::Memory { .. }) {
            return Err(error);
        }
        self.most = self.most.min(candidates / 2);
        Ok(())
    }

    /// Processes one piece of the jobs after the other.
    fn in_pieces(&mut self, jobs: &[Job<'_>], each: &mut Each<'_>) -> Result<(), EvaluateError> {
        let candidates = Job::candidates(jobs);
        let mut from = 0;
        while from < candidates {
            let count = self.most.min(candidates - from);
            match each(self.inner.as_mut(), &piece(jobs, from, count).borrowed(), from) {
                Ok(()) => from += count,
                Err(error) => self.halve(count, error)?,
            }
        }
        Ok(())
    }
}

/// Some candidates of the jobs, numbered across the jobs from `from` on.
fn piece(jobs: &[Job<'_>], from: usize, count: usize) -> OwnJobs {
    let (mut begin, mut found) = (0, Vec::new());
    for job in jobs {
        let of = |at: usize| at.clamp(begin, begin + job.population.len()) - begin;
        let mut population = Population::new(job.population.symbols());
        (of(from)..of(from + count)).for_each(|i| population.push(job.population.values(i)));
        if !population.is_empty() {
            found.push((job.case, population));
        }
        begin += job.population.len();
    }
    OwnJobs(found)
}

impl Evaluator for Splitting {
    crate::forward_evaluator!(inner: cases, gof, name, precision, adapter, overlaps);

    fn timings(&self) -> Timings {
        self.inner.timings()
    }

    fn submit(&mut self, set: BufferSet, jobs: &[Job<'_>]) -> Result<(), EvaluateError> {
        let kept = &mut self.sets[set as usize];
        kept.jobs.keep(jobs);
        let candidates = Job::candidates(jobs);
        kept.under_way = candidates <= self.most;
        if kept.under_way
            && let Err(error) = self.inner.submit(set, jobs)
        {
            self.halve(candidates, error)?;
            self.sets[set as usize].under_way = false;
        }
        Ok(())
    }

    fn collect(&mut self, set: BufferSet, scores: &mut [Score]) -> Result<(), EvaluateError> {
        if self.sets[set as usize].under_way {
            match self.inner.collect(set, scores) {
                Ok(()) => return Ok(()),
                Err(error) => self.halve(scores.len(), error)?,
            }
        }
        let jobs = std::mem::take(&mut self.sets[set as usize].jobs);
        let candidates = Job::candidates(&jobs.borrowed());
        if scores.len() != candidates {
            self.sets[set as usize].jobs = jobs;
            return Err(EvaluateError::Room { candidates, scores: scores.len() });
        }
        self.in_pieces(&jobs.borrowed(), &mut |inner, piece, from| {
            inner.submit(set, piece)?;
            inner.collect(set, &mut scores[from..from + Job::candidates(piece)])
        })
    }

    fn slopes(&mut self, job: &Job<'_>, differences: &[Differences]) -> Result<Option<Vec<Slopes>>, EvaluateError> {
        let (mut all, mut rest) = (Vec::with_capacity(differences.len()), differences);
        while !rest.is_empty() {
            let mut candidates = 0;
            let fits = |group: &&Differences| {
                candidates += group.group().len();
                candidates <= self.most
            };
            let groups = rest.iter().take_while(fits).count().max(1);
            let (now, later) = rest.split_at(groups);
            match self.inner.slopes(job, now) {
                Ok(Some(slopes)) => all.extend(slopes),
                Ok(None) => return Ok(None),
                Err(error) if groups == 1 => return Err(error),
                Err(error) => {
                    self.halve(now.iter().map(|group| group.group().len()).sum(), error)?;
                    continue;
                }
            }
            rest = later;
        }
        Ok(Some(all))
    }

    fn outcomes(&mut self, jobs: &[Job<'_>]) -> Result<Vec<Outcome>, EvaluateError> {
        let mut all = Vec::new();
        self.in_pieces(jobs, &mut |inner, piece, _| {
            all.extend(inner.outcomes(piece)?);
            Ok(())
        })?;
        Ok(all)
    }
}
