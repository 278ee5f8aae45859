//! Held-back data of each driver: the last part of the drive, or drives of other files.

use super::{Drive, Pair};
use crate::trajectory::prepare::SEGMENT_MIN_S;
use crate::trajectory::{Trajectory, driver_id};
use std::collections::HashMap;

/// Held-back data, to be scored and not to be calibrated on.
#[derive(Debug, Clone)]
pub enum Held {
    /// This share of each drive, its end.
    Share(f64),
    /// The drives of these pairs, each of the driver of the same id.
    Pairs(Vec<Pair>),
}

/// The id of a driver: the name of the car, otherwise that of the trajectory; `None` without either.
pub fn driver(pair: &Pair) -> Option<&str> {
    driver_id(&pair.name, pair.trajectory.as_deref())
}

impl Held {
    /// Removes it from the pairs, or assigns it to them. Returns the number of usable pairs without held-back data.
    pub fn hold(self, pairs: &mut [Pair]) -> usize {
        match self {
            Held::Share(share) => pairs.iter_mut().for_each(|pair| cut(pair, share)),
            Held::Pairs(held) => {
                let mut of: HashMap<String, Vec<Drive>> = HashMap::new();
                for pair in held {
                    if let (Some(id), Ok(drive)) = (driver(&pair).map(str::to_owned), pair.drive) {
                        of.entry(id).or_default().push(drive);
                    }
                }
                for pair in pairs.iter_mut() {
                    pair.held = driver(pair).and_then(|id| of.get(id)).cloned().unwrap_or_default();
                }
            }
        }
        pairs.iter().filter(|pair| pair.drive.is_ok() && pair.held.is_empty()).count()
    }
}

/// Cuts the end off a drive. A drive that is too short for two parts cannot be calibrated.
fn cut(pair: &mut Pair, share: f64) {
    let Ok(Drive { trajectory, vehicle }) = &pair.drive else { return };
    match kept_and_held(trajectory, share) {
        Ok([kept, held]) => {
            pair.held = vec![Drive { trajectory: held, vehicle: vehicle.clone() }];
            pair.drive = Ok(Drive { trajectory: kept, vehicle: vehicle.clone() });
        }
        Err(why) => {
            pair.is_short = true;
            pair.drive = Err(why);
        }
    }
}

/// A drive without this share of it, and the share, its end. The error says in words that a part is too short to be simulated.
pub fn kept_and_held(trajectory: &Trajectory, share: f64) -> Result<[Trajectory; 2], String> {
    let whole = trajectory.len();
    let at = ((1.0 - share) * whole as f64).round() as usize;
    let least = (SEGMENT_MIN_S / trajectory.dt).ceil() as usize + 1;
    if at < least || whole - at < least {
        let seconds = (whole - 1) as f64 * trajectory.dt;
        let shorter = at.min(whole - at).saturating_sub(1) as f64 * trajectory.dt;
        return Err(format!(
            "{}: expected at least {SEGMENT_MIN_S} s in either part, found {shorter:.1} s of {seconds:.1} s; hold back another share",
            trajectory.label
        ));
    }
    Ok(trajectory.split(at))
}
