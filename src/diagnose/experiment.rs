//! Which drive would tell two causes apart that these data do not.

use super::family;
use crate::extension::Extension;

/// What to measure so that a cause and its rival predict different things.
#[must_use]
pub fn experiment(cause: &Extension, rival: &Extension) -> &'static str {
    let families = [family(cause), family(rival)];
    let names = [cause.name.as_str(), rival.name.as_str()];
    let both = |name: &str| families.iter().all(|family| *family == name);
    let one_of = |list: &[&str]| names.iter().any(|name| list.contains(name));
    if both("phase") {
        "a leader that brakes and accelerates at once and hard, under sensors with little noise: a delay shifts what follows, a lag or \
         filter rounds it"
    } else if both("drag_or_headway") {
        "driving without a car ahead at several set speeds: drag lowers the speed that is kept, a headway does not act there"
    } else if both("anticipation") {
        "a car two ahead that brakes or accelerates while the one between keeps its speed"
    } else if families.contains(&"absorbed") {
        "an independent measurement of gap and speeds (satellite positions of both cars, a tape at standstill): what a sensor reads \
         wrongly shows there, and only there"
    } else if families.contains(&"anticipation") {
        "a leader that accelerates at once from a constant speed: anticipation answers before speed and gap have changed"
    } else if one_of(&["headway_mode_change", "set_speed_change"]) {
        "the same drive once more without touching the settings: what was an event does not come again"
    } else if one_of(&["grade"]) {
        "the same road in the other direction: what the slope does changes its sign"
    } else if one_of(&["accel_cap", "power_cap", "jerk_limit", "decel_cap"]) {
        "a leader that drives off fast and brakes hard, once begun at once and once gently, from low and from high speed: a limit of the \
         power falls with the speed, one of the jerk acts at the beginning only"
    } else {
        "drives of another kind: a leader that stops, drives off fast, and keeps several speeds for minutes"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wgsl::extension_named;

    #[test]
    fn what_tells_apart_follows_from_what_the_two_have_in_common() {
        let told = |names: [&str; 2]| {
            let [a, b] = names.map(|name| extension_named(name).expect("built in"));
            assert_eq!(experiment(a, b), experiment(b, a), "whichever comes first");
            experiment(a, b)
        };
        assert!(told(["perception_delay", "sensor_lowpass"]).contains("a delay shifts"));
        assert!(told(["aero_drag", "speed_dep_headway"]).contains("without a car ahead"));
        assert!(told(["leader_accel_ff", "multi_anticipation"]).contains("two ahead"));
        assert!(told(["speed_dep_headway", "speed_scale"]).contains("independent measurement"));
        assert!(told(["accel_cap", "power_cap"]).contains("falls with the speed"));
        assert!(told(["dead_zone", "periodic"]).contains("another kind"));
    }
}
