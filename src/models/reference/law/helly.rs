use super::{Memory, Seen, values};
use crate::symbols::Parameters;

/// Helly (1959), without his delay, which is a separate part: commanded acceleration \[m/s²\].
pub fn acceleration(seen: &Seen<'_>, _memory: &mut Memory) -> f64 {
    let [gamma] = values(seen.own);
    let (p, x) = (seen.p, seen.x);
    let s_des = p.d_0 + p.t_h * x.v_f + gamma * seen.a_f;
    p.k_v * x.dv() + p.k_s * (x.s - s_des)
}

/// The desired spacing without acceleration \[m\].
pub fn equilibrium(p: &Parameters, _own: &[f64], v: f64) -> f64 {
    p.d_0 + p.t_h * v
}

#[cfg(test)]
mod tests {
    use super::super::tests::{rests, same, steady};
    use super::*;

    const P: Parameters = Parameters { k_s: 0.2, k_v: 0.5, d_0: 2.0, t_h: 1.5, ..Parameters::NONE };

    fn law(x: [f64; 3], a_f: f64) -> f64 {
        acceleration(&Seen { a_f, ..steady(&P, &[3.0], x) }, &mut Memory::default())
    }

    #[test]
    fn as_by_hand() {
        // D = 2 + 1.5 10 = 17: 0.5 2 + 0.2 (22 - 17) = 2.
        same(law([22.0, 10.0, 12.0], 0.0), 2.0);
        // D = 17 + 3 1 = 20: 0.5 2 + 0.2 (22 - 20) = 1.4.
        same(law([22.0, 10.0, 12.0], 1.0), 1.4);
        // D = 17 + 3 (-2) = 11: 0.5 (-4) + 0.2 (16 - 11) = -1.
        same(law([16.0, 10.0, 6.0], -2.0), -1.0);
    }

    #[test]
    fn rests_at_its_equilibrium() {
        // 2 + 1.5 10.
        same(equilibrium(&P, &[3.0], 10.0), 17.0);
        rests("helly", &P, &[3.0], &[0.0, 10.0, 40.0]);
    }
}
