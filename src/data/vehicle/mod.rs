//! Vehicles: mass, inertia, road-load bounds and MFC curves, built in (AstaZero) or read from a file.

mod file;
mod mfc;

pub use file::{VehicleError, find, find_for, find_in, read_table};
pub use mfc::Mfc;

use crate::trajectory::Source;

/// Properties of a car that the equations need.
#[derive(Debug, Clone, PartialEq)]
pub struct Vehicle {
    /// Short name, `tesla_model3`.
    pub slug: String,
    /// Full name.
    pub name: String,
    /// Other spellings found in measured files.
    pub aliases: Vec<String>,
    /// Unladen mass m_0 \[kg\].
    pub m_0: f64,
    /// Equivalent inertial mass factor φ_f.
    pub phi_f: f64,
    /// Length over all \[m\].
    pub length: Option<f64>,
    /// Bounds of f_0 \[N\].
    pub f_0: [f64; 2],
    /// Bounds of f_1 as printed in Table 3, per km/h \[N/(km/h)\].
    pub f_1_printed: [f64; 2],
    /// Bounds of f_2 as printed in Table 3, per (km/h)² \[N/(km/h)²\].
    pub f_2_printed: [f64; 2],
    /// Acceleration and deceleration potential, if there is a curve.
    pub mfc: Option<Mfc>,
    /// The table it was read from; `None` if built in.
    pub table: Option<Source>,
}

impl Vehicle {
    /// The five vehicles of the AstaZero platoons, without MFC curves.
    pub fn built_in() -> Vec<Vehicle> {
        file::parse(include_str!("astazero.toml"), "built-in vehicle table", None).expect("the built-in table is valid")
    }

    /// The files it was read from: table and MFC curve.
    pub fn files(&self) -> Vec<&Source> {
        self.table.iter().chain(self.mfc.as_ref().and_then(|m| m.source.as_ref())).collect()
    }

    /// True if `name` is this vehicle's slug, name or one of its aliases, ignoring case.
    pub fn is_called(&self, name: &str) -> bool {
        let name = name.trim();
        std::iter::once(&self.slug).chain([&self.name]).chain(&self.aliases).any(|n| n.eq_ignore_ascii_case(name))
    }

    /// The built-in vehicle of that name.
    pub fn called(name: &str) -> Option<Vehicle> {
        Vehicle::built_in().into_iter().find(|v| v.is_called(name))
    }
}
