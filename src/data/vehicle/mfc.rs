//! The MFC curves a_ap(v) and a_dp(v) of Eq. 14, as tables.

use super::VehicleError;
use crate::text::bounded;
use crate::trajectory::Source;
use std::ops::RangeInclusive;
use std::path::Path;

/// Range of the columns \[m/s, m/s², m/s²\]: three times the values of the strongest road cars; with the other sign,
/// the largest values of fits and of cars beyond their top speed.
const RANGES: [(&str, RangeInclusive<f64>); 3] =
    [("speed_mps", 0.0..=200.0), ("a_ap", -1.0..=30.0), ("a_dp", -30.0..=1.0)];

/// Acceleration and deceleration potential over speed (Makridis et al., 2019; He et al., 2020a).
#[derive(Debug, Clone, PartialEq)]
pub struct Mfc {
    /// Speeds \[m/s\], strictly increasing.
    pub v: Vec<f64>,
    /// Acceleration potential a_ap \[m/s²\].
    pub a_ap: Vec<f64>,
    /// Deceleration potential a_dp \[m/s²\], negative.
    pub a_dp: Vec<f64>,
    /// The file it was read from, if any.
    pub source: Option<Source>,
}

impl Mfc {
    /// Reads `speed_mps,a_ap,a_dp`. Fails for a missing column, a value that is not a finite number, speeds that do not increase, fewer than two
    /// rows.
    pub fn read_csv(path: &Path) -> Result<Mfc, VehicleError> {
        let table = |line: u64, found: String, expected: &'static str| VehicleError::Table {
            path: path.display().to_string(),
            line,
            expected,
            found,
        };
        let bytes = bounded::read(path, bounded::TEXT_MAX)
            .map_err(|source| VehicleError::Read { path: path.display().to_string(), source })?;
        let mut reader = csv::Reader::from_reader(bytes.as_slice());
        let read_error = |source| VehicleError::Csv { path: path.display().to_string(), source };
        let headers = reader.headers().map_err(read_error)?.clone();
        let mut columns = [0; 3];
        for (column, name) in columns.iter_mut().zip(["speed_mps", "a_ap", "a_dp"]) {
            *column = headers.iter().position(|h| h.trim() == name).ok_or_else(|| {
                table(1, headers.iter().collect::<Vec<_>>().join(","), "the columns speed_mps, a_ap, a_dp")
            })?;
        }
        let mut mfc =
            Mfc { v: Vec::new(), a_ap: Vec::new(), a_dp: Vec::new(), source: Some(Source::of_bytes(path, &bytes)) };
        for record in reader.records() {
            let record = record.map_err(read_error)?;
            let line = record.position().map_or(0, csv::Position::line);
            let mut row = [0.0; 3];
            for (value, column) in row.iter_mut().zip(columns) {
                let text = record.get(column).unwrap_or_default();
                *value = text
                    .trim()
                    .parse()
                    .ok()
                    .filter(|x: &f64| x.is_finite())
                    .ok_or_else(|| table(line, text.to_owned(), "a finite number"))?;
            }
            if mfc.v.last().is_some_and(|last| *last >= row[0]) {
                return Err(table(line, row[0].to_string(), "a speed_mps above that of the row before"));
            }
            for (value, (name, range)) in row.iter().zip(RANGES) {
                if !range.contains(value) {
                    let expected = format!("{name} from {} to {}", range.start(), range.end());
                    return Err(VehicleError::Range {
                        path: path.display().to_string(),
                        line,
                        expected,
                        found: *value,
                    });
                }
            }
            // A car beyond its top speed has no acceleration left.
            if row[2] >= row[1] {
                let found = format!("a_dp {} beside a_ap {}", row[2], row[1]);
                return Err(table(line, found, "a_dp below a_ap, so that the curves do not cross"));
            }
            mfc.v.push(row[0]);
            mfc.a_ap.push(row[1]);
            mfc.a_dp.push(row[2]);
        }
        if mfc.v.len() < 2 {
            return Err(table(1, format!("{} rows", mfc.v.len()), "at least two rows"));
        }
        Ok(mfc)
    }
}
