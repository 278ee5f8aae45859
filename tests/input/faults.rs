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
