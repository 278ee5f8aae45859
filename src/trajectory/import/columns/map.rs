//! The text of a column map: TOML, checked with the line of each mistake.

use super::error::MapError;
use super::role::Role;
use super::unit::Quantity;
use crate::trajectory::import::header::nearest;
use serde::Deserialize;
use std::collections::BTreeMap;
use toml::Spanned;

/// What a row of the table is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Rows {
    /// One vehicle at one time.
    Vehicles,
    /// One time of a follower and the vehicle ahead of it.
    Pairs,
}

impl Rows {
    pub fn name(self) -> &'static str {
        match self {
            Rows::Vehicles => "vehicles",
            Rows::Pairs => "pairs",
        }
    }
}

/// What lies between two fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Separator {
    Comma,
    Semicolon,
    Tab,
    /// Any number of blanks and tabs.
    Whitespace,
}

/// What stands before the fraction of a number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Decimal {
    Point,
    Comma,
}

/// Towards which end of the positions a vehicle drives.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Direction {
    Increasing,
    Decreasing,
    /// A vehicle with negative speeds drives towards lower positions.
    BySpeed,
    /// Speeds have no sign; a vehicle whose last position is the lower one drives towards lower positions.
    ByPosition,
}

/// Which point of a vehicle its position means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum PositionAt {
    Front,
    Centre,
    Rear,
    /// The end with the lower position, whichever way the vehicle drives (the corner of a bounding box).
    LowEnd,
}

/// One mapped column.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    pub role: Role,
    /// The column bears one of these names.
    pub names: Vec<String>,
    pub unit: String,
    /// From the file to SI.
    pub factor: f64,
    /// A file may lack it.
    pub optional: bool,
}

/// Which columns of a table mean what, in which unit.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnMap {
    /// Name of a shipped map, or the path of a file.
    pub name: String,
    /// What it is for, in words.
    pub title: String,
    pub(super) rows: Rows,
    pub(super) separator: Separator,
    pub(super) decimal: Decimal,
    pub(super) header: Option<Vec<String>>,
    pub(super) nobody: Vec<String>,
    pub(super) direction: Direction,
    pub(super) position_at: PositionAt,
    pub(super) check_units: bool,
    pub(super) columns: Vec<Column>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    #[serde(default)]
    title: String,
    rows: Rows,
    #[serde(default = "comma")]
    separator: Separator,
    #[serde(default = "point")]
    decimal: Decimal,
    header: Option<Vec<String>>,
    #[serde(default)]
    nobody: Vec<String>,
    #[serde(default = "increasing")]
    direction: Direction,
    #[serde(default = "front")]
    position_at: PositionAt,
    frame_rate_hz: Option<f64>,
    #[serde(default = "yes")]
    check_units: bool,
    columns: BTreeMap<Spanned<String>, Spanned<Entry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    name: Names,
    unit: Option<String>,
    #[serde(default)]
    optional: bool,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected a name, or a list of names of which a file has one")]
enum Names {
    One(String),
    Several(Vec<String>),
}

fn comma() -> Separator {
    Separator::Comma
}

fn point() -> Decimal {
    Decimal::Point
}

fn increasing() -> Direction {
    Direction::Increasing
}

fn front() -> PositionAt {
    PositionAt::Front
}

fn yes() -> bool {
    true
}

impl ColumnMap {
    /// Reads the text of a map; `name` stands for the file in messages.
    ///
    /// # Errors
    /// [`MapError`] with the line, what was expected and what was found.
    pub fn parse(text: &str, name: &str) -> Result<ColumnMap, MapError> {
        let path = || name.to_owned();
        let parsed: Text = toml::from_str(text).map_err(|error| {
            let start = error.span().map_or(0, |span| span.start);
            let before = &text[..start.min(text.len())];
            let line = before.matches('\n').count() + 1;
            let column = before.rsplit('\n').next().unwrap_or_default().chars().count() + 1;
            MapError::Text { path: path(), line, column, message: error.message().replace('\n', "; ") }
        })?;
        let frame_s = match parsed.frame_rate_hz {
            Some(rate) if !(0.2..=1000.0).contains(&rate) => return Err(MapError::Rate { path: path(), found: rate }),
            rate => rate.map(|rate| 1.0 / rate),
        };
        let mut columns = Vec::new();
        for (key, entry) in &parsed.columns {
            let line = text[..key.span().start].matches('\n').count() + 1;
            columns.push(column(key.as_ref(), entry.as_ref(), parsed.rows, frame_s, name, line)?);
        }
        // In the order of the roles, whatever the order of the file: it is that of the numbers of a row.
        columns.sort_by_key(|column: &Column| Role::ALL.iter().position(|role| *role == column.role));
        let map = ColumnMap {
            name: path(),
            title: parsed.title,
            rows: parsed.rows,
            separator: parsed.separator,
            decimal: parsed.decimal,
            header: parsed.header,
            nobody: parsed.nobody,
            direction: parsed.direction,
            position_at: parsed.position_at,
            check_units: parsed.check_units,
            columns,
        };
        map.complete()?;
        Ok(map)
    }

    /// Names of its columns, for lists.
    #[must_use]
    pub fn column_names(&self) -> Vec<&str> {
        self.columns.iter().filter_map(|column| column.names.first().map(String::as_str)).collect()
    }

    pub(super) fn column(&self, role: Role) -> Option<&Column> {
        self.columns.iter().find(|column| column.role == role)
    }

    fn complete(&self) -> Result<(), MapError> {
        if (self.separator, self.decimal) == (Separator::Comma, Decimal::Comma) {
            return Err(MapError::TwoCommas { path: self.name.clone() });
        }
        let has = |role: Role| self.column(role).is_some();
        let missing = |needed, why| {
            let found = self.columns.iter().map(|column| column.role.name()).collect();
            Err(MapError::Missing { path: self.name.clone(), needed, found, why })
        };
        if !has(Role::Time) {
            return missing("time", "without it there is no order");
        }
        if !has(Role::Speed) {
            return missing("speed", "speeds are not derived from positions");
        }
        match self.rows {
            Rows::Vehicles if !has(Role::Id) => missing("id", "every row must say whose it is"),
            Rows::Vehicles if !has(Role::Ahead) => missing("ahead", "every row must say whom the vehicle follows"),
            Rows::Vehicles if has(Role::Gap) => Ok(()),
            Rows::Vehicles if (has(Role::Headway) || has(Role::Position)) && has(Role::Length) => Ok(()),
            Rows::Vehicles => missing(
                "gap, or length with headway or position",
                "the bumper-to-bumper gap must follow from something",
            ),
            Rows::Pairs if !has(Role::LeadSpeed) => missing("lead_speed", "the vehicle ahead is what is followed"),
            Rows::Pairs if has(Role::Gap) => Ok(()),
            Rows::Pairs if has(Role::Headway) && has(Role::LeadLength) => Ok(()),
            Rows::Pairs if has(Role::Position) && has(Role::LeadPosition) && has(Role::LeadLength) => Ok(()),
            Rows::Pairs => missing(
                "gap, or lead_length with headway or both positions",
                "the bumper-to-bumper gap must follow from something",
            ),
        }
    }
}

fn column(
    key: &str,
    entry: &Entry,
    rows: Rows,
    frame_s: Option<f64>,
    name: &str,
    line: usize,
) -> Result<Column, MapError> {
    let path = || name.to_owned();
    let allowed = |role: &Role| if rows == Rows::Vehicles { role.in_vehicles() } else { role.in_pairs() };
    let known = || Role::ALL.iter().filter(|role| allowed(role)).map(|role| role.name()).collect::<Vec<_>>();
    let Some(role) = Role::ALL.into_iter().find(|role| role.name() == key) else {
        let near = nearest(key, known().into_iter()).map(str::to_owned);
        return Err(MapError::Role { path: path(), line, found: key.to_owned(), known: known(), near });
    };
    let role_name = role.name();
    if !allowed(&role) {
        return Err(MapError::Misplaced { path: path(), line, role: role_name, rows: rows.name(), known: known() });
    }
    let names = match &entry.name {
        Names::One(name) => vec![name.trim().to_owned()],
        Names::Several(names) => names.iter().map(|name| name.trim().to_owned()).collect(),
    };
    if names.is_empty() || names.iter().any(String::is_empty) {
        return Err(MapError::NoName { path: path(), line, role: role_name });
    }
    let (unit, factor) = match (role.quantity(), &entry.unit) {
        (None, None) => (String::new(), 1.0),
        (None, Some(found)) => {
            return Err(MapError::UnitOfName { path: path(), line, role: role_name, found: found.clone() });
        }
        (Some(quantity), unit) => {
            let unit = unit.as_deref().unwrap_or(quantity.si());
            let Some(factor) = quantity.factor(unit) else {
                let known = quantity.units().iter().map(|(name, _)| *name).collect();
                return Err(MapError::Unit { path: path(), line, role: role_name, found: unit.to_owned(), known });
            };
            let is_frame = quantity == Quantity::Time && factor.is_nan();
            let factor = if is_frame { frame_s.ok_or_else(|| MapError::NoRate { path: path() })? } else { factor };
            (unit.to_owned(), factor)
        }
    };
    Ok(Column { role, names, unit, factor, optional: entry.optional })
}
