use super::ovm;
use super::{Memory, Seen, values};
use crate::symbols::Parameters;

/// Jiang, Wu, Zhu (2001): the optimal velocity model and a term for the speed difference \[m/s²\].
pub fn acceleration(seen: &Seen<'_>, _memory: &mut Memory) -> f64 {
    let [kappa, lambda, ds, beta] = values(seen.own);
    kappa * (ovm::optimal_speed(seen.p.v_0, ds, beta, seen.x.s) - seen.x.v_f) + lambda * seen.x.dv()
}

/// The optimal speed, solved for the spacing \[m\].
pub fn equilibrium(p: &Parameters, own: &[f64], v: f64) -> f64 {
    let [_kappa, _lambda, ds, beta] = values(own);
    ovm::spacing(p.v_0, ds, beta, v)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{rests, same, steady};
    use super::*;

    const P: Parameters = Parameters { v_0: 32.0, ..Parameters::NONE };
    /// tanh(ln 2) = (2 - 1/2) / (2 + 1/2) = 0.6.
    const OWN: [f64; 4] = [0.5, 0.25, 10.0, std::f64::consts::LN_2];

    fn law(s: f64, v: f64, v_l: f64) -> f64 {
        acceleration(&steady(&P, &OWN, [s, v, v_l]), &mut Memory::default())
    }

    #[test]
    fn as_by_hand() {
        // V = 32 (0 + 0.6) / 1.6 = 12; 0.5 (12 - 10) + 0.25 (10 - 10) = 1.
        same(law(10.0 * 2f64.ln(), 10.0, 10.0), 1.0);
        // The preceding vehicle is faster: 1 + 0.25 (14 - 10) = 2.
        same(law(10.0 * 2f64.ln(), 10.0, 14.0), 2.0);
        // tanh(ln 3) = 0.8: V = 32 (0.8 + 0.6) / 1.6 = 28; 0.5 (28 - 30) + 0.25 (22 - 30) = -3.
        same(law(10.0 * 6f64.ln(), 30.0, 22.0), -3.0);
    }

    #[test]
    fn rests_at_its_equilibrium() {
        // V = 28 at 10 ln 6 m, as above.
        same(equilibrium(&P, &OWN, 28.0), 10.0 * 6f64.ln());
        rests("fvdm", &P, &OWN, &[0.0, 5.0, 12.0, 31.0]);
    }
}
