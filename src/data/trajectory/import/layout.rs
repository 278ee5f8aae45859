//! The known file layouts, and how a file is recognised.

use super::header::{Field, split, stands_for};
use crate::text::spelling::{any_of, did_you_mean};
use std::str::FromStr;

/// The layout of a file of measured trajectories, by its name on the command line and in reports.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize, strum::Display, strum::IntoStaticStr)]
#[strum(const_into_str, serialize_all = "kebab-case")]
#[serde(rename_all = "kebab-case")]
pub enum Layout {
    /// Original OpenACC: five metadata lines, then `Time, Speed1, Lat1, ..., IVS1, ..., Driver1, ...` in any order and number.
    #[serde(rename = "openacc")]
    #[strum(serialize = "openacc")]
    OpenAcc,
    /// AstaZero platoons rebuilt in the style of OpenACC: `Time, Speed1.., IVS1..` only.
    AstazeroRebuilt,
    /// AstaZero platoons as processed by the paper's authors: `Time, X1.., SpeedDoppler1.., Accel1.., Spacing2..`.
    AstazeroProcessed,
    /// Ultra-AV and Open-PAV tables of pairs. Built from its documentation
    /// (Zhou et al. 2024, Scientific Data, Table 1: time in s, `Spatial_Gap` bumper to bumper,
    /// `Spatial_Headway` centre to centre), not tested on its files.
    UltraAv,
    /// One pair per file, our own: `time_s, lead_speed_mps, speed_mps, spacing_m` and optional columns.
    Pair,
    /// Any table, read by a column map; it has no name on the command line.
    Columns,
}

impl Layout {
    /// All layouts that leadlag recognises by the header.
    pub const ALL: [Layout; 5] =
        [Layout::OpenAcc, Layout::AstazeroRebuilt, Layout::AstazeroProcessed, Layout::UltraAv, Layout::Pair];

    /// Their names.
    #[must_use]
    pub fn names() -> [&'static str; 5] {
        Layout::ALL.map(|layout| layout.into_str())
    }

    /// Name of the time column.
    #[must_use]
    pub fn time_column(self) -> &'static str {
        match self {
            Layout::OpenAcc | Layout::AstazeroRebuilt | Layout::AstazeroProcessed => "Time",
            Layout::UltraAv => "Time_Index",
            Layout::Pair => "time_s",
            Layout::Columns => "time",
        }
    }
}

/// A name that is not the name of a layout.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("no layout {name}; expected {}{}", any_of(&Layout::names()), did_you_mean(name, Layout::names()))]
pub struct UnknownLayout {
    /// The name.
    pub name: String,
}

impl FromStr for Layout {
    type Err = UnknownLayout;

    fn from_str(name: &str) -> Result<Self, UnknownLayout> {
        let found = Layout::ALL.into_iter().find(|layout| layout.into_str() == name);
        found.ok_or_else(|| UnknownLayout { name: name.to_owned() })
    }
}

/// The layout of the first line of a file: the one most of whose columns it has, including misspelt names and synonyms.
/// Both OpenACC layouts begin alike; the header distinguishes them.
pub(super) fn detect(first_line: &str) -> Option<Layout> {
    let mut fields = Vec::new();
    split(first_line, &mut fields);
    if fields[0].text.eq_ignore_ascii_case("Date") {
        return Some(Layout::OpenAcc);
    }
    // A sample of columns is enough to distinguish the layouts.
    let typical: [(Layout, &[&str]); 4] = [
        (Layout::OpenAcc, &["Time", "Speed1", "Speed2", "IVS1"]),
        (Layout::AstazeroProcessed, &["Time", "SpeedDoppler1", "SpeedDoppler2", "Spacing2", "Accel1", "X1"]),
        (Layout::UltraAv, super::ultra_av::COLUMNS),
        (Layout::Pair, super::pair::COLUMNS),
    ];
    let score = |columns: &[&str]| {
        // All kinds of tables have a column called Time.
        let of = |field: &Field| match columns.contains(&field.text) && field.text != "Time" {
            true => 10,
            false => i32::from(columns.iter().any(|column| stands_for(field.text, column))),
        };
        fields.iter().map(of).sum::<i32>()
    };
    let scores = typical.map(|(layout, columns)| (score(columns), layout));
    scores
        .into_iter()
        // `max_by_key` keeps the last of equals: a table with unknown names is most easily turned into a pair file. One name with several
        // meanings does not decide the layout.
        .max_by_key(|&(score, _)| score)
        .filter(|&(score, _)| score > 1)
        .map(|(_, layout)| layout)
}
