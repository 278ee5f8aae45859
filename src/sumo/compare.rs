//! Compares SUMO with leadlag, and both with the measured car.

use super::drive::{Drive, Motion};
use crate::score::SignalMeasures;
use serde::{Deserialize, Serialize};

/// Distance of one signal of SUMO from that of leadlag.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Loss {
    /// Root mean square, in the unit of the signal.
    pub rms: f64,
    /// Largest difference.
    pub largest: f64,
    /// Time of that \[s\], as in the measured file.
    pub at_s: f64,
}

/// Loss of the export.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Comparison {
    pub samples: usize,
    /// Spacing \[m\].
    pub spacing_m: Loss,
    /// Speed \[m/s\].
    pub speed_mps: Loss,
    /// Acceleration \[m/s²\].
    pub accel_mps2: Loss,
    /// NRMSE(s,v,a) against the measured follower: of leadlag.
    pub nrmse_sva: f64,
    pub sumo_nrmse_sva: f64,
    /// True if the follower of SUMO collided with the leader.
    pub collision: bool,
}

/// Compares the follower of SUMO with that of leadlag.
pub fn compare(drive: &Drive, sumo: &Motion) -> Comparison {
    let loss = |ours: &[f64], theirs: &[f64]| {
        let differences = ours.iter().zip(theirs).map(|(ours, theirs)| (theirs - ours).abs());
        let largest =
            differences.clone().enumerate().fold((0, 0.0), |most, one| if one.1 > most.1 { one } else { most });
        let squares: f64 = differences.map(|d| d * d).sum();
        Loss { rms: (squares / ours.len() as f64).sqrt(), largest: largest.1, at_s: drive.t[largest.0] }
    };
    let nrmse = |of: &Motion| {
        let pairs = [(&of.s, &drive.measured.s), (&of.v, &drive.measured.v), (&of.a, &drive.measured.a)];
        pairs.iter().map(|(simulated, measured)| SignalMeasures::compare(simulated, measured, false).nrmse).sum()
    };
    Comparison {
        samples: drive.t.len(),
        spacing_m: loss(&drive.simulated.s, &sumo.s),
        speed_mps: loss(&drive.simulated.v, &sumo.v),
        accel_mps2: loss(&drive.simulated.a, &sumo.a),
        nrmse_sva: nrmse(&drive.simulated),
        sumo_nrmse_sva: nrmse(sumo),
        collision: sumo.s.iter().any(|s| *s <= 0.0),
    }
}
