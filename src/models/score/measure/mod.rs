//! The measures of a signal, one file each: name, formula, and the sums of a run that it needs.

use super::{Accumulation, Measured};

/// A measure of one signal: √(sum of squared terms / `count`) / `magnitude`.
#[derive(Debug)]
pub struct Measure {
    /// Its name; that of a goodness of fit continues with the signals: `rmse-sv`.
    pub name: &'static str,
    /// What follows each signal in a name: with `n`, `rmse-sn-vn`.
    pub mark: &'static str,
    /// The signals that a goodness of fit may add up.
    pub signals: &'static [&'static str],
    /// What it is, in words.
    pub meaning: &'static str,
    /// True if it has the unit of the signal.
    pub has_unit: bool,
    /// Terms to sum.
    pub sums: Accumulation,
    /// Number of terms.
    pub count: fn(&Measured) -> f64,
    /// Magnitude that normalises it; 1 for [`Accumulation::Theil`], which has its own.
    pub magnitude: fn(&Measured) -> f64,
    pub value: fn(&SignalMeasures) -> f64,
}

/// All sets of signals.
const ALL: &[&str] = &["s", "v", "a", "sv", "sa", "va", "sva"];

impl PartialEq for Measure {
    fn eq(&self, other: &Measure) -> bool {
        (self.name, self.mark) == (other.name, other.mark)
    }
}

impl Measure {
    /// The name of a goodness of fit of these signals.
    pub fn of(&self, signals: &str) -> String {
        let marked = |signal: char| format!("-{signal}{}", self.mark);
        match self.mark {
            "" => format!("{}-{signals}", self.name),
            _ => format!("{}{}", self.name, signals.chars().map(marked).collect::<String>()),
        }
    }
}

/// Makes the list of the measures, and the values of a signal, from the names of the files.
macro_rules! measures {
    ($($name:ident,)*) => {
        $(mod $name;)*

        pub const MEASURES: &[&Measure] = &[$(&$name::MEASURE),*];

        /// The measures of one signal; those without a unit are relative.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub struct SignalMeasures {
            $(
                #[doc = concat!("As `score/measure/", stringify!($name), ".rs` defines it.")]
                pub $name: f64,
            )*
        }

        impl SignalMeasures {
            pub(super) fn by(of: impl Fn(&Measure) -> f64) -> SignalMeasures {
                SignalMeasures { $($name: of(&$name::MEASURE)),* }
            }
        }
    };
}

measures! {
    rmse,
    rmspe,
    nrmse,
    u,
    rmse_n,
}

/// The measure that the paper minimises.
pub(super) const NRMSE: &Measure = &nrmse::MEASURE;
