//! The symbol table: every calibration parameter of the paper's Tables 1 and 3, once.
//!
//! The table generates [`Symbol`] (the name) and [`Parameters`] (one named value per symbol), so that a new
//! parameter is one new row here.

/// Bounds of a parameter in a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bounds {
    /// Lower and upper bound of Table 3.
    Fixed(f64, f64),
    /// Table 3 gives one pair per vehicle (road loads).
    PerVehicle,
}

/// Values for which the equations make sense at all, whatever the bounds of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// > 0
    Positive,
    /// >= 0
    NonNegative,
    /// < 0
    Negative,
    /// Any number.
    Any,
}

impl Domain {
    /// True if `value` is inside, and of a size (below 1e9) with which no equation overflows.
    #[must_use]
    pub fn contains(self, value: f64) -> bool {
        value.abs() < 1e9
            && match self {
                Domain::Positive => value > 0.0,
                Domain::NonNegative => value >= 0.0,
                Domain::Negative => value < 0.0,
                Domain::Any => true,
            }
    }

    /// In words, for messages.
    #[must_use]
    pub fn expected(self) -> &'static str {
        match self {
            Domain::Positive => "a number above 0",
            Domain::NonNegative => "a number of at least 0",
            Domain::Negative => "a number below 0",
            Domain::Any => "a number",
        }
    }
}

macro_rules! symbol_table {
    ($($ident:ident, $paper:literal, $unit:literal, $bounds:expr, $domain:ident, $meaning:literal;)*) => {
        /// A calibration parameter; variants are spelled like the paper's symbols.
        #[allow(non_camel_case_types, reason = "identifiers follow the paper's symbols")]
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
        pub enum Symbol {
            $(#[doc = $meaning] $ident,)*
        }

        impl Symbol {
            /// All symbols, in table order.
            pub const ALL: &'static [Symbol] = &[$(Symbol::$ident),*];

            /// The identifier used in code, CSV, JSON and TOML.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Symbol::$ident => stringify!($ident)),* }
            }

            /// The symbol as printed in the paper.
            #[must_use]
            pub fn paper(self) -> &'static str {
                match self { $(Symbol::$ident => $paper),* }
            }

            /// SI unit, `-` if dimensionless.
            #[must_use]
            pub fn unit(self) -> &'static str {
                match self { $(Symbol::$ident => $unit),* }
            }

            /// What it means, in words.
            #[must_use]
            pub fn meaning(self) -> &'static str {
                match self { $(Symbol::$ident => $meaning),* }
            }

            /// Table 3.
            #[must_use]
            pub fn bounds(self) -> Bounds {
                match self { $(Symbol::$ident => $bounds),* }
            }

            /// Where the equations make sense.
            #[must_use]
            pub fn domain(self) -> Domain {
                match self { $(Symbol::$ident => Domain::$domain),* }
            }

            /// The symbol with this identifier.
            #[must_use]
            pub fn from_name(name: &str) -> Option<Symbol> {
                match name { $(stringify!($ident) => Some(Symbol::$ident),)* _ => None }
            }
        }

        /// One value per symbol; NaN where a variant has no such parameter, so that reading it cannot go unnoticed.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Parameters {
            $(#[doc = concat!($meaning, " \\[", $unit, "\\]")] pub $ident: f64,)*
        }

        impl Parameters {
            /// No parameter set.
            pub const NONE: Parameters = Parameters { $($ident: f64::NAN),* };

            /// The value of one symbol.
            #[must_use]
            pub fn get(&self, symbol: Symbol) -> f64 {
                match symbol { $(Symbol::$ident => self.$ident),* }
            }

            /// Sets the value of one symbol.
            pub fn set(&mut self, symbol: Symbol, value: f64) {
                match symbol { $(Symbol::$ident => self.$ident = value),* }
            }
        }
    };
}

// Bounds: paper, Table 3.
symbol_table! {
    delta,     "δ",      "-",     Bounds::Fixed(0.1, 10.0),   Positive,    "exponent factor of the IDM";
    k_s,       "k_s",    "1/s²",  Bounds::Fixed(0.01, 5.0),   Any,         "gain for the spacing error";
    k_v,       "k_v",    "1/s",   Bounds::Fixed(0.01, 5.0),   Any,         "gain for the speed difference";
    k_0,       "k_0",    "1/s",   Bounds::Fixed(0.01, 5.0),   Any,         "gain for the set-speed deviation";
    theta,     "θ",      "s",     Bounds::Fixed(0.0, 3.0),    NonNegative, "additional delay in Gipps' model";
    v_0,       "v_0",    "m/s",   Bounds::Fixed(30.0, 35.0),  Positive,    "desired speed (ACC set speed)";
    d_0,       "d_0",    "m",     Bounds::Fixed(1.0, 5.0),    Any,         "desired spacing at standstill";
    t_h,       "t_h",    "s",     Bounds::Fixed(0.1, 3.0),    Positive,    "headway, or Gipps' reaction time";
    a_max,     "a_max",  "m/s²",  Bounds::Fixed(0.5, 5.0),    Positive,    "maximum acceleration";
    a_min,     "a_min",  "m/s²",  Bounds::Fixed(-5.0, -0.5),  Negative,    "comfort deceleration";
    a_hat_min, "â_min",  "m/s²",  Bounds::Fixed(-5.0, -0.5),  Negative,    "assumed deceleration ahead";
    tau_p,     "τ_p",    "s",     Bounds::Fixed(0.1, 0.8),    NonNegative, "perception delay";
    tau_a,     "τ_a",    "s",     Bounds::Fixed(0.3, 0.8),    NonNegative, "actuation lag";
    m_load,    "m_load", "kg",    Bounds::Fixed(230.0, 300.0), NonNegative, "mass of the vehicle's load";
    f_0,       "f_0",    "N",     Bounds::PerVehicle,         Any,         "constant road load";
    f_1,       "f_1",    "kg/s",  Bounds::PerVehicle,         Any,         "road load linear in speed";
    f_2,       "f_2",    "kg/m",  Bounds::PerVehicle,         Any,         "road load quadratic in speed";
}
