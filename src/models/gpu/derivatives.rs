//! Scores with derivatives: groups of candidates in parts, and what their sums of products mean.

use super::kernel::Sums;
use super::plan::{Groups, Leaves, PAIR_WORDS, most_candidates, pairs};
use super::results::score_of;
use super::{Gpu, OWN};
use crate::evaluator::{Differences, EvaluateError, Job, Population, Products, SIGNALS, Score, Slopes};
use std::ops::Range;

impl Gpu {
    /// The slopes of all groups, as many at a time as fit.
    pub(super) fn slopes_in_parts(
        &mut self,
        job: &Job<'_>,
        differences: &[Differences],
    ) -> Result<Vec<Slopes>, EvaluateError> {
        let (mut all, mut rest) = (Vec::with_capacity(differences.len()), differences);
        while !rest.is_empty() {
            let (now, later) = rest.split_at(self.fitting(rest)?);
            all.extend(self.slopes_at_once(job, now)?);
            rest = later;
        }
        Ok(all)
    }

    /// As many of these groups, from the first on, as one part has room for.
    fn fitting(&mut self, groups: &[Differences]) -> Result<usize, EvaluateError> {
        self.twice(|gpu| gpu.opened().map(drop))?;
        let limits = self.context.as_ref().expect("opened above").device.limits;
        let kernel = self.kernel(Sums::Score(self.gof.accumulation()), false);
        let most = most_candidates(&kernel, &Leaves::Errors(Groups::default()), &limits) as usize;
        let (mut candidates, mut rows, mut fitting) = (0, 0, 0);
        for group in groups {
            candidates += group.group().len();
            rows = rows.max(group.group().len() as u32);
            let sums = 4 * (fitting + 1) as u64 * u64::from(PAIR_WORDS) * u64::from(pairs(rows));
            if candidates > most || sums > limits.binding.min(limits.buffer) {
                break;
            }
            fitting += 1;
        }
        if fitting == 0 && !groups.is_empty() {
            let message = format!("a candidate and its {} copies do not fit into one binding", rows - 1);
            return Err(EvaluateError::Memory { adapter: self.adapter.clone(), message });
        }
        Ok(fitting)
    }

    /// The slopes of groups that fit into one part.
    fn slopes_at_once(&mut self, job: &Job<'_>, differences: &[Differences]) -> Result<Vec<Slopes>, EvaluateError> {
        let Job { case, population } = *job;
        let mut own = Population::new(population.symbols());
        let (mut of, mut places): (Vec<[u32; 2]>, Vec<Range<usize>>) = (Vec::new(), Vec::new());
        for group in differences.iter().map(Differences::group) {
            let first = own.len();
            of.push([first as u32, group.len() as u32]);
            group.for_each(|i| own.push(population.values(i)));
            places.push(first..own.len());
        }
        let rows = of.iter().map(|[_, count]| *count).max().unwrap_or(0);
        let sums = Sums::Score(self.gof.accumulation());
        self.start(OWN, &[Job { case, population: &own }], sums, &[], Leaves::Errors(Groups { of, rows }))?;
        let work = self.finish(OWN)?;
        let scores: Vec<Score> = self.results.words.iter().map(|word| score_of(*word)).collect();
        let word = |at: usize| f64::from(f32::from_bits(self.results.blocks[at]));
        let (rows, pairs) = (rows as usize, pairs(rows) as usize);
        let all = differences.len() * pairs;
        let slopes = |(k, (group, place)): (usize, (&Differences, Range<usize>))| {
            let mut matrices = vec![0.0; SIGNALS * rows * rows];
            let upper = (0..rows).flat_map(|a| (a..rows).map(move |b| (a, b)));
            for (pair, (a, b)) in upper.enumerate() {
                for signal in 0..3 {
                    let at = k * pairs + pair;
                    matrices[(signal * rows + a) * rows + b] = word(signal * all + at) + word((signal + 3) * all + at);
                }
            }
            let first = self.cases[case].pace(&own.parameters(place.start)).first;
            let norm = self.courses[case].norm(&self.gof, first);
            let weights = [0, 1, 2].map(|k| [norm.weight[k], norm.per_count[k]].map(|x| f64::from(x as f32)));
            let mut slopes = Products::new(group, rows, matrices).slopes(weights, 0.0);
            if scores[place].iter().any(|score| matches!(score, Score::Failed(_))) {
                slopes.cost = f64::INFINITY;
            }
            slopes
        };
        let slopes = differences.iter().zip(places).enumerate().map(slopes).collect();
        self.spare[OWN] = work.plan;
        Ok(slopes)
    }
}
