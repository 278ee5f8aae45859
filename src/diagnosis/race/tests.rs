use super::*;
use crate::wgsl::extension_named;

fn cause(name: &str) -> &'static Extension {
    extension_named(name).expect("in the library")
}

#[test]
fn pairs_are_causes_that_hide_each_other() {
    let causes = ["dead_zone", "actuation_lag", "leader_accel_ff", "set_speed_change", LEAD].map(cause);
    let names: Vec<Vec<String>> = sets(&causes).iter().map(|set| names(set)).collect();
    // What happens at a time has no fold to be judged on, and the lead is no property of a car.
    let expected: [&[&str]; 4] =
        [&["dead_zone"], &["actuation_lag"], &["leader_accel_ff"], &["actuation_lag", "leader_accel_ff"]];
    assert_eq!(names, expected);
}
