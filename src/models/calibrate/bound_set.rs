//! Named sets of bounds: for cars with adaptive cruise control, and for human drivers.

use super::space::{Overrides, parse_bounds};
use crate::catalog::Variant;

/// Bounds of human drivers; beside each number is its source, or a mark that it is chosen.
const HUMAN: &str = include_str!("human.toml");

/// A named set of bounds, as `--bounds` takes it.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, strum::EnumString, strum::IntoStaticStr, strum::VariantArray, strum::VariantNames,
)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum BoundSet {
    /// Table 3 of the paper: cars with adaptive cruise control.
    Acc,
    /// Human drivers: wide, partly from papers.
    Human,
}

impl BoundSet {
    /// Source of its numbers, in words.
    #[must_use]
    pub fn source(self) -> &'static str {
        match self {
            BoundSet::Acc => "Table 3",
            BoundSet::Human => {
                "Rafati Fard and Shariat Mohaymany (2019), Green (2000), some chosen wide; those of the car by Table 3"
            }
        }
    }

    /// Bounds that replace Table 3 for a variant.
    ///
    /// # Panics
    /// Never: the sets are part of the program, and a test reads them.
    #[must_use]
    pub fn overrides(self, variant: &Variant) -> Overrides {
        match self {
            BoundSet::Acc => Overrides::new(),
            BoundSet::Human => {
                let mut bounds = parse_bounds(HUMAN, "human.toml", variant).expect("the set is valid");
                bounds.retain(|name, _| variant.parameters().iter().any(|symbol| symbol.name() == name));
                bounds
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::SearchSpace;
    use crate::convention::Convention;
    use strum::VariantArray;

    #[test]
    fn every_variant_can_be_searched_within_every_set() {
        for variant in Variant::all() {
            let vehicle = crate::vehicle::Vehicle::built_in().remove(0);
            for set in BoundSet::VARIANTS {
                let overrides = set.overrides(&variant);
                let space = SearchSpace::new(&variant, Some(&vehicle), Convention::PAPER, &overrides);
                assert!(space.is_ok(), "{variant} {}: {space:?}", set.into_str());
            }
        }
    }

    /// Typical drivers, and those of a slow car in a city.
    #[test]
    fn human_drivers_are_within_the_human_set() {
        let idm: Variant = "idm".parse().expect("a base");
        let (acc, human) = (BoundSet::Acc.overrides(&idm), BoundSet::Human.overrides(&idm));
        assert!(acc.is_empty());
        for (name, values) in [
            ("v_0", [8.0, 54.0 / 3.6, 120.0 / 3.6]),
            ("t_h", [0.6, 1.0, 2.6]),
            ("d_0", [0.8, 2.0, 4.8]),
            ("a_max", [0.5, 1.0, 3.0]),
            ("a_min", [-0.7, -1.5, -4.5]),
        ] {
            let [lower, upper] = human[name];
            assert!(values.iter().all(|value| (lower..=upper).contains(value)), "{name}: {lower} to {upper}");
        }
        assert_eq!(human["delta"], [4.0, 4.0]);
        assert!(!human.contains_key("theta"), "not one of the IDM's");
        assert_eq!("human".parse(), Ok(BoundSet::Human));
        assert!("human.toml".parse::<BoundSet>().is_err());
    }
}
