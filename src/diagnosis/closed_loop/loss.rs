//! How far a free simulation is off, bin by bin.

use super::Layout;
use crate::diagnose::Drive;
use crate::diagnose::likelihood::model::FreeRun;

/// Signals that are compared: spacing, speed, and the mean acceleration over a second.
pub const SIGNALS: usize = 3;
/// Errors that nobody cares about: 5 cm, 2 cm/s, 2 cm/s².
const FLOOR: [f64; SIGNALS] = [0.05, 0.02, 0.02];

/// What a failure costs a fit: as much as errors that are 1.6 times as large everywhere, so that a model is fitted to come through.
const COLLISION: f64 = 1.0;

/// Mean squared errors of a bin: spacing \[m²\], speed \[m²/s²\], acceleration \[m²/s⁴\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Per signal.
    pub mse: [f64; SIGNALS],
}

impl Bin {
    /// Mean over the signals of the logarithm of the squared error and its floor: a bin counts by the ratio of errors, so that a few bad
    /// ones do not decide.
    #[must_use]
    pub fn log(&self) -> f64 {
        let of = |(mse, floor): (&f64, f64)| (mse + floor * floor).ln();
        self.mse.iter().zip(FLOOR).map(of).sum::<f64>() / SIGNALS as f64
    }

    /// Sum over the signals of the error relative to the root mean square of the drive: what NRMSE(s,v,a) adds up.
    #[must_use]
    pub fn root(&self, rms: &[f64; SIGNALS]) -> f64 {
        self.mse.iter().zip(rms).map(|(mse, rms)| mse.sqrt() / rms).sum()
    }

    /// What a squared error of each signal weighs in the derivative of [`Bin::log`].
    #[must_use]
    pub fn weights(&self) -> [f64; SIGNALS] {
        std::array::from_fn(|k| 1.0 / (SIGNALS as f64 * (self.mse[k] + FLOOR[k] * FLOOR[k])))
    }
}

/// A candidate on a drive.
#[derive(Debug, Clone, PartialEq)]
pub struct DriveLoss {
    /// Bin by bin; from a failure to the end of its bin, or its window, an error as large as the signals themselves.
    pub bins: Vec<Bin>,
    /// Root mean squares of the measured signals.
    pub rms: [f64; SIGNALS],
    /// How often the car ran into the one ahead, or no number was left; each time it goes on from the measurement.
    pub failures: usize,
    /// The smallest spacing as a share of the smallest measured one; 0 of a run that fails.
    pub margin: f64,
}

impl DriveLoss {
    /// Mean squared error of each signal over all bins.
    fn mean(&self) -> [f64; SIGNALS] {
        let mean = |k: usize| self.bins.iter().map(|bin| bin.mse[k]).sum::<f64>() / self.bins.len().max(1) as f64;
        std::array::from_fn(mean)
    }

    /// NRMSE(s,v,a) of the drive.
    #[must_use]
    pub fn nrmse(&self) -> f64 {
        Bin { mse: self.mean() }.root(&self.rms)
    }
}

/// A candidate on all drives; `None` where it was not simulated.
#[derive(Debug, Clone, PartialEq)]
pub struct Losses {
    /// Drive by drive.
    pub drives: Vec<Option<DriveLoss>>,
}

impl Losses {
    /// Mean logarithmic loss of the bins; infinite without any.
    #[must_use]
    pub fn log(&self) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for drive in self.drives.iter().flatten() {
            sum += drive.bins.iter().map(Bin::log).sum::<f64>();
            count += drive.bins.len() as f64;
        }
        if count > 0.0 && sum.is_finite() { sum / count } else { f64::INFINITY }
    }

    /// What a fit lowers: the mean logarithmic loss, and what every failure costs.
    #[must_use]
    pub fn cost(&self) -> f64 {
        self.log() + COLLISION * self.failures() as f64
    }

    /// NRMSE(s,v,a), the mean over the drives by their bins; infinite without any.
    #[must_use]
    pub fn nrmse(&self) -> f64 {
        let of = |(sum, count): (f64, f64), drive: &DriveLoss| {
            let bins = drive.bins.len() as f64;
            (sum + bins * drive.nrmse(), count + bins)
        };
        let (sum, count) = self.drives.iter().flatten().fold((0.0, 0.0), of);
        if count > 0.0 && sum.is_finite() { sum / count } else { f64::INFINITY }
    }

    /// Logarithmic loss of every bin, drive after drive.
    #[must_use]
    pub fn logs(&self) -> Vec<f64> {
        self.drives.iter().flatten().flat_map(|drive| drive.bins.iter().map(Bin::log)).collect()
    }

    /// Root loss of every bin, drive after drive.
    #[must_use]
    pub fn roots(&self) -> Vec<f64> {
        let of = |drive: &DriveLoss| drive.bins.iter().map(|bin| bin.root(&drive.rms)).collect::<Vec<_>>();
        self.drives.iter().flatten().flat_map(of).collect()
    }

    /// The smallest [`DriveLoss::margin`].
    #[must_use]
    pub fn margin(&self) -> f64 {
        self.drives.iter().flatten().map(|drive| drive.margin).fold(f64::INFINITY, f64::min)
    }

    /// How often runs failed.
    #[must_use]
    pub fn failures(&self) -> usize {
        self.drives.iter().flatten().map(|drive| drive.failures).sum()
    }
}

/// A drive as it was measured.
#[derive(Debug)]
pub(super) struct Measured {
    /// Root mean squares: spacing \[m\], speed \[m/s\], acceleration over a second \[m/s²\].
    rms: [f64; SIGNALS],
    /// Spacing \[m\].
    spacing: Vec<f64>,
    /// The smallest spacing \[m\].
    least: f64,
}

impl Measured {
    pub(super) fn of(drive: &Drive) -> Measured {
        let (s, v) = (&drive.trajectory.s, &drive.trajectory.v_f);
        let second = ((1.0 / drive.dt()).round() as usize).max(1);
        let rms = |sum: f64, count: usize, floor: f64| (sum / count.max(1) as f64).sqrt().max(floor);
        let squares = |y: &[f64]| y.iter().map(|y| y * y).sum::<f64>();
        let a: Vec<f64> = v.iter().skip(second).zip(v).map(|(now, then)| now - then).collect();
        // A car that stands has no speed to be off by a share of: what nobody cares about is the least.
        let rms = [
            rms(squares(s), s.len(), FLOOR[0]),
            rms(squares(v), v.len(), FLOOR[1]),
            rms(squares(&a), a.len(), FLOOR[2]),
        ];
        let least = s.iter().copied().fold(f64::INFINITY, f64::min).max(FLOOR[0]);
        Measured { rms, spacing: s.clone(), least }
    }
}

/// The errors of a sample: those of the run, and that of the acceleration where it was free for a second. NaN where a run failed.
pub(super) fn errors(run: &FreeRun, layout: &Layout, t: usize) -> [f64; SIGNALS] {
    let held = |t: usize| layout.windows.is_some_and(|windows| windows.holds(t));
    let [s, v] = run.errors[t];
    let is_free = |from: usize| !held(from) && !run.errors[from..t].iter().any(|e| e[0].is_nan());
    let before = t.checked_sub(layout.second).filter(|before| is_free(*before));
    [s, v, before.map_or(v, |before| v - run.errors[before][1])]
}

/// Mean squared errors of a run in bins.
pub(super) fn of_run(run: &FreeRun, layout: &Layout, measured: &Measured) -> DriveLoss {
    let rms = &measured.rms;
    let mut sums = vec![[0.0; SIGNALS]; layout.count];
    let mut counts = vec![0_u32; layout.count];
    // Where the run has failed: the end of what counts as lost.
    let (mut lost, mut failures) = (0, 0);
    for (t, bin) in layout.bins.iter().enumerate() {
        let failed = run.failed.is_some() || run.errors[t][0].is_nan();
        let Some(bin) = *bin else {
            // Over a whole drive every sample is one to come through, in a bin or not.
            failures += usize::from(failed && layout.windows.is_none() && t >= lost && run.failed.is_none());
            continue;
        };
        if failed && t >= lost {
            failures += 1;
            lost = layout.lost_until(t);
        }
        let squares = if t < lost { rms.map(|r| r * r) } else { errors(run, layout, t).map(|e| e * e) };
        sums[bin as usize].iter_mut().zip(squares).for_each(|(sum, square)| *sum += square);
        counts[bin as usize] += 1;
    }
    let mean = |(sums, count): (&[f64; SIGNALS], &u32)| Bin { mse: sums.map(|sum| sum / f64::from((*count).max(1))) };
    let closest = match failures {
        0 => run.errors.iter().zip(&measured.spacing).map(|([s, _], own)| own + s).fold(f64::INFINITY, f64::min),
        _ => 0.0,
    };
    let margin = closest / measured.least;
    DriveLoss { bins: sums.iter().zip(&counts).map(mean).collect(), rms: *rms, failures, margin }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_loop::Horizon;

    #[test]
    fn losses_are_those_of_the_definition() {
        let layout = Layout::new(325, 0.1, Horizon::Drive);
        let errors: Vec<[f64; 2]> = (0..325).map(|t| [0.5, 0.1 * f64::from(t) * 0.1]).collect();
        let rms = [20.0, 10.0, 0.5];
        let measured = Measured { rms, spacing: vec![2.0; 325], least: 2.0 };
        let loss = of_run(&FreeRun { errors: errors.clone(), failed: None }, &layout, &measured);
        assert!((loss.margin - 1.25).abs() < 1e-12);
        assert_eq!(loss.bins.len(), 3);
        let [s, v, a] = loss.bins[1].mse;
        // The speed is off by 0.1 m/s more every second, so the acceleration by 0.1 m/s².
        assert!((s - 0.25).abs() < 1e-12 && (a - 0.01).abs() < 1e-12 && v > 1.25_f64.powi(2));
        let log = ((0.25_f64 + 0.0025).ln() + (v + 0.0004).ln() + (0.01_f64 + 0.0004).ln()) / 3.0;
        assert!((loss.bins[1].log() - log).abs() < 1e-12);
        let root = 0.5 / 20.0 + v.sqrt() / 10.0 + 0.1 / 0.5;
        assert!((loss.bins[1].root(&rms) - root).abs() < 1e-12);

        let mut broken = errors;
        broken[126] = [f64::NAN; 2];
        let failed = of_run(&FreeRun { errors: broken, failed: None }, &layout, &measured);
        assert!(failed.failures == 1 && failed.margin == 0.0 && failed.bins[0] == loss.bins[0]);
        // The second bin has the samples 126 to 225: all of it is lost.
        assert!(failed.bins[1].mse == rms.map(|r| r * r) && failed.bins[2].mse[0] == loss.bins[2].mse[0]);
        let losses = Losses { drives: vec![Some(failed), None] };
        assert!(losses.log().is_finite() && losses.failures() == 1 && losses.logs().len() == 3);
    }
}
