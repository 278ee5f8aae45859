//! Valid files of every layout, broken in a hundred ways: each is refused with its place, or passes every step.
//!
//! `LEADLAG_FUZZ_SECONDS=600` breaks files for that time per test; by default a second. (fuzz/ has targets that learn from
//! coverage.)

use crate::all_steps;
use crate::common::parquet_table;
use cpu_time::ThreadTime;
use leadlag::internal::trajectory::import::ColumnMap;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::time::{Duration, Instant};

const OPENACC: &[u8] = include_bytes!("../data/openacc.csv");
const REBUILT: &[u8] = include_bytes!("../data/rebuilt.csv");
const PROCESSED: &[u8] = include_bytes!("../data/processed/made_up.csv");
const ULTRA_AV: &[u8] = include_bytes!("../data/ultra_av.csv");
const PAIR: &[u8] = include_bytes!("../data/pair.csv");
const GRADES: &[&[u8]] = &[include_bytes!("../data/grade_open.csv"), include_bytes!("../data/processed/Slope.csv")];
const LABELS: &[&[u8]] = &[include_bytes!("../data/processed/Labels.csv")];
const ALL: &[&[u8]] = &[OPENACC, REBUILT, PROCESSED, ULTRA_AV, PAIR];

/// Time limit for a file of this size, whatever its content; such a file takes milliseconds.
const LONGEST: Duration = Duration::from_secs(10);
/// Replacements of a number.
const FIELDS: &[&str] = &[
    "",
    " ",
    "0",
    "-0",
    "-1",
    "1e9",
    "1e308",
    "-1e308",
    "1e-320",
    "NaN",
    "nan",
    "inf",
    "-inf",
    "9007199254740993",
    "1,5",
    "0x10",
    "1_0",
    "\"",
    "\"1",
    "\u{feff}",
    "é",
    "12:34:56",
    "2020-02-01T00:00:00Z",
    "20",
    "0.1",
    "0.30000000000000004",
];
/// Bytes that may occur anywhere in a file.
const PIECES: &[&str] = &[
    ",", ";", "\t", "\n", "\r", "\r\n", "\n\n", "\0", "#", "\"", "=", "[", "]", "{", "}", ".", "-", "e", "\u{2028}",
    "1",
];

/// Breaks files.
struct Vandal(ChaCha8Rng);

impl Vandal {
    /// 0 if there is nothing below.
    fn below(&mut self, end: usize) -> usize {
        self.0.random_range(0..end.max(1))
    }

    fn pick<'a, T: ?Sized>(&mut self, of: &[&'a T]) -> &'a T {
        of[self.below(of.len())]
    }

    /// One of these files, broken in a few places; mostly short ones, in which a place matters more.
    fn broken(&mut self, of: &[&[u8]]) -> Vec<u8> {
        let mut file = self.pick(of).to_vec();
        if self.below(3) > 0 {
            let lines = 2 + self.below(16);
            let end = file.iter().enumerate().filter(|(_, byte)| **byte == b'\n').nth(lines).map(|(at, _)| at + 1);
            file.truncate(end.unwrap_or(file.len()));
        }
        for _ in 0..self.below(8) {
            self.breaks(&mut file, of);
        }
        file
    }

    fn breaks(&mut self, file: &mut Vec<u8>, of: &[&[u8]]) {
        let at = self.below(file.len());
        match self.below(10) {
            0 if !file.is_empty() => file[at] = self.0.random_range(0..=255),
            1 if !file.is_empty() => file[at] ^= 1 << self.below(8),
            2 => drop(file.splice(at..at, self.pick(PIECES).bytes())),
            3 => {
                let end = (at + 1 + self.below(8)).min(file.len());
                file.drain(at.min(end)..end);
            }
            4 => {
                let field = piece(file, at, |byte| b",;\t\n =".contains(&byte));
                let new = self.pick(FIELDS);
                file.splice(field, new.bytes());
            }
            5 => {
                let line = piece(file, at, |byte| byte == b'\n');
                let copy = file[line.clone()].to_vec();
                let times = 1 + self.below(40);
                let again = copy.iter().copied().chain([b'\n']).collect::<Vec<u8>>().repeat(times);
                file.splice(line.start..line.start, again);
            }
            6 => {
                let line = piece(file, at, |byte| byte == b'\n');
                file.drain(line.start..(line.end + 1).min(file.len()));
            }
            7 => {
                // The rest of another file, from a random place on.
                let other = self.pick(of);
                let from = self.below(other.len());
                let to = (from + self.below(400)).min(other.len());
                file.splice(at..at, other[from..to].iter().copied());
            }
            8 => self.swaps(file),
            _ => file.truncate(at.max(1)),
        }
    }

    /// Swaps the names of two columns, or two lines.
    fn swaps(&mut self, file: &mut [u8]) {
        let ends = |byte: u8| b",\n".contains(&byte);
        let [one, other] = [self.below(file.len()), self.below(file.len())].map(|at| piece(file, at, ends));
        let length = one.len().min(other.len());
        for k in 0..length {
            file.swap(one.start + k, other.start + k);
        }
    }
}

/// The piece between two of these bytes that a place is in.
fn piece(file: &[u8], at: usize, ends: impl Fn(u8) -> bool) -> std::ops::Range<usize> {
    let start = file[..at].iter().rposition(|byte| ends(*byte)).map_or(0, |before| before + 1);
    let end = file[at..].iter().position(|byte| ends(*byte)).map_or(file.len(), |after| at + after);
    start..end
}

/// Breaks files for the requested time; `read` returns whether one is still accepted.
fn attack(read: impl Fn(&mut Vandal) -> bool + Sync) {
    let seconds = std::env::var("LEADLAG_FUZZ_SECONDS").map_or(1, |seconds| seconds.parse().expect("a number"));
    let (began, mut count, mut taken, mut longest) = (Instant::now(), 0_u64, 0_u64, Duration::ZERO);
    while began.elapsed() < Duration::from_secs(seconds) {
        // Many per thread, with the seed as its name, so that a panic shows which ones.
        let work = || {
            let mut vandal = Vandal(ChaCha8Rng::seed_from_u64(count));
            let timed = |_| {
                let began = ThreadTime::now();
                (read(&mut vandal), began.elapsed())
            };
            (0..50).map(timed).collect::<Vec<_>>()
        };
        let done = std::thread::scope(|scope| {
            let thread = std::thread::Builder::new().name(format!("files of seed {count}"));
            thread.spawn_scoped(scope, work).expect("a thread").join().expect("no file panics")
        });
        for (is_taken, time) in done {
            assert!(time < LONGEST, "a file of seed {count} takes {time:?}");
            longest = longest.max(time);
            taken += u64::from(is_taken);
        }
        count += 50;
    }
    eprintln!("{count} files, {taken} of them taken, {longest:?} at most, in {:?}", began.elapsed());
    assert!(taken > 0 && taken < count, "{taken} of {count} files are taken");
}

/// Files of a layout, read as this layout, or by their header.
macro_rules! each_is_attacked {
    ($($test:ident: $files:expr, $layout:expr;)*) => {$(
        #[test]
        fn $test() {
            attack(|vandal| all_steps::run(&vandal.broken($files), $layout));
        }
    )*};
}

each_is_attacked! {
    broken_files_of_any_layout: ALL, None;
    broken_openacc_files: &[OPENACC, REBUILT], Some("openacc");
    broken_rebuilt_files: &[REBUILT], Some("astazero-rebuilt");
    broken_processed_files: &[PROCESSED], Some("astazero-processed");
    broken_ultra_av_files: &[ULTRA_AV], Some("ultra-av");
    broken_pair_files: &[PAIR], Some("pair");
}

#[test]
fn broken_grade_profiles() {
    attack(|vandal| all_steps::grade(&vandal.broken(GRADES)));
}

#[test]
fn broken_labels() {
    attack(|vandal| all_steps::labels(&vandal.broken(LABELS)));
}

/// Maps for tables of pairs and of platoons; those that are shipped are for tables of vehicles.
const PAIRS: &str = r#"rows = "pairs"
[columns]
time = { name = "time_s" }
speed = { name = "speed_mps", unit = "m/s" }
lead_speed = { name = ["v_l", "lead_speed_mps"] }
gap = { name = "spacing_m", unit = "m" }
sin_grade = { name = "sin_grade", optional = true }
"#;
const PLATOON: &str = r#"rows = "platoon"
length = 4.6
[columns]
time = { name = "Time" }
position = { name = "X{}" }
speed = { name = "SpeedDoppler{}" }
gap = { name = "Spacing{}" }
"#;

/// A table for a shipped map: a vehicle whose speed oscillates around 15 m/s and one 30 m behind it.
fn table(map: &str) -> Vec<u8> {
    let header = match map {
        "ngsim" => "Global_Time,Vehicle_ID,Preceding,Lane_ID,Local_Y,v_Vel,v_Acc,v_Length,Space_Headway",
        "highd" => "frame,id,precedingId,laneId,x,xVelocity,width",
        "sumo-fcd" => "timestep_time;vehicle_id;vehicle_leaderID;vehicle_speed;vehicle_leaderGap",
        "exid" => "frame,trackId,leadId,leadDHW,lonVelocity,length",
        "i24-motion" => "timestamp,_id,lane,x_position,speed,length",
        "fhwa-cav" => "run_no,timestamp,xLeaderReal,vLeaderReal,xFollowerReal,vFollowerReal",
        "waymo-pairs" => "Time_Index,Trajectory_ID,Speed_FAV,Speed_LV,Spatial_Gap",
        "tgsim" => "time,id,lane_kf,xloc_kf,speed_kf,length_smoothed",
        other => panic!("{other}: a table for it is missing here"),
    };
    let mut text = header.to_owned() + "\n";
    for step in 1..=60_u32 {
        for (id, ahead, behind) in [(1, 0, 0.0), (2, 1, 30.0)] {
            let t = f64::from(step) / if ["highd", "exid"].contains(&map) { 25.0 } else { 10.0 };
            let (x, v) = (50.0 - behind + 15.0 * t + 20.0 * (1.0 - (0.2 * t).cos()), 15.0 + 4.0 * (0.2 * t).sin());
            text += &match map {
                "ngsim" => {
                    let [x, v, length, headway] = [x, v, 4.5, behind].map(|si| si / 0.3048);
                    format!(
                        "{}00,{id},{ahead},2,{x:.3},{v:.3},0,{length:.1},{headway:.3}\n",
                        u64::from(step) + 11_188_469_802
                    )
                }
                "highd" => format!("{step},{id},{ahead},2,{x:.3},{v:.3},4.5\n"),
                "exid" => format!("{step},{id},{},25.5,{v:.3},4.5\n", if ahead == 0 { -1 } else { ahead }),
                "i24-motion" => {
                    let [x, v, length] = [x, v, 4.5].map(|si| si / 0.3048);
                    format!("{:.1},{id},2,{x:.3},{v:.3},{length:.1}\n", 1.6e9 + t)
                }
                "fhwa-cav" | "waymo-pairs" if id == 1 => String::new(),
                "fhwa-cav" => format!("1,{t:.1},{:.3},{v:.3},{x:.3},{v:.3}\n", x + 30.0),
                "waymo-pairs" => format!("{},7,{v:.3},{v:.3},25.5\n", 100 * step),
                "sumo-fcd" if id == 1 => format!("{t:.2};lead;;{v:.3};-1\n"),
                "sumo-fcd" => format!("{t:.2};ego;lead;{v:.3};25.5\n"),
                _ => format!("{t:.1},{id},2,{x:.3},{v:.3},4.5\n"),
            };
        }
    }
    text.into_bytes()
}

#[test]
fn broken_column_maps_and_tables() {
    let shipped = ColumnMap::shipped().iter().map(|(name, map)| (map.as_bytes(), table(name)));
    let others = [(PAIRS.as_bytes(), PAIR.to_vec()), (PLATOON.as_bytes(), PROCESSED.to_vec())];
    let known: Vec<(&[u8], Vec<u8>)> = shipped.chain(others).collect();
    for (map, table) in &known {
        assert!(all_steps::mapped(map, table), "{}", String::from_utf8_lossy(map));
    }
    let maps: Vec<&[u8]> = known.iter().map(|(map, _)| *map).collect();
    attack(|vandal| {
        let (map, table) = &known[vandal.below(known.len())];
        // If both are broken at once, the map is refused.
        if vandal.below(3) > 0 {
            return all_steps::mapped(map, &vandal.broken(&[table]));
        }
        let mut map = map.to_vec();
        (0..=vandal.below(4)).for_each(|_| vandal.breaks(&mut map, &maps));
        all_steps::mapped(&map, table)
    });
}

/// The footer, which has the positions of everything, is broken more often than the pages.
#[test]
fn broken_parquet_tables() {
    use parquet::basic::{Compression, Encoding, ZstdLevel};
    use parquet::file::properties::WriterVersion;
    let folder = tempfile::tempdir().expect("a folder");
    let rows: Vec<Vec<f64>> = (0..60).map(|k| vec![0.1 * f64::from(k), 15.0, 15.0, 20.0]).collect();
    let sound = |how: Compression| {
        let path = folder.path().join("sound.parquet");
        parquet_table::parquet("time_s,lead_speed_mps,speed_mps,spacing_m", &rows, how, &path);
        assert!(all_steps::file(&path), "{how}");
        std::fs::read(path).expect("it was written")
    };
    let ways = [Compression::UNCOMPRESSED, Compression::SNAPPY, Compression::ZSTD(ZstdLevel::default())];
    // Text by its differences, whose lengths leadlag checks itself.
    let drivers: Vec<Option<String>> =
        (0..60).map(|row| (row % 7 != 3).then(|| format!("driver {}", row / 20))).collect();
    let text = [Encoding::DELTA_BYTE_ARRAY, Encoding::DELTA_LENGTH_BYTE_ARRAY]
        .map(|encoding| parquet_table::with_drivers(&drivers, encoding, WriterVersion::PARQUET_2_0));
    // Numbers by their differences, and split into bytes, which the library reads.
    let others =
        [include_bytes!("../data/pair.parquet").to_vec(), include_bytes!("../data/pair_delta.parquet").to_vec()];
    let files: Vec<Vec<u8>> = ways.map(sound).into_iter().chain(text).chain(others).collect();
    attack(|vandal| {
        let mut file = files[vandal.below(files.len())].clone();
        for _ in 0..=vandal.below(4) {
            let from = if vandal.below(3) > 0 { file.len().saturating_sub(700) } else { 0 };
            let at = from + vandal.below(file.len() - from);
            file[at] = [0, 255, 127, 128, file[at] ^ 1, vandal.below(256) as u8][vandal.below(6)];
        }
        let path = folder.path().join(format!("{:?}.parquet", std::thread::current().id()));
        std::fs::write(&path, file).expect("room");
        all_steps::file(&path)
    });
}
