use super::{Memory, Seen, values};
use crate::symbols::Parameters;

/// Newell (2002): the preceding vehicle's trajectory, `tau` later and `d_0` behind, or `v_0`. A car that is not there closes the distance
/// within `tau`. Commanded acceleration, relative to the present own speed \[m/s²\].
pub fn acceleration(seen: &Seen<'_>, _memory: &mut Memory) -> f64 {
    let [tau] = values(seen.own);
    // Its displacement in the last tau, by Simpson's rule.
    let way = tau * (seen.x.v_l + 4.0 * seen.v_l_half + seen.v_l_then) / 6.0;
    // Its position tau ago is now ahead of the target position by `behind`; it continued from there at `v_l_then`.
    let behind = seen.x.s - seen.p.d_0 - way;
    let v_next = seen.p.v_0.min(seen.v_l_then + behind / tau);
    (v_next - seen.v_f) / seen.dt
}

/// The distance driven in `tau` at this speed, and `d_0` \[m\].
pub fn equilibrium(p: &Parameters, own: &[f64], v: f64) -> f64 {
    let [tau] = values(own);
    p.d_0 + tau * v
}

#[cfg(test)]
mod tests {
    use super::super::tests::{rests, same, steady};
    use super::*;

    const P: Parameters = Parameters { v_0: 20.0, d_0: 2.0, ..Parameters::NONE };

    /// The other car drove 10, 11 and 12 m/s: in tau = 1.5 s it covered 1.5 (12 + 44 + 10) / 6 = 16.5 m.
    fn law(s: f64, v: f64) -> f64 {
        let seen = Seen { v_l_half: 11.0, v_l_then: 10.0, ..steady(&P, &[1.5], [s, v, 12.0]) };
        acceleration(&seen, &mut Memory::default())
    }

    #[test]
    fn as_by_hand() {
        // 10 + (20 - 2 - 16.5) / 1.5 = 11: (11 - 10.5) / 0.1.
        same(law(20.0, 10.5), 5.0);
        // 10 + (17 - 2 - 16.5) / 1.5 = 9: (9 - 9.5) / 0.1.
        same(law(17.0, 9.5), -5.0);
        // 10 + (48.5 - 2 - 16.5) / 1.5 = 30, so 20: (20 - 19.5) / 0.1.
        same(law(48.5, 19.5), 5.0);
    }

    #[test]
    fn rests_at_its_equilibrium() {
        // 2 + 1.5 10.
        same(equilibrium(&P, &[1.5], 10.0), 17.0);
        rests("newell", &P, &[1.5], &[0.0, 6.0, 10.0, 20.0]);
    }
}
