//! Changes to measured data before a simulation.

use super::soundness::Finding;
use std::fmt;

/// One change of the data, in the order of the changes. `Display` gives one line.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(rename_all = "snake_case", tag = "kind")]
#[non_exhaustive]
pub enum Note {
    /// The file marks the driver: at this time the mode begins (or the file starts with it).
    DriverMode { car: usize, t_s: f64, mode: String },
    /// Vehicles that follow, at least for a while, one that is not in the table.
    LeadersAbsent { vehicles: usize },
    /// Half of the vehicles are longer than cars, as `column` says.
    LongVehicles { column: String, median_m: f64 },
    /// Columns that no layout knows were not read.
    IgnoredColumns { columns: Vec<String> },
    /// The last line has no end: if the file was cut there, its last number may be wrong.
    OpenEnd { line: u64 },
    /// A length that the file does not state.
    LengthDerived { car: usize, length_m: f64, from: String },
    /// The length of the car ahead is unknown: positions of that car mean its rear bumper.
    LengthUnknown,
    /// A signal that the file does not have was derived from others.
    Derived { signal: String, from: String },
    /// The time window that was kept.
    Cut { from_s: f64, to_s: f64, rows: usize, kept: usize },
    /// Small negative speeds, sensor noise at standstill, became 0.
    Clipped { signal: String, samples: usize, lowest_mps: f64 },
    /// A new time step by linear interpolation.
    Resampled { from_s: f64, to_s: f64, rows: usize, samples: usize },
    /// Rows missing from the file were put back, their values interpolated.
    RowsFilled { rows: usize, longest_s: f64 },
    /// Missing values were interpolated linearly; `longest_s` lies between the measured neighbours.
    Filled { signal: String, samples: usize, longest_s: f64 },
    /// Gaps longer than allowed split the data; this is segment number `segment` of `segments`.
    Split { segment: usize, segments: usize, from_s: f64, to_s: f64 },
    /// A stretch between long gaps too short to be used.
    Dropped { from_s: f64, to_s: f64, needed_s: f64 },
    /// An optional signal has long gaps here and is left out.
    LeftOut { signal: String, missing: usize },
    /// Savitzky-Golay passes as the paper's authors applied them; rms change of each speed and the spacing.
    Smoothed {
        passes: usize,
        points: usize,
        order: usize,
        dt_s: f64,
        lead_speed_rms_mps: f64,
        speed_rms_mps: f64,
        spacing_rms_m: f64,
    },
    /// Without a measured position, the preceding vehicle starts here.
    StartAssumed { position_m: f64 },
    /// Spacing and speeds were made consistent; the residual is the measured gap minus the integrated speed difference.
    Reconciled { anchor: String, rms_m: f64, largest_m: f64, drift_m_per_km: f64 },
    /// The grade under the follower was taken along its path; samples at rest count once.
    GradeFromColumn { points: usize },
    /// The table was read by this column map; the number of this pair in it.
    Mapped { map: String, pair: Option<String> },
    /// Pairs of a long table that are too short to be used.
    ShortPairs { pairs: usize, needed_s: f64 },
    /// Gaps that are not above 0, which became missing values: their car, and the name of the column.
    NoGap { car: usize, signal: String, samples: usize },
    /// The time of a trajectory restarts, so that two have the same id; the second counts as another one.
    IdAgain { id: String, line: u64, read_as: String },
    /// Lines around the header that hold no data, from this one on.
    LinesSkipped { line: u64, lines: u64, what: String },
    /// Vehicles with the number of an earlier one.
    NumbersAgain { vehicles: usize, numbers: usize },
    /// Vehicles with impossible values, whose pairs are left out.
    BrokenLeftOut { vehicles: usize, problem: String },
    /// Findings of the check of the data.
    Found { finding: Box<Finding> },
    /// Identical rows that were counted once.
    RowsRepeated { rows: usize, line: u64 },
}

impl Note {
    /// True if it counts what a table has beside its pairs.
    pub fn leaves_out(&self) -> bool {
        matches!(self, Note::ShortPairs { .. } | Note::LeadersAbsent { .. } | Note::BrokenLeftOut { .. })
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Note::DriverMode { car, t_s, mode } => {
                write!(f, "car {car}: driver mode {mode} from {t_s:.1} s")
            }
            Note::LeadersAbsent { vehicles } => {
                write!(
                    f,
                    "{vehicles} vehicles name a vehicle ahead that is not in the table; those stretches are left out"
                )
            }
            Note::LongVehicles { column, median_m } => write!(
                f,
                "column {column}: half of the vehicles are {median_m:.1} m long or longer; right for lorries, wrong for cars: is it in feet?"
            ),
            Note::IgnoredColumns { columns } => {
                write!(f, "columns not read: {}", columns.join(", "))
            }
            Note::OpenEnd { line } => write!(f, "line {line}, the last, has no line end: was the file cut?"),
            Note::LengthDerived { car, length_m, from } => {
                write!(f, "length of car {car}: {length_m:.3} m from {from}")
            }
            Note::LengthUnknown => {
                write!(f, "length of the car ahead unknown: its position means its rear bumper")
            }
            Note::Derived { signal, from } => write!(f, "{signal} derived from {from}"),
            Note::Cut { from_s, to_s, rows, kept } => {
                write!(f, "cut to {from_s:.1}..{to_s:.1} s: {kept} of {rows} rows")
            }
            Note::Clipped { signal, samples, lowest_mps } => {
                write!(f, "{signal}: {samples} negative samples set to 0 (lowest {lowest_mps:.3} m/s)")
            }
            Note::Resampled { from_s, to_s, rows, samples } => {
                write!(f, "resampled linearly from {from_s:.4} s to {to_s:.4} s: {rows} rows, {samples} samples")
            }
            Note::RowsFilled { rows, longest_s } => {
                write!(f, "{rows} missing rows interpolated (longest gap {longest_s:.2} s)")
            }
            Note::Filled { signal, samples, longest_s } => {
                write!(f, "{signal}: {samples} missing samples interpolated (longest gap {longest_s:.2} s)")
            }
            Note::Split { segment, segments, from_s, to_s } => {
                write!(f, "segment {segment} of {segments} between long gaps: {from_s:.1}..{to_s:.1} s")
            }
            Note::Dropped { from_s, to_s, needed_s } => {
                write!(f, "dropped {from_s:.1}..{to_s:.1} s between long gaps: shorter than {needed_s:.1} s")
            }
            Note::LeftOut { signal, missing } => {
                write!(f, "{signal} left out: {missing} samples missing in long gaps")
            }
            Note::Smoothed { passes, points, order, dt_s, lead_speed_rms_mps, speed_rms_mps, spacing_rms_m } => write!(
                f,
                "smoothed: {passes} Savitzky-Golay passes, {points} points ({:.1} s), order {order}; rms change of lead \
                 speed {lead_speed_rms_mps:.4} m/s, speed {speed_rms_mps:.4} m/s, spacing {spacing_rms_m:.4} m",
                dt_s * (*points as f64 - 1.0)
            ),
            Note::StartAssumed { position_m } => {
                write!(f, "position unknown: the preceding vehicle starts at {position_m} m")
            }
            Note::Reconciled { anchor, rms_m, largest_m, drift_m_per_km } => write!(
                f,
                "spacing from {anchor}; measured gap minus integrated speeds: rms {} m, largest {} m, drift {} m/km",
                thousandths(*rms_m),
                thousandths(*largest_m),
                thousandths(*drift_m_per_km),
            ),
            Note::Mapped { map, pair: None } => write!(f, "read by the column map {map}"),
            Note::Mapped { map, pair: Some(pair) } => write!(f, "read by the column map {map}, pair {pair}"),
            Note::ShortPairs { pairs, needed_s } => {
                write!(f, "{pairs} more pairs of the file are shorter than {needed_s} s")
            }
            Note::NoGap { signal, samples, .. } => {
                write!(f, "{signal}: {samples} samples are not above 0 and count as missing")
            }
            Note::IdAgain { id, line, read_as } => write!(
                f,
                "line {line}: the time restarts, so two trajectories have the id {id}; the second one is read as {read_as}"
            ),
            Note::LinesSkipped { line, lines: 1, what } => write!(f, "line {line} not read: {what}"),
            Note::LinesSkipped { line, lines, what } => {
                write!(f, "lines {line} to {} not read: {what}", line + lines - 1)
            }
            Note::NumbersAgain { vehicles, numbers } => write!(
                f,
                "numbers recur after a pause and count as other vehicles: {} vehicles have {numbers} numbers",
                numbers + vehicles
            ),
            Note::BrokenLeftOut { vehicles, problem } => {
                write!(f, "pairs of {vehicles} vehicles with broken values are left out; {problem}")
            }
            Note::RowsRepeated { rows: 1, line } => {
                write!(f, "line {line} repeats another row exactly; used once")
            }
            Note::RowsRepeated { rows, line } => {
                write!(f, "{rows} rows are exact repetitions and count once, the first in line {line}")
            }
            Note::Found { finding } => write!(f, "{}", finding.message()),
            Note::GradeFromColumn { points } => {
                write!(f, "grade along the measured path from column sin_grade: {points} points")
            }
        }
    }
}

/// Three decimals, without the sign of a zero.
fn thousandths(x: f64) -> String {
    let text = format!("{x:.3}");
    if text == "-0.000" { "0.000".to_owned() } else { text }
}
