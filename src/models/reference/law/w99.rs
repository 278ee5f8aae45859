use super::{Memory, Seen, values};
use crate::symbols::Parameters;

/// Up to this speed the free acceleration grows \[m/s\].
const GROWS_UNTIL: f64 = 80.0 / 3.6;
/// Mean of the random part of the free acceleration \[m/s²\].
const MEAN: f64 = 0.5;
/// SUMO's `emergencyDecel` of cars \[m/s²\].
const EMERGENCY: f64 = 9.0;

/// Wiedemann 99 as in W99 of SUMO 1.28, random numbers at their means: commanded acceleration \[m/s²\].
pub fn acceleration(seen: &Seen<'_>, _memory: &mut Memory) -> f64 {
    let cc8 = seen.own[7];
    let wanted = wanted(seen);
    // Afterwards SUMO limits the speed of the next step: by cc8, by the desired speed, and last by hard braking.
    wanted.min(cc8).min((seen.p.v_0 - seen.v_f) / seen.dt).max(-EMERGENCY)
}

/// Before the limits \[m/s²\].
fn wanted(seen: &Seen<'_>) -> f64 {
    let cc0 = seen.p.d_0;
    let [cc1, cc2, cc3, cc4, cc5, cc6, cc7, cc8, cc9] = values(seen.own);
    let (dx, dv) = (seen.x.s, seen.x.dv());
    // A measured speed may be slightly below zero, which means standstill.
    let v = seen.x.v_f.max(0.0);
    let v_l = seen.x.v_l;

    // SDXc, SDXo, SDXv: the shortest and the longest spacing in following, and the one at which braking begins. With its mean of 0, the
    // random number leaves only v_l for a vehicle ahead that is slower but accelerates.
    let slower = if dv >= 0.0 || seen.a_l < 1.0 { v } else { v_l };
    let shortest = cc0 + if v_l > 0.0 { cc1 * slower.max(0.0) } else { 0.0 };
    let longest = shortest + cc2;
    let braking = longest + cc3 * (dv - cc4);
    // SDV, SDVc, SDVo: the thresholds of the speed difference for perception, closing and opening.
    let noticed = cc6 * dx * dx / 10_000.0;
    let closing = if v > 0.0 { cc4 - noticed } else { 0.0 };
    let opening = if v_l > cc5 { noticed + cc5 } else { noticed };

    if dv < opening && dx <= shortest {
        // Too close. Behind a standing vehicle, closer than cc0, SUMO's W99 commands 0.
        if v_l <= 0.0 {
            return 0.0;
        }
        let a = if dv >= 0.0 {
            0.0
        } else if dx > cc0 {
            (seen.a_l + dv * dv / (cc0 - dx)).min(0.0)
        } else {
            (seen.a_l + 0.5 * (dv - opening)).min(0.0)
        };
        if a > -cc7 { -cc7 } else { a.max(-10.0 + 0.5 * v.sqrt()) }
    } else if dv < closing && dx < braking {
        // Closing in.
        0.5 * dv * dv / (shortest - dx - 0.1)
    } else if dv < opening && dx < longest {
        // Following.
        if seen.a_f <= 0.0 { seen.a_f.min(-cc7) } else { seen.a_f.max(cc7) }
    } else if dx > shortest {
        // Free.
        let most = cc8 + cc9 * v.min(GROWS_UNTIL) + MEAN;
        if dx < longest { most.min(dv * dv / (longest - dx)) } else { most }
    } else {
        0.0
    }
}

/// No spacing is stationary: below the end of following the car brakes by cc7, above it the car accelerates \[m\]. Beyond `v_0`, the
/// spacing of `v_0`.
pub fn equilibrium(p: &Parameters, own: &[f64], v: f64) -> f64 {
    let [cc1, cc2, _, _, _, _, _, _, _] = values(own);
    p.d_0 + cc1 * v.min(p.v_0) + cc2
}

#[cfg(test)]
mod tests {
    use super::super::tests::{same, steady};
    use super::*;

    const P: Parameters = Parameters { v_0: 30.0, d_0: 2.0, ..Parameters::NONE };
    /// cc1 to cc9. At 10 m/s following is between 2 + 1 10 = 12 and 12 + 8 = 20 m.
    /// A speed difference is noticed from dx^2 / 1000 on, and 0.5 m/s more.
    const OWN: [f64; 9] = [1.0, 8.0, -10.0, -0.5, 0.5, 10.0, 0.25, 2.0, 1.0];

    fn law(x: [f64; 3], a_f: f64, a_l: f64) -> f64 {
        acceleration(&Seen { a_f, a_l, ..steady(&P, &OWN, x) }, &mut Memory::default())
    }

    #[test]
    fn too_close() {
        // -2 < 0.6 and 10 <= 12: 0 + 4 / (2 - 10).
        same(law([10.0, 10.0, 8.0], 0.0, 0.0), -0.5);
        // -20 + 4 / (2 - 10) = -20.5, but -10 + 0.5 sqrt(16) at least.
        same(law([10.0, 16.0, 14.0], 0.0, -20.0), -8.0);
        // 4 / (2 - 10) + 0.4 = -0.1, but cc7 at least.
        same(law([10.0, 10.0, 8.0], 0.0, 0.4), -0.25);
        // Nearer than cc0: opening = 0.004 + 0.5, 0.5 (-2 - 0.504) = -1.252.
        same(law([2.0, 10.0, 8.0], 0.0, 0.0), -1.252);
        // The same at a crawl: v_l <= cc5, opening = 0.004, 0.5 (-0.5 - 0.004) = -0.252.
        same(law([2.0, 0.9, 0.4], 0.0, 0.0), -0.252);
        // Not closing: cc7.
        same(law([10.0, 10.0, 10.0], 0.0, 0.0), -0.25);
        // Closer than cc0 to a standing vehicle: command 0.
        same(law([2.0, 10.0, 0.0], 0.0, 0.0), 0.0);
        // Opening by more than 0.1 + 0.5 m/s: command 0.
        same(law([10.0, 10.0, 12.0], 0.0, 0.0), 0.0);
    }

    #[test]
    fn closing_in() {
        // -4 < -0.5 - 0.9 and 30 < 20 - 10 (-4 + 0.5) = 55: 0.5 16 / (12 - 30 - 0.1).
        same(law([30.0, 10.0, 6.0], 0.0, 0.0), -8.0 / 18.1);
        // 30 < 20 - 10 (-1.3 + 0.5) = 28 does not hold, and 30 > 20: free, cc8.
        same(law([30.0, 10.0, 8.7], 0.0, 0.0), 2.0);
        // 0.5 81 / (12 - 15 - 0.1) = -13.1, but -9 at least.
        same(law([15.0, 10.0, 1.0], 0.0, 0.0), -9.0);
        // Behind a standing vehicle the shortest spacing is 2: 0.5 100 / (2 - 10 - 0.1).
        same(law([10.0, 10.0, 0.0], 0.0, 0.0), -50.0 / 8.1);
        // The slower one speeds up, so 2 + 1 8 = 10 instead of 12: 0.5 4 / (10 - 11 - 0.1) instead of 4 / (2 - 11).
        same(law([11.0, 10.0, 8.0], 0.0, 1.0), -2.0 / 1.1);
        same(law([11.0, 10.0, 8.0], 0.0, 0.0), -4.0 / 9.0);
    }

    #[test]
    fn following() {
        // 0 < 0.225 + 0.5 and 15 < 20: continue as before, by at least cc7.
        same(law([15.0, 10.0, 10.0], 0.0, 0.0), -0.25);
        same(law([15.0, 10.0, 10.0], -1.0, 0.0), -1.0);
        same(law([15.0, 10.0, 10.0], 0.1, 0.0), 0.25);
        same(law([15.0, 10.0, 10.0], 1.0, 0.0), 1.0);
        // cc8 at most.
        same(law([15.0, 10.0, 10.0], 5.0, 0.0), 2.0);
    }

    #[test]
    fn free() {
        // 1 > 0.725, 12 < 15 < 20: 1 / (20 - 15).
        same(law([15.0, 10.0, 11.0], 0.0, 0.0), 0.2);
        // 2 + 1 10 + 0.5 = 12.5, but cc8 at most.
        same(law([25.0, 10.0, 10.0], 0.0, 0.0), 2.0);
        // Up to v_0: (30 - 29.9) / 0.1.
        same(law([100.0, 29.9, 29.9], 0.0, 0.0), 1.0);
        // Above: (30 - 31) / 0.1 = -10, but -9 at least.
        same(law([100.0, 31.0, 31.0], 0.0, 0.0), -9.0);
        // Standing, 2 < 3 < 10, v_l > 0.009: 0.04 / (10 - 3).
        same(law([3.0, 0.0, 0.2], 0.0, 0.0), 0.04 / 7.0);
    }

    #[test]
    fn the_free_acceleration_before_the_limits() {
        let free = |v: f64| wanted(&steady(&P, &OWN, [100.0, v, v]));
        // 2 + 1 10 + 0.5; constant above 80 km/h = 22.2 m/s.
        same(free(10.0), 12.5);
        same(free(29.0), 2.5 + 200.0 / 9.0);
    }

    #[test]
    fn it_has_no_rest_but_turns_at_its_equilibrium() {
        for v in [0.0, 10.0, 29.0] {
            let s = equilibrium(&P, &OWN, v);
            // 2 + 1 v + 8.
            same(s, 10.0 + v);
            same(law([s - 1e-9, v, v], 0.0, 0.0), -0.25);
            same(law([s + 1e-9, v, v], 0.0, 0.0), 2.0);
        }
        same(equilibrium(&P, &OWN, 40.0), equilibrium(&P, &OWN, 30.0));
    }
}
