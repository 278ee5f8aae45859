use super::{Memory, Seen, values};
use crate::symbols::Parameters;

/// Largest share of `v_0` that has a spacing: the optimal speed approaches `v_0` only at infinity.
const MOST: f64 = 0.999;

/// Bando et al. (1995): relaxation to the optimal speed \[m/s²\].
pub fn acceleration(seen: &Seen<'_>, _memory: &mut Memory) -> f64 {
    let [kappa, ds, beta] = values(seen.own);
    kappa * (optimal_speed(seen.p.v_0, ds, beta, seen.x.s) - seen.x.v_f)
}

/// Treiber, Kesting (2013), Sec. 10.6: optimal speed at a net spacing \[m/s\]; 0 at 0 and `v_0` far away.
pub fn optimal_speed(v_0: f64, ds: f64, beta: f64, s: f64) -> f64 {
    v_0 * ((s / ds - beta).tanh() + beta.tanh()) / (1.0 + beta.tanh())
}

/// The spacing of which `v` is the optimal speed \[m\]; from `v_0` on, that of a speed just below.
pub fn spacing(v_0: f64, ds: f64, beta: f64, v: f64) -> f64 {
    let share = (v / v_0).min(MOST);
    ds * (beta + (share * (1.0 + beta.tanh()) - beta.tanh()).atanh())
}

/// The optimal speed, solved for the spacing \[m\].
pub fn equilibrium(p: &Parameters, own: &[f64], v: f64) -> f64 {
    let [_kappa, ds, beta] = values(own);
    spacing(p.v_0, ds, beta, v)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{rests, same, steady};
    use super::*;

    const P: Parameters = Parameters { v_0: 32.0, ..Parameters::NONE };
    /// tanh(ln 2) = (2 - 1/2) / (2 + 1/2) = 0.6.
    const OWN: [f64; 3] = [0.5, 10.0, std::f64::consts::LN_2];

    fn law(s: f64, v: f64) -> f64 {
        acceleration(&steady(&P, &OWN, [s, v, 7.0]), &mut Memory::default())
    }

    #[test]
    fn as_by_hand() {
        // At the steepest rise: V = 32 (0 + 0.6) / 1.6 = 12; 0.5 (12 - 10) = 1.
        same(law(10.0 * 2f64.ln(), 10.0), 1.0);
        // s/ds - beta = ln 6 - ln 2 = ln 3, tanh(ln 3) = (3 - 1/3) / (3 + 1/3) = 0.8:
        // V = 32 (0.8 + 0.6) / 1.6 = 28; 0.5 (28 - 30) = -1.
        same(law(10.0 * 6f64.ln(), 30.0), -1.0);
        // Nose to tail: V = 0; 0.5 (0 - 4) = -2.
        same(law(0.0, 4.0), -2.0);
        // No car ahead: V = 32; 0.5 (32 - 30) = 1.
        same(law(1e4, 30.0), 1.0);
    }

    #[test]
    fn rests_at_its_equilibrium() {
        // V = 28 at 10 ln 6 m, as above.
        same(equilibrium(&P, &OWN, 28.0), 10.0 * 6f64.ln());
        rests("ovm", &P, &OWN, &[0.0, 5.0, 12.0, 31.0]);
        // No spacing is too large for v_0: that of 0.999 v_0, where tanh is 0.999 1.6 - 0.6 = 0.9984.
        same(equilibrium(&P, &OWN, 32.0), 10.0 * (2f64.ln() + 0.5 * (1.9984f64 / 0.0016).ln()));
        same(equilibrium(&P, &OWN, 40.0), equilibrium(&P, &OWN, 32.0));
    }
}
