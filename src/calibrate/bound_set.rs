//! Named sets of bounds: for cars with adaptive cruise control, and for human drivers.

use super::space::{Overrides, parse_bounds};
use crate::catalog::Variant;

/// Bounds of human drivers; beside each number is its source, or that it is chosen.
const HUMAN: &str = include_str!("human.toml");

/// A named set of bounds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BoundSet {
    /// Table 3 of the paper: cars with adaptive cruise control.
    Acc,
    /// Human drivers: wide, partly from papers.
    Human,
}

impl BoundSet {
    /// All of them.
    pub const ALL: [BoundSet; 2] = [BoundSet::Acc, BoundSet::Human];

    /// As `--bounds` takes it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            BoundSet::Acc => "acc",
            BoundSet::Human => "human",
        }
    }

    /// Where its numbers are from, in words.
    #[must_use]
    pub fn source(self) -> &'static str {
        match self {
            BoundSet::Acc => "Table 3",
            BoundSet::Human => {
                "Rafati Fard and Shariat Mohaymany (2019), Green (2000), some chosen wide; what is the car's by Table 3"
            }
        }
    }

    /// The set of a name.
    #[must_use]
    pub fn called(name: &str) -> Option<BoundSet> {
        Self::ALL.into_iter().find(|set| set.name() == name)
    }

    /// What replaces Table 3 for a variant.
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

    #[test]
    fn every_variant_can_be_searched_within_every_set() {
        for variant in Variant::all() {
            let vehicle = crate::vehicle::Vehicle::built_in().remove(0);
            for set in BoundSet::ALL {
                let overrides = set.overrides(&variant);
                let space = SearchSpace::new(&variant, Some(&vehicle), Convention::PAPER, &overrides);
                assert!(space.is_ok(), "{variant} {}: {space:?}", set.name());
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
        assert_eq!(BoundSet::called("human"), Some(BoundSet::Human));
        assert_eq!(BoundSet::called("human.toml"), None);
    }
}
