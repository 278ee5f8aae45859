//! One problem of one file, with its place.

use crate::text::option::COLUMNS;
use std::fmt::Write as _;

/// One thing wrong in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    /// Line, counted from 1.
    pub line: u64,
    /// Character of the line at which the field starts, counted from 1 (as compilers do).
    pub column: Option<usize>,
    pub kind: ProblemKind,
}

/// A smaller step is not the time step of a sensor \[s\]: a second in days is 1.2e-5.
pub(crate) const DAYS_STEP_S: f64 = 2e-5;
/// Nor is one below this \[s\]: it is 2 s in hours, and no logger writes 2,000 rows per second.
pub(crate) const HOURS_STEP_S: f64 = 5e-4;

/// The fault: expected, found, and remedy.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemKind {
    #[error("the file is empty; expected a header line and rows of numbers")]
    Empty,
    #[error("byte 0x{byte:02X} is not text; expected CSV in UTF-8: convert the file, or unpack it if it is compressed")]
    NotText { byte: u8 },
    #[error("this is {what}; expected a table as text, CSV in UTF-8: {advice}")]
    OtherFormat { what: &'static str, advice: &'static str },
    #[error("the file is UTF-16; expected UTF-8: save it again as UTF-8")]
    Utf16,
    #[error("the line is longer than {limit} bytes; expected rows of CSV: is this the right file?")]
    LineTooLong { limit: usize },
    #[error(
        "expected a table of at most {limit} bytes of text (unpacked), found more; split the file by time or by vehicle, and remove columns that leadlag does not read"
    )]
    TableTooLarge { limit: u64 },
    #[error(
        "expected at most {rows} lines, which take {} MiB of memory, found more; split the file by time or by vehicle, or allow this process more memory if it is limited (`ulimit -v`)",
        limit >> 20
    )]
    TooManyRows { limit: u64, rows: u64 },
    #[error("a carriage return inside a line; expected line endings LF or CRLF: convert the line endings of the file")]
    LoneCarriageReturn,
    #[error(
        "the fields are separated by {found}; expected commas, and a point in decimal numbers: convert the file{}",
        by_map(*mapped)
    )]
    Separator { found: &'static str, mapped: Option<&'static str> },
    #[error(
        "the header line is missing, the first line has numbers: {}; put a line with the names of the columns before it, for a pair time_s,lead_speed_mps,speed_mps,spacing_m in the order of the file, or give them as header = [...] in a column map ({COLUMNS})",
        some(found)
    )]
    NoNames { found: Vec<String> },
    #[error(
        "no known layout has the columns {}; expected those of openacc or astazero-rebuilt (metadata lines, then Time, Speed1, IVS1, ...), astazero-processed (Time, X1, SpeedDoppler1, Spacing2, ...), ultra-av (Trajectory_ID, Time_Index, ...) or pair (time_s, speed_mps, spacing_m, lead_speed_mps): rename the columns, or read the table with {COLUMNS} (`leadlag list columns`, or a file of your own)",
        some(found)
    )]
    UnknownHeader { found: Vec<String> },
    #[error(
        "expected the metadata line \"{expected},...\", found {}; OpenACC files have 5 such lines before the header: restore them{}",
        quoted(found),
        if *expected == "Date" { format!("; if the table never had them, read its columns with {COLUMNS}, or rename those of a pair to time_s, lead_speed_mps, speed_mps and spacing_m") } else { String::new() }
    )]
    Metadata { expected: &'static str, found: String },
    #[error("expected a column map for this layout; read the file with one ({COLUMNS})")]
    NeedsMap,
    #[error("the file ends after its header; expected rows of numbers")]
    NoRows,
    #[error("the file ends before its header; expected a header line and rows of numbers after the metadata")]
    NoHeader,
    #[error("expected at least 2 rows of numbers, found 1; a trajectory needs more")]
    OneRow,
    #[error("{}", missing(columns, has, needed, renames, advice))]
    MissingColumns {
        columns: Vec<String>,
        has: Vec<String>,
        needed: Vec<String>,
        renames: Vec<(String, String)>,
        advice: String,
    },
    #[error("column {} is unknown; did you mean {near}? Rename it", clipped(column))]
    UnknownColumn { column: String, near: String },
    #[error("expected at most {limit} columns, found {found}; is this the header of a measured file?")]
    TooManyColumns { limit: usize, found: usize },
    #[error("column {} appears twice; remove or rename one", clipped(column))]
    DuplicateColumn { column: String },
    #[error("expected {expected} fields as in the header, found {found}; {}", field_hint(*expected, *found, *last))]
    FieldCount { expected: usize, found: usize, last: bool },
    #[error(
        "column {column}: expected a finite number, found {}; {}",
        quoted(found),
        if *optional { "leave the field empty if the value is missing" } else { "give a number or delete the row" }
    )]
    NotANumber { column: String, found: String, optional: bool },
    #[error(
        "column {column}: expected a finite number, found {}; write decimal numbers with a point{}",
        quoted(found),
        if *mapped { ", or set decimal = \"comma\" in the column map" } else { "" }
    )]
    DecimalComma { column: String, found: String, mapped: bool },
    #[error(
        "column {column}: expected a number with a decimal comma and no point, found {}; the column map says decimal = \"comma\"",
        quoted(found)
    )]
    DecimalPoint { column: String, found: String },
    #[error("column {column}: expected {expected}, found {}; correct its unit in the column map", quoted(found))]
    NotATime { column: String, expected: &'static str, found: String },
    #[error(
        "column {column}: expected a number, found the time {}; set unit = \"iso\" (date and time) or \"hhmmss\" (time of day) in the column map",
        quoted(found)
    )]
    TimeUnit { column: String, found: String },
    #[error(
        "expected columns of at least 2 cars, found those of {found}; {{}} in a name of the column map stands for the number of a car, {{-1}} for that of the car ahead"
    )]
    FewCars { found: usize },
    #[error(
        "column {column}: expected the unit {expected}, found {}; convert the column, or read the table with {COLUMNS}",
        quoted(found)
    )]
    OtherUnit { column: String, expected: &'static str, found: String },
    #[error("the file ends within the first {lines} lines, which skip_lines of the column map leaves out")]
    AllSkipped { lines: u64 },
    #[error(
        "a row of {found} fields below {expected} names holds a whole trajectory, as in pNEUMA; expected a row per vehicle and time, with \
         time, vehicle, speed, lane and position along the road: rewrite the table, and read it with {COLUMNS}"
    )]
    WholeTrajectory { expected: usize, found: usize },
    #[error("column {column}: expected a finite number, found nothing; give a number or delete the row")]
    Missing { column: String },
    #[error(
        "column {column}: expected a measured value, found {found} in {rows} rows and no other value out of range: does it stand for a \
         missing value? Leave the field empty, or read the table with missing = [\"{found}\"] in a column map ({COLUMNS})"
    )]
    Sentinel { column: String, found: f64, rows: u64 },
    #[error(
        "repeats the header: two recordings in one file, of which the second begins here; split the file at this line"
    )]
    HeaderAgain,
    #[error(
        "column {column}: expected the speed of the vehicle ahead, found values around {found} m/s, behind a follower at {own:.0} m/s: a \
         relative speed? Name it relative_speed in the column map ({COLUMNS}), or add the speed of the follower to it"
    )]
    MappedRelative { column: String, own: f64, found: f64 },
    #[error(
        "{column}: expected a time after {previous}, found {found}; time runs backwards: sort the rows, or split the file here"
    )]
    TimeBack { column: String, previous: f64, found: f64 },
    #[error(
        "{column}: starts over at {found}: two recordings in one file, of which the second begins here; split the file at this line, or name a column that distinguishes them as group in a column map ({COLUMNS})"
    )]
    TimeAnew { column: String, found: f64 },
    #[error(
        "{column}: {rows} rows have the time of the row before: the times are rounded; write them with more digits, or number the rows \
         and read the numbers with unit = \"frame\" and frame_rate in a column map ({COLUMNS})"
    )]
    TimesRounded { column: String, rows: u64 },
    #[error(
        "{column}: expected a time after {found}, found {found} again, first in line {first}; the two rows differ: remove one of them"
    )]
    TimeTwice { column: String, found: f64, first: u64 },
    #[error(
        "{column}: expected a time after {previous}, found {found}; the column map names no group: if {guess} distinguishes drives, add `group = {{ name = \"{name}\" }}` to [columns]",
        guess = guess.join(" or "), name = guess.first().map_or("", String::as_str)
    )]
    NoGroup { column: String, previous: f64, found: f64, guess: Vec<String> },
    #[error(
        "column {column}: expected a spacing above 0 m, found {found}, and none above 0; check that it is bumper to bumper, and its sign"
    )]
    Spacing { column: String, found: f64 },
    #[error(
        "column {column}: expected at most {limit} m in size, found {found}; check the unit, or leave the field empty"
    )]
    TooLong { column: String, limit: f64, found: f64 },
    #[error("column {column}: expected at most {limit} m/s, found {found}; looks like km/h: divide by 3.6")]
    SpeedTooHigh { column: String, limit: f64, found: f64 },
    #[error(
        "column {column}: expected at least {limit} m/s, found {found}; speeds count forwards: check the sign, or leave the field empty"
    )]
    SpeedNegative { column: String, limit: f64, found: f64 },
    #[error(
        "column {column}: expected the sine of the grade, between -{limit} and {limit}, found {found}; divide by 100 if it is in per cent"
    )]
    Grade { column: String, limit: f64, found: f64 },
    #[error(
        "column {column}: expected a position after {previous} m, found {found}; sort the rows and remove duplicates"
    )]
    PositionBack { column: String, previous: f64, found: f64 },
    #[error(
        "column {column}: expected a lap of {shortest} to {longest} m, found {found}; the last position is the length of the closed track"
    )]
    Lap { column: String, shortest: f64, longest: f64, found: f64 },
    #[error(
        "column {column}: expected the track to start at 0 m, found {found}; columns X and Y describe a closed track, position_m and sin_grade an open road"
    )]
    TrackStart { column: String, found: f64 },
    #[error("column {column}: expected a length between 0.5 and 30 m, found {found}; the unit is m")]
    Length { column: String, found: f64 },
    #[error(
        "column {column}: expected at most {limit:.0} {unit}, found {found}; no road vehicle is faster: correct its unit in the column map"
    )]
    MappedSpeed { column: String, unit: String, limit: f64, found: f64 },
    #[error(
        "column {column}: expected at least {limit} m/s forwards, found {found}; for vehicles that drive towards lower positions set direction = \"by-speed\" in the column map"
    )]
    MappedReverse { column: String, limit: f64, found: f64 },
    #[error(
        "column {column}: expected that half of the vehicles are {lowest} to {highest} m long, found {found:.2} m; correct its unit in the column map, or set check_units = false there"
    )]
    MappedLength { column: String, lowest: f64, highest: f64, found: f64 },
    #[error(
        "column {column}: expected a usual step of {shortest} to {longest} s, found {} s; {}correct its unit in the column map",
        format!("{found:.6}").trim_end_matches('0'),
        if *found < DAYS_STEP_S { "is the time in days, unit = \"day\"? " } else { "" }
    )]
    MappedStep { column: String, shortest: f64, longest: f64, found: f64 },
    #[error(
        "column {column}: expected distances in m, found {found:.2} in the middle of those at speeds above 30 km/h: a time headway in s? Name the column of the distance, or positions and lengths, in the column map; check_units = false there accepts it unchanged"
    )]
    MappedTimeHeadway { column: String, found: f64 },
    #[error(
        "columns {a} and {b} contradict each other: the first changes {ratio:.3} times as much as the second implies; {hint}; check_units = false there accepts them unchanged"
    )]
    UnitsContradict { a: String, b: String, ratio: f64, hint: String },
    #[error(
        "vehicle {id} is at {found} s for the second time, first in line {first}, and the two rows differ; remove one of them, or name the column that distinguishes recordings as group in the column map"
    )]
    VehicleTwice { id: String, found: f64, first: u64 },
    #[error(
        "none of {vehicles} vehicles drives behind another one in the same lane for {needed} s, the longest for {longest} s; check the columns lane and position, and direction"
    )]
    NobodyAhead { vehicles: usize, longest: f64, needed: f64 },
    #[error(
        "none of {vehicles} vehicles follows another one of the table for {needed} s, the longest for {longest} s; is {column} the right column of the vehicle ahead?"
    )]
    NoPairs { column: String, vehicles: usize, longest: f64, needed: f64 },
}

impl ProblemKind {
    /// The column and value of a number that may stand for a missing one: negative, or twice the limit. Speeds in another unit are
    /// only slightly above the limit.
    pub(super) fn outside(&self) -> Option<(&str, f64)> {
        let (column, limit, found) = match self {
            ProblemKind::SpeedTooHigh { column, limit, found }
            | ProblemKind::MappedSpeed { column, limit, found, .. }
            | ProblemKind::TooLong { column, limit, found }
            | ProblemKind::SpeedNegative { column, limit, found }
            | ProblemKind::MappedReverse { column, limit, found } => (column, *limit, *found),
            _ => return None,
        };
        (found < 0.0 || found > 2.0 * limit).then_some((column, found))
    }
}

/// At most this many column names are listed.
const NAMES_SHOWN: usize = 12;

/// At most this many characters of a field are repeated.
const CHARACTERS_SHOWN: usize = 40;

fn clipped(text: &str) -> String {
    let mut short: String = text.chars().take(CHARACTERS_SHOWN).collect();
    if short.len() < text.len() {
        short.push_str("...");
    }
    short
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", clipped(text))
}

/// A hint that a column map reads other separators.
fn by_map(separator: Option<&str>) -> String {
    separator.map_or_else(String::new, |name| {
        format!(", or read it by a column map ({COLUMNS}) with separator = \"{name}\"; decimal = \"comma\" there reads decimal commas")
    })
}

fn some(names: &[String]) -> String {
    let shown: Vec<String> = names.iter().take(NAMES_SHOWN).map(|n| clipped(n)).collect();
    let mut text = shown.join(", ");
    if names.len() > NAMES_SHOWN {
        let _ = write!(text, ", ... ({} in all)", names.len());
    }
    text
}

/// Missing columns, in one message for any number.
fn missing(
    columns: &[String],
    has: &[String],
    needed: &[String],
    renames: &[(String, String)],
    advice: &str,
) -> String {
    let [noun, are] = if columns.len() == 1 { ["column", "is"] } else { ["columns", "are"] };
    let mut text = format!("{noun} {} {are} missing; the file has {}", listed(columns), some(has));
    if columns.len() < needed.len() {
        let _ = write!(text, " (needed: {})", needed.join(", "));
    }
    // A new name would not change the unit.
    let speed = |name: &String| name.ends_with("mps");
    let same: Vec<String> = renames
        .iter()
        .filter(|(from, to)| !(speed(to) && says_kmh(from)))
        .map(|(from, to)| format!("{} to {to}", clipped(from)))
        .collect();
    let in_kmh: Vec<String> = has.iter().filter(|name| says_kmh(name)).map(|name| clipped(name)).collect();
    let in_kmh = if columns.iter().any(speed) { in_kmh } else { Vec::new() };
    if !same.is_empty() {
        let _ = write!(text, "; rename {}?", listed(&same));
    }
    if !in_kmh.is_empty() {
        let joint = if same.is_empty() { "; speeds" } else { " Speeds" };
        let _ =
            write!(text, "{joint} are needed in m/s: divide {} by 3.6, or give the unit in a map.", listed(&in_kmh));
    }
    if !advice.is_empty() {
        let _ = write!(text, "{} {advice}", if same.is_empty() && in_kmh.is_empty() { ";" } else { " Or" });
    }
    text
}

/// True for the name of a column of speeds in km/h.
fn says_kmh(name: &str) -> bool {
    let name = name.to_lowercase();
    ["kmh", "km/h", "km_h", "kph", "kmph"].iter().any(|unit| name.contains(unit))
}

/// `a`, `a and b`, `a, b and c`.
fn listed(names: &[String]) -> String {
    match names {
        [before @ .., last] if !before.is_empty() => format!("{} and {last}", before.join(", ")),
        _ => names.concat(),
    }
}

fn field_hint(expected: usize, found: usize, last: bool) -> &'static str {
    if found > expected {
        "write decimal numbers with a point, and no separator within a number"
    } else if last {
        "the last line is cut off: delete it, or copy the file again"
    } else {
        "complete the row (empty fields mean missing values), or delete it"
    }
}
