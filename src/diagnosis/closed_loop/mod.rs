//! Models in closed loop: simulated freely over whole drives and in windows, their losses bin by bin, and fits to the least loss.
//!
//! A closed loop is what a user of a model has: nothing corrects the simulated car. Whole drives show slow errors, windows of half a
//! minute the fast ones, each with its own fits.

mod fit;
mod loss;

pub use fit::{Plan, Point, fit};
use loss::Measured;
pub use loss::{Bin, DriveLoss, Losses, SIGNALS};

use crate::calibrate::Overrides;
use crate::catalog::Variant;
use crate::diagnose::likelihood::model::{FreeRun, Model};
use crate::diagnose::{DiagnoseError, Drive};
use crate::evaluator::Windows;
use rayon::prelude::*;

/// Of a drive: its number, the candidates that count there, and what was made of the run of each.
type OnDrive<R> = (usize, Vec<usize>, Vec<R>);

/// How long a simulation is left alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Horizon {
    /// To the end of the drive.
    Drive,
    /// For [`WINDOW_S`].
    Window,
}

/// Length of a window \[s\]: three bins.
pub const WINDOW_S: f64 = 30.0;
/// Run-up of a window \[s\], in which the car is kept on the measurement and memories adjust: two time constants of the slowest lag.
pub const RUN_UP_S: f64 = 5.0;
/// Length of a bin \[s\].
pub const BIN_S: f64 = 10.0;
/// Where the first bin begins \[s\]: behind the longest delay of a base and a cause together, so that all models have the same bins.
const FROM_S: f64 = 2.5;
/// Runs that are held in memory at once.
const BATCH: usize = 96;

impl Horizon {
    /// Both, the shorter one first: fits over windows lead to those over whole drives.
    pub const ALL: [Horizon; 2] = [Horizon::Window, Horizon::Drive];

    /// Its length \[s\]; `None` for whole drives.
    #[must_use]
    pub fn seconds(self) -> Option<f64> {
        (self == Horizon::Window).then_some(WINDOW_S)
    }
}

/// The samples of a drive in bins.
#[derive(Debug, Clone)]
pub struct Layout {
    /// Where runs are put back; `None` for whole drives.
    pub windows: Option<Windows>,
    /// Of every sample the bin that it counts in.
    pub bins: Vec<Option<u32>>,
    /// Number of bins.
    pub count: usize,
    /// Samples between two speeds whose difference is the acceleration, 1 s.
    pub second: usize,
}

impl Layout {
    /// Of a drive of so many samples, `dt` \[s\] apart. A last bin that is less than half full is left out.
    #[must_use]
    pub fn new(samples: usize, dt: f64, horizon: Horizon) -> Layout {
        let number = |seconds: f64| ((seconds / dt).round() as usize).max(1);
        let (from, bin) = ((FROM_S / dt).ceil() as usize + 1, number(BIN_S));
        let windows = (horizon == Horizon::Window).then(|| Windows {
            from,
            run_up: number(RUN_UP_S),
            free: bin * (WINDOW_S / BIN_S).round() as usize,
        });
        let place = |t: usize| {
            let since = t.checked_sub(from)?;
            let Some(Windows { run_up, free, .. }) = windows else { return Some(since / bin) };
            let within = (since % (run_up + free)).checked_sub(run_up)?;
            Some(since / (run_up + free) * (free / bin) + within / bin)
        };
        let places: Vec<Option<usize>> = (0..samples).map(place).collect();
        let count = places.iter().flatten().max().map_or(0, |last| last + 1);
        let mut sizes = vec![0_usize; count];
        places.iter().flatten().for_each(|k| sizes[*k] += 1);
        let full = sizes.iter().take_while(|size| 2 * **size >= bin).count();
        let bins: Vec<Option<u32>> = places.iter().map(|k| k.filter(|k| *k < full).map(|k| k as u32)).collect();
        Layout { windows, bins, count: full, second: number(1.0) }
    }

    /// The sample to which a run that fails at `t` counts as lost: the end of its window, or of its bin.
    fn lost_until(&self, t: usize) -> usize {
        let ends = |k: &usize| match self.windows {
            Some(windows) => windows.holds(*k),
            None => self.bins[*k] != self.bins[t],
        };
        (t..self.bins.len()).find(ends).unwrap_or(self.bins.len())
    }
}

/// A variant over some drives, as it is simulated and judged.
#[derive(Debug)]
pub struct ClosedLoop {
    /// The variant with its bounds.
    pub model: Model,
    layouts: [Vec<Layout>; 2],
    measured: Vec<Measured>,
}

impl ClosedLoop {
    /// Lays some drives out for a variant.
    ///
    /// # Errors
    /// As [`Model::new`].
    pub fn new(variant: Variant, drives: &[Drive], bounds: &Overrides) -> Result<ClosedLoop, DiagnoseError> {
        let model = Model::new(variant, drives, bounds, &[])?;
        let layouts = [Horizon::Drive, Horizon::Window]
            .map(|horizon| drives.iter().map(|d| Layout::new(d.samples(), d.dt(), horizon)).collect());
        Ok(ClosedLoop { model, layouts, measured: drives.iter().map(Measured::of).collect() })
    }

    /// Bins of every drive.
    #[must_use]
    pub fn layouts(&self, horizon: Horizon) -> &[Layout] {
        &self.layouts[horizon as usize]
    }

    /// Candidates simulated until now, over one drive each.
    #[must_use]
    pub fn simulations(&self) -> u64 {
        self.model.simulations()
    }

    /// Losses of some candidates on the drives that `counts`; others have none.
    ///
    /// # Errors
    /// As [`Model::free_runs`].
    pub fn losses(
        &self,
        candidates: &[Vec<f64>],
        horizon: Horizon,
        counts: &(dyn Fn(usize, usize) -> bool + Sync),
    ) -> Result<Vec<Losses>, DiagnoseError> {
        let empty = || Losses { drives: vec![None; self.measured.len()] };
        let mut all: Vec<Losses> = candidates.iter().map(|_| empty()).collect();
        let loss =
            |drive: usize, run: FreeRun| Some(loss::of_run(&run, &self.layouts(horizon)[drive], &self.measured[drive]));
        for (drive, mine, found) in self.on_drives(candidates, horizon, counts, &loss)? {
            mine.into_iter().zip(found).for_each(|(i, loss)| all[i].drives[drive] = loss);
        }
        Ok(all)
    }

    /// Makes something of the run of each candidate on each drive that counts for it; drives side by side, in their order.
    fn on_drives<R: Send>(
        &self,
        candidates: &[Vec<f64>],
        horizon: Horizon,
        counts: &(dyn Fn(usize, usize) -> bool + Sync),
        of: &(dyn Fn(usize, FreeRun) -> R + Sync),
    ) -> Result<Vec<OnDrive<R>>, DiagnoseError> {
        let one = |drive: usize| {
            let mine: Vec<usize> = (0..candidates.len()).filter(|&i| counts(i, drive)).collect();
            let mut found = Vec::with_capacity(mine.len());
            for batch in mine.chunks(BATCH) {
                let batch: Vec<Vec<f64>> = batch.iter().map(|&i| candidates[i].clone()).collect();
                let runs = self.model.free_runs(drive, &batch, self.layouts(horizon)[drive].windows)?;
                found.par_extend(runs.into_par_iter().map(|run| of(drive, run)));
            }
            Ok((drive, mine, found))
        };
        (0..self.measured.len()).into_par_iter().map(one).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_have_ten_seconds_at_any_rate() {
        for dt in [0.04, 0.1, 0.5, 1.0] {
            let samples = (200.0 / dt) as usize;
            let whole = Layout::new(samples, dt, Horizon::Drive);
            assert_eq!(whole.count, 20, "{dt}");
            let first = whole.bins.iter().position(Option::is_some).expect("bins");
            assert!((first as f64 * dt - FROM_S).abs() < 2.0 * dt);
            let windows = Layout::new(samples, dt, Horizon::Window);
            let holds = windows.windows.expect("windows");
            for (t, bin) in windows.bins.iter().enumerate() {
                assert!(bin.is_none() || !holds.holds(t), "{dt}: sample {t}");
            }
            let free = windows.bins.iter().filter(|bin| **bin == Some(0)).count();
            assert!((free as f64 * dt - BIN_S).abs() < 1e-9);
            let begins = |k: u32| windows.bins.iter().position(|bin| *bin == Some(k)).expect("a bin") as f64 * dt;
            assert!((begins(3) - begins(0) - WINDOW_S - RUN_UP_S).abs() < 1e-9);
        }
    }
}
