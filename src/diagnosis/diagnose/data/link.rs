//! The signals of a follower and the car ahead of it, as measured.

use super::finding::Who;
use crate::trajectory::{Recording, inspect};

/// Both cars of such a link drive at least this fast where gap and speeds are compared \[m/s\]: a speed sensor that gives
/// magnitudes is biased at rest.
pub(super) const DRIVING: f64 = 0.5;
/// A row may lie this far off the time grid \[time steps\]; others are left out.
const OFF_GRID: f64 = 0.25;

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
    /// Gap from bumper to bumper \[m\].
    pub gap: Vec<f64>,
    /// Position of the car ahead \[m\], where measured.
    pub x_l: Option<Vec<f64>>,
    /// Position of the follower \[m\], where measured.
    pub x_f: Option<Vec<f64>>,
    /// Length of the car ahead \[m\], where known.
    pub len_l: Option<f64>,
}

/// One signal of a link.
pub(super) struct Signal<'a> {
    pub values: &'a [f64],
    pub who: Who,
    pub name: &'static str,
    pub unit: &'static str,
    /// Noise below this is less than any sensor has: a tenth of the best one of the shared data (data README, Section 3.1).
    pub noise_floor: f64,
}

impl Signal<'_> {
    pub fn title(&self) -> String {
        match self.who {
            Who::Leader => format!("{} of the car ahead", self.name),
            _ if self.name == "gap" => "gap".to_owned(),
            _ => format!("{} of the follower", self.name),
        }
    }
}

impl Link {
    /// The link of a follower in one platoon of a recording; `None` without a gap or a car ahead.
    #[must_use]
    pub fn of(recording: &Recording, platoon: usize, follower: usize) -> Option<Link> {
        let step = inspect(recording).platoons.get(platoon)?.sampling.step_s;
        let platoon = recording.platoons.get(platoon)?;
        let car = |number: usize| platoon.cars.iter().find(|car| car.number == number);
        let (lead, ego) = (car(follower)?, car(follower.checked_add(1)?)?);
        let (&first, &last) = (platoon.t.first()?, platoon.t.last()?);
        let count = ((last - first) / step).round();
        // A file that mixes units of time has no grid.
        if !(step > 0.0 && count < 5e6) {
            return None;
        }
        let on_grid = |values: &[f64]| {
            let mut grid = vec![f64::NAN; count as usize + 1];
            for (&t, &value) in platoon.t.iter().zip(values) {
                let place = (t - first) / step;
                if (place - place.round()).abs() <= OFF_GRID {
                    grid[place.round() as usize] = value;
                }
            }
            grid
        };
        let optional = |values: &Option<Vec<f64>>| values.as_deref().map(on_grid);
        Some(Link {
            t_0: first,
            dt: step,
            v_l: on_grid(&lead.v),
            v_f: on_grid(&ego.v),
            gap: optional(&ego.gap)?,
            x_l: optional(&lead.x),
            x_f: optional(&ego.x),
            len_l: lead.length,
        })
    }

    /// Number of samples.
    #[must_use]
    pub fn len(&self) -> usize {
        self.gap.len()
    }

    /// True without samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.gap.is_empty()
    }

    /// Time of a sample in the file \[s\].
    #[must_use]
    pub fn time(&self, sample: usize) -> f64 {
        self.t_0 + sample as f64 * self.dt
    }

    /// True where both cars drive.
    pub(super) fn driving(&self, i: usize) -> bool {
        self.v_l[i] > DRIVING && self.v_f[i] > DRIVING
    }

    /// Samples of so many seconds.
    pub(super) fn samples(&self, seconds: f64) -> usize {
        ((seconds / self.dt).round() as usize).max(1)
    }

    pub(super) fn signals(&self) -> [Signal<'_>; 3] {
        let speed = |values, who| Signal { values, who, name: "speed", unit: "m/s", noise_floor: 1.2e-4 };
        [
            speed(&self.v_l, Who::Leader),
            speed(&self.v_f, Who::Follower),
            Signal { values: &self.gap, who: Who::Follower, name: "gap", unit: "m", noise_floor: 5e-5 },
        ]
    }
}
