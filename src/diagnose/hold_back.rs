//! Without a file of its own, the hold-out is the end of every file.

use super::drive::{Drive, DriveError};
use crate::trajectory::Trajectory;
use crate::vehicle::Vehicle;

/// Share of a file that is trained on.
pub const TRAINED_ON: f64 = 2.0 / 3.0;

/// The beginning of a trajectory, to be trained on, and its end, to be held back.
#[must_use]
pub fn hold_back(trajectory: &Trajectory) -> [Trajectory; 2] {
    let cut = (TRAINED_ON * trajectory.len() as f64).round() as usize;
    let part = |range: std::ops::Range<usize>, name: &str| {
        let of = |values: &[f64]| values[range.clone()].to_vec();
        let optional = |values: &Option<Vec<f64>>| values.as_deref().map(of);
        Trajectory {
            label: format!("{} {name}", trajectory.label),
            t: of(&trajectory.t),
            x_l: of(&trajectory.x_l),
            v_l: of(&trajectory.v_l),
            x_f: of(&trajectory.x_f),
            v_f: of(&trajectory.v_f),
            s: of(&trajectory.s),
            v_l2: optional(&trajectory.v_l2),
            s_l2: optional(&trajectory.s_l2),
            source: trajectory.source.clone(),
            name: trajectory.name.clone(),
            id: trajectory.id.clone(),
            grade: trajectory.grade.clone(),
            notes: trajectory.notes.clone(),
            ..*trajectory
        }
    };
    [part(0..cut, "beginning"), part(cut..trajectory.len(), "end")]
}

/// The drives of the beginning and of the end.
///
/// # Errors
/// As [`Drive::of`]; [`DriveError::HeldBack`] where the whole file would be long enough.
pub fn drives_apart(trajectory: &Trajectory, vehicle: Option<&Vehicle>) -> Result<[Vec<Drive>; 2], DriveError> {
    let parts = hold_back(trajectory);
    let seconds = |part: &Trajectory| part.len() as f64 * part.dt;
    let [beginning, end] = parts.each_ref().map(|part| {
        Drive::of(part, vehicle).map(|(drives, _)| drives).map_err(|error| match error {
            DriveError::TooShort { jumps: 0, .. } => DriveError::HeldBack {
                label: trajectory.label.clone(),
                whole: seconds(trajectory),
                held: seconds(&parts[1]),
            },
            other => other,
        })
    });
    Ok([beginning?, end?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plant;
    use crate::trajectory::{Preparation, import, prepare};

    fn drive(seconds: f64) -> Trajectory {
        let scenario = plant::Scenario { duration_s: seconds, ..plant::Scenario::default() };
        let mut file = Vec::new();
        plant::write_pair(&plant::run(&scenario).expect("drives"), 1, &mut file).expect("memory");
        let recording = import::read_bytes(&file, "made_up.csv", None).expect("a pair file");
        prepare(&recording, 1, &Preparation::default()).expect("complete").remove(0)
    }

    #[test]
    fn what_is_too_short_to_be_parted_says_what_would_be_long_enough() {
        assert!(drives_apart(&drive(91.0), None).is_ok());
        let said = drives_apart(&drive(70.0), None).expect_err("too short").to_string();
        for part in ["70.1 s", "the last third (23.4 s) is held back", "90 s in all", "--holdout OTHER.csv"] {
            assert!(said.contains(part), "{part}: {said}");
        }
        assert!(!said.contains("jump"), "{said}");
        let said = Drive::of(&drive(20.0), None).expect_err("too short").to_string();
        assert!(said.contains("20.1 s") && said.contains("30 s") && !said.contains("jump"), "{said}");
    }
}
