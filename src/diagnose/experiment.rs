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
