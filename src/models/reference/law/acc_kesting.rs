use super::iidm;
use super::{Memory, Seen, values};
use crate::symbols::Parameters;

/// Kesting, Treiber, Helbing (2010), Eq. 2.4, with the IIDM in place of the IDM as in Treiber, Kesting (2013), Sec. 11.3.8:
/// commanded acceleration \[m/s²\].
pub fn acceleration(seen: &Seen<'_>, memory: &mut Memory) -> f64 {
    let [coolness] = values(seen.own);
    let b = -seen.p.a_min;
    let following = iidm::acceleration(seen, memory);
    let heuristic = constant_accelerations(seen);
    if following >= heuristic {
        return following;
    }
    (1.0 - coolness) * following + coolness * (heuristic + b * ((following - heuristic) / b).tanh())
}

/// Eq. 2.3: the largest constant acceleration without a crash while the preceding vehicle keeps its acceleration \[m/s²\].
fn constant_accelerations(seen: &Seen<'_>) -> f64 {
    let x = seen.x;
    // At least 1 mm, as in the IIDM: a perceived spacing may be less.
    let s = x.s.max(1e-3);
    let a_l = seen.a_l.min(seen.p.a_max);
    let closing = x.v_f - x.v_l;
    // The preceding vehicle stops before the gap is at its smallest.
    // With <= as in the article, two standing cars would give 0/0; the value is the same from both sides.
    if x.v_l * closing < -2.0 * s * a_l {
        x.v_f * x.v_f * a_l / (x.v_l * x.v_l - 2.0 * s * a_l)
    } else {
        a_l - closing.max(0.0).powi(2) / (2.0 * s)
    }
}

/// That of the IIDM: at a constant speed the heuristic commands nothing \[m\].
pub fn equilibrium(p: &Parameters, _own: &[f64], v: f64) -> f64 {
    iidm::equilibrium(p, &[], v)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{rests, same, steady};
    use super::*;

    /// As in the tests of the IIDM, whose -6 and 0.9375 are worked there.
    const P: Parameters =
        Parameters { delta: 1.0, v_0: 20.0, d_0: 2.0, t_h: 1.0, a_max: 2.0, a_min: -2.0, ..Parameters::NONE };

    fn law(coolness: f64, x: [f64; 3], a_l: f64) -> f64 {
        acceleration(&Seen { a_l, ..steady(&P, &[coolness], x) }, &mut Memory::default())
    }

    #[test]
    fn the_iidm_where_it_brakes_less() {
        // IIDM 0.9375, CAH 0.
        same(law(0.5, [24.0, 10.0, 10.0], 0.0), 0.9375);
        // Without coolness always: IIDM -6.
        same(law(0.0, [16.0, 10.0, 2.0], 0.0), -6.0);
    }

    #[test]
    fn the_preceding_vehicle_stops_first() {
        // IIDM -6. 6 4 = 24 < 2 11 12 = 264: CAH 100 (-12) / (36 + 264) = -4.
        // 0.5 (-6) + 0.5 (-4 + 2 tanh(-2/2)) = -5 - tanh(1).
        same(law(0.5, [11.0, 10.0, 6.0], -12.0), -5.0 - 0.761_594_155_955_764_9);
    }

    #[test]
    fn the_preceding_vehicle_goes_on() {
        // s_des = 2 + 10 + 10 8 / 4 = 32, z = 2: IIDM -6. 2 8 = 16 > 0: CAH 0 - 8^2 / (2 16) = -2.
        // 0.5 (-6) + 0.5 (-2 + 2 tanh(-4/2)) = -4 - tanh(2).
        same(law(0.5, [16.0, 10.0, 2.0], 0.0), -4.0 - 0.964_027_580_075_816_9);
        // Its 5 m/s2 count as a_max = 2: CAH 2. 0.5 (-6) + 0.5 (2 + 2 tanh(-8/2)) = -2 - tanh(4).
        same(law(0.5, [6.0, 10.0, 10.0], 5.0), -2.0 - 0.999_329_299_739_067);
        // It is faster: s_des = 2 + 10 - 10/4 = 9.5, z = 2, IIDM -6. -11 > -2 4.75 2 = -19: CAH 2 - 0.
        same(law(0.5, [4.75, 10.0, 11.0], 5.0), -2.0 - 0.999_329_299_739_067);
        // Both stand at z = 2: IIDM -6, CAH 0. 0.5 (-6) + 0.5 (0 + 2 tanh(-6/2)) = -3 - tanh(3).
        same(law(0.5, [1.0, 0.0, 0.0], 0.0), -3.0 - 0.995_054_753_686_730_5);
    }

    #[test]
    fn rests_at_its_equilibrium() {
        same(equilibrium(&P, &[0.5], 10.0), 12.0);
        rests("acc_kesting", &P, &[0.5], &[0.0, 3.0, 10.0, 20.0]);
    }
}
