//! The text of a column map: TOML, checked with the line of each mistake.

use super::error::MapError;
use super::role::Role;
use super::text::{Decimal, Direction, Entry, Fixed, Headerless, Named, Names, PositionAt, Rows, Separator, Text};
use super::unit::Form;
use crate::trajectory::Preparation;
use crate::trajectory::grade::LAPS_M;
use crate::trajectory::import::header::nearest;
use strum::VariantArray;

/// One mapped column.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Column {
    pub role: Role,
    /// The column has one of these names.
    pub names: Vec<String>,
    pub unit: String,
    pub form: Form,
    /// A file may lack it.
    pub optional: bool,
    /// Remedy if it is missing.
    pub hint: String,
}

/// The meaning and unit of the columns of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct ColumnMap {
    /// Name of a built-in map, or the path of a file.
    pub name: String,
    /// Title, in words.
    pub title: String,
    pub(super) rows: Rows,
    pub(super) separator: Separator,
    pub(super) decimal: Decimal,
    pub(super) header: Option<Vec<String>>,
    pub(super) headerless: Option<Headerless>,
    /// Lines before the header.
    pub(super) skip_lines: u64,
    /// True if the line behind the header holds units.
    pub(super) units_row: bool,
    /// Words for missing values, besides the built-in ones.
    pub(super) missing: Vec<String>,
    /// Length of every vehicle without a column for it \[m\].
    pub(super) length: Option<f64>,
    /// Length of the vehicle ahead in a table of pairs \[m\].
    pub(super) lead_length: Option<f64>,
    /// Length of the vehicle ahead \[m\], instead of any column.
    pub(super) lead_override: Option<f64>,
    /// Positions restart after this distance \[m\].
    pub(super) lap_length: Option<f64>,
    pub(super) nobody: Vec<String>,
    pub(super) direction: Direction,
    pub(super) position_at: PositionAt,
    pub(super) check_units: bool,
    /// In the order of the file.
    pub(super) columns: Vec<Column>,
    /// Of a layout that is recognised by its header.
    pub(super) layout: Option<Fixed>,
}

impl ColumnMap {
    /// Reads the text of a map; `name` stands for the file in messages.
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
        let (mut length, mut lead_length) = (parsed.length, parsed.lead_length);
        for (key, entry) in &parsed.columns {
            let line = text[..key.span().start].matches('\n').count() + 1;
            let context = Context { rows: parsed.rows, frame_s, name, line };
            match entry.as_ref() {
                Entry::Column(named) => columns.push((key.span().start, column(key.as_ref(), named, &context)?)),
                Entry::Constant(value) => match role(key.as_ref(), &context)? {
                    Role::Length => length = Some(*value),
                    Role::LeadLength => lead_length = Some(*value),
                    other => return Err(MapError::Constant { path: path(), line, role: other.into_str() }),
                },
            }
        }
        let [lowest, highest] = Preparation::LEAD_LENGTH_M;
        for (key, value) in [("length", length), ("lead_length", lead_length)] {
            if let Some(found) = value.filter(|value| !(lowest..=highest).contains(value)) {
                return Err(MapError::Length { path: path(), key, found, lowest, highest });
            }
        }
        if let Some(found) = parsed.lap_length.filter(|lap| !LAPS_M.contains(lap)) {
            return Err(MapError::Lap { path: path(), found });
        }
        columns.sort_by_key(|(start, _)| *start);
        let map = ColumnMap {
            name: path(),
            title: parsed.title,
            rows: parsed.rows,
            separator: parsed.separator,
            decimal: parsed.decimal,
            header: parsed.header,
            headerless: parsed.headerless,
            skip_lines: parsed.skip_lines,
            units_row: parsed.units_row,
            missing: parsed.missing,
            length,
            lead_length,
            lead_override: None,
            lap_length: parsed.lap_length,
            nobody: parsed.nobody.iter().map(|name| whole(name).to_owned()).collect(),
            direction: parsed.direction,
            position_at: parsed.position_at,
            check_units: parsed.check_units,
            columns: columns.into_iter().map(|(_, column)| column).collect(),
            layout: parsed.layout,
        };
        map.complete()?;
        Ok(map)
    }

    /// Names of its columns, for lists.
    pub fn column_names(&self) -> Vec<&str> {
        self.columns.iter().filter_map(|column| column.names.first().map(String::as_str)).collect()
    }

    /// The first name of its column of times.
    pub(in crate::trajectory::import) fn time_column(&self) -> Option<&str> {
        self.column(Role::Time)?.names.first().map(String::as_str)
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
            let found = self.columns.iter().map(|column| column.role.into_str()).collect();
            Err(MapError::Missing { path: self.name.clone(), needed, found, why })
        };
        if !has(Role::Time) {
            return missing("time", "without it there is no order");
        }
        if !has(Role::Speed) {
            return missing("speed", "speeds are not derived from positions");
        }
        if let Some((role, found)) = self.shared().filter(|_| self.rows == Rows::Platoon) {
            return Err(MapError::NoNumber { path: self.name.clone(), role: role.into_str(), found: found.to_owned() });
        }
        let lead_length = has(Role::LeadLength) || self.lead_length.is_some();
        let length = has(Role::Length) || self.length.is_some();
        let how = "the bumper-to-bumper gap must follow from something; a length without a column is a number, length = 4.6, or \
                   lead_length = 4.6 in a table of pairs";
        match self.rows {
            Rows::Vehicles if !has(Role::Id) => missing("id", "every row must name its vehicle"),
            Rows::Vehicles if !has(Role::Ahead) && !self.is_searched() => missing(
                "ahead, or lane and position",
                "every row must name the vehicle ahead, or give the place of the vehicle",
            ),
            Rows::Vehicles if has(Role::Gap) => Ok(()),
            Rows::Vehicles if (has(Role::Headway) || has(Role::Position)) && length => Ok(()),
            Rows::Vehicles => missing("gap, or length with headway or position", how),
            Rows::Pairs if !has(Role::LeadSpeed) && !has(Role::RelativeSpeed) => {
                missing("lead_speed or relative_speed", "it gives the vehicle ahead")
            }
            Rows::Pairs if has(Role::Gap) => Ok(()),
            Rows::Pairs if has(Role::Headway) && lead_length => Ok(()),
            // Without a length preparation asks for one (--lead-length).
            Rows::Pairs if has(Role::Position) && has(Role::LeadPosition) => Ok(()),
            Rows::Pairs => missing("gap, or lead_length with headway or both positions", how),
            Rows::Platoon if has(Role::Gap) || has(Role::Position) => Ok(()),
            Rows::Platoon if has(Role::Headway) && length => Ok(()),
            Rows::Platoon => missing("gap, or length with headway, or position", how),
        }
    }

    /// The name of a column without a number, which would be the same for every car of a platoon.
    fn shared(&self) -> Option<(Role, &str)> {
        let own = [Role::Speed, Role::Gap, Role::Headway, Role::Position];
        let all = self.columns.iter().filter(|column| own.contains(&column.role));
        let mut named = all.flat_map(|column| column.names.iter().map(|name| (column.role, name.as_str())));
        // A gap may have the number of the car ahead.
        named.find(|(role, name)| !(name.contains("{}") || role.is_gap() && name.contains("{-1}")))
    }

    /// True if the vehicle ahead is the nearest one in front in the same lane, because no column names it.
    pub(super) fn is_searched(&self) -> bool {
        let has = |role: Role| self.column(role).is_some();
        !has(Role::Ahead) && has(Role::Position) && (has(Role::Lane) || self.lap_length.is_some())
    }

    /// Distance of one front ahead of another one by their positions \[m\]: on a closed track never negative.
    pub(super) fn ahead_by(&self, difference: f64) -> f64 {
        self.lap_length.map_or(difference, |lap| difference.rem_euclid(lap))
    }

    /// A change of position \[m\], without the end of a lap.
    pub(super) fn unwrapped(&self, change: f64) -> f64 {
        self.lap_length.map_or(change, |lap| (change + lap / 2.0).rem_euclid(lap) - lap / 2.0)
    }

    /// The same map for a table with commas, points and one header line, whatever the map sets.
    pub(super) fn of_plain_csv(self) -> ColumnMap {
        let (separator, decimal) = (Separator::Comma, Decimal::Point);
        ColumnMap { separator, decimal, header: None, headerless: None, skip_lines: 0, units_row: false, ..self }
    }

    /// The same map with this length of the vehicle ahead \[m\], instead of any column; that of a follower stays.
    pub fn with_lead_length(mut self, length: Option<f64>) -> ColumnMap {
        self.lead_override = length;
        self
    }
}

/// `11` for `11.0`: programs without missing integers write them as decimals.
pub(super) fn whole(name: &str) -> &str {
    match name.split_once('.') {
        Some((number, zeros)) if !zeros.is_empty() && zeros.bytes().all(|b| b == b'0') => {
            let digits = number.strip_prefix('-').unwrap_or(number);
            let is_whole = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
            if is_whole { number } else { name }
        }
        _ => name,
    }
}

/// Place of an entry in a map, and its conditions.
struct Context<'a> {
    rows: Rows,
    frame_s: Option<f64>,
    name: &'a str,
    line: usize,
}

fn role(key: &str, context: &Context) -> Result<Role, MapError> {
    let Context { rows, line, .. } = *context;
    let path = || context.name.to_owned();
    let allowed = |role: &Role| role.is_in(rows);
    let known = || Role::VARIANTS.iter().filter(|role| allowed(role)).map(Role::into_str).collect::<Vec<_>>();
    let Ok(role) = key.parse::<Role>() else {
        let near = nearest(key, known().into_iter()).map(str::to_owned);
        return Err(MapError::Role { path: path(), line, found: key.to_owned(), known: known(), near });
    };
    if !allowed(&role) {
        let (role, rows) = (role.into_str(), rows.into_str());
        return Err(MapError::Misplaced { path: path(), line, role, rows, known: known() });
    }
    Ok(role)
}

fn column(key: &str, entry: &Named, context: &Context) -> Result<Column, MapError> {
    let Context { frame_s, line, .. } = *context;
    let path = || context.name.to_owned();
    let role = role(key, context)?;
    let role_name = role.into_str();
    let names = match &entry.name {
        Names::One(name) => vec![name.trim().to_owned()],
        Names::Several(names) => names.iter().map(|name| name.trim().to_owned()).collect(),
    };
    if names.is_empty() || names.iter().any(String::is_empty) {
        return Err(MapError::NoName { path: path(), line, role: role_name });
    }
    let (unit, form) = match (role.quantity(), &entry.unit) {
        (None, None) => (String::new(), Form::Factor(1.0)),
        (None, Some(found)) => {
            return Err(MapError::UnitOfName { path: path(), line, role: role_name, found: found.clone() });
        }
        (Some(quantity), unit) => {
            let unit = unit.as_deref().unwrap_or(quantity.si());
            // Some radars call it positive where the gap closes.
            let turned = unit.strip_prefix('-').filter(|unit| role == Role::RelativeSpeed && !unit.is_empty());
            let turn = |form| match form {
                Form::Factor(factor) if turned.is_some() => Form::Factor(-factor),
                form => form,
            };
            let Some(form) = quantity.form(turned.unwrap_or(unit)).map(turn) else {
                let known = quantity.names();
                return Err(MapError::Unit { path: path(), line, role: role_name, found: unit.to_owned(), known });
            };
            let is_frame = matches!(form, Form::Factor(factor) if factor.is_nan());
            let form =
                if is_frame { Form::Factor(frame_s.ok_or_else(|| MapError::NoRate { path: path() })?) } else { form };
            (unit.to_owned(), form)
        }
    };
    Ok(Column { role, names, unit, form, optional: entry.optional, hint: entry.hint.clone() })
}
