//! One row of the table: the requested run, or why there is none.

use super::library::{Library, LibraryError, NamedFile, Wanted};
use super::{Settings, TableError};
use crate::catalog::Variant;
use crate::evaluator::{Case, CaseError, InvalidParameter};
use crate::simulate::far_above_in;
use crate::symbols::{Parameters, Symbol};
use crate::text::spelling::nearest;
use crate::wgsl::{ModelError, read_model};
use csv::ByteRecord;

/// Largest number of columns of a table, including those of the user.
const COLUMNS: usize = 1000;

/// Where the needed columns are. Those of the table of a fleet have other names: `model`, `file`, `follower`, and units behind those of parameters.
pub(super) struct Columns {
    width: usize,
    /// The existing ones; a row may fill either.
    model_id: Option<usize>,
    variant: Option<usize>,
    /// Neither is needed if all rows are of one file.
    platoon: Option<usize>,
    file: Option<usize>,
    trajectory: Option<usize>,
    follower: usize,
    parameters: Vec<(Symbol, usize)>,
    /// Other columns: parameters of laws, the user's own, or misspelt.
    others: Vec<(String, usize)>,
}

impl Columns {
    /// `one_file`: whether all rows are of one file, so that none has to name it.
    pub(super) fn find(headers: &ByteRecord, path: &str, one_file: bool) -> Result<Columns, TableError> {
        if headers.len() > COLUMNS {
            return Err(TableError::Wide { path: path.to_owned(), most: COLUMNS, found: headers.len() });
        }
        // A byte order mark is not part of a name.
        let names: Vec<String> = headers
            .iter()
            .map(|name| String::from_utf8_lossy(name).trim_start_matches('\u{feff}').trim().to_owned())
            .collect();
        let position = |wanted: &str| names.iter().position(|name| name == wanted);
        let read = ["model_id", "variant", "model", "platoon", "file", "trajectory", "follower_position", "follower"];
        for wanted in read.into_iter().chain(Symbol::ALL.iter().map(|s| s.name())) {
            if names.iter().filter(|name| *name == wanted).count() > 1 {
                return Err(TableError::Twice { path: path.to_owned(), column: wanted });
            }
        }
        let need = |found: Option<usize>, missing| {
            found.ok_or_else(|| TableError::Column { path: path.to_owned(), missing, found: names.clone() })
        };
        let of_symbol = |symbol: Symbol| position(symbol.name()).or_else(|| position(&symbol.column()));
        let parameters: Vec<(Symbol, usize)> =
            Symbol::ALL.iter().filter_map(|&symbol| Some((symbol, of_symbol(symbol)?))).collect();
        let (model_id, variant) = (position("model_id"), position("variant"));
        let variant = variant.or_else(|| position("model").filter(|_| model_id.is_none()));
        need(model_id.or(variant), "model_id")?;
        let platoon = position("platoon");
        let file = position("file").filter(|_| platoon.is_none());
        if !one_file {
            need(platoon.or(file), "platoon")?;
        }
        let is_known =
            |name: &str, column: usize| read.contains(&name) || parameters.iter().any(|(_, known)| *known == column);
        Ok(Columns {
            width: names.len(),
            model_id,
            variant,
            platoon,
            file,
            trajectory: position("trajectory"),
            follower: need(position("follower_position").or_else(|| position("follower")), "follower_position")?,
            others: names
                .iter()
                .cloned()
                .enumerate()
                .filter(|(k, name)| !is_known(name, *k))
                .map(|(k, name)| (name, k))
                .collect(),
            parameters,
        })
    }

    /// The column of a parameter; that of a law's own has its name.
    fn of(&self, symbol: Symbol) -> Option<usize> {
        let known = self.parameters.iter().find(|(known, _)| *known == symbol).map(|(_, column)| *column);
        let others = || self.others.iter();
        let by_name = || others().find(|(name, _)| name == symbol.name());
        let own = || by_name().or_else(|| others().find(|(name, _)| *name == symbol.column()));
        known.or_else(|| own().map(|(_, column)| *column))
    }

    /// Parameters of a row that its variant does not have. Nothing, NaN and 0 mean a missing parameter.
    pub(super) fn unused(&self, record: &ByteRecord, variant: &Variant) -> Vec<&'static str> {
        let own = variant.parameters();
        let is_given = |column: usize| {
            let text = std::str::from_utf8(record.get(column).unwrap_or_default()).unwrap_or_default();
            text.trim().parse::<f64>().is_ok_and(|value| !value.is_nan() && value != 0.0)
        };
        let others = self.parameters.iter().filter(|(symbol, _)| !own.contains(symbol));
        others.filter(|(_, column)| is_given(*column)).map(|(symbol, _)| symbol.name()).collect()
    }

    /// The column that probably means this name, for the end of a message.
    fn near(&self, missing: &str) -> String {
        let near = nearest(missing, self.others.iter().map(|(name, _)| name.as_str()));
        near.map_or_else(String::new, |near| format!("; did you mean {missing} by the column `{near}`?"))
    }
}

/// Why a row cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub(super) enum InvalidRow {
    #[error("expected {expected} fields as in the header, found {found}")]
    Width { expected: usize, found: usize },
    #[error(transparent)]
    Variant(#[from] ModelError),
    #[error("model_id {id} is {model}, but the column variant says {variant}; leave one of the two empty")]
    Contradiction { id: String, model: String, variant: String },
    #[error("follower_position: expected 1 or more (1 = right behind the platoon leader), found `{0}`")]
    Follower(String),
    #[error("{name}: expected a number for variant {variant}, found `{found}`")]
    Number { name: &'static str, variant: String, found: String },
    #[error("{name}: variant {variant} needs this parameter, but there is no such column{near}")]
    NoColumn { name: &'static str, variant: String, near: String },
    #[error(transparent)]
    Library(#[from] LibraryError),
    #[error(transparent)]
    Case(#[from] CaseError),
    #[error(transparent)]
    Parameter(#[from] InvalidParameter),
}

/// A run, or why there is none.
pub(super) type Task = Result<(Case, Parameters), InvalidRow>;

pub(super) fn parse(record: &ByteRecord, columns: &Columns, library: &mut Library, settings: &Settings) -> Task {
    if record.len() != columns.width {
        return Err(InvalidRow::Width { expected: columns.width, found: record.len() });
    }
    let text = |column: usize| String::from_utf8_lossy(record.get(column).unwrap_or_default()).trim().to_owned();
    let filled = |column: Option<usize>| column.map(text).filter(|text| !text.is_empty());
    let (id, name) = (filled(columns.model_id), filled(columns.variant));
    let (variant, delay_upper) = match name.as_deref().and_then(|name| library.models.get(name)) {
        Some(known) => *known,
        None => (variant(id, name)?, None),
    };
    let follower = text(columns.follower);
    let follower = follower.parse().ok().filter(|f| *f > 0).ok_or(InvalidRow::Follower(follower))?;
    let mut parameters = Parameters::NONE;
    for symbol in variant.parameters() {
        let name = symbol.name();
        let Some(column) = columns.of(symbol) else {
            return Err(InvalidRow::NoColumn { name, variant: variant.name(), near: columns.near(name) });
        };
        let found = text(column);
        let Ok(value) = found.parse() else {
            return Err(InvalidRow::Number { name, variant: variant.name(), found });
        };
        parameters.set(symbol, value);
    }
    let file = match (columns.platoon, columns.file) {
        (Some(stem), _) => NamedFile::Platoon(text(stem)),
        (None, path) => NamedFile::Path(path.map(text).unwrap_or_default()),
    };
    let wanted = Wanted { file, trajectory: filled(columns.trajectory), follower };
    let case = library.case(wanted, settings)?;
    let extension_delay_upper = delay_upper.or(case.extension_delay_upper);
    let case = Case { extension_delay_upper, ..case }.for_variant(variant)?;
    case.check(&parameters)?;
    library.uses_vehicle_of(&case);
    far_above_in(&case, &parameters).into_iter().for_each(|doubt| library.doubt(doubt));
    Ok((case, parameters))
}

/// The variant of a row by its id, its name, or both.
fn variant(id: Option<String>, name: Option<String>) -> Result<Variant, InvalidRow> {
    // Results give 0 as the id of a law.
    let id = id.filter(|id| id != "0" || name.is_none());
    let Some(id) = id else { return Ok(read_model(&name.unwrap_or_default())?) };
    let by_id = read_model(&id)?;
    match name {
        Some(name) if read_model(&name)? != by_id => {
            Err(InvalidRow::Contradiction { id, model: by_id.name(), variant: name })
        }
        _ => Ok(by_id),
    }
}
