use super::{Memory, Seen};
use crate::symbols::Parameters;

/// Above this gap the set speed counts \[m\].
const SPEED_ABOVE: f64 = 120.0;
/// Below this gap the gap law acts \[m\]; in between, the previous law.
const GAP_BELOW: f64 = 100.0;

/// Milanés, Shladover (2014), with one set of gains, as in SUMO's ACC: commanded acceleration \[m/s²\].
/// The memory is 1 while it follows, 0 while it holds the set speed.
pub fn acceleration(seen: &Seen<'_>, memory: &mut Memory) -> f64 {
    let (p, x) = (seen.p, seen.x);
    // SUMO's gap, without minGap.
    let gap = x.s - p.d_0;
    if gap > SPEED_ABOVE {
        memory[0] = 0.0;
    } else if gap < GAP_BELOW {
        memory[0] = 1.0;
    }
    if memory[0] == 0.0 {
        p.k_0 * (p.v_0 - x.v_f)
    } else {
        p.k_v * x.dv() + p.k_s * (gap - p.t_h * x.v_f - margin(x.v_f))
    }
}

/// Xiao, Wang, Schakel, van Arem (2018), Eq. 5: addition to the spacing at a low speed \[m\].
fn margin(v: f64) -> f64 {
    // Infinite at standstill, so 2; a measured speed may lie slightly below zero.
    (75.0 / v.max(0.0) - 5.0).clamp(0.0, 2.0)
}

/// Acceleration by the law of the gap \[m/s²\].
pub fn equilibrium(p: &Parameters, _own: &[f64], v: f64) -> f64 {
    p.d_0 + p.t_h * v + margin(v)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{rests, same, steady};
    use super::*;

    const P: Parameters =
        Parameters { k_s: 0.2, k_v: 0.5, k_0: 0.4, v_0: 30.0, d_0: 2.0, t_h: 1.0, ..Parameters::NONE };

    /// The acceleration, and which law is left in the memory.
    #[track_caller]
    fn law(follows: f64, x: [f64; 3], a: f64, then: f64) {
        let mut memory = [follows, 0.0, 0.0, 0.0];
        same(acceleration(&steady(&P, &[], x), &mut memory), a);
        same(memory[0], then);
    }

    #[test]
    fn the_law_for_the_gap() {
        // No margin above 15 m/s: 0.5 (18 - 20) + 0.2 (30 - 2 - 20) = -1 + 1.6.
        law(0.0, [30.0, 20.0, 18.0], 0.6, 1.0);
        // Margin 75 / 12.5 - 5 = 1: 0.2 (20.5 - 2 - 12.5 - 1) = 1.
        law(0.0, [20.5, 12.5, 12.5], 1.0, 1.0);
        // Margin 2: 0.5 (3 - 5) + 0.2 (14 - 2 - 5 - 2) = 0.
        law(1.0, [14.0, 5.0, 3.0], 0.0, 1.0);
        // Standing: 0.2 (3 - 2 - 0 - 2) = -0.2.
        law(1.0, [3.0, 0.0, 0.0], -0.2, 1.0);
    }

    #[test]
    fn the_law_for_the_speed() {
        // 123 - 2 > 120: 0.4 (30 - 20) = 4.
        law(1.0, [123.0, 20.0, 18.0], 4.0, 0.0);
        // 0.4 (30 - 32) = -0.8.
        law(0.0, [200.0, 32.0, 32.0], -0.8, 0.0);
    }

    #[test]
    fn the_hysteresis() {
        // A gap of 110: 0.2 (110 - 20) + 0.5 (18 - 20) = 17 if it followed, 0.4 (30 - 20) = 4 if not.
        law(1.0, [112.0, 20.0, 18.0], 17.0, 1.0);
        law(0.0, [112.0, 20.0, 18.0], 4.0, 0.0);
        // At the ends, gaps of 100 and 120, nothing changes either: 0.2 (100 - 20) - 1 = 15, 0.2 (120 - 20) - 1 = 19.
        law(0.0, [102.0, 20.0, 18.0], 4.0, 0.0);
        law(1.0, [102.0, 20.0, 18.0], 15.0, 1.0);
        law(0.0, [122.0, 20.0, 18.0], 4.0, 0.0);
        law(1.0, [122.0, 20.0, 18.0], 19.0, 1.0);
    }

    #[test]
    fn rests_at_its_equilibrium() {
        // 2 + 1 12.5 + 1.
        same(equilibrium(&P, &[], 12.5), 15.5);
        rests("acc_milanes", &P, &[], &[0.0, 5.0, 10.75, 12.5, 15.0, 30.0]);
    }
}
