//! Adds up products of differences, in f64, or in f32 as shaders/products.wgsl does.

use crate::evaluator::products::{SHORTFALL, SIGNALS, place};
use crate::evaluator::{Differences, Products, Residuals};
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;
use std::ops::Range;

/// Samples that are summed separately.
#[derive(Debug, Clone, Copy)]
pub struct Bins<'a> {
    /// The bin of every sample, if it counts; the samples of a bin are contiguous.
    pub of: &'a [Option<u32>],
    /// Number of bins.
    pub count: usize,
    /// Number of samples over which the acceleration is averaged, as a difference of speeds; 0: the acceleration of each sample.
    pub mean: usize,
}

impl Bins<'_> {
    /// All samples in one.
    pub(super) const ONE: Bins<'static> = Bins { of: &[], count: 1, mean: 0 };

    /// The samples of a stretch that lie in a bin, as ranges from its start.
    fn of_stretch(&self, stretch: &Residuals) -> Vec<(usize, Range<usize>)> {
        let Some(own) = self.of.get(stretch.from..stretch.from + stretch.samples) else {
            return vec![(0, 0..stretch.samples)];
        };
        let mut from = 0;
        let ranges = own.chunk_by(|a, b| a == b).map(|run| {
            from += run.len();
            (run[0], from - run.len()..from)
        });
        ranges.filter_map(|(bin, range)| Some((bin? as usize, range))).collect()
    }
}

/// Places of the signals.
const SPEED: usize = 1;
const ACCELERATION: usize = 2;

/// Numbers of the widest vector.
const STRIDE: usize = 8;

/// Adds up the products of a group of runs, stretch by stretch.
#[derive(Debug)]
pub(super) struct Adder<'a> {
    of: &'a Differences,
    bins: Bins<'a>,
    /// Numbers in a row of a matrix of `sums`, and rows: a multiple of [`STRIDE`].
    width: usize,
    /// One matrix per bin and signal, row by row; only from the diagonal on. Entries beyond the coordinates are undefined.
    sums: Vec<f64>,
    /// For runs in f32, whose products are added in f32 as shaders/products.wgsl adds them: what rounding takes from each sum. Empty for
    /// runs in f64.
    lost: Vec<f32>,
    /// The differences of a stretch, sample by sample.
    stretch: Vec<f64>,
    /// Speeds before it, as many as the mean acceleration needs.
    past: Vec<f64>,
}

impl<'a> Adder<'a> {
    pub fn new(of: &'a Differences, bins: Bins<'a>, is_f32: bool) -> Adder<'a> {
        let width = (of.steps.len() + 1).next_multiple_of(STRIDE);
        let sums = vec![0.0; bins.count * SIGNALS * width * width];
        let lost = vec![0.0; if is_f32 { sums.len() } else { 0 }];
        Adder { of, bins, width, sums, lost, stretch: Vec::new(), past: vec![0.0; bins.mean * width] }
    }

    pub fn done(mut self) -> Products<'a> {
        self.sums.iter_mut().zip(&self.lost).for_each(|(sum, lost)| *sum += f64::from(*lost));
        Products::new(self.of, self.width, self.sums)
    }

    /// Adds a stretch of all runs.
    pub fn add(&mut self, stretch: &Residuals) {
        let ranges = self.bins.of_stretch(stretch);
        for signal in 0..SIGNALS {
            let lagged = signal == ACCELERATION && self.bins.mean > 0;
            let differs = if lagged {
                self.lag();
                true
            } else {
                self.differ(stretch, signal)
            };
            if differs {
                self.add_signal(signal, &ranges);
            }
        }
    }

    /// Reads the differences of a signal; false if all are 0.
    fn differ(&mut self, stretch: &Residuals, signal: usize) -> bool {
        let (lanes, width) = (stretch.lanes, self.width);
        let candidates = self.of.first..self.of.first + self.of.steps.len() + 1;
        self.stretch.resize(stretch.samples * width, 0.0);
        let mut at = candidates.start;
        while at < candidates.end {
            let (block, lane) = (&stretch.blocks[at / lanes], at % lanes);
            let count = (lanes - lane).min(candidates.end - at);
            let (first, every, place) = (signal * lanes + lane, stretch.signals * lanes, at - candidates.start);
            let differences = &mut self.stretch;
            Arch::new().dispatch(Differ { block, first, every, count, differences, width, place });
            at += count;
        }
        // Most runs have no shortfall.
        signal != SHORTFALL || self.stretch.iter().fold(0, |bits, number| bits | number.to_bits()) != 0
    }

    fn add_signal(&mut self, signal: usize, ranges: &[(usize, Range<usize>)]) {
        let (width, rows) = (self.width, self.of.steps.len() + 1);
        for (bin, range) in ranges {
            let place = place(width, *bin, signal);
            let differences = &self.stretch[range.start * width..range.end * width];
            if self.lost.is_empty() {
                Arch::new().dispatch(Add { sums: &mut self.sums[place], differences, width, rows });
            } else {
                add_in_f32(&mut self.sums[place.clone()], &mut self.lost[place], differences, width, rows);
            }
        }
    }

    /// Turns the differences of the speed into those of its change over the samples of a mean.
    fn lag(&mut self) {
        let speeds = std::mem::take(&mut self.stretch);
        let kept = self.past.len();
        self.past.extend(&speeds);
        self.stretch = speeds.iter().zip(&self.past).map(|(now, then)| now - then).collect();
        self.past.drain(..self.past.len() - kept);
    }
}

/// The same sums in f32, with the part that rounding loses: `add` of shaders/sums.wgsl.
fn add_in_f32(sums: &mut [f64], lost: &mut [f32], differences: &[f64], width: usize, rows: usize) {
    for differences in differences.chunks_exact(width) {
        for i in 0..rows {
            for j in i..rows {
                // The difference of two numbers of a run in f32, taken in f64, rounds to that in f32.
                let term = differences[i] as f32 * differences[j] as f32;
                let sum = sums[i * width + j] as f32;
                let high = sum + term;
                let term_seen = high - sum;
                let sum_seen = high - term_seen;
                lost[i * width + j] += (sum - sum_seen) + (term - term_seen);
                sums[i * width + j] = f64::from(high);
            }
        }
    }
}

/// Reads some values of a block, sample by sample, as differences from those of the first candidate.
struct Differ<'a> {
    block: &'a [f64],
    /// Place of the first value in the block, distance to that of the next sample, and number of values per sample.
    first: usize,
    every: usize,
    count: usize,
    differences: &'a mut [f64],
    width: usize,
    /// Position of these values among those of all candidates.
    place: usize,
}

/// Adds the products of differences.
struct Add<'a> {
    sums: &'a mut [f64],
    differences: &'a [f64],
    width: usize,
    /// Rows that are needed: one more than coordinates.
    rows: usize,
}

// Explicit vectors, because the compiler vectorises loops for the oldest processor, if at all. Every sum runs from sample to sample, and no
// multiplication is fused with an addition, so that every processor gives the same bits.
impl WithSimd for Differ<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Differ { block, first, every, count, differences, width, place } = self;
        for (to, start) in differences.chunks_exact_mut(width).zip((first..block.len()).step_by(every)) {
            let error = if place == 0 { block[start] } else { to[0] };
            match block.get(start..start + width) {
                // Whole vectors: entries beyond the coordinates are undefined.
                Some(from) if place == 0 => {
                    let from = S::as_simd_f64s(from).0;
                    for (to, from) in S::as_mut_simd_f64s(to).0.iter_mut().zip(from) {
                        *to = simd.sub_f64s(*from, simd.splat_f64s(error));
                    }
                }
                _ => {
                    for (to, from) in to[place..place + count].iter_mut().zip(&block[start..start + count]) {
                        *to = from - error;
                    }
                }
            }
            to[0] = error;
        }
    }
}

impl WithSimd for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        for block in 0..self.width / STRIDE {
            match self.rows - block * STRIDE {
                1 => self.add_rows::<S, 1>(simd, block),
                2 => self.add_rows::<S, 2>(simd, block),
                3 => self.add_rows::<S, 3>(simd, block),
                4 => self.add_rows::<S, 4>(simd, block),
                5 => self.add_rows::<S, 5>(simd, block),
                6 => self.add_rows::<S, 6>(simd, block),
                7 => self.add_rows::<S, 7>(simd, block),
                _ => self.add_rows::<S, STRIDE>(simd, block),
            }
        }
    }
}

impl Add<'_> {
    /// The first rows of a block of [`STRIDE`], from the diagonal on.
    #[inline(always)]
    fn add_rows<S: Simd, const ROWS: usize>(&mut self, simd: S, block: usize) {
        let (lanes, width) = (S::F64_LANES, self.width);
        let rows = &mut self.sums[block * STRIDE * width..(block + 1) * STRIDE * width];
        // Tiles of as many sums as fit into registers.
        for column in block * STRIDE / lanes..width / lanes {
            let mut tile = [simd.splat_f64s(0.0); ROWS];
            for (sums, row) in tile.iter_mut().zip(rows.chunks_exact(width)) {
                *sums = S::as_simd_f64s(row).0[column];
            }
            for differences in self.differences.chunks_exact(width) {
                let d_j = S::as_simd_f64s(differences).0[column];
                let own: &[f64; STRIDE] = &differences.as_chunks().0[block];
                for (sums, d_i) in tile.iter_mut().zip(own) {
                    *sums = simd.add_f64s(*sums, simd.mul_f64s(simd.splat_f64s(*d_i), d_j));
                }
            }
            for (sums, row) in tile.iter().zip(rows.chunks_exact_mut(width)) {
                S::as_mut_simd_f64s(row).0[column] = *sums;
            }
        }
    }
}

/// Σ of the squared errors of every candidate over the samples of a bin.
#[derive(Debug)]
pub(super) struct Squares<'a> {
    bins: Bins<'a>,
    lanes: usize,
    blocks: Vec<Block>,
}

#[derive(Debug)]
struct Block {
    /// One row of lanes per bin and signal.
    sums: Vec<f64>,
    /// Rows of the speed before a stretch, as many as the mean acceleration needs, and of the stretch.
    past: Vec<f64>,
}

impl<'a> Squares<'a> {
    pub fn new(bins: Bins<'a>) -> Squares<'a> {
        Squares { bins, lanes: 1, blocks: Vec::new() }
    }

    /// Adds a stretch of all runs.
    pub fn add(&mut self, stretch: &Residuals) {
        let (lanes, bins) = (stretch.lanes, self.bins);
        let ranges = bins.of_stretch(stretch);
        let row = SIGNALS * lanes;
        let empty = || Block { sums: vec![0.0; bins.count * row], past: vec![0.0; bins.mean * lanes] };
        self.lanes = lanes;
        self.blocks.resize_with(stretch.blocks.len(), empty);
        self.blocks.par_iter_mut().zip(&stretch.blocks).for_each(|(block, rows)| {
            let kept = block.past.len();
            if bins.mean > 0 {
                rows.chunks_exact(row).for_each(|sample| block.past.extend(&sample[SPEED * lanes..][..lanes]));
            }
            for (bin, range) in &ranges {
                let sums = &mut block.sums[bin * row..(bin + 1) * row];
                for t in range.clone() {
                    let sample = &rows[t * row..(t + 1) * row];
                    for (signal, sums) in sums.chunks_exact_mut(lanes).enumerate() {
                        if signal == ACCELERATION && bins.mean > 0 {
                            let [then, now] = [t, t + bins.mean].map(|t| &block.past[t * lanes..][..lanes]);
                            sums.iter_mut()
                                .zip(then.iter().zip(now))
                                .for_each(|(sum, (a, b))| *sum += (b - a) * (b - a));
                        } else {
                            let errors = &sample[signal * lanes..][..lanes];
                            sums.iter_mut().zip(errors).for_each(|(sum, error)| *sum += error * error);
                        }
                    }
                }
            }
            block.past.drain(..block.past.len() - kept);
        });
    }

    /// The sums of one candidate, bin by bin.
    pub fn of(&self, candidate: usize) -> Vec<[f64; SIGNALS]> {
        let (lanes, lane) = (self.lanes, candidate % self.lanes);
        let bins = self.blocks[candidate / lanes].sums.chunks_exact(SIGNALS * lanes);
        bins.map(|bin| std::array::from_fn(|signal| bin[signal * lanes + lane])).collect()
    }
}
