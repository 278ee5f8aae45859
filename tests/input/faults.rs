//! Planted faults of tables and drives: the rows that are read nevertheless, and the messages.

use leadlag::internal::trajectory::import::{self, ColumnMap, read_mapped_from};
use leadlag::internal::trajectory::{Preparation, Recording, prepare};

/// A drive of a follower behind a car whose speed oscillates, a row each: time, both speeds, gap.
fn rows(count: u32, dt: f64) -> Vec<[f64; 4]> {
    let row = |k: u32| {
        let t = f64::from(k) * dt;
        [t, 20.0 + (0.3 * t).sin(), 20.0 + (0.3 * t - 0.5).sin(), 30.0 + (0.3 * t).cos()]
    };
    (0..count).map(row).collect()
}

const HEADER: &str = "time_s,lead_speed_mps,speed_mps,spacing_m\n";

fn text(rows: &[[f64; 4]]) -> String {
    let field = |x: &f64| if x.is_finite() { format!("{x:.6}") } else { String::new() };
    let row = |row: &[f64; 4]| row.iter().map(field).collect::<Vec<_>>().join(",") + "\n";
    HEADER.to_owned() + &rows.iter().map(row).collect::<String>()
}

fn pair(text: &str) -> Recording {
    import::read_bytes(text.as_bytes(), "pair.csv", None).expect("a pair file")
}

fn mapped(map: &str, text: &str) -> Result<Recording, String> {
    let map = ColumnMap::parse(map, "map.toml").expect("a good map");
    read_mapped_from(text.as_bytes(), "table.csv", &map).map_err(|error| error.to_string())
}

#[test]
fn sensors_of_two_rates_are_joined_by_their_own_values() {
    let mut both = rows(1200, 0.05);
    for (k, row) in both.iter_mut().enumerate() {
        // No row has the values of both sensors.
        if k % 2 == 0 {
            row[3] = f64::NAN;
        } else {
            (row[1], row[2]) = (f64::NAN, f64::NAN);
        }
    }
    let resampled = Preparation { resample: Some(0.1), ..Preparation::default() };
    let trajectories = prepare(&pair(&text(&both)), 1, &resampled).expect("holes of 0.1 s");
    assert_eq!((trajectories.len(), trajectories[0].dt), (1, 0.1));
    assert!(trajectories[0].len() > 595, "{}", trajectories[0].len());
}

#[test]
fn coarse_steps_are_divided_unless_another_step_is_asked_for() {
    let recording = pair(&text(&rows(120, 1.0)));
    let step = |resample| {
        let preparation = Preparation { resample, ..Preparation::default() };
        prepare(&recording, 1, &preparation).expect("two minutes")[0].dt
    };
    assert_eq!([step(None), step(Some(1.0)), step(Some(0.2))], [0.1, 1.0, 0.2]);
    let usual = prepare(&pair(&text(&rows(120, 0.5))), 1, &Preparation::default()).expect("a minute");
    assert_eq!(usual[0].dt, 0.5);
}

#[test]
fn a_drive_is_cut_where_another_one_takes_over() {
    let mut file =
        "Date,14,05,2024\nVehicle_order,Lead car,Test car\nNumber_of_vehicles,2\nACC,2\nDistance_setting,medium\n"
            .to_owned();
    file += "Time,Speed1,Speed2,IVS1,Driver2\n";
    for [t, v_l, v_f, gap] in rows(600, 0.1) {
        let driver = if t < 29.95 { "ACC" } else { "Human" };
        file += &format!("{t:.1},{v_l:.6},{v_f:.6},{gap:.6},{driver}\n");
    }
    let trajectories = prepare(&pair(&file), 1, &Preparation::default()).expect("two drivers");
    let told: Vec<(Option<&str>, f64)> = trajectories.iter().map(|one| (one.driver(), one.t[0])).collect();
    assert_eq!(told, [(Some("ACC"), 0.0), (Some("Human"), 30.0)]);
}

#[test]
fn a_header_within_a_file_is_said_once() {
    let twice = text(&rows(60, 0.1)) + &text(&rows(60, 0.1));
    let error = import::read_bytes(twice.as_bytes(), "pair.csv", None).expect_err("two recordings").to_string();
    assert!(error.starts_with("pair.csv:62: repeats the header") && !error.contains('\n'), "{error}");
}

#[test]
fn a_relative_speed_is_read_and_told_from_that_of_the_vehicle_ahead() {
    let mut table = "t,v,rel,gap\n".to_owned();
    for [t, v_l, v_f, gap] in rows(300, 0.1) {
        table += &format!("{t:.1},{v_f:.6},{:.6},{gap:.6}\n", v_l - v_f);
    }
    let map = |key: &str| {
        format!(
            "rows = \"pairs\"\n[columns]\ntime = {{ name = \"t\" }}\nspeed = {{ name = \"v\" }}\n{key} = {{ name = \"rel\" }}\ngap = {{ name = \"gap\" }}\n"
        )
    };
    for key in ["relative_speed", "range_rate"] {
        let recording = mapped(&map(key), &table).expect("it is read");
        assert!((recording.platoons[0].cars[0].v[0] - 20.0).abs() < 1e-5);
    }
    let said = mapped(&map("lead_speed"), &table).expect_err("a lead speed around 0");
    assert!(said.contains("a relative speed? Name it relative_speed") && !said.contains("by-speed"), "{said}");
}

#[test]
fn a_time_headway_is_no_distance() {
    let mut table = "t,v,lead,headway,gap\n".to_owned();
    for [t, v_l, v_f, gap] in rows(300, 0.1) {
        table += &format!("{t:.1},{v_f:.6},{v_l:.6},{:.6},{gap:.6}\n", (gap + 5.0) / v_f);
    }
    let map = |key: &str, column: &str, more: &str| {
        format!(
            "rows = \"pairs\"\nlead_length = 5\n{more}\n[columns]\ntime = {{ name = \"t\" }}\nspeed = {{ name = \"v\" }}\n\
             lead_speed = {{ name = \"lead\" }}\n{key} = {{ name = \"{column}\" }}\n"
        )
    };
    for key in ["gap", "headway"] {
        let said = mapped(&map(key, "headway", ""), &table).expect_err("times as distances");
        assert!(
            said.contains("column headway (m): expected distances in m, found 1.7")
                && said.contains("a time headway in s?"),
            "{said}"
        );
        mapped(&map(key, "headway", "check_units = false"), &table).expect("as the map asks for");
        mapped(&map(key, "gap", ""), &table).expect("distances");
    }
}

#[test]
fn days_and_decimal_words_for_missing_are_read() {
    let map = "rows = \"pairs\"\nmissing = [\"-999\"]\n[columns]\ntime = { name = \"t\", unit = \"day\" }\n\
               speed = { name = \"v\" }\nlead_speed = { name = \"lead\" }\ngap = { name = \"gap\" }\n";
    let mut table = "t,v,lead,gap\n".to_owned();
    for (k, [t, v_l, v_f, gap]) in rows(600, 0.1).into_iter().enumerate() {
        let lead = if k % 100 == 50 { "-999.0".to_owned() } else { format!("{v_l:.6}") };
        table += &format!("{:.9},{v_f:.6},{lead},{gap:.6}\n", 739_386.395_833_333 + t / 86_400.0);
    }
    let recording = mapped(map, &table).expect("it is read");
    let platoon = &recording.platoons[0];
    assert_eq!(platoon.cars[0].v.iter().filter(|v| v.is_nan()).count(), 6);
    let trajectories = prepare(&recording, 1, &Preparation::default()).expect("regular tenths of seconds");
    assert_eq!((trajectories.len(), trajectories[0].dt, trajectories[0].len()), (1, 0.1, 600));
}

/// The message that refuses a pair file.
fn refused(text: &str) -> String {
    import::read_bytes(text.as_bytes(), "pair.csv", None).expect_err("a fault").to_string()
}

/// The map of a table of pairs with these columns besides time, own speed and gap.
fn map_with(more: &str) -> String {
    let columns = "time = { name = \"t\" }\nspeed = { name = \"v\" }\ngap = { name = \"gap\" }\n";
    format!("rows = \"pairs\"\n[columns]\n{columns}{more}")
}

/// A table of pairs for such a map; `last` writes the last columns of a row by its number and values.
fn table_with(names: &str, last: impl Fn(u32, [f64; 4]) -> String) -> String {
    let row = |(k, row): (u32, [f64; 4])| format!("{:.3},{:.6},{:.6},{}\n", row[0], row[2], row[3], last(k, row));
    format!("t,v,gap,{names}\n") + &(0..).zip(rows(600, 0.1)).map(row).collect::<String>()
}

#[test]
fn a_value_that_stands_for_a_missing_one_is_said_once() {
    for value in [-1.0, -999.0, 255.0, 327.67, 9999.0] {
        let mut drive = rows(600, 0.1);
        drive.iter_mut().skip(100).step_by(40).for_each(|row| row[1] = value);
        let said = refused(&text(&drive));
        let expected = format!("found {value} in 13 rows and no other value out of range");
        assert!(said.starts_with("pair.csv:102:") && said.contains(&expected) && !said.contains('\n'), "{said}");
        let map = map_with("lead_speed = { name = \"lead\" }\n");
        let table = table_with("lead", |k, row| if k % 40 == 30 { format!("{value:.2}") } else { row[1].to_string() });
        let said = mapped(&map, &table).expect_err("it is no speed");
        assert!(said.contains(&format!("missing = [\"{value}\"]")) && !said.contains('\n'), "{said}");
        mapped(&format!("missing = [\"{value}\"]\n{map}"), &table).expect("the map says it");
    }
    // Speeds in km/h do not count as such words, even if they recur.
    let kmh: Vec<[f64; 4]> = rows(600, 0.1).into_iter().map(|row| [row[0], 97.0, row[2], row[3]]).collect();
    let said = refused(&text(&kmh));
    assert!(said.contains("km/h") && !said.contains("missing value") && said.lines().count() == 11, "{said}");
}

#[test]
fn recordings_put_together_are_said_once() {
    let mut other = rows(300, 0.1);
    other.iter_mut().for_each(|row| row[3] += 1.0);
    let both = text(&rows(600, 0.1)) + text(&other).strip_prefix(HEADER).expect("it begins with the header");
    let said = refused(&both);
    assert!(said.starts_with("pair.csv:602: time_s: starts over at 0") && !said.contains('\n'), "{said}");
    let map = "rows = \"pairs\"\n[columns]\ntime = { name = \"time_s\" }\nspeed = { name = \"speed_mps\" }\n\
               lead_speed = { name = \"lead_speed_mps\" }\ngap = { name = \"spacing_m\" }\n";
    let said = mapped(map, &both).expect_err("two recordings");
    assert!(said.starts_with("table.csv:602: time_s (s): starts over at 0") && !said.contains('\n'), "{said}");
    let said = mapped(map, &(text(&rows(60, 0.1)) + &text(&other))).expect_err("two headers");
    assert!(said.starts_with("table.csv:62: repeats the header") && !said.contains('\n'), "{said}");
}

#[test]
fn rounded_times_are_said_once() {
    for digits in [0, 1] {
        let row = |[t, v_l, v_f, gap]: [f64; 4]| format!("{t:.digits$},{v_l:.6},{v_f:.6},{gap:.6}\n");
        let said = refused(&(HEADER.to_owned() + &rows(900, 0.04).into_iter().map(row).collect::<String>()));
        assert!(said.contains("the times are rounded") && !said.contains('\n') && !said.contains("remove"), "{said}");
    }
}

#[test]
fn a_column_says_who_drives() {
    let told = |recording: &Recording| -> Vec<(Option<String>, f64)> {
        let trajectories = prepare(recording, 1, &Preparation::default()).expect("it is sound");
        trajectories.iter().map(|one| (one.driver().map(str::to_owned), one.t[0])).collect()
    };
    let expected = |modes: [&str; 2]| modes.map(|mode| Some(mode.to_owned())).into_iter().zip([0.0, 30.0]);
    for (words, modes) in
        [(["1", "0"], ["ACC", "Human"]), (["human", "ACC"], ["Human", "ACC"]), (["Anna", "Ben"], ["Anna", "Ben"])]
    {
        let word = |k: u32| words[usize::from(k >= 300)].to_owned();
        let map = map_with("lead_speed = { name = \"lead\" }\ndriver = { name = \"who\" }\n");
        let table = table_with("lead,who", |k, row| format!("{},{}", row[1], word(k)));
        let of_table = told(&mapped(&map, &table).expect("it is read"));
        assert_eq!(of_table, expected(modes).collect::<Vec<_>>());
        let row = |(k, row): (u32, [f64; 4])| format!("{:.1},{},{},{},{}\n", row[0], row[1], row[2], row[3], word(k));
        let file = HEADER.replace('\n', ",driver\n") + &(0..).zip(rows(600, 0.1)).map(row).collect::<String>();
        assert_eq!(told(&pair(&file)), expected(modes).collect::<Vec<_>>());
    }
}

#[test]
fn the_sign_of_a_relative_speed_is_told_and_turned() {
    let row =
        |k: u32| (f64::from(k) * 0.1, 30.0 + 5.0 * (0.03 * f64::from(k)).cos(), 1.5 * (0.03 * f64::from(k)).sin());
    let line = |(t, gap, closing)| format!("{t:.1},20,{gap:.6},{closing:.6}\n");
    let table = "t,v,gap,closing\n".to_owned() + &(0..600).map(row).map(line).collect::<String>();
    let map = |unit: &str| map_with(&format!("relative_speed = {{ name = \"closing\", unit = \"{unit}\" }}\n"));
    let said = mapped(&map("m/s"), &table).expect_err("the other sign");
    assert!(said.contains("set its unit to \"-m/s\"") && !said.contains("swapped"), "{said}");
    let recording = mapped(&map("-m/s"), &table).expect("it is read");
    assert!((recording.platoons[0].cars[0].v[10] - (20.0 - row(10).2)).abs() < 1e-5);
    let lead: Vec<[f64; 4]> = rows(600, 0.1).into_iter().map(|r| [r[0], r[1] - r[2], r[2], r[3]]).collect();
    assert!(refused(&text(&lead)).contains("a relative speed?"));
}

#[test]
fn rows_of_whole_trajectories_are_named() {
    for separator in [",", "; "] {
        let mut table = ["id", "type", "way", "mean", "lat", "lon", "v", "a", "b", "time"].join(separator) + "\n";
        for id in 0..3 {
            let fields: Vec<String> = (0..60 + 12 * id).map(|k| format!("{}.5", k + id)).collect();
            table += &(fields.join(separator) + "\n");
        }
        let said = refused(&table);
        let maps =
            map_with("lead_speed = { name = \"a\" }\n").replace("\"t\"", "\"time\"").replace("\"gap\" }", "\"b\" }");
        let name = if separator == "," { "comma" } else { "semicolon" };
        let by_map = mapped(&format!("separator = \"{name}\"\n{maps}"), &table).expect_err("no samples");
        let expected = "a row of 60 fields below 10 names holds a whole trajectory";
        assert!(by_map.contains(expected) && !by_map.contains('\n'), "{by_map}");
        assert!(separator == "," || said.contains(expected) && !said.contains('\n'), "{said}");
    }
}

#[test]
fn lorries_are_read_and_noted() {
    let map = "rows = \"vehicles\"\n[columns]\ntime = { name = \"t\" }\nid = { name = \"id\" }\nlane = { name = \"lane\" }\n\
               position = { name = \"x\" }\nspeed = { name = \"v\" }\nlength = { name = \"length\" }\n";
    let table = |length: f64| {
        let mut table = "t,id,lane,x,v,length\n".to_owned();
        for k in 0..300 {
            for id in 0..3 {
                let (t, behind) = (f64::from(k) * 0.1, 60.0 * f64::from(id));
                table += &format!("{t:.1},{id},1,{:.3},20,{length}\n", 500.0 - behind + 20.0 * t);
            }
        }
        table
    };
    let notes = |length| mapped(map, &table(length)).map(|recording| format!("{:?}", recording.platoons[0].notes));
    for lorry in [16.5, 18.75, 25.25] {
        assert!(notes(lorry).expect("lorries").contains("LongVehicles"), "{lorry}");
    }
    assert!(!notes(4.6).expect("cars").contains("LongVehicles"));
    assert!(notes(45.0).expect_err("no vehicle").contains("1.5 to 30 m long"));
}

#[test]
fn a_pair_of_sumo_goes_on_across_edges_and_absent_leaders_are_counted() {
    let mut table =
        "timestep_time;vehicle_id;vehicle_lane;vehicle_leaderID;vehicle_leaderGap;vehicle_speed\n".to_owned();
    for k in 0..600 {
        let (t, lane) = (f64::from(k) * 0.1, ["E0_0", ":J1_0_0", "E1_0"][k as usize / 200]);
        table += &format!("{t:.1};lead;{lane};gone;40.0;15\n{t:.1};ego;{lane};lead;{:.2};15\n", 20.0 + 0.01 * t);
    }
    let map = ColumnMap::find("sumo-fcd").expect("it is shipped");
    let recording = read_mapped_from(table.as_bytes(), "fcd.csv", &map).expect("it is read");
    let lengths: Vec<usize> = recording.platoons.iter().map(|platoon| platoon.t.len()).collect();
    assert_eq!(lengths, [600]);
    let said: Vec<String> = recording.platoons[0].notes.iter().map(ToString::to_string).collect();
    assert!(
        said.iter().any(|note| note.starts_with("1 vehicles name a vehicle ahead that is not in the table")),
        "{said:?}"
    );
}
