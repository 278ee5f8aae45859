//! The signals of a follower and the car ahead of it, as measured.

use super::finding::Who;
use crate::trajectory::prepare::{GRID_TOLERANCE_S, median_step, nominal_step, stretches};
use crate::trajectory::{Layout, Platoon, Recording, factor};
use std::ops::Range;

/// Smallest speed of both cars at which gap and speeds are compared \[m/s\]: a speed sensor that gives magnitudes is biased at rest.
pub(super) const DRIVING: f64 = 0.5;
/// Largest distance of a row from the time grid \[time steps\]; others are left out.
const OFF_GRID: f64 = 0.25;
/// Largest number of samples of a drive: a file that mixes units of time has no grid.
const SAMPLES_MAX: f64 = 5e6;

/// A link on a uniform time step; missing values are NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct Link {
    /// Time of the file at sample 0 \[s\].
    pub t_0: f64,
    /// Time step \[s\].
    pub dt: f64,
    /// Speed of the car ahead \[m/s\].
    pub v_l: Vec<f64>,
    /// Speed of the follower \[m/s\].
    pub v_f: Vec<f64>,
    /// Gap from bumper to bumper \[m\]; from positions if it is not measured.
    pub gap: Vec<f64>,
    /// Name of the gap in the file.
    pub called: String,
    /// Position of the car ahead \[m\], if measured.
    pub x_l: Option<Vec<f64>>,
    /// Position of the follower \[m\], if measured.
    pub x_f: Option<Vec<f64>>,
    /// Length of the car ahead \[m\], if known.
    pub len_l: Option<f64>,
    /// True if all rows are present and on the grid.
    pub regular: bool,
    /// True if the file has no other cars than these two, so that they may be exchanged.
    pub alone: bool,
}

pub(super) struct Signal<'a> {
    pub values: &'a [f64],
    pub who: Who,
    pub name: &'static str,
    pub unit: &'static str,
    /// Smallest noise of a sensor: a tenth of the best one of the shared data (data README, Section 3.1).
    pub noise_floor: f64,
    /// Its name in messages.
    pub title: &'a str,
}

impl Link {
    /// The link of a follower in a platoon of a recording, between two times \[s\]; `None` without a gap or a car ahead.
    pub fn of(recording: &Recording, platoon: &Platoon, follower: usize, window: [Option<f64>; 2]) -> Option<Link> {
        let from = window[0].map_or(0, |from| platoon.t.partition_point(|&t| t < from - GRID_TOLERANCE_S));
        let to = window[1].map_or(platoon.t.len(), |to| platoon.t.partition_point(|&t| t <= to + GRID_TOLERANCE_S));
        let rows = from..to.max(from);
        let t = &platoon.t[rows.clone()];
        let median = median_step(t)?;
        let step = nominal_step(t, &stretches(t, 1.5 * median), median);
        let car = |number: usize| platoon.cars.iter().find(|car| car.number == number);
        let (lead, ego) = (car(follower)?, car(follower.checked_add(1)?)?);
        let (&first, &last) = (t.first()?, t.last()?);
        let count = ((last - first) / step).round();
        if !(step > 0.0 && count < SAMPLES_MAX) {
            return None;
        }
        let on_grid = |values: &[f64]| {
            let mut grid = vec![f64::NAN; count as usize + 1];
            for (&t, &value) in t.iter().zip(&values[rows.clone()]) {
                let place = (t - first) / step;
                if (place - place.round()).abs() <= OFF_GRID {
                    grid[place.round() as usize] = value;
                }
            }
            grid
        };
        let optional = |values: &Option<Vec<f64>>| values.as_deref().map(on_grid);
        let (x_l, x_f) = (optional(&lead.x), optional(&ego.x));
        let between = || {
            let length = lead.length.unwrap_or(0.0);
            Some(x_l.as_ref()?.iter().zip(x_f.as_ref()?).map(|(x_l, x_f)| x_l - x_f - length).collect())
        };
        let called = if ego.gap.is_some() {
            gap_column(ego.number, recording.layout)
        } else {
            "the distance of the two positions".to_owned()
        };
        Some(Link {
            t_0: first,
            dt: step,
            v_l: on_grid(&lead.v),
            v_f: on_grid(&ego.v),
            gap: optional(&ego.gap).or_else(between)?,
            called,
            x_l,
            x_f,
            len_l: lead.length,
            regular: t.windows(2).all(|pair| ((pair[1] - pair[0]) / step - 1.0).abs() < 0.01),
            alone: platoon.cars.iter().filter(|car| car.number > 0).count() == 2,
        })
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.gap.len()
    }

    /// True without samples.
    pub fn is_empty(&self) -> bool {
        self.gap.is_empty()
    }

    /// Time of a sample in the file \[s\].
    pub fn time(&self, sample: usize) -> f64 {
        // Without the rounding errors of sums.
        ((self.t_0 + sample as f64 * self.dt) * 1e6).round() / 1e6
    }

    /// True where both cars drive.
    pub(super) fn driving(&self, i: usize) -> bool {
        self.v_l[i] > DRIVING && self.v_f[i] > DRIVING
    }

    /// Samples in this many seconds.
    pub(super) fn samples(&self, seconds: f64) -> usize {
        ((seconds / self.dt).round() as usize).max(1)
    }

    /// Change of the gap between two samples by the speeds \[m\]: a straight line between the measured values.
    pub(super) fn change_by_speeds(&self, a: usize, b: usize) -> f64 {
        let dv = |i: usize| self.v_l[i] - self.v_f[i];
        0.5 * (dv(a) + dv(b)) * (b - a) as f64 * self.dt
    }

    /// Change of the gap between two samples minus that by the speeds \[m\]; NaN if a value is missing.
    pub(super) fn step(&self, a: usize, b: usize) -> f64 {
        self.gap[b] - self.gap[a] - self.change_by_speeds(a, b)
    }

    /// Change of the gap over that by the speeds, if they vary together; `size` is the unit of time \[s\].
    pub(super) fn ratio(&self, size: f64) -> Option<f64> {
        let t: Vec<f64> = (0..self.len()).map(|i| i as f64 * self.dt * size).collect();
        let dv: Vec<f64> = self.v_l.iter().zip(&self.v_f).map(|(v_l, v_f)| v_l - v_f).collect();
        factor::ratio([(t.as_slice(), dv.as_slice(), self.gap.as_slice())])
    }

    pub(super) fn signals(&self) -> [Signal<'_>; 3] {
        let speed = |values, who, title| Signal { values, who, name: "speed", unit: "m/s", noise_floor: 1.2e-4, title };
        [
            speed(&self.v_l, Who::Leader, "the speed of the car ahead"),
            speed(&self.v_f, Who::Follower, "the speed of the follower"),
            Signal {
                values: &self.gap,
                who: Who::Follower,
                name: "gap",
                unit: "m",
                noise_floor: 5e-5,
                title: &self.called,
            },
        ]
    }
}

/// Gap rate minus speed difference, averaged over a second \[m/s\], with the first sample of that second; NaN if a value is missing.
pub(super) fn rates<'a>(link: &'a Link, stretches: &'a [Range<usize>]) -> impl Iterator<Item = (usize, f64)> + 'a {
    let d: Vec<f64> = (1..link.len()).map(|i| link.step(i - 1, i)).collect();
    let width = link.samples(1.0);
    stretches.iter().flat_map(move |r| {
        let sum = |i: usize| d[i..i + width].iter().sum::<f64>() / (width as f64 * link.dt);
        let rates: Vec<(usize, f64)> = (r.start..r.end.saturating_sub(width)).map(|i| (i, sum(i))).collect();
        rates
    })
}

/// Name of the column with the gap ahead of a car.
pub(in crate::trajectory) fn gap_column(number: usize, layout: Layout) -> String {
    match layout {
        Layout::OpenAcc | Layout::AstazeroRebuilt => format!("IVS{}", number.saturating_sub(1)),
        Layout::AstazeroProcessed => format!("Spacing{number}"),
        Layout::UltraAv => "Spatial_Gap".to_owned(),
        Layout::Pair if number == 1 => "lead2_spacing_m".to_owned(),
        Layout::Pair => "spacing_m".to_owned(),
        Layout::Columns => "gap".to_owned(),
    }
}
