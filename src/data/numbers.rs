//! Deciding numbers, each with its unit and its reason.

use serde::Serialize;

/// A number that decides.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Number {
    pub name: &'static str,
    pub value: f64,
    /// Its unit; `-` for none.
    pub unit: &'static str,
    /// Meaning of the number, and the reason for its value.
    pub reason: &'static str,
}

/// A struct of numbers and its one value: `name = value, unit, reason;` each.
#[macro_export]
macro_rules! numbers {
    ($(#[$about:meta])* $Of:ident $ALL:ident: $($name:ident = $value:expr, $unit:literal, $reason:literal;)*) => {
        $(#[$about])*
        #[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
        pub struct $Of {
            $(#[doc = $reason] pub $name: f64,)*
        }

        /// The numbers of this version.
        pub const $ALL: $Of = $Of { $($name: $value,)* };

        impl $Of {
            /// All numbers in the order of the page.
            pub fn numbers(&self) -> Vec<$crate::numbers::Number> {
                vec![$($crate::numbers::Number {
                    name: stringify!($name), value: self.$name, unit: $unit, reason: $reason
                },)*]
            }
        }
    };
}
