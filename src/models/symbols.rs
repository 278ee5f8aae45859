//! The symbol table: every calibration parameter of the paper's Tables 1 and 3, once.
//!
//! The table generates [`Symbol`] (the name) and [`Parameters`] (one named value per symbol), so that a new parameter needs only a new row
//! here. Extensions add their own rows.

/// Largest number of parameters of the extensions of one model.
pub const EXTENSION_PARAMETERS: usize = 24;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtensionValues([Option<(&'static ExtensionParameter, f64)>; EXTENSION_PARAMETERS]);

impl ExtensionValues {
    /// None set.
    const NONE: ExtensionValues = ExtensionValues([None; EXTENSION_PARAMETERS]);

    fn get(&self, row: &ExtensionParameter) -> f64 {
        let mut set = self.0.iter().map_while(|value| *value);
        set.find(|(known, _)| *known == row).map_or(f64::NAN, |(_, value)| value)
    }

    fn set(&mut self, row: &'static ExtensionParameter, value: f64) {
        let free = |slot: &&mut Option<(&ExtensionParameter, f64)>| slot.is_none_or(|(known, _)| known == row);
        let slot = self.0.iter_mut().find(free);
        *slot.expect("a model with more parameters of extensions is refused") = Some((row, value));
    }
}

/// A parameter of an extension: a row of the symbol table from a WGSL file.
#[derive(Debug, Clone)]
pub struct ExtensionParameter {
    /// The extension it belongs to.
    pub extension: String,
    /// Its identifier in code, CSV, JSON and TOML.
    pub name: String,
    /// SI unit, `-` if dimensionless.
    pub unit: String,
    /// Its meaning, in words.
    pub meaning: String,
    /// Smallest value in a calibration.
    pub lower: f64,
    /// Largest value in a calibration.
    pub upper: f64,
    /// The neutral value, or the one of least effect within the bounds; NaN for a parameter that is a time and not a
    /// size.
    pub neutral: f64,
    /// Use of the parameter by the program itself.
    pub role: Role,
    /// How a diagnosis looks for the cause that it belongs to.
    pub search: SearchKind,
    /// The scale of the search in its range, unless it is a time.
    pub scale: Scale,
}

/// How a diagnosis searches for a cause, by its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, strum::EnumString, strum::IntoStaticStr, strum::VariantNames)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum SearchKind {
    /// Sizes: derivatives lead from one to the next.
    #[default]
    Size,
    /// One size at which a signal is cut off; neutral at its upper bound.
    Limit,
    /// One step size of a discrete effect, for which no derivative helps.
    Steps,
    /// From a time on.
    Event,
    /// From a time on, for a length of time.
    Stretch,
    /// With a frequency.
    Harmonic,
    /// One gain on a sum over time, which moves the equilibrium.
    Integral,
}

/// How a range is searched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, strum::EnumString, strum::IntoStaticStr, strum::VariantNames)]
#[strum(const_into_str, serialize_all = "snake_case")]
pub enum Scale {
    /// In equal differences.
    #[default]
    Linear,
    /// In equal ratios.
    Ratio,
}

/// Use of an extension's parameter by the program itself, besides passing it on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Role {
    /// Nothing.
    #[default]
    Value,
    /// The time loop delays all perception by it.
    Delay,
    /// The duration of an event, so the length of the data bounds it.
    Length,
}

impl ExtensionParameter {
    /// True for the parameters of events: when they happen, and for how long.
    pub(crate) fn is_time(&self) -> bool {
        // Bounds of about a day, because the length of a file is not known beforehand.
        self.unit == "s" && !self.neutral.is_finite() && self.upper >= 1e4
    }

    pub(crate) fn domain(&self) -> Domain {
        match self.role {
            Role::Delay => Domain::NonNegative,
            _ if self.is_time() => Domain::Time,
            _ => Domain::Any,
        }
    }
}

/// The same extension's parameter of the same name; a neutral value that is NaN would not be equal to itself.
impl PartialEq for ExtensionParameter {
    fn eq(&self, other: &Self) -> bool {
        self.extension == other.extension && self.name == other.name
    }
}

/// Bounds of a parameter in a calibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bounds {
    /// Lower and upper bound of Table 3.
    Fixed(f64, f64),
    /// Table 3 gives one pair per vehicle (road loads).
    PerVehicle,
}

/// Values for which the equations are defined, whatever the bounds of a calibration.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Domain {
    /// > 0
    Positive,
    /// >= 0
    NonNegative,
    /// < 0
    Negative,
    /// A time of the file \[s\]; clocks that count from 1970 are among them.
    Time,
    /// Any number.
    Any,
}

impl Domain {
    /// The size below which no equation overflows, in the parameter's unit.
    pub fn most(self) -> f64 {
        if self == Domain::Time { 1e12 } else { 1e9 }
    }

    /// True if `value` is inside, and of a size with which no equation overflows.
    pub fn contains(self, value: f64) -> bool {
        value.abs() < self.most()
            && match self {
                Domain::Positive => value > 0.0,
                Domain::NonNegative => value >= 0.0,
                Domain::Negative => value < 0.0,
                Domain::Time | Domain::Any => true,
            }
    }

    /// In words, for messages.
    pub fn expected(self) -> String {
        let limit = self.most();
        match self {
            Domain::Positive => format!("a number above 0 and below {limit:e}"),
            Domain::NonNegative => format!("a number of at least 0 and below {limit:e}"),
            Domain::Negative => format!("a number below 0 and above -{limit:e}"),
            Domain::Time => format!("a time in s between -{limit:e} and {limit:e}"),
            Domain::Any => format!("a number between -{limit:e} and {limit:e}"),
        }
    }
}

macro_rules! symbol_table {
    ($($ident:ident, $paper:literal, $unit:literal, $bounds:expr, $domain:ident, $meaning:literal;)*) => {
        /// A calibration parameter; variants are spelled like the paper's symbols.
        #[allow(non_camel_case_types, reason = "identifiers follow the paper's symbols")]
        #[derive(Debug, Clone, Copy)]
        pub enum Symbol {
            $(#[doc = $meaning] $ident,)*
            Extension(&'static ExtensionParameter),
        }

        impl Symbol {
            /// All symbols of the table, in table order; those of extensions are not among them.
            pub const ALL: &'static [Symbol] = &[$(Symbol::$ident),*];

            /// Place in the table; parameters of extensions come after it.
            fn place(self) -> usize {
                #[allow(non_camel_case_types, reason = "identifiers follow the paper's symbols")]
                enum Place { $($ident,)* Extension }
                match self {
                    $(Symbol::$ident => Place::$ident as usize,)*
                    Symbol::Extension(_) => Place::Extension as usize,
                }
            }

            /// The identifier used in code, CSV, JSON and TOML.
            pub fn name(self) -> &'static str {
                match self { $(Symbol::$ident => stringify!($ident),)* Symbol::Extension(row) => &row.name }
            }

            /// The symbol as printed in the paper.
            pub fn paper(self) -> &'static str {
                match self { $(Symbol::$ident => $paper,)* Symbol::Extension(row) => &row.name }
            }

            /// SI unit, `-` if dimensionless.
            pub fn unit(self) -> &'static str {
                match self { $(Symbol::$ident => $unit,)* Symbol::Extension(row) => &row.unit }
            }

            /// Its column in a table: the name with its unit, if any, such as `v_0_mps`.
            pub fn column(self) -> String {
                let unit = self.unit().replace('²', "2");
                let unit = match unit.as_str() {
                    "-" | "" => return self.name().to_owned(),
                    "m/s" => "mps".to_owned(),
                    "m/s2" => "mps2".to_owned(),
                    // 1/s becomes per_s, kg/m becomes kg_per_m; extensions may have units of any kind.
                    other => other.replace('/', "_per_").trim_start_matches("1_").replace(|c: char| !c.is_alphanumeric(), "_"),
                };
                format!("{}_{unit}", self.name())
            }

            /// Its meaning, in words.
            pub fn meaning(self) -> &'static str {
                match self { $(Symbol::$ident => $meaning,)* Symbol::Extension(row) => &row.meaning }
            }

            /// Table 3, or the extension's own bounds.
            pub fn bounds(self) -> Bounds {
                match self {
                    $(Symbol::$ident => $bounds,)*
                    Symbol::Extension(row) => Bounds::Fixed(row.lower, row.upper),
                }
            }

            /// The values for which the equations are defined.
            pub fn domain(self) -> Domain {
                match self { $(Symbol::$ident => Domain::$domain,)* Symbol::Extension(row) => row.domain() }
            }

            /// The symbol of the table with this identifier.
            pub fn from_name(name: &str) -> Option<Symbol> {
                match name { $(stringify!($ident) => Some(Symbol::$ident),)* _ => None }
            }
        }

        /// One value per symbol; NaN if a variant has no such parameter, so that reading it does not go unnoticed.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct Parameters {
            $(#[doc = concat!($meaning, " \\[", $unit, "\\]")] pub $ident: f64,)*
            /// Values of the parameters of extensions; see [`Parameters::get`].
            pub extensions: ExtensionValues,
        }

        impl Parameters {
            /// No parameter set.
            pub const NONE: Parameters = Parameters { $($ident: f64::NAN,)* extensions: ExtensionValues::NONE };

            /// The value of one symbol.
            pub fn get(&self, symbol: Symbol) -> f64 {
                match symbol {
                    $(Symbol::$ident => self.$ident,)*
                    Symbol::Extension(row) => self.extensions.get(row),
                }
            }

            /// Sets the value of one symbol. Panics with more than [`EXTENSION_PARAMETERS`] parameters of extensions; such a model is refused before.
            pub fn set(&mut self, symbol: Symbol, value: f64) {
                match symbol {
                    $(Symbol::$ident => self.$ident = value,)*
                    Symbol::Extension(row) => self.extensions.set(row, value),
                }
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

impl Symbol {
    /// The neutral value of a parameter of an extension; `None` for those of the table, and for parameters that are
    /// times and not sizes.
    pub fn neutral(self) -> Option<f64> {
        match self {
            Symbol::Extension(row) if row.neutral.is_finite() => Some(row.neutral),
            _ => None,
        }
    }

    /// True for the parameters of events of an extension: when they happen, and for how long.
    pub fn is_time(self) -> bool {
        matches!(self, Symbol::Extension(row) if row.is_time())
    }

    /// True for the parameter of an extension by which everything is perceived later.
    pub fn is_delay(self) -> bool {
        matches!(self, Symbol::Extension(row) if row.role == Role::Delay)
    }

    /// True for the durations of events.
    pub fn is_length_of_time(self) -> bool {
        matches!(self, Symbol::Extension(row) if row.is_time() && row.role == Role::Length)
    }

    /// Bounds of the start of an event in data from `first` to `last` \[s\]: the data within the event's own bounds. All of the data if
    /// none of them is within, or if their clock begins below 0, because the event's own bounds assume clocks that count from 0.
    pub fn begins_within(self, [first, last]: [f64; 2]) -> [f64; 2] {
        match self.bounds() {
            Bounds::Fixed(lower, upper) if first >= 0.0 && first.max(lower) <= last.min(upper) => {
                [first.max(lower), last.min(upper)]
            }
            _ => [first, last],
        }
    }

    fn key(self) -> (usize, &'static str, &'static str) {
        match self {
            Symbol::Extension(row) => (self.place(), &row.extension, &row.name),
            _ => (self.place(), "", ""),
        }
    }
}

impl PartialEq for Symbol {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Symbol::Extension(one), Symbol::Extension(other)) => std::ptr::eq(*one, *other) || one == other,
            _ => self.place() == other.place(),
        }
    }
}

impl Eq for Symbol {}

impl std::hash::Hash for Symbol {
    fn hash<H: std::hash::Hasher>(&self, state: &mut H) {
        self.key().hash(state);
    }
}

impl PartialOrd for Symbol {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

/// The order of the table, then by extension and name.
impl Ord for Symbol {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.key().cmp(&other.key())
    }
}
