//! Tables: named columns of one type each, for every output format.

/// A table; all columns are of one length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// The columns, in order.
    pub columns: Vec<Column>,
}

/// A column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name, which ends with the unit.
    pub name: String,
    /// Its values.
    pub values: Values,
}

/// Values of one type, `None` if missing.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Whole numbers.
    Integer(Vec<Option<i64>>),
    /// Numbers.
    Number(Vec<Option<f64>>),
    /// True or false.
    Flag(Vec<Option<bool>>),
    /// Text.
    Text(Vec<Option<String>>),
}

impl Values {
    /// Number of values.
    #[must_use]
    pub fn len(&self) -> usize {
        match self {
            Values::Integer(values) => values.len(),
            Values::Number(values) => values.len(),
            Values::Flag(values) => values.len(),
            Values::Text(values) => values.len(),
        }
    }

    /// True without values.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A value as text: numbers in their shortest form that reads back the same, flags as `true` and `false`; empty without a value.
    #[must_use]
    pub fn text(&self, row: usize) -> String {
        match self {
            Values::Integer(values) => values[row].map_or_else(String::new, |x| x.to_string()),
            Values::Number(values) => values[row].map_or_else(String::new, |x| format!("{x:?}")),
            Values::Flag(values) => values[row].map_or_else(String::new, |x| x.to_string()),
            Values::Text(values) => values[row].clone().unwrap_or_default(),
        }
    }
}

impl Table {
    /// Adds a column of whole numbers.
    pub fn integer(&mut self, name: &str, values: impl Iterator<Item = Option<i64>>) {
        self.push(name, Values::Integer(values.collect()));
    }

    /// Adds a column of numbers.
    pub fn number(&mut self, name: &str, values: impl Iterator<Item = Option<f64>>) {
        self.push(name, Values::Number(values.collect()));
    }

    /// Adds a column of flags.
    pub fn flag(&mut self, name: &str, values: impl Iterator<Item = Option<bool>>) {
        self.push(name, Values::Flag(values.collect()));
    }

    /// Adds a column of texts.
    pub fn text<'a>(&mut self, name: &str, values: impl Iterator<Item = Option<&'a str>>) {
        self.push(name, Values::Text(values.map(|text| text.map(str::to_owned)).collect()));
    }

    fn push(&mut self, name: &str, values: Values) {
        debug_assert!(self.columns.first().is_none_or(|c| c.values.len() == values.len()), "column {name}");
        self.columns.push(Column { name: name.to_owned(), values });
    }

    /// Number of rows.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }
}
