//! Units of columns, and their factors to SI.

/// A measured quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Quantity {
    Time,
    Length,
    Speed,
    Acceleration,
    Ratio,
}

/// The conversion of a text to SI.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Form {
    /// A number, times this.
    Factor(f64),
    /// Days since some day, as in spreadsheets and MATLAB.
    Days,
    /// A date and a time of day: 2019-10-09T14:58:30.1Z.
    Iso,
    /// A time of day: 145830.1 or 14:58:30.1.
    Clock,
}

/// Times in other forms than a number with a unit.
const CLOCKS: [(&str, Form); 3] = [("iso", Form::Iso), ("hhmmss", Form::Clock), ("day", Form::Days)];

/// International foot, mile and nautical mile \[m\]; standard gravity \[m/s²\].
const FOOT: f64 = 0.3048;
const MILE: f64 = 1609.344;
const NAUTICAL_MILE: f64 = 1852.0;
const GRAVITY: f64 = 9.80665;

impl Quantity {
    /// The default unit.
    pub fn si(self) -> &'static str {
        self.units()[0].0
    }

    /// Its default unit as people write it behind a header; nothing if they write many.
    pub fn written(self) -> &'static [&'static str] {
        match self {
            Quantity::Time => &["s", "sec", "secs", "second", "seconds"],
            Quantity::Speed => &["m/s", "mps", "m/sec", "m s-1", "ms-1"],
            Quantity::Length => &["m", "meter", "meters", "metre", "metres"],
            Quantity::Acceleration | Quantity::Ratio => &[],
        }
    }

    /// Names of the units of this quantity with their size in SI; a frame has the size that the frame rate gives it.
    pub fn units(self) -> &'static [(&'static str, f64)] {
        match self {
            Quantity::Time => &[
                ("s", 1.0),
                ("ms", 1e-3),
                ("us", 1e-6),
                ("ns", 1e-9),
                ("min", 60.0),
                ("h", 3600.0),
                ("frame", f64::NAN),
            ],
            Quantity::Length => {
                &[("m", 1.0), ("km", 1e3), ("cm", 1e-2), ("mm", 1e-3), ("ft", FOOT), ("yd", 3.0 * FOOT), ("mi", MILE)]
            }
            Quantity::Speed => &[
                ("m/s", 1.0),
                ("km/h", 1e3 / 3600.0),
                ("ft/s", FOOT),
                ("mph", MILE / 3600.0),
                ("kn", NAUTICAL_MILE / 3600.0),
                ("cm/s", 1e-2),
            ],
            Quantity::Acceleration => &[("m/s2", 1.0), ("ft/s2", FOOT), ("g", GRAVITY), ("km/h/s", 1e3 / 3600.0)],
            Quantity::Ratio => &[("-", 1.0), ("%", 1e-2)],
        }
    }

    /// How a value in this unit is read.
    pub fn form(self, unit: &str) -> Option<Form> {
        if self == Quantity::Time
            && let Some((_, form)) = CLOCKS.iter().find(|(name, _)| *name == unit)
        {
            return Some(*form);
        }
        self.units().iter().find(|(name, _)| *name == unit).map(|(_, factor)| Form::Factor(*factor))
    }

    pub fn names(self) -> Vec<&'static str> {
        let clocks = if self == Quantity::Time { &CLOCKS[..] } else { &[] };
        self.units().iter().map(|(name, _)| *name).chain(clocks.iter().map(|(name, _)| *name)).collect()
    }
}
