//! Measured data: from a file to leader–follower pairs for simulation.
//!
//! A file becomes a [`Recording`] (`import`), its platoons become [`Trajectory`] pairs (`prepare`);
//! everything derived, filled, cut or reconciled on the way is kept as [`Note`]s.

pub mod error;
mod factor;
mod grade;
pub mod import;
pub mod inspect;
mod note;
pub mod prepare;
pub mod savitzky_golay;
pub mod soundness;
mod split;
mod steps;
mod treatment;

pub use error::{Faults, ImportError, PrepareError};
pub use grade::Grade;
pub use import::Layout;
pub use inspect::{Inspection, inspect};
pub use note::Note;
pub use prepare::{Preparation, Reconcile, Stretch, prepare, prepare_platoon};
pub use soundness::{Finding, FindingKind, Remedy};
pub use treatment::Treatment;

use std::collections::BTreeMap;

/// Source of data: enough to find the file again and to notice a change.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Source {
    /// The path as the user gave it.
    pub path: String,
    /// SHA-256 of the file's bytes, lower-case hexadecimal.
    pub sha256: String,
}

impl Source {
    /// The checksum of a file whose bytes are these.
    pub fn of_bytes(path: &std::path::Path, bytes: &[u8]) -> Source {
        use sha2::{Digest, Sha256};
        Source { path: path.display().to_string(), sha256: hexadecimal(&Sha256::digest(bytes)) }
    }

    /// The checksum of a file, read in pieces. Fails when it cannot be read.
    pub fn of(path: &std::path::Path) -> std::io::Result<Source> {
        use sha2::{Digest, Sha256};
        let mut hash = Sha256::new();
        let mut file = std::fs::File::open(path)?;
        let mut piece = [0; 65536];
        loop {
            let length = std::io::Read::read(&mut file, &mut piece)?;
            if length == 0 {
                return Ok(Source { path: path.display().to_string(), sha256: hexadecimal(&hash.finalize()) });
            }
            hash.update(&piece[..length]);
        }
    }
}

/// A checksum in its usual form: lower-case hexadecimal.
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// One imported file: one platoon in most layouts, one pair per trajectory id in Ultra-AV tables.
#[derive(Debug, Clone)]
pub struct Recording {
    /// The file.
    pub source: Source,
    /// Its layout, detected or given.
    pub layout: Layout,
    /// At least one platoon, in file order.
    pub platoons: Vec<Platoon>,
    /// Files beside it that were also read (`Labels.csv`, `Slope.csv`).
    pub companions: Vec<Source>,
    /// Grade of the road from a file beside it, if any.
    pub grade: Option<Grade>,
    /// Selection of its followers.
    pub chosen_by: ChosenBy,
}

/// Selection of a follower of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ChosenBy {
    /// Its place: 1 is right behind the leader.
    Place,
    /// The id of the vehicle, in a table of vehicles.
    Vehicle,
    /// The name of its group, in a table of pairs.
    Group,
}

impl Recording {
    /// Name of the file without folder and extension.
    pub fn stem(&self) -> &str {
        let stem = std::path::Path::new(&self.source.path).file_stem();
        stem.and_then(std::ffi::OsStr::to_str).unwrap_or(&self.source.path)
    }
}

/// Cars driving one behind the other, on one time axis. Missing samples are NaN.
#[derive(Debug, Clone)]
pub struct Platoon {
    /// Trajectory id of layouts that hold several platoons in one file.
    pub id: Option<String>,
    /// Time as written in the file \[s\], strictly increasing.
    pub t: Vec<f64>,
    /// Line of each sample in the file, counted from 1.
    pub lines: Vec<u64>,
    /// Front to back; `cars[0]` is the platoon leader. Cars without any column are absent.
    pub cars: Vec<Car>,
    /// Changes by the importer.
    pub notes: Vec<Note>,
}

/// The measured signals of one car; every vector is as long as the platoon's `t`.
#[derive(Debug, Clone)]
pub struct Car {
    /// Position in the platoon as numbered by the file: 1 is the platoon leader. 0 is the car ahead of the leader of a
    /// pair file.
    pub number: usize,
    /// Name as written in the file (`Tesla(Model3)`), or `car 2` if the file gives none.
    pub name: String,
    /// Length of the car \[m\] if the file or its companion table gives one.
    pub length: Option<f64>,
    /// Speed \[m/s\].
    pub v: Vec<f64>,
    /// Cumulative position along the road \[m\], if measured.
    pub x: Option<Vec<f64>>,
    /// Bumper-to-bumper gap to the car with the next lower number \[m\], if measured.
    pub gap: Option<Vec<f64>>,
    /// Acceleration \[m/s²\], if the file gives one (checked by `inspect`, never simulated against).
    pub a: Option<Vec<f64>>,
    /// Sine of the road grade under this car, if the file gives one.
    pub sin_grade: Option<Vec<f64>>,
    /// Faults of its own signals; results that need these signals are unavailable.
    pub faults: Faults,
    pub gap_faults: Faults,
}

/// True for a placeholder: pair files name no car, and tables give a number. Two cars may share it.
pub fn is_nameless(car: &str) -> bool {
    let is_number = car.chars().all(|c| c.is_ascii_digit());
    is_number || car == "follower" || car.starts_with("car ") || car.starts_with("vehicle ")
}

/// The id of a driver: the name of the car, otherwise that of the trajectory; `None` without either.
pub fn driver_id<'a>(name: &'a str, trajectory: Option<&'a str>) -> Option<&'a str> {
    Some(name).filter(|name| !is_nameless(name)).or(trajectory)
}

impl Platoon {
    /// Faults of the signals that a follower needs; 1 is the car right behind the leader.
    pub fn faults_of(&self, follower: usize) -> Faults {
        let mut faults = Faults::default();
        for car in self.cars.iter().filter(|car| car.number == follower || car.number == follower.saturating_add(1)) {
            faults.merge(car.faults.clone());
            if car.number > follower {
                faults.merge(car.gap_faults.clone());
            }
        }
        faults
    }

    /// True if there is a follower with sound signals of sufficient length.
    fn is_usable(&self) -> bool {
        let duration = self.t.first().zip(self.t.last()).map_or(0.0, |(first, last)| last - first);
        if duration < prepare::SEGMENT_MIN_S {
            return false;
        }
        let followers = self.cars.windows(2).filter(|pair| pair[0].number > 0 && pair[1].number == pair[0].number + 1);
        followers.map(|pair| pair[0].number).any(|follower| self.faults_of(follower).is_empty())
    }
}

impl Car {
    /// A car without signals; without a name (or with an empty one) its number is the name.
    fn new(number: usize, name: Option<&str>) -> Self {
        Car {
            number,
            name: match name {
                Some(name) if !name.is_empty() => name.to_owned(),
                _ => format!("car {number}"),
            },
            length: None,
            v: Vec::new(),
            x: None,
            gap: None,
            a: None,
            sin_grade: None,
            faults: Faults::default(),
            gap_faults: Faults::default(),
        }
    }
}

/// One leader–follower pair without gaps, on a uniform time step: input of an evaluator.
///
/// All vectors have the same length; `s[i] == x_l[i] - x_f[i] - len_l` up to rounding, and `x_f`
/// follows from `v_f` by the ballistic scheme of the paper's Eq. 1.
#[derive(Debug, Clone)]
pub struct Trajectory {
    /// `FILE-STEM follower N`, with the trajectory id and segment if there are several.
    pub label: String,
    /// The file.
    pub source: Source,
    /// 1 = the car right behind the platoon leader.
    pub follower: usize,
    /// Name of the follower as in the file.
    pub name: String,
    /// Its id, if the file names its trajectories.
    pub id: Option<String>,
    /// Nominal time step \[s\], decimal (0.1, not the difference of two decimal times).
    pub dt: f64,
    /// `t[1] - t[0]` as a double \[s\], which the paper's authors simulate with (0.10000000000000009 for 0.1).
    pub dt_raw: f64,
    /// Time as written in the file \[s\]; samples that were filled in or resampled lie on the grid of the others.
    pub t: Vec<f64>,
    /// Position of the preceding vehicle along the road \[m\].
    pub x_l: Vec<f64>,
    /// Speed of the preceding vehicle \[m/s\].
    pub v_l: Vec<f64>,
    /// Length of the preceding vehicle \[m\]; 0 if unknown, `x_l` then means its rear bumper.
    pub len_l: f64,
    /// Measured position of the follower \[m\].
    pub x_f: Vec<f64>,
    /// True if the file gives a position, so that equal positions of two drives are one place of the road.
    pub is_placed: bool,
    /// Measured speed of the follower \[m/s\].
    pub v_f: Vec<f64>,
    /// Measured bumper-to-bumper spacing \[m\].
    pub s: Vec<f64>,
    /// Speed of the car ahead of the preceding vehicle \[m/s\], if measured.
    pub v_l2: Option<Vec<f64>>,
    /// Gap between those two \[m\], if measured.
    pub s_l2: Option<Vec<f64>>,
    /// Road grade, where known.
    pub grade: Option<Grade>,
    /// Signals derived, filled, cut, smoothed, resampled or reconciled, in order.
    pub notes: Vec<Note>,
}

impl Trajectory {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.t.len()
    }

    /// The longest of the segments that [`prepare()`] finds, which are never none; of equally long ones the first. Panics without a segment.
    pub fn longest(segments: Vec<Trajectory>) -> Trajectory {
        segments.into_iter().rev().max_by_key(Trajectory::len).expect("`prepare` finds at least one")
    }

    /// Driver of the follower, if the file names one: `ACC`, `Human`.
    pub fn driver(&self) -> Option<&str> {
        self.notes.iter().find_map(|note| match note {
            Note::DriverMode { mode, .. } => Some(mode.as_str()),
            _ => None,
        })
    }

    /// Changes to the data, in order.
    pub fn preparation(&self) -> impl Iterator<Item = &Note> {
        self.notes.iter().filter(|note| !matches!(note, Note::Found { .. }))
    }

    /// Findings of the check of the data.
    pub fn findings(&self) -> impl Iterator<Item = &Finding> {
        self.notes.iter().filter_map(|note| match note {
            Note::Found { finding } => Some(&**finding),
            _ => None,
        })
    }

    /// Faults of the data that change the calibration or were corrected, one line each.
    pub fn faults(&self) -> impl Iterator<Item = String> {
        self.faults_of(|_| true)
    }

    /// The same of some kinds.
    pub fn faults_of(&self, of: impl Fn(FindingKind) -> bool) -> impl Iterator<Item = String> {
        let counts = move |finding: &&Finding| of(finding.kind) && (finding.matters || finding.correction.is_some());
        self.findings().filter(counts).map(Finding::message)
    }

    /// True if there is no sample (never in a prepared trajectory).
    pub fn is_empty(&self) -> bool {
        self.t.is_empty()
    }
}

/// The message if the data name different followers, or different drivers (`ACC`, `Human`), and their number. Placeholders and unknown drivers
/// say nothing.
pub fn different_names(trajectories: &[&Trajectory]) -> Option<(usize, String)> {
    let names = |one: &Trajectory| Some(one.name.clone()).filter(|name| !name.is_empty() && !is_nameless(name));
    let drivers = |one: &Trajectory| one.driver().map(str::to_owned);
    let differ = |what: &str, of: &dyn Fn(&Trajectory) -> Option<String>| {
        let mut all: BTreeMap<String, &str> = BTreeMap::new();
        trajectories.iter().filter_map(|one| Some((of(one)?, one))).for_each(|(name, one)| {
            all.entry(name).or_insert(&one.source.path);
        });
        let (count, shown) = (all.len(), all.iter().take(2).map(|(name, path)| format!("{name} in {path}")));
        let shown = shown.collect::<Vec<_>>().join(", ");
        (count > 1).then(|| (count, format!("the data name {count} {what}, such as {shown}; diagnose each separately")))
    };
    differ("followers", &names).or_else(|| differ("drivers", &drivers))
}

/// Positions that follow from speeds by the ballistic scheme, Eq. 1 \[m\].
pub fn integrate(x_0: f64, v: &[f64], dt: f64) -> Vec<f64> {
    let mut x = Vec::with_capacity(v.len());
    let mut x_i = x_0;
    for (i, &v_i) in v.iter().enumerate() {
        if i > 0 {
            x_i += (v[i - 1] + v_i) / 2.0 * dt;
        }
        x.push(x_i);
    }
    x
}
