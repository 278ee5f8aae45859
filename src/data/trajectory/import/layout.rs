//! The known file layouts, and how a file is recognised.

use super::columns::ColumnMap;
use super::header::{Field, split, stands_for};
use crate::text::spelling::{any_of, did_you_mean};
use std::str::FromStr;
use std::sync::LazyLock;

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

    pub fn names() -> [&'static str; 5] {
        Layout::ALL.map(|layout| layout.into_str())
    }

    /// The meaning of its columns; `None` for a layout that needs a map of its own.
    pub(super) fn map(self) -> Option<&'static ColumnMap> {
        let like = if self == Layout::AstazeroRebuilt { Layout::OpenAcc } else { self };
        MAPS.iter().find(|known| known.layout == like).map(|known| &known.map)
    }

    /// Name of the time column.
    pub fn time_column(self) -> &'static str {
        self.map().and_then(|map| map.time_column()).unwrap_or("time")
    }
}

/// A layout that a header is recognised by.
struct Known {
    layout: Layout,
    map: ColumnMap,
    /// Names of its columns that distinguish it from others.
    typical: Vec<String>,
}

/// The maps of the layouts. Of layouts with as many columns of a header the last one counts: a table with unknown names is most easily turned
/// into a pair file.
static MAPS: LazyLock<[Known; 4]> = LazyLock::new(|| {
    let texts = [
        (Layout::OpenAcc, include_str!("columns/maps/openacc.toml")),
        (Layout::AstazeroProcessed, include_str!("columns/maps/astazero-processed.toml")),
        (Layout::UltraAv, include_str!("columns/maps/ultra-av.toml")),
        (Layout::Pair, include_str!("columns/maps/pair.toml")),
    ];
    texts.map(|(layout, text)| {
        let map = ColumnMap::parse(text, layout.into_str()).expect("tests read a file of each layout");
        Known { layout, typical: map.typical(), map }
    })
});

/// The number of columns of a line that belong to a layout.
pub(super) fn named(line: &str) -> usize {
    let mut fields = Vec::new();
    split(line, &mut fields);
    let is_known = |field: &&Field| MAPS.iter().flat_map(|known| &known.typical).any(|name| name == field.text);
    fields.iter().filter(is_known).count()
}

/// A name that is not the name of a layout.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("no layout {name}; expected {}{}", any_of(&Layout::names()), did_you_mean(name, Layout::names()))]
pub struct UnknownLayout {
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
    let score = |columns: &[String]| {
        // All kinds of tables have a column called Time.
        let of = |field: &Field| match columns.iter().any(|name| name == field.text) && field.text != "Time" {
            true => 10,
            false => i32::from(columns.iter().any(|column| stands_for(field.text, column))),
        };
        fields.iter().map(of).sum::<i32>()
    };
    let scores = MAPS.iter().map(|known| (score(&known.typical), known.layout));
    // One name with several meanings does not decide the layout.
    scores.max_by_key(|&(score, _)| score).filter(|&(score, _)| score > 1).map(|(_, layout)| layout)
}
