use super::{Memory, Seen};
use crate::symbols::Parameters;

/// Krauss (1998) without randomness: commanded acceleration, relative to the present own speed \[m/s²\].
pub fn acceleration(seen: &Seen<'_>, _memory: &mut Memory) -> f64 {
    let (p, x) = (seen.p, seen.x);
    let v_next = p.v_0.min(seen.v_f + p.a_max * seen.dt).min(safe_speed(p, x.s - p.d_0, x.v_l)).max(0.0);
    (v_next - seen.v_f) / seen.dt
}

/// The speed at which the distance of `t_h` and of braking just fits into the gap and the other's braking distance \[m/s\]: `v t_h +
/// v²/(2b) = gap + v_l²/(2b)`, solved for v as in `KraussOrig1` of SUMO.
fn safe_speed(p: &Parameters, gap: f64, v_l: f64) -> f64 {
    let b = -p.a_min;
    let radicand = (b * p.t_h).powi(2) + v_l * v_l + 2.0 * b * gap;
    // Negative if no speed is safe.
    -b * p.t_h + radicand.max(0.0).sqrt()
}

/// The gap at which the own speed is the safe one: both have the same braking distance \[m\].
pub fn equilibrium(p: &Parameters, _own: &[f64], v: f64) -> f64 {
    p.d_0 + p.t_h * v
}

#[cfg(test)]
mod tests {
    use super::super::tests::{rests, same, steady};
    use super::*;

    /// The safe speed is `-2 + sqrt(4 + v_l^2 + 4 (s - 2))`.
    const P: Parameters = Parameters { v_0: 20.0, d_0: 2.0, t_h: 1.0, a_max: 1.0, a_min: -2.0, ..Parameters::NONE };

    fn law(s: f64, v: f64, v_l: f64) -> f64 {
        acceleration(&steady(&P, &[], [s, v, v_l]), &mut Memory::default())
    }

    #[test]
    fn the_safe_speed() {
        // -2 + sqrt(4 + 36 + 24) = 6: (6 - 7) / 0.1.
        same(law(8.0, 7.0, 6.0), -10.0);
        // -2 + sqrt(4 + 0 - 2) < 0, so 0: (0 - 1) / 0.1.
        same(law(1.5, 1.0, 0.0), -10.0);
        // 4 + 0 - 6 < 0: no speed is safe.
        same(law(0.5, 1.0, 0.0), -10.0);
    }

    #[test]
    fn the_largest_acceleration_and_the_desired_speed() {
        // -2 + sqrt(4 + 100 + 112) = 12.7, 6 + 0.1: a_max.
        same(law(30.0, 6.0, 10.0), 1.0);
        // -2 + sqrt(4 + 400 + 400) = 26.4, 19.95 + 0.1 = 20.05, 20: (20 - 19.95) / 0.1.
        same(law(102.0, 19.95, 20.0), 0.5);
    }

    #[test]
    fn the_present_speed_is_what_it_starts_from() {
        // Perceived are 7 m/s, the safe speed is 6; from the present 6.5: (6 - 6.5) / 0.1.
        let seen = Seen { v_f: 6.5, ..steady(&P, &[], [8.0, 7.0, 6.0]) };
        same(acceleration(&seen, &mut Memory::default()), -5.0);
    }

    #[test]
    fn rests_at_its_equilibrium() {
        // 2 + 1 6.
        same(equilibrium(&P, &[], 6.0), 8.0);
        rests("krauss", &P, &[], &[0.0, 6.0, 13.0, 20.0]);
    }
}
