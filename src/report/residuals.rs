//! Errors of a simulation, sorted: from the columns of a simulation file to an error budget and to residuals over speed.

use super::html::Chart;
use super::panel::{Panel, Series, Style};
use crate::diagnose::describe::covariates::Covariates;
use crate::diagnose::describe::error_breakdown::{Budget, Errors, budget};
use crate::result::{DataEntry, ResultFile};

/// Width of the classes of speed \[m/s\].
const CLASS: f64 = 1.0;
/// Accelerations that determine the driving state are slopes over this many seconds to either side, as in a diagnosis \[s\].
const SLOPE_S: f64 = 0.5;
/// Smallest number of samples of a class.
const FEWEST: usize = 30;
/// Times within this are the same \[s\]; so are root mean squares within this share of them, because the order of a sum changes them by
/// less.
const SAME: f64 = 1e-6;

/// A measured follower with its simulation.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Simulated {
    /// Name of the trajectory.
    pub label: String,
    /// Time \[s\].
    pub t: Vec<f64>,
    /// Speed of the car ahead \[m/s\].
    pub v_l: Vec<f64>,
    /// Measured spacing \[m\], speed \[m/s\], acceleration \[m/s²\].
    pub measured: [Vec<f64>; 3],
    /// The same, simulated; NaN if it is not.
    pub simulated: [Vec<f64>; 3],
    /// First compared sample.
    pub first: usize,
}

impl Simulated {
    /// Simulated minus measured, from the first compared sample to where the simulation ends.
    fn errors(&self) -> [Vec<f64>; 3] {
        let error = |k: usize| -> Vec<f64> {
            let pairs = self.simulated[k].iter().zip(&self.measured[k]).skip(self.first);
            pairs.map(|(simulated, measured)| simulated - measured).take_while(|error| error.is_finite()).collect()
        };
        let mut all = [0, 1, 2].map(error);
        let shortest = all.iter().map(Vec::len).min().unwrap_or(0);
        all.iter_mut().for_each(|errors| errors.truncate(shortest));
        all
    }

    /// Evidence that the simulation belongs to another drive than the result; none without any.
    pub fn other_drive(&self, entry: &DataEntry) -> Option<String> {
        let ends = [self.t.first(), self.t.last()].map(|t| t.copied().unwrap_or(f64::NAN));
        let alike = ends.iter().zip(entry.window_s).all(|(found, expected)| (found - expected).abs() < SAME);
        let ([from, to], [first, last]) = (ends, entry.window_s);
        (!alike || self.t.len() != entry.samples).then(|| {
            format!(
                "expected {} samples from {first:.1} to {last:.1} s, found {} from {from:.1} to {to:.1} s",
                entry.samples,
                self.t.len()
            )
        })
    }

    /// Root mean square error of spacing \[m\], speed \[m/s\] and acceleration \[m/s²\].
    pub fn rms(&self) -> [f64; 3] {
        self.errors().map(|errors| (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt())
    }

    fn scene(&self) -> Covariates {
        let dt = self.t.get(1).map_or(1.0, |t| t - self.t[0]);
        let [s, v, _] = &self.measured;
        Covariates {
            label: self.label.clone(),
            t: self.t.clone(),
            dt,
            v: v.clone(),
            s: s.clone(),
            dv: self.v_l.iter().zip(v).map(|(v_l, v)| v_l - v).collect(),
            a: slopes(v, dt),
            a_l: slopes(&self.v_l, dt),
            sin_grade: None,
            place: None,
        }
    }
}

/// Evidence that simulations do not belong to a result: the error of the spacing differs. `None` if it is the same, or the result has no
/// error.
pub fn other_errors(all: &[Simulated], result: &ResultFile) -> Option<String> {
    let expected = result.score.get("rmse_s").copied().flatten()?;
    let square = |one: &Simulated| {
        let [errors, ..] = one.errors();
        errors.iter().map(|error| error * error).sum::<f64>() / (one.t.len().saturating_sub(one.first)) as f64
    };
    let found = all.iter().map(|one| square(one).sqrt()).sum::<f64>() / all.len() as f64;
    let same = (found - expected).abs() <= SAME * expected.abs().max(SAME);
    (!same)
        .then(|| format!("expected an error of the spacing of {expected:.4} m (root mean square), found {found:.4} m"))
}

/// Slope of a signal around every sample.
fn slopes(y: &[f64], dt: f64) -> Vec<f64> {
    let half = ((SLOPE_S / dt).round() as usize).max(1);
    let around = |i: usize| (i.saturating_sub(half), (i + half).min(y.len() - 1));
    let slope =
        |(from, to): (usize, usize)| if to > from { (y[to] - y[from]) / ((to - from) as f64 * dt) } else { 0.0 };
    (0..y.len()).map(|i| slope(around(i))).collect()
}

/// The error budget of several trajectories together; none without a compared sample.
pub fn error_budget(all: &[Simulated]) -> Option<Budget> {
    let parts: Vec<(Covariates, [Vec<f64>; 3])> = all.iter().map(|one| (one.scene(), one.errors())).collect();
    let runs: Vec<Errors> = parts
        .iter()
        .zip(all)
        .map(|((scene, errors), one)| Errors {
            scene,
            first: one.first,
            values: [&errors[0], &errors[1], &errors[2]].map(Vec::as_slice),
        })
        .collect();
    budget(&runs)
}

/// Mean residual, and the range of two thirds of the residuals, in classes of measured speed; `None` if no class has enough
/// samples.
pub fn over_speed(all: &[Simulated]) -> Option<Chart> {
    let mut classes: std::collections::BTreeMap<usize, Vec<[f64; 3]>> = std::collections::BTreeMap::new();
    for one in all {
        let errors = one.errors();
        for (i, v) in one.measured[1].iter().skip(one.first).enumerate().take(errors[0].len()) {
            let class = (v.max(0.0) / CLASS).floor() as usize;
            classes.entry(class).or_default().push([0, 1, 2].map(|k| errors[k][i]));
        }
    }
    classes.retain(|_, errors| errors.len() >= FEWEST);
    if classes.is_empty() {
        return None;
    }
    // A row without values separates two classes that are not neighbours, so that no line connects them.
    let apart: Vec<usize> =
        classes.keys().zip(classes.keys().skip(1)).filter(|(a, b)| *a + 1 < **b).map(|(a, _)| a + 1).collect();
    apart.into_iter().for_each(|class| _ = classes.insert(class, Vec::new()));
    let x: Vec<f64> = classes.keys().map(|class| (*class as f64 + 0.5) * CLASS).collect();
    let panel = |(k, label): (usize, &str)| {
        let statistics = classes.values().map(|errors| {
            // NaN of an empty one.
            let n = errors.len() as f64;
            let mean = errors.iter().map(|e| e[k]).sum::<f64>() / n;
            let deviation = (errors.iter().map(|e| (e[k] - mean).powi(2)).sum::<f64>() / n).sqrt();
            (mean, deviation)
        });
        let (mean, deviation): (Vec<f64>, Vec<f64>) = statistics.unzip();
        let side = |sign: f64| -> Vec<f64> { mean.iter().zip(&deviation).map(|(m, d)| m + sign * d).collect() };
        let (upper, lower) = (side(1.0), side(-1.0));
        let series = vec![
            Series::new("mean", Style::Simulated, mean),
            Series::new("mean + deviation", Style::Context, upper),
            Series::new("mean − deviation", Style::Context, lower),
        ];
        Panel::new(label, series)
    };
    let labels = ["residual of s [m]", "residual of v [m/s]", "residual of a [m/s²]"];
    Some(Chart {
        title: "Residuals over speed: mean and standard deviation in classes of 1 m/s".to_owned(),
        x_label: "measured speed [m/s]".to_owned(),
        x,
        points: true,
        panels: labels.into_iter().enumerate().map(panel).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The simulation is 1 m too far behind below 10 m/s, and correct above; it ends early at sample 180.
    fn made_up() -> Simulated {
        let count = 200;
        let v: Vec<f64> = (0..count).map(|i| 0.1 * i as f64).collect();
        let simulated = |i: usize| if i >= 180 { f64::NAN } else { 20.0 + if v[i] < 10.0 { 1.0 } else { 0.0 } };
        Simulated {
            label: "made up".to_owned(),
            t: (0..count).map(|i| 0.1 * i as f64).collect(),
            v_l: v.clone(),
            measured: [vec![20.0; count], v.clone(), vec![1.0; count]],
            simulated: [(0..count).map(simulated).collect(), v.clone(), vec![1.0; count]],
            first: 20,
        }
    }

    #[test]
    fn the_budget_says_where_the_error_is() {
        let found = error_budget(&[made_up()]).expect("compared samples");
        // Of samples 20 to 179, 20 to 99 are off by 1 m.
        assert!((found.rms[0] - 0.5_f64.sqrt()).abs() < 1e-12 && found.rms[1] == 0.0, "{:?}", found.rms);
        // The speed rises by 0.1 m/s a sample, and the car is only compared from sample 20 on.
        let [only] = &found.regime[..] else { panic!("{:?}", found.regime) };
        assert_eq!((only.name.as_str(), only.time, only.error[0]), ("accelerating", 1.0, 1.0));
        assert!((found.bias[0] - 0.5).abs() < 1e-12, "{:?}", found.bias);
    }

    #[test]
    fn residuals_over_speed_are_means_of_classes() {
        let mut long = made_up();
        assert!(over_speed(&[long.clone()]).is_none(), "ten samples per class are too few");
        long.measured[1].iter_mut().for_each(|v| *v = (*v / 4.0).floor() * 4.0 + 0.2);
        let chart = over_speed(&[long]).expect("40 samples per class");
        // No samples between 5 and 8 m/s: points, and no line from one to the other.
        assert!(chart.points);
        assert_eq!(chart.x, [4.5, 5.5, 8.5, 9.5, 12.5]);
        let values = &chart.panels[0].series[0].values;
        assert_eq!([values[0], values[2], values[4]], [1.0, 0.5, 0.0]);
        assert!(values[1].is_nan() && values[3].is_nan() && values.len() == 5, "{values:?}");
    }
}
