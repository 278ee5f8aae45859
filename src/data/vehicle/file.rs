//! Vehicle tables: TOML (one table per vehicle) and the CSV layout `slug,name,mass_unladen_kg,phi,...`.

use super::{Mfc, Vehicle};
use crate::text::bounded;
use crate::text::spelling::did_you_mean;
use crate::trajectory::Source;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A vehicle that cannot be read or found.
#[derive(Debug, thiserror::Error)]
pub enum VehicleError {
    #[error("{path}: cannot read the vehicle table")]
    Read { path: String, source: std::io::Error },
    #[error(
        "{path}: expected one table per vehicle with mass_unladen_kg, phi, f_0_N, f_1_N_per_kmh, f_2_N_per_kmh2 and \
         optionally name, aliases, length_m, mfc"
    )]
    Toml { path: String, source: Box<toml::de::Error> },
    #[error("{path}: cannot read the table")]
    Csv { path: String, source: csv::Error },
    #[error("{table}: vehicle {slug}: its MFC curve {path} cannot be used")]
    Curve { table: String, slug: String, path: String, source: Box<VehicleError> },
    #[error("{path}:{line}: expected {expected}, found `{found}`")]
    Table { path: String, line: u64, expected: &'static str, found: String },
    #[error("{path}:{line}: expected {expected}, found {found}")]
    Range { path: String, line: u64, expected: String, found: f64 },
    #[error("{path}: vehicle {slug}: {quantity}: expected {expected}, found {found}")]
    Value { path: String, slug: String, quantity: &'static str, expected: &'static str, found: String },
    #[error("vehicle `{name}` is not in {table}; it has {}{}", known.join(", "), did_you_mean(name, known.iter().map(String::as_str)))]
    Unknown { name: String, table: String, known: Vec<String> },
}

/// One vehicle as written in a file; units are in the names.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
#[allow(non_snake_case, reason = "N is the symbol of the newton")]
struct Entry {
    name: Option<String>,
    #[serde(default)]
    aliases: Vec<String>,
    mass_unladen_kg: f64,
    phi: f64,
    length_m: Option<f64>,
    f_0_N: [f64; 2],
    f_1_N_per_kmh: [f64; 2],
    f_2_N_per_kmh2: [f64; 2],
    mfc: Option<PathBuf>,
}

/// A vehicle of a table, without its curve, because an unneeded curve must not cause an error.
struct Listed {
    vehicle: Vehicle,
    table: String,
    curve: Option<PathBuf>,
}

impl Listed {
    /// With its curve.
    fn whole(self) -> Result<Vehicle, VehicleError> {
        let Listed { vehicle, table, curve } = self;
        let slug = vehicle.slug.clone();
        let read = |path: PathBuf| {
            let why = |source| VehicleError::Curve {
                table,
                slug,
                path: path.display().to_string(),
                source: Box::new(source),
            };
            Mfc::read_csv(&path).map_err(why)
        };
        Ok(Vehicle { mfc: curve.map(read).transpose()?, ..vehicle })
    }

    /// With its curve, if that can be read.
    fn with_what_is_there(self) -> Vehicle {
        let plain = self.vehicle.clone();
        self.whole().unwrap_or(plain)
    }
}

impl Entry {
    /// Checks the numbers; `place` gives file and line of a quantity.
    fn into_listed(
        self,
        slug: String,
        path: &str,
        folder: Option<&Path>,
        place: impl Fn(&str) -> String,
    ) -> Result<Listed, VehicleError> {
        let check = |ok: bool, quantity, expected, found: String| {
            if ok {
                Ok(())
            } else {
                Err(VehicleError::Value { path: place(quantity), slug: slug.clone(), quantity, expected, found })
            }
        };
        let (mass, phi, length) = (self.mass_unladen_kg, self.phi, self.length_m.unwrap_or(1.0));
        // From a motorcycle to a road train.
        let is_mass = (50.0..=200_000.0).contains(&mass);
        check(is_mass, "mass_unladen_kg", "a mass of 50 to 200000 kg", mass.to_string())?;
        // Rotating parts add a few per cent, in a low gear as much again.
        check((0.1..=10.0).contains(&phi), "phi", "a factor of 0.1 to 10", phi.to_string())?;
        check((0.1..=100.0).contains(&length), "length_m", "a length of 0.1 to 100 m", length.to_string())?;
        for (quantity, [lower, upper]) in
            [("f_0_N", self.f_0_N), ("f_1_N_per_kmh", self.f_1_N_per_kmh), ("f_2_N_per_kmh2", self.f_2_N_per_kmh2)]
        {
            let found = format!("[{lower}, {upper}]");
            check(lower <= upper, quantity, "[lower, upper] with lower <= upper", found.clone())?;
            let is_load = ROAD_LOADS.contains(&lower) && ROAD_LOADS.contains(&upper);
            check(is_load, quantity, "both within -100000 to 100000", found)?;
        }
        // A curve beside the table may have the slug's name without being mentioned.
        let beside = folder.map(|f| f.join(format!("mfc_{slug}.csv"))).filter(|p| p.exists());
        let mfc_path = self.mfc.map(|p| folder.map_or(p.clone(), |f| f.join(p))).or(beside);
        let vehicle = Vehicle {
            name: crate::text::shown::name(&self.name.unwrap_or_else(|| slug.clone())).into_owned(),
            aliases: self.aliases,
            m_0: self.mass_unladen_kg,
            phi_f: self.phi,
            length: self.length_m,
            f_0: self.f_0_N,
            f_1_printed: self.f_1_N_per_kmh,
            f_2_printed: self.f_2_N_per_kmh2,
            mfc: None,
            table: None,
            slug,
        };
        Ok(Listed { vehicle, table: path.to_owned(), curve: mfc_path })
    }
}

/// Range of a coefficient of the road load, in its unit: ten times that of the heaviest truck.
const ROAD_LOADS: std::ops::RangeInclusive<f64> = -1e5..=1e5;

/// `FILE:LINE` of a quantity of a vehicle in the text of a TOML table; the file alone if the quantity has no line of its own.
fn place(text: &str, path: &str, slug: &str, quantity: &str) -> String {
    let unquoted = |text: &str| text.trim().trim_matches(['"', '\'']).to_owned();
    let mut inside = false;
    for (line, content) in (1..).zip(text.lines()) {
        if let Some(name) = content.trim().strip_prefix('[') {
            inside = unquoted(name.split(']').next().unwrap_or_default()) == slug;
        } else if inside && content.split_once('=').is_some_and(|(key, _)| unquoted(key) == quantity) {
            return format!("{path}:{line}");
        }
    }
    path.to_owned()
}

/// Parses a TOML vehicle table; `path` is for messages, and `folder` holds the MFC files.
pub(super) fn parse(text: &str, path: &str, folder: Option<&Path>) -> Result<Vec<Vehicle>, VehicleError> {
    parse_listed(text, path, folder)?.into_iter().map(Listed::whole).collect()
}

fn parse_listed(text: &str, path: &str, folder: Option<&Path>) -> Result<Vec<Listed>, VehicleError> {
    let entries: BTreeMap<String, Entry> = toml::from_str(text)
        .map_err(|source| VehicleError::Toml { path: path.to_owned(), source: Box::new(source) })?;
    let listed = |(slug, entry): (String, Entry)| {
        let own = slug.clone();
        entry.into_listed(slug, path, folder, |quantity| place(text, path, &own, quantity))
    };
    entries.into_iter().map(listed).collect()
}

/// The relevant columns of `vehicles.csv`.
#[derive(Debug, Deserialize)]
#[allow(non_snake_case, reason = "N is the symbol of the newton")]
struct CsvRow {
    slug: String,
    name: String,
    paper_name: Option<String>,
    mass_unladen_kg: f64,
    phi: f64,
    length_m: Option<f64>,
    f_0_lb_N: f64,
    f_0_ub_N: f64,
    f_1_lb_N_per_kmh: f64,
    f_1_ub_N_per_kmh: f64,
    f_2_lb_N_per_kmh2: f64,
    f_2_ub_N_per_kmh2: f64,
}

fn parse_csv(path: &Path, bytes: &[u8]) -> Result<Vec<Listed>, VehicleError> {
    let shown = path.display().to_string();
    let csv_error = |source| VehicleError::Csv { path: shown.clone(), source };
    let mut reader = csv::Reader::from_reader(bytes);
    let headers = reader.headers().map_err(csv_error)?.clone();
    let records = reader.records().collect::<Result<Vec<_>, _>>().map_err(csv_error)?;
    let row = |record: &csv::StringRecord| {
        let line = record.position().map_or(0, csv::Position::line);
        Ok((line, record.deserialize::<CsvRow>(Some(&headers)).map_err(csv_error)?))
    };
    let rows = records.iter().map(row).collect::<Result<Vec<(u64, CsvRow)>, _>>()?;
    rows.into_iter()
        .map(|(line, row)| {
            // The names that measured files use for the built-in cars stay valid for a table of the same slugs.
            let built_in = Vehicle::built_in().into_iter().find(|v| v.slug == row.slug);
            let mut aliases = built_in.map(|v| v.aliases).unwrap_or_default();
            aliases.extend(row.paper_name);
            let entry = Entry {
                name: Some(row.name),
                aliases,
                mass_unladen_kg: row.mass_unladen_kg,
                phi: row.phi,
                length_m: row.length_m,
                f_0_N: [row.f_0_lb_N, row.f_0_ub_N],
                f_1_N_per_kmh: [row.f_1_lb_N_per_kmh, row.f_1_ub_N_per_kmh],
                f_2_N_per_kmh2: [row.f_2_lb_N_per_kmh2, row.f_2_ub_N_per_kmh2],
                mfc: None,
            };
            entry.into_listed(row.slug, &shown, path.parent(), |_| format!("{shown}:{line}"))
        })
        .collect()
}

/// Reads a vehicle table, TOML or (by extension) CSV. Fails if the file cannot be read, or a vehicle in it is incomplete or impossible.
pub fn read_table(path: &Path) -> Result<Vec<Vehicle>, VehicleError> {
    listed(path)?.into_iter().map(Listed::whole).collect()
}

fn listed(path: &Path) -> Result<Vec<Listed>, VehicleError> {
    let shown = path.display().to_string();
    let read_error = |source| VehicleError::Read { path: shown.clone(), source };
    let bytes = bounded::read(path, bounded::TEXT_MAX).map_err(read_error)?;
    let table = Source::of_bytes(path, &bytes);
    let mut vehicles = if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("csv")) {
        parse_csv(path, &bytes)?
    } else {
        let text = String::from_utf8(bytes)
            .map_err(|e| read_error(std::io::Error::new(std::io::ErrorKind::InvalidData, e.utf8_error())))?;
        parse_listed(&text, &shown, path.parent())?
    };
    vehicles.iter_mut().for_each(|listed| listed.vehicle.table = Some(table.clone()));
    Ok(vehicles)
}

/// The vehicle `name` of a table, if there is one. With `needs_curve` its MFC curve has to be sound; without, one that cannot be read is left out.
/// Curves of other vehicles are ignored. Fails if the file cannot be read, a vehicle in it is impossible, or the curve that is needed cannot be used.
pub fn find_in(table: &Path, name: &str, needs_curve: bool) -> Result<Option<Vehicle>, VehicleError> {
    let found = listed(table)?.into_iter().find(|listed| listed.vehicle.is_called(name));
    found.map(|listed| if needs_curve { listed.whole() } else { Ok(listed.with_what_is_there()) }).transpose()
}

/// Finds a vehicle by `NAME` (built in) or `FILE#NAME`, with its MFC curve if it has one. Fails if the file cannot be read, has no vehicle of that
/// name, or its curve cannot be used.
pub fn find(text: &str) -> Result<Vehicle, VehicleError> {
    find_for(text, true)
}

/// As [`find`], for callers that may not need the curve: see [`find_in`].
pub fn find_for(text: &str, needs_curve: bool) -> Result<Vehicle, VehicleError> {
    let unknown = |table: &str, name: &str, known: Vec<String>| VehicleError::Unknown {
        name: name.to_owned(),
        table: table.to_owned(),
        known,
    };
    let Some((path, name)) = text.rsplit_once('#') else {
        let known = || Vehicle::built_in().into_iter().map(|vehicle| vehicle.slug).collect();
        return Vehicle::called(text).ok_or_else(|| unknown("the built-in table", text, known()));
    };
    if let Some(vehicle) = find_in(Path::new(path), name, needs_curve)? {
        return Ok(vehicle);
    }
    let known = listed(Path::new(path))?.into_iter().map(|listed| listed.vehicle.slug).collect();
    Err(unknown(path, name, known))
}
