//! Laws outside the paper, by hand in f64, to compare with shaders/law/. One file per law.

use super::types::Perceived;
use crate::catalog::law_files;
use crate::symbols::Parameters;

/// Input of a law at a step.
#[derive(Debug, Clone, Copy)]
pub struct Seen<'a> {
    /// Parameters with a name of the paper's table, as extensions left them.
    pub p: &'a Parameters,
    /// The law's own parameters, in the order of its file; those of the paper's table are not among them.
    pub own: &'a [f64],
    /// The perceived values.
    pub x: Perceived,
    /// Present own speed, which is not delayed \[m/s\].
    pub v_f: f64,
    /// Own acceleration at the beginning of the step \[m/s²\].
    pub a_f: f64,
    /// Acceleration of the preceding vehicle, as perceived \[m/s²\].
    pub a_l: f64,
    /// Speed of the preceding vehicle `tau` earlier, for laws that look back \[m/s\].
    pub v_l_then: f64,
    /// The same, half as much earlier \[m/s\].
    pub v_l_half: f64,
    /// Time step \[s\].
    pub dt: f64,
}

/// Memory of a law from step to step: the members of `State` in the order of its file. All start at 0.
pub type Memory = [f64; 4];

#[derive(Debug)]
pub struct Law {
    /// The name of its file.
    pub name: &'static str,
    /// Commanded acceleration \[m/s²\].
    pub acceleration: fn(&Seen<'_>, &mut Memory) -> f64,
    /// `(p, own, v)` to the spacing at which a car at constant speed v behind another at that speed does not change it \[m\].
    pub equilibrium: fn(&Parameters, &[f64], f64) -> f64,
}

macro_rules! laws {
    ($($file:ident,)*) => {
        $(mod $file;)*

        static ALL: &[Law] = &[
            $(Law {
                name: stringify!($file),
                acceleration: $file::acceleration,
                equilibrium: $file::equilibrium,
            }),*
        ];
    };
}

law_files!(laws);

pub fn named(name: &str) -> Option<&'static Law> {
    ALL.iter().find(|law| law.name == name)
}

/// The law's own parameters, to be named one by one.
fn values<const N: usize>(own: &[f64]) -> [f64; N] {
    std::array::from_fn(|i| own[i])
}

#[cfg(test)]
mod tests {
    use super::{ALL, Memory, Parameters, Perceived, Seen, named};

    /// Spacing, own speed and the other's, without delay; both speeds have been constant for a long time. The step is 0.1 s.
    pub(super) fn steady<'a>(p: &'a Parameters, own: &'a [f64], [s, v_f, v_l]: [f64; 3]) -> Seen<'a> {
        let x = Perceived { s, v_f, v_l };
        Seen { p, own, x, v_f, a_f: 0.0, a_l: 0.0, v_l_then: v_l, v_l_half: v_l, dt: 0.1 }
    }

    /// Fails unless both are equal up to rounding.
    #[track_caller]
    pub(super) fn same(found: f64, expected: f64) {
        assert!((found - expected).abs() <= 1e-12 * expected.abs().max(1.0), "{found}, not {expected}");
    }

    /// Fails unless the law of this name rests at its equilibrium, with these speeds \[m/s\].
    #[track_caller]
    pub(super) fn rests(name: &str, p: &Parameters, own: &[f64], speeds: &[f64]) {
        let law = named(name).expect("a law of this name");
        for &v in speeds {
            let s = (law.equilibrium)(p, own, v);
            let a = (law.acceleration)(&steady(p, own, [s, v, v]), &mut Memory::default());
            assert!(a.abs() <= 1e-10, "{name} at {v} m/s and {s} m: {a} m/s2");
        }
    }

    #[test]
    fn laws_are_found_by_name() {
        for law in ALL {
            assert!(named(law.name).is_some_and(|found| std::ptr::eq(found, law)), "{}", law.name);
        }
        assert!(named("no_such_law").is_none());
    }
}
