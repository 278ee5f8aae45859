//! The drive that both programs follow: the table of `calibrate`.

use super::SumoError;
use crate::simulate::SIMULATION_COLUMNS;
use crate::text::bounded::Lines;
use std::path::Path;

/// Spacing, speed and acceleration of one follower, of equal lengths.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Motion {
    /// Spacing \[m\].
    pub s: Vec<f64>,
    /// Speed \[m/s\].
    pub v: Vec<f64>,
    /// Acceleration \[m/s²\].
    pub a: Vec<f64>,
}

/// A measured leader with the measured follower and the one that leadlag simulated, from the first scored sample on.
#[derive(Debug, Clone, PartialEq)]
pub struct Drive {
    /// Time \[s\], as in the measured file.
    pub t: Vec<f64>,
    /// Time step \[s\].
    pub dt: f64,
    /// Speed of the preceding vehicle \[m/s\].
    pub v_l: Vec<f64>,
    /// Rear of the preceding vehicle, relative to the first position of the follower's front \[m\].
    pub x_l: Vec<f64>,
    /// The measured follower.
    pub measured: Motion,
    /// The follower of leadlag.
    pub simulated: Motion,
}

impl Drive {
    /// Reads a `simulation.csv` from the sample `first` on. Fails when the file is not one, or its run ended early.
    pub fn read(path: &Path, first: usize, dt: f64) -> Result<Drive, SumoError> {
        let read = |source| SumoError::Read { path: path.to_owned(), source };
        let wrong = |problem: String| SumoError::Drive { path: path.to_owned(), problem };
        let lines = Lines::of_table(path).map_err(|error| read(error.into()))?;
        let mut reader = csv::Reader::from_reader(lines);
        let header = reader.headers().map_err(read)?.clone();
        let mut places = [0; 9];
        for (place, name) in places.iter_mut().zip(SIMULATION_COLUMNS) {
            let found = header.iter().position(|column| column == name);
            *place = found.ok_or_else(|| wrong(format!("found no column {name}")))?;
        }
        let mut values: [Vec<f64>; 9] = Default::default();
        for (row, record) in reader.records().enumerate().skip(first) {
            let record = record.map_err(read)?;
            for (column, place) in values.iter_mut().zip(places) {
                let number = record.get(place).and_then(|field| field.parse::<f64>().ok()).filter(|x| x.is_finite());
                column.push(number.ok_or_else(|| {
                    wrong(format!("found no number in row {}; a run that ended early cannot be compared", row + 1))
                })?);
            }
        }
        let [t, v_l, s, v, a, sim_x, sim_s, sim_v, sim_a] = values;
        if t.len() < 2 {
            return Err(wrong(format!("found {} rows from sample {first} on", t.len())));
        }
        let x_l = sim_x.iter().zip(&sim_s).map(|(x, s)| x - sim_x[0] + s).collect();
        Ok(Drive { t, dt, v_l, x_l, measured: Motion { s, v, a }, simulated: Motion { s: sim_s, v: sim_v, a: sim_a } })
    }
}
