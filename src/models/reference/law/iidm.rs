use super::{Memory, Seen};
use crate::symbols::Parameters;

/// The smallest perceived spacing \[m\].
const CONTACT: f64 = 1e-3;

/// Treiber, Kesting (2013), Sec. 11.3.7: commanded acceleration of the improved IDM \[m/s²\].
pub fn acceleration(seen: &Seen<'_>, _memory: &mut Memory) -> f64 {
    let (p, x) = (seen.p, seen.x);
    let (a_max, b) = (p.a_max, -p.a_min);
    // A measured speed may lie slightly below zero; it means standstill.
    let share = (x.v_f / p.v_0).max(0.0);
    // Eq. 3 of the paper.
    let s_des = p.d_0 + (p.t_h * x.v_f + x.v_f * (x.v_f - x.v_l) / (2.0 * (a_max * b).sqrt())).max(0.0);
    let z = s_des / x.s.max(CONTACT);
    if share <= 1.0 {
        let free = a_max * (1.0 - share.powf(p.delta));
        if z >= 1.0 {
            a_max * (1.0 - z * z)
        } else if free > 0.0 {
            free * (1.0 - z.powf(2.0 * a_max / free))
        } else {
            0.0
        }
    } else {
        let free = -b * (1.0 - (1.0 / share).powf(a_max * p.delta / b));
        if z >= 1.0 { free + a_max * (1.0 - z * z) } else { free }
    }
}

/// Where the spacing equals the desired one \[m\].
pub fn equilibrium(p: &Parameters, _own: &[f64], v: f64) -> f64 {
    p.d_0 + p.t_h * v
}

#[cfg(test)]
mod tests {
    use super::super::tests::{rests, same, steady};
    use super::*;

    /// 2 sqrt(2 2) = 4. The free acceleration is 2 (1 - v/20), above 20 m/s -2 (1 - 20/v).
    const P: Parameters =
        Parameters { delta: 1.0, v_0: 20.0, d_0: 2.0, t_h: 1.0, a_max: 2.0, a_min: -2.0, ..Parameters::NONE };

    fn law(s: f64, v: f64, v_l: f64) -> f64 {
        acceleration(&steady(&P, &[], [s, v, v_l]), &mut Memory::default())
    }

    #[test]
    fn up_to_the_desired_speed() {
        // s_des = 2 + 10 = 12, z = 2: 2 (1 - 4) = -6.
        same(law(6.0, 10.0, 10.0), -6.0);
        // z = 0.5, free 2 (1 - 0.5) = 1: 1 (1 - 0.5^(2 2 / 1)) = 1 - 1/16.
        same(law(24.0, 10.0, 10.0), 0.9375);
        // Closing: s_des = 2 + 10 + 10 4 / 4 = 22, z = 2.
        same(law(11.0, 10.0, 6.0), -6.0);
        // Opening: 10 + 10 (-20) / 4 = -40, so s_des = 2, z = 0.5.
        same(law(4.0, 10.0, 30.0), 0.9375);
        // Standing, z = 0.5: free 2, 2 (1 - 0.5^2) = 1.5.
        same(law(4.0, 0.0, 0.0), 1.5);
        // With an impossible spacing: z = 12 / 0.001.
        same(law(-1.0, 10.0, 10.0), 2.0 * (1.0 - 12_000.0 * 12_000.0));
        // At v_0 with z < 1 the acceleration is 0.
        same(law(44.0, 20.0, 20.0), 0.0);
    }

    #[test]
    fn above_the_desired_speed() {
        // a delta / b = 1: free -2 (1 - 20/40) = -1; s_des = 42, z = 0.5.
        same(law(84.0, 40.0, 40.0), -1.0);
        // z = 2: -1 + 2 (1 - 4) = -7.
        same(law(21.0, 40.0, 40.0), -7.0);
    }

    #[test]
    fn rests_at_its_equilibrium() {
        // 2 + 1 10.
        same(equilibrium(&P, &[], 10.0), 12.0);
        rests("iidm", &P, &[], &[0.0, 3.0, 10.0, 20.0]);
    }
}
