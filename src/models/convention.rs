//! Differences between the paper and its authors' program: one switch per difference, two presets.

use crate::text::spelling::did_you_mean;
use std::fmt;
use std::str::FromStr;

macro_rules! rows {
    ($($row:ident: $type:ident, $meaning:literal {
        $paper:ident, $paper_doc:literal;
        $authors:ident, $authors_doc:literal;
    })*) => {
        $(
            #[doc = concat!("Row `", stringify!($row), "`: ", $meaning, ".")]
            #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, strum::EnumString, strum::IntoStaticStr)]
            #[strum(const_into_str, serialize_all = "snake_case")]
            pub enum $type {
                #[doc = concat!("paper: ", $paper_doc, ".")]
                $paper,
                #[doc = concat!("authors: ", $authors_doc, ".")]
                $authors,
            }
        )*

        /// One choice per row; `docs/MODELS.md` gives the reasons.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub struct Convention {
            $(#[doc = $meaning] pub $row: $type,)*
        }

        impl Convention {
            /// The paper's equations in SI units, the default.
            pub const PAPER: Convention = Convention { $($row: $type::$paper),* };
            /// The authors' program.
            pub const AUTHORS: Convention = Convention { $($row: $type::$authors),* };

            /// Every row: name, meaning, and name and meaning of its values in `paper` and in `authors`.
            pub const ROWS: &'static [Row] = &[$(Row {
                name: stringify!($row),
                meaning: $meaning,
                paper: ($type::$paper.into_str(), $paper_doc),
                authors: ($type::$authors.into_str(), $authors_doc),
            }),*];

            fn set(&mut self, row: &str, value: &str) -> Result<(), ConventionError> {
                match row {
                    $(stringify!($row) => self.$row = value.parse().map_err(|_| ConventionError::Value {
                        row: stringify!($row),
                        found: value.to_owned(),
                        paper: $type::$paper.into_str(),
                        authors: $type::$authors.into_str(),
                    })?,)*
                    _ => return Err(ConventionError::Row { found: row.to_owned() }),
                }
                Ok(())
            }

            fn departures(&self, from: &Convention) -> Vec<String> {
                let mut list = Vec::new();
                $(if self.$row != from.$row {
                    list.push(format!("{}={}", stringify!($row), self.$row.into_str()));
                })*
                list
            }
        }
    };
}

rows! {
    acceleration: Acceleration, "differences that give the measured acceleration" {
        Backward, "backward difference, as Eq. 1 pairs a(t) with v(t) - v(t - dt)";
        Forward, "forward difference, one sample early against the simulated one";
    }
    delay: Delay, "perception delay on the sampled signals, and the scored window" {
        Fractional, "linear interpolation; scored from sample ceil(upper bound / dt) + 1 for every candidate";
        Floor, "D = floor(tau_p / dt) whole samples; scored from sample D + 1";
    }
    road_load: RoadLoad, "unit of the bounds of f_1 and f_2" {
        Si, "Table 3 times 3.6 and 12.96: coefficients for a speed in m/s";
        Printed, "the printed numbers, made for km/h, yet multiplied by a speed in m/s";
    }
    mfc: MfcLookup, "look-up in the MFC curves" {
        Linear, "linear interpolation";
        Bisection, "the last node that a bisection visits, often the segment above the speed";
    }
    bounds: BoundRule, "a candidate that touches an acceleration bound" {
        Clip, "is clipped and counted";
        Reject, "is clipped and counted, and rejected in a calibration";
    }
    radicand: Radicand, "start of a Gipps run whose radicand is negative at the measured state" {
        Measured, "start as measured";
        Shifted, "start further back, where the radicand is zero";
    }
    grade: GradeLookup, "ends of the grade table" {
        Linear, "linear interpolation everywhere";
        Held, "constant in the first cell and beyond the last but one node";
    }
    step: Step, "the time step" {
        Nominal, "the nominal step of the file, such as 0.1 s";
        Raw, "difference of the first two times in floating point, so that tau_p = k/10 gives D = k - 1";
    }
    denominators: Denominators, "standstill in relative errors" {
        Plain, "samples measured below 0.001 (in SI units) are left out of RMSPE";
        Floored, "a measured speed below 0.001 m/s counts as 0.001 m/s";
    }
}

/// One documented row of the convention table.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    /// Name of the switch.
    pub name: &'static str,
    pub meaning: &'static str,
    /// Value and meaning in the `paper` preset.
    pub paper: (&'static str, &'static str),
    /// Value and meaning in the `authors` preset.
    pub authors: (&'static str, &'static str),
}

/// A convention that cannot be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ConventionError {
    #[error(
        "convention `{found}`: expected `paper` or `authors`, then any number of ROW=VALUE, separated by commas{}",
        did_you_mean(found, ["paper", "authors"])
    )]
    Preset { found: String },
    #[error("convention row `{found}`: expected one of {}{}", row_names(), near_row(found))]
    Row { found: String },
    #[error("convention row `{found}`: expected once, found more than once; remove the others")]
    Twice { found: String },
    #[error("convention row `{row}`: expected `{paper}` or `{authors}`, found `{found}`")]
    Value { row: &'static str, found: String, paper: &'static str, authors: &'static str },
}

/// The nearest known row.
fn near_row(found: &str) -> String {
    did_you_mean(found, Convention::ROWS.iter().map(|row| row.name))
}

fn row_names() -> String {
    Convention::ROWS.iter().map(|r| r.name).collect::<Vec<_>>().join(", ")
}

impl Default for Convention {
    fn default() -> Self {
        Convention::PAPER
    }
}

impl FromStr for Convention {
    type Err = ConventionError;

    /// `paper`, `authors`, or a preset with departures: `authors,road_load=si`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let mut words = text.split(',').map(str::trim);
        let mut convention = match words.next() {
            Some("paper") => Convention::PAPER,
            Some("authors") => Convention::AUTHORS,
            other => return Err(ConventionError::Preset { found: other.unwrap_or_default().to_owned() }),
        };
        let mut chosen: Vec<&str> = Vec::new();
        for word in words {
            let (row, value) = word.split_once('=').map_or((word, ""), |(row, value)| (row.trim(), value.trim()));
            convention.set(row, value)?;
            if chosen.contains(&row) {
                return Err(ConventionError::Twice { found: row.to_owned() });
            }
            chosen.push(row);
        }
        Ok(convention)
    }
}

impl fmt::Display for Convention {
    /// The shorter description: the preset from which fewer rows depart.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let from_paper = self.departures(&Convention::PAPER);
        let from_authors = self.departures(&Convention::AUTHORS);
        let (preset, departures) =
            if from_authors.len() < from_paper.len() { ("authors", from_authors) } else { ("paper", from_paper) };
        f.write_str(preset)?;
        departures.iter().try_for_each(|d| write!(f, ",{d}"))
    }
}

impl serde::Serialize for Convention {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}
