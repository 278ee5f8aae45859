//! Files in the form in which users have them: their content as read, and the messages. Synthetic drives, written here.

use crate::common::parquet_table::parquet;
use crate::common::program::{fails, flat, json, leadlag, refused, scratch, stderr, stdout, succeeds, text};
use leadlag::internal::trajectory::import::ColumnMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

/// A car whose speed oscillates around 20 m/s and one behind it: time, speed and position of both, gap. Every tenth of a second for
/// `seconds`.
fn drive(seconds: f64) -> Vec<[f64; 6]> {
    let lead = |t: f64| (20.0 + 3.0 * (0.2 * t).sin(), 100.0 + 20.0 * t - 15.0 * (0.2 * t).cos());
    let rows = 0..=(seconds * 10.0) as u32;
    let row = |i: u32| {
        let t = f64::from(i) / 10.0;
        let ((v_l, x_l), (v_f, x_f)) = (lead(t), lead(t - 1.5));
        [t, v_l, x_l, v_f, x_f, x_l - x_f - 4.6]
    };
    rows.map(row).collect()
}

fn pair(seconds: f64, change: impl Fn(&mut [f64; 6])) -> String {
    let mut text = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    for mut row in drive(seconds) {
        change(&mut row);
        let [t, v_l, _, v_f, _, gap] = row;
        writeln!(text, "{t:.1},{v_l:.4},{v_f:.4},{gap:.4}").unwrap();
    }
    text
}

fn write(test: &str, files: &[(&str, &str)]) -> PathBuf {
    let folder = scratch("what_people_have", test);
    for (name, content) in files {
        fs::write(folder.join(name), content).unwrap();
    }
    folder
}

fn inspect(arguments: &[&str]) -> String {
    stdout(&succeeds(&[&["inspect"], arguments].concat()))
}

/// A short calibration: its messages, and whether it succeeds.
fn calibrate(files: &[&str], extra: &[&str], out: &Path) -> (bool, String) {
    let search = ["--model", "idm", "--max-evaluations", "200", "--no-intervals", "--out", text(out)];
    let output = leadlag(&[&["calibrate"], files, &search, extra].concat());
    (output.status.success(), stderr(&output))
}

#[test]
fn a_cut_in_is_named_by_both_verbs() {
    let cut = pair(60.0, |row| {
        if row[0] > 30.05 {
            row[5] -= 14.0;
        }
    });
    let folder = write("cut_in", &[("pair.csv", &cut)]);
    let file = folder.join("pair.csv");
    let said = inspect(&[text(&file)]);
    assert!(said.contains("jumps down by 14.0 m") && said.contains("at 30.1 s") && said.contains("--to 30 "), "{said}");
    let (done, said) = calibrate(&[text(&file)], &[], &folder.join("fit"));
    assert!(done && said.contains("pair.csv: spacing_m: jumps down by 14.0 m"), "{said}");
    let (_, said) = calibrate(&[text(&file)], &["--to", "30"], &folder.join("cut"));
    assert!(!said.contains("jumps"), "{said}");
}

#[test]
fn a_car_above_the_bound_of_v_0_is_told_before_the_search() {
    let fast = pair(60.0, |row| {
        row[1] += 20.0;
        row[3] += 20.0;
    });
    let folder = write("fast", &[("pair.csv", &fast), ("bounds.toml", "v_0 = [30, 50]\n")]);
    let (file, bounds) = (folder.join("pair.csv"), folder.join("bounds.toml"));
    let (done, said) = calibrate(&[text(&file)], &[], &folder.join("fit"));
    assert!(
        done && said.contains("the follower drives up to 43.0 m/s") && said.contains("up to 35 m/s: the model"),
        "{said}"
    );
    let (_, said) = calibrate(&[text(&file)], &["--bounds", text(&bounds)], &folder.join("wide"));
    assert!(!said.contains("drives up to"), "{said}");
}

#[test]
fn bounds_of_human_drivers_are_a_set_of_their_own() {
    let folder = write("bounds", &[("pair.csv", &pair(60.0, |_| ())), ("own.toml", "v_0 = [20, 40]\n")]);
    let (file, own) = (folder.join("pair.csv"), folder.join("own.toml"));
    let result = |fit: &str, extra: &[&str]| -> serde_json::Value {
        let (done, said) = calibrate(&[text(&file)], extra, &folder.join(fit));
        assert!(done, "{said}");
        serde_json::from_str(&fs::read_to_string(folder.join(fit).join("result.json")).unwrap()).unwrap()
    };
    let acc = result("acc", &[]);
    assert_eq!(acc["bounds"]["v_0"], serde_json::json!([30.0, 35.0]));
    let from = acc["bounds_from"].as_str().unwrap();
    assert!(from.starts_with("acc: Table 3, because the driver is unknown"), "{from}");
    let human = result("human", &["--bounds", "human"]);
    assert_eq!(human["bounds"]["v_0"], serde_json::json!([1.0, 70.0]));
    assert_eq!(human["parameters"]["delta"], 4.0);
    assert!(
        human["bounds_from"].as_str().unwrap().starts_with("human: Rafati Fard and Shariat Mohaymany (2019)"),
        "{human}"
    );
    // A file takes precedence over a set, and a fixed value over both.
    let both = result("both", &["--bounds", "human", "--bounds", text(&own), "--fix", "delta=2"]);
    assert_eq!(both["bounds"]["v_0"], serde_json::json!([20.0, 40.0]));
    assert_eq!((&both["bounds"]["t_h"], &both["parameters"]["delta"]), (&serde_json::json!([0.1, 5.0]), &2.0.into()));
}

#[test]
fn one_bad_file_of_a_batch_does_not_cost_the_others() {
    let (good, short) = (pair(20.0, |_| ()), pair(1.3, |_| ()));
    let folder = write("batch", &[("a.csv", &good), ("b.csv", &short), ("c.csv", &good), ("d.csv", "MATLAB 5.0")]);
    let files = ["a.csv", "b.csv", "c.csv", "d.csv"].map(|name| folder.join(name));
    let (done, said) = calibrate(&files.each_ref().map(|file| text(file)), &[], &folder.join("fit"));
    assert!(!done && said.contains("b.csv: follower 1: expected at least 2 s, the recording has 1.3 s"), "{said}");
    assert!(
        said.contains("d.csv:1:1: this is a MATLAB file") && said.contains("not calibrated: 2 of 4 files"),
        "{said}"
    );
    for name in ["a_follower1", "c_follower1"] {
        assert!(folder.join("fit").join(name).join("result.json").is_file(), "{name}");
    }
    // Together, every file counts.
    let (done, _) = calibrate(&files.each_ref().map(|file| text(file)), &["--joint"], &folder.join("joint"));
    assert!(!done && !folder.join("joint").exists());
}

/// Three trajectories of one vehicle, one of which is broken and one too short.
fn pieces() -> String {
    let mut text = "Trajectory_ID,Time_Index,ID_LV,Type_LV,Speed_LV,ID_FAV,Speed_FAV,Spatial_Gap\n".to_owned();
    for (id, seconds) in [(0, 12.0), (1, 12.0), (2, 1.0), (3, 12.0)] {
        for (i, [t, v_l, _, v_f, _, gap]) in drive(seconds).into_iter().enumerate() {
            let v_f = if (id, i) == (3, 7) { "?".to_owned() } else { format!("{v_f:.4}") };
            // Different gaps, because the same drive twice is refused.
            let gap = gap + f64::from(id);
            writeln!(text, "{id},{t:.1},-1,0,{v_l:.4},5,{v_f},{gap:.4}").unwrap();
        }
    }
    text
}

#[test]
fn the_pieces_of_a_table_are_calibrated_jointly_or_one_by_one() {
    let folder = write("pieces", &[("table.csv", &pieces())]);
    let table = folder.join("table.csv");
    let trajectories = |fit: &str| {
        let text = fs::read_to_string(folder.join(fit).join("result.json")).unwrap();
        serde_json::from_str::<serde_json::Value>(&text).unwrap()["data"].as_array().unwrap().len()
    };
    let (done, said) = calibrate(&[text(&table)], &["--joint"], &folder.join("joint"));
    assert!(done && said.contains("2 of 4 trajectories cannot be used; the first of them is 2"), "{said}");
    assert_eq!(trajectories("joint"), 2);
    let (done, said) = calibrate(&[text(&table)], &["--joint", "--trajectory", "0,1"], &folder.join("chosen"));
    assert!(done && !said.contains("cannot be used"), "{said}");
    let (done, said) = calibrate(&[text(&table)], &["--trajectory", "0,1"], &folder.join("each"));
    assert!(done, "{said}");
    assert_eq!(trajectories("each/table_follower1_trajectory1"), 1);
    let (done, said) = calibrate(&[text(&table)], &["--trajectory", "3"], &folder.join("broken"));
    assert!(!done && said.contains("column Speed_FAV: expected a finite number, found \"?\""), "{said}");
    // A calibration on one is simulated on several, and all of them are checked.
    let (fit, out) = (folder.join("each/table_follower1_trajectory1"), folder.join("out"));
    let again =
        ["simulate", text(&table), "--result", text(&fit), "--trajectory", "0,1", "--json", "--out", text(&out)];
    let said = json(&again);
    let ids: Vec<&str> =
        said["runs"].as_array().unwrap().iter().map(|run| run["trajectory"].as_str().unwrap()).collect();
    assert_eq!(ids, ["0", "1"]);
    assert!(out.join("simulation_trajectory0.csv").exists() && out.join("plot_trajectory1.svg").exists());
    let said = stdout(&succeeds(&["diagnose", "--data-only", text(&table), "--trajectory", "0,1"]));
    assert!(said.contains("trajectory 0,") && said.contains("trajectory 1,"), "{said}");
    refused(2, &["diagnose", "--data-only", text(&table), "--trajectory", "0,9"]).says("no trajectory 9");
    let said = inspect(&[text(&table), "--trajectory", "1,3"]);
    assert!(
        !said.contains("trajectory 0\n") && said.contains("trajectory 1\n") && said.contains("trajectory 3\n"),
        "{said}"
    );
    refused(2, &["inspect", text(&table), "--trajectory", "9"]).says("no trajectory 9; the file has 0, 1, 2, 3");
}

/// Pauses cut the drives of two followers; every verb that takes all of them says that only the longest pieces are used.
#[test]
fn pieces_that_are_left_out_are_counted() {
    const MAP: &str = "rows = \"vehicles\"
length = 4.6
nobody = [\"0\"]
[columns]
time = { name = \"t\" }
id = { name = \"id\" }
ahead = { name = \"ahead\" }
position = { name = \"x\" }
speed = { name = \"v\" }
";
    let mut table = "t,id,ahead,x,v\n".to_owned();
    for [t, v_l, x_l, v_f, x_f, _] in drive(40.0) {
        writeln!(table, "{t:.1},1,0,{x_l:.4},{v_l:.4}\n{t:.1},2,1,{x_f:.4},{v_f:.4}").unwrap();
        if ![10.0..14.0, 30.0..32.0].iter().any(|pause| pause.contains(&t)) {
            writeln!(table, "{t:.1},3,2,{:.4},{v_f:.4}", x_f - 30.0).unwrap();
        }
    }
    let folder = write("cut", &[("table.csv", &table), ("map.toml", MAP)]);
    let (file, map) = (folder.join("table.csv"), folder.join("map.toml"));
    let told = "2 pieces of 1 drive left out: long gaps cut a drive into pieces, of which only the longest is used; a longer --max-gap";
    for kind in ["--joint", "--all"] {
        let (done, said) = calibrate(&[text(&file)], &[kind, "--columns", text(&map)], &folder.join(kind));
        assert!(done && said.contains(told), "{kind}: {said}");
        let whole = [kind, "--columns", text(&map), "--max-gap", "6"];
        let (done, said) = calibrate(&[text(&file)], &whole, &folder.join(format!("{kind}_whole")));
        assert!(done && !said.contains("left out"), "{kind}: {said}");
    }
}

#[test]
fn a_follower_is_chosen_by_the_name_of_its_car() {
    let mut text_ = "Date,1,2,2020\nVehicle_order,Audi(A8),Tesla(Model3),BMW(X5)\nNumber_of_vehicles,3\nACC,1\nDistance_setting,S\n\
                     Time,Speed1,Speed2,Speed3,IVS1,IVS2\n"
        .to_owned();
    for [t, v_l, _, v_f, _, gap] in drive(20.0) {
        writeln!(text_, "{t:.1},{v_l:.4},{v_f:.4},{v_f:.4},{gap:.4},25").unwrap();
    }
    let folder = write("by_name", &[("platoon.csv", &text_)]);
    let file = folder.join("platoon.csv");
    let (done, said) = calibrate(&[text(&file)], &["--follower", "Tesla(Model3)"], &folder.join("fit"));
    assert!(done, "{said}");
    let result = fs::read_to_string(folder.join("fit/result.json")).unwrap();
    assert!(result.contains("\"follower\": 1,") && result.contains("Tesla(Model3)"), "{result}");
    let (done, said) = calibrate(&[text(&file)], &["--follower", "Tesla(Model4)"], &folder.join("none"));
    assert!(
        !done
            && said.contains("platoon.csv has Tesla(Model3), BMW(X5)")
            && said.contains("did you mean `Tesla(Model3)`?"),
        "{said}"
    );
}

/// Reads a table with a map, and returns the output of `inspect`.
fn mapped(test: &str, table: &str, map: &str) -> String {
    let folder = write(test, &[("table.csv", table), ("map.toml", map)]);
    inspect(&[text(&folder.join("table.csv")), "--columns", text(&folder.join("map.toml"))])
}

#[test]
fn maps_have_constants_words_preambles_and_names_of_any_case() {
    let mut table = "made by a logger\nlap 3\nTIME,VL,XL,VF,XF\n[s],[km/h],[m],[km/h],[m]\n".to_owned();
    for (i, [t, v_l, x_l, v_f, x_f, _]) in drive(20.0).into_iter().enumerate() {
        let v_f = if i == 50 { "lost".to_owned() } else { format!("{:.4}", v_f * 3.6) };
        writeln!(table, "{t:.1},{:.4},{x_l:.4},{v_f},{x_f:.4}", v_l * 3.6).unwrap();
    }
    let map = "rows = \"pairs\"\nskip_lines = 2\nmissing = [\"lost\"]\nlead_length = 4.6\n[columns]\ntime = { name = \"Time\" }\n\
               lead_speed = { name = \"vl\", unit = \"km/h\" }\nlead_position = { name = \"xl\" }\n\
               speed = { name = \"vf\", unit = \"km/h\" }\nposition = { name = \"xf\" }\n";
    let said = mapped("constants", &table, map);
    assert!(said.contains("201 rows") && said.contains("1 rows incomplete"), "{said}");
    assert!(said.contains("lines 1 to 2 not read") && said.contains("line 4 not read: units"), "{said}");
    assert!(said.contains("gap derived from positions and the length") && !said.contains("warning"), "{said}");
    let in_columns = map.replace("lead_length = 4.6\n", "") + "lead_length = 4.6\n";
    // A constant in place of the columns gives the same result.
    assert_eq!(mapped("constants", &table, &in_columns), said);
}

#[test]
fn dates_and_clocks_become_seconds() {
    let of = |stamp: &dyn Fn(f64) -> String, unit: &str| {
        let mut table = "t,vl,vf,gap\n".to_owned();
        for [t, v_l, _, v_f, _, gap] in drive(20.0) {
            writeln!(table, "{},{v_l:.4},{v_f:.4},{gap:.4}", stamp(t)).unwrap();
        }
        let map = format!(
            "rows = \"pairs\"\n[columns]\ntime = {{ name = \"t\", unit = \"{unit}\" }}\nlead_speed = {{ name = \"vl\" }}\n\
             speed = {{ name = \"vf\" }}\ngap = {{ name = \"gap\" }}\n"
        );
        mapped(&format!("clock_{unit}"), &table, &map)
    };
    // From ten seconds before midnight on.
    let clock = |t: f64| {
        let s = (86_390.0 + t) % 86_400.0;
        let [h, m] = [(s / 3600.0).floor(), (s / 60.0).floor() % 60.0];
        (h, m, ((s - 3600.0 * h - 60.0 * m) * 10.0).round() / 10.0)
    };
    let said = of(
        &|t| {
            let (h, m, s) = clock(t);
            format!("{h:02}{m:02}{s:04.1}")
        },
        "hhmmss",
    );
    assert!(said.contains("201 rows, 86390.0 .. 86410.0 s (20.0 s), step 0.1 s"), "{said}");
    let iso = |t: f64| {
        let (h, m, s) = clock(t);
        format!("2024-02-{}T{h:02}:{m:02}:{s:04.1}Z", if t < 10.0 { 28 } else { 29 })
    };
    assert!(of(&iso, "iso").contains("(20.0 s), step 0.1 s"));
    let epoch = |t: f64| format!("{:.0}", 1.7e18 + t * 1e9);
    assert!(of(&epoch, "ns").contains("(20.0 s), step 0.1 s"));
}

#[test]
fn a_clock_among_seconds_is_noticed() {
    let clock = pair(100.0, |row| {
        let s = 53_910.0 + row[0];
        row[0] = (s / 3600.0).floor() * 1e4 + (s / 60.0).floor() % 60.0 * 100.0 + s % 60.0;
    });
    let folder = write("clock", &[("pair.csv", &clock)]);
    let said = inspect(&[text(&folder.join("pair.csv"))]);
    assert!(said.contains("looks like a clock, HHMMSS: 145859.9 is followed by 145900"), "{said}");
}

#[test]
fn a_platoon_is_read_by_a_map() {
    let mut table = "t,v0,v1,v2,d1,d2\n".to_owned();
    for [t, v_l, _, v_f, _, gap] in drive(20.0) {
        writeln!(table, "{t:.1},{v_l:.4},{v_f:.4},{v_f:.4},{gap:.4},25").unwrap();
    }
    let map = "rows = \"platoon\"\n[columns]\ntime = { name = \"t\" }\nspeed = { name = \"v{}\" }\ngap = { name = \"d{}\" }\n";
    let said = mapped("platoon", &table, map);
    assert!(said.contains("gap of follower 1 [m]") && said.contains("car 3 is follower 2"), "{said}");
    let folder = scratch("what_people_have", "platoon_fit");
    let there = Path::new(env!("CARGO_TARGET_TMPDIR")).join("what_people_have/platoon");
    let (file, map) = (there.join("table.csv"), there.join("map.toml"));
    let (done, said) = calibrate(&[text(&file)], &["--columns", text(&map), "--follower", "1"], &folder);
    assert!(done, "{said}");
}

#[test]
fn a_broken_value_of_one_car_does_not_cost_a_platoon_the_others() {
    let map = "rows = \"platoon\"\n[columns]\ntime = { name = \"t\" }\nspeed = { name = \"v{}\" }\ngap = { name = \"d{}\" }\n";
    // Each car by its number in the file, with the followers (from 1) that need its speed or its gap.
    for (broken, needed) in [("v5", &[4, 5][..]), ("d5", &[4][..])] {
        let names = "t,v1,v2,v3,v4,v5,v6,d2,d3,d4,d5,d6";
        let mut table = format!("{names}\n");
        for (i, [t, v_l, _, v_f, _, gap]) in drive(12.0).into_iter().enumerate() {
            let value = |name: &str| match name {
                name if name == broken && i == 9 => "?".to_owned(),
                "t" => format!("{t:.1}"),
                "v1" => format!("{v_l:.4}"),
                "d2" => format!("{gap:.4}"),
                name if name.starts_with('v') => format!("{v_f:.4}"),
                _ => "25".to_owned(),
            };
            table += &(names.split(',').map(value).collect::<Vec<_>>().join(",") + "\n");
        }
        let folder = write(&format!("platoon_{broken}"), &[("table.csv", &table), ("map.toml", map)]);
        let (file, map) = (folder.join("table.csv"), folder.join("map.toml"));
        for follower in 1..=5 {
            let chosen = follower.to_string();
            let extra = ["--columns", text(&map), "--follower", &chosen];
            let (done, said) = calibrate(&[text(&file)], &extra, &folder.join(format!("fit{follower}")));
            assert_eq!(done, !needed.contains(&follower), "{broken}, follower {follower}: {said}");
            assert!(done || said.contains(&format!("column {broken}: expected a finite number")), "{said}");
        }
    }
}

/// Three cars in lane 1 and one that changes from lane 2 to lane 1 between the first two at 10 s; on a ring if `lap` is given.
fn tracks(lap: Option<f64>) -> String {
    let mut text = "id,time,x,lane,v,length\n".to_owned();
    for i in 0..=300_u32 {
        let t = f64::from(i) / 10.0;
        for (id, start) in [(1, 120.0), (2, 40.0), (3, 0.0), (4, 80.0)] {
            let lane = if id == 4 && t < 10.0 { 2 } else { 1 };
            let x = start + 10.0 * t;
            let x = lap.map_or(x, |lap| x % lap);
            writeln!(text, "{id},{t:.1},{x:.3},{lane},10.0,4.5").unwrap();
        }
    }
    text
}

const TRACKS: &str = "rows = \"vehicles\"\n[columns]\ntime = { name = \"time\" }\nid = { name = \"id\" }\nlane = { name = \"lane\" }\n\
                      position = { name = \"x\" }\nspeed = { name = \"v\" }\nlength = { name = \"length\" }\n";

#[test]
fn the_vehicle_ahead_is_found_by_lane_and_position() {
    let said = mapped("lanes", &tracks(None), TRACKS);
    assert!(said.contains("4 pairs of a follower"), "{said}");
    let rows: Vec<Vec<&str>> = said.lines().map(|line| line.split_whitespace().collect()).collect();
    for (ego, lead, from, time) in
        [("2", "1", "0.0", "9.9"), ("2", "4", "10.0", "20.0"), ("4", "1", "10.0", "20.0"), ("3", "2", "0.0", "30.0")]
    {
        let expected = ["vehicle", ego, "vehicle", lead, from, time];
        assert!(rows.iter().any(|row| row.starts_with(&expected)), "{expected:?}\n{said}");
    }
}

#[test]
fn positions_on_a_ring_go_on_where_a_lap_ends() {
    let ring = format!("lap_length = 160\n{TRACKS}");
    let said = mapped("ring", &tracks(Some(160.0)), &ring);
    // On the ring, the first car also has a car ahead.
    assert!(said.contains("5 pairs of a follower") && !said.contains("contradict"), "{said}");
    let (_, gaps) = said.split_once("vehicle 3 ").expect("it follows");
    assert!(gaps.lines().next().expect("its line").contains("35.5-35.5"), "{said}");
    // Without the length of the lap the ends of laps are not driving, either.
    let said = mapped("no_lap", &tracks(Some(160.0)), TRACKS);
    assert!(!said.contains("contradict"), "{said}");
}

#[test]
fn a_pause_on_a_ring_is_no_other_car() {
    // All cars advance by 100 m of 160 m during the pause.
    let is_seen =
        |row: &&str| row.split(',').nth(1).is_none_or(|t| t.parse().is_ok_and(|t| !(5.05..14.95).contains(&t)));
    let table = tracks(Some(160.0));
    let seen: Vec<&str> = table.lines().take(1).chain(table.lines().skip(1).filter(is_seen)).collect();
    let said = mapped("ring_pause", &(seen.join("\n") + "\n"), &format!("lap_length = 160\n{TRACKS}"));
    assert!(said.contains("pairs of a follower") && !said.contains("vehicles bear"), "{said}");
}

#[test]
fn numbers_that_come_again_are_other_cars() {
    let mut table = tracks(None);
    for row in tracks(None).lines().skip(1) {
        let mut fields: Vec<&str> = row.split(',').collect();
        let later = format!("{:.1}", fields[1].parse::<f64>().unwrap() + 900.0);
        fields[1] = &later;
        table += &(fields.join(",") + "\n");
    }
    let said = mapped("again", &table, TRACKS);
    assert!(said.contains("8 pairs of a follower") && said.contains("8 vehicles have 4 numbers"), "{said}");
}

#[test]
fn groups_of_pairs_that_begin_anew_or_are_broken_do_not_cost_the_others() {
    let mut table = "drive,t,vl,vf,gap\n".to_owned();
    // Different gaps, because identical rows would be used once.
    for (more, name, broken) in [(0.0, "a", false), (1.0, "a", false), (2.0, "b", true), (3.0, "c", false)] {
        for (i, [t, v_l, _, v_f, _, gap]) in drive(12.0).into_iter().enumerate() {
            let v_f = if broken && i == 9 { -7.0 } else { v_f };
            writeln!(table, "{name},{t:.1},{v_l:.4},{v_f:.4},{:.4}", gap + more).unwrap();
        }
    }
    let map = "rows = \"pairs\"\n[columns]\ngroup = { name = \"drive\" }\ntime = { name = \"t\" }\nlead_speed = { name = \"vl\" }\n\
               speed = { name = \"vf\" }\ngap = { name = \"gap\" }\n";
    let said = mapped("groups", &table, map);
    assert!(said.contains("4 pairs of a follower"), "{said}");
    let there = Path::new(env!("CARGO_TARGET_TMPDIR")).join("what_people_have/groups");
    let (file, map) = (there.join("table.csv"), there.join("map.toml"));
    let columns = ["--columns", text(&map)];
    let said = inspect(&[&[text(&file), "--trajectory", "a.2,b"], &columns[..]].concat());
    assert!(said.contains("line 123: the time restarts, so two trajectories have the id a"), "{said}");
    assert!(said.contains("cannot be calibrated") && said.contains("at least -0.5 m/s forwards, found -7"), "{said}");
    let (done, said) = calibrate(&[text(&file)], &[&["--joint"], &columns[..]].concat(), &there.join("fit"));
    assert!(done && said.contains("1 of 4 trajectories cannot be used; the first of them is b"), "{said}");
}

#[test]
fn a_broken_value_does_not_cost_the_later_ones_that_bear_its_name() {
    // Identical rows would be used once.
    let broken = |piece: usize, i: usize, v_f: f64| {
        if (piece, i) == (0, 9) { "?".to_owned() } else { format!("{:.4}", v_f + 1e-3 * piece as f64) }
    };
    let mut pairs = "drive,t,vl,vf,gap\n".to_owned();
    let mut own = "Trajectory_ID,Time_Index,ID_LV,Type_LV,Speed_LV,ID_FAV,Speed_FAV,Spatial_Gap\n".to_owned();
    for piece in [0, 1] {
        for (i, [t, v_l, _, v_f, _, gap]) in drive(12.0).into_iter().enumerate() {
            let v_f = broken(piece, i, v_f);
            writeln!(pairs, "a,{t:.1},{v_l:.4},{v_f},{gap:.4}").unwrap();
            writeln!(own, "a,{t:.1},-1,0,{v_l:.4},5,{v_f},{gap:.4}").unwrap();
        }
    }
    let map = "rows = \"pairs\"\n[columns]\ngroup = { name = \"drive\" }\ntime = { name = \"t\" }\nlead_speed = { name = \"vl\" }\n\
               speed = { name = \"vf\" }\ngap = { name = \"gap\" }\n";
    let folder = write("later", &[("pairs.csv", &pairs), ("own.csv", &own), ("map.toml", map)]);
    let map = folder.join("map.toml");
    for (name, columns) in [("pairs.csv", &["--columns", text(&map)][..]), ("own.csv", &[][..])] {
        let file = folder.join(name);
        for (id, usable) in [("a", false), ("a.2", true)] {
            let extra = [&["--trajectory", id], columns].concat();
            let (done, said) = calibrate(&[text(&file)], &extra, &folder.join(format!("{name}_{id}")));
            assert!(done == usable && (done || said.contains("found \"?\"")), "{name}, {id}: {said}");
        }
    }
    // The speed of vehicle 3 at 1 s; the same numbers occur again later.
    let first = tracks(None).replacen("\n3,1.0,10.000,1,10.0,", "\n3,1.0,10.000,1,?,", 1);
    let later = tracks(None).lines().skip(1).fold(String::new(), |all, row| {
        let mut fields: Vec<&str> = row.split(',').collect();
        let later = format!("{:.1}", fields[1].parse::<f64>().unwrap() + 900.0);
        fields[1] = &later;
        all + &fields.join(",") + "\n"
    });
    let said = mapped("later_vehicles", &(first + &later), TRACKS);
    let said = flat(&said);
    assert!(said.contains("7 pairs of a follower") && said.contains("found \"?\""), "{said}");
}

#[test]
fn distance_is_not_driven_over_a_pause() {
    let pause = pair(60.0, |row| {
        if row[0] > 30.0 {
            row[0] += 1000.0;
        }
    });
    let folder = write("pause", &[("pair.csv", &pause)]);
    let said = inspect(&[text(&folder.join("pair.csv"))]);
    assert!(said.contains("0.0 s  1.2") && !said.contains("contradict"), "{said}");
}

#[test]
fn files_that_are_no_tables_are_named() {
    let files = [
        ("drive.json", "[{\"t\": 1}]", "this is JSON"),
        ("fcd.xml", "<?xml version=\"1.0\"?>\n<fcd-export>\n", "floating car data of SUMO as XML"),
        ("drive.mat", "MATLAB 5.0 MAT-file", "a MATLAB file"),
        (
            "drive.xlsx",
            "PK\u{3}\u{4}xl/workbook.xml",
            "an Excel workbook; expected a table as text, CSV in UTF-8: save the sheet as CSV",
        ),
    ];
    for (name, content, expected) in files {
        let folder = write("no_table", &[(name, content)]);
        refused(1, &["inspect", text(&folder.join(name))]).says(expected);
    }
}

#[test]
fn a_file_packed_by_gzip_is_read_as_it_is() {
    use std::io::Write;
    let folder = scratch("what_people_have", "gzip");
    let file = fs::File::create(folder.join("pair.csv.gz")).unwrap();
    let mut packed = flate2::write::GzEncoder::new(file, flate2::Compression::default());
    packed.write_all(pair(20.0, |_| ()).as_bytes()).unwrap();
    packed.finish().unwrap();
    assert!(inspect(&[text(&folder.join("pair.csv.gz"))]).contains("201 rows"));
}

#[test]
fn a_parquet_table_is_read_as_the_same_table_of_text_is() {
    use parquet::basic::{Compression, ZstdLevel};
    let folder = scratch("what_people_have", "parquet");
    let written = pair(20.0, |_| ());
    let numbers = |line: &str| line.split(',').map(|field| field.parse::<f64>().unwrap()).collect::<Vec<f64>>();
    let rows: Vec<Vec<f64>> = written.lines().skip(1).map(numbers).collect();
    let plain = folder.join("pair.csv");
    fs::write(&plain, &written).unwrap();
    // Behind name, layout and checksum.
    let told = |said: &str| said.lines().skip(3).map(str::to_owned).collect::<Vec<_>>();
    let expected = told(&inspect(&[text(&plain)]));
    for (name, how) in [
        ("plain", Compression::UNCOMPRESSED),
        ("snappy", Compression::SNAPPY),
        ("zstd", Compression::ZSTD(ZstdLevel::default())),
    ] {
        let file = folder.join(format!("{name}.parquet"));
        parquet("time_s,lead_speed_mps,speed_mps,spacing_m", &rows, how, &file);
        let said = inspect(&[text(&file)]);
        assert!(said.contains("201 rows, 0.0 .. 20.0 s"), "{name}: {said}");
        assert_eq!(told(&said), expected, "{name}");
    }
    // A missing value, by a map whose separator is that of text files.
    let mut rows = rows;
    rows[50][3] = f64::NAN;
    let file = folder.join("mapped.parquet");
    parquet("t,v_lead,v,gap", &rows, Compression::SNAPPY, &file);
    let map = folder.join("map.toml");
    let columns = "lead_speed = { name = \"v_lead\" }\nspeed = { name = \"v\" }\ngap = { name = \"gap\" }\ntime = { name = \"t\" }\n";
    fs::write(
        &map,
        format!(
            "title = \"t\"\nrows = \"pairs\"\nseparator = \"semicolon\"\ndecimal = \"comma\"\n[columns]\n{columns}"
        ),
    )
    .unwrap();
    let said = inspect(&[text(&file), "--columns", text(&map)]);
    assert!(said.contains("201 rows") && said.contains("1 rows incomplete"), "{said}");
    // A truncated one.
    let whole = fs::read(&file).unwrap();
    let broken = folder.join("broken.parquet");
    fs::write(&broken, &whole[..whole.len() / 2]).unwrap();
    refused(1, &["inspect", text(&broken)]).says("a Parquet file that cannot be read").says("or as CSV");
}

#[test]
fn a_table_of_sumo_without_leaders_says_how_to_get_them() {
    let table = "timestep_time;vehicle_id;vehicle_lane;vehicle_pos;vehicle_speed\n0.00;c0;E0_0;60.0;9.7\n0.10;c0;E0_0;61.0;9.7\n";
    let folder = write("no_leader", &[("fcd.csv", table)]);
    let (_, said) = fails(&["inspect", text(&folder.join("fcd.csv")), "--columns", "sumo-fcd"]);
    assert!(said.contains("--fcd-output.max-leader-distance 250"), "{said}");
}

#[test]
fn shipped_maps_are_printed_to_begin_with() {
    let printed = stdout(&succeeds(&["columns", "ngsim"]));
    assert!(printed.contains("[headerless]") && printed.contains("ahead = "), "{printed}");
    // Both help texts name all of them.
    for verb in ["inspect", "calibrate"] {
        let help = stdout(&succeeds(&[verb, "--help"]));
        let help = flat(&help);
        let names: Vec<&str> = ColumnMap::shipped().iter().map(|(name, _)| *name).collect();
        assert!(help.contains(&format!("another layout: {} (`leadlag list", names.join(", "))), "{help}");
    }
    refused(2, &["columns", "ngsm"]).says("did you mean `ngsim`?");
}

#[test]
fn an_export_to_sumo_says_for_which_step_it_is_meant() {
    let folder = write("sumo", &[("pair.csv", &pair(20.0, |_| ()))]);
    let (done, said) = calibrate(&[text(&folder.join("pair.csv"))], &["--fix", "t_h=0.4"], &folder.join("fit"));
    assert!(done, "{said}");
    let said = stdout(&succeeds(&["export", "sumo", text(&folder.join("fit")), "--no-run"]));
    let said = flat(&said);
    assert!(said.contains("--step-length 0.1 --step-method.ballistic true; tau = 0.400 s is below the 1 s"), "{said}");
    let xml = fs::read_to_string(folder.join("fit/sumo/vtype.add.xml")).unwrap();
    assert!(xml.contains("step-length 0.1 step-method.ballistic true; tau = 0.400 s is below the 1 s"), "{xml}");
}

/// Tables of an impossible vehicle and an impossible road, with their messages.
#[test]
fn absurd_tables_are_refused_with_line_value_and_range() {
    let vehicle = "[my_car]\nmass_unladen_kg = 1500.0\nphi = 1.04\nf_0_N = [150.0, 160.0]\nf_1_N_per_kmh = [0.1, 0.2]\n\
                   f_2_N_per_kmh2 = [0.02, 0.03]\nmfc = \"curve.csv\"\n";
    let curve = "speed_mps,a_ap,a_dp\n0,4,-5\n20,2,-4\n";
    let cases = [
        (
            vehicle.replace("1500.0", "1e308"),
            curve.to_owned(),
            "cars.toml:2: vehicle my_car: mass_unladen_kg: expected a mass of 50 to 200000 kg, found 1",
        ),
        (
            vehicle.replace("160.0", "1e308"),
            curve.to_owned(),
            "cars.toml:4: vehicle my_car: f_0_N: expected both within -100000 to 100000, found [150, 1",
        ),
        (vehicle.to_owned(), curve.replace("4,-5", "-3,-5"), "curve.csv:2: expected a_ap from -1 to 30, found -3"),
        (vehicle.to_owned(), curve.replace("2,-4", "1e308,-4"), "curve.csv:3: expected a_ap from -1 to 30, found 1"),
        (vehicle.to_owned(), curve.replace("-4", "-1e308"), "curve.csv:3: expected a_dp from -30 to 1, found -1"),
        (vehicle.to_owned(), curve.replace("2,-4", "-0.2,0.1"), "curve.csv:3: expected a_dp below a_ap, so that the"),
    ];
    for (cars, curve, expected) in cases {
        let folder =
            write("vehicle", &[("pair.csv", &pair(20.0, |_| ())), ("cars.toml", &cars), ("curve.csv", &curve)]);
        let vehicle = format!("{}#my_car", text(&folder.join("cars.toml")));
        let model = ["--vehicle", vehicle.as_str()];
        let search =
            ["--model", "idm+mfc", "--max-evaluations", "200", "--no-intervals", "--out", text(&folder.join("fit"))]
                .map(str::to_owned);
        let search: Vec<&str> = search.iter().map(String::as_str).collect();
        let output = leadlag(&[&["calibrate", text(&folder.join("pair.csv"))], &model[..], &search].concat());
        assert!(!output.status.success() && stderr(&output).contains(expected), "{expected}\n{}", stderr(&output));
    }
    let slight = curve.replace("0,4,-5", "0,4,0.1").replace("20,2,-4", "20,-0.2,-0.4");
    let slight = write("slight", &[("curve.csv", &slight)]).join("curve.csv");
    let mfc = leadlag::internal::vehicle::Mfc::read_csv(&slight).expect("a little of the other sign is taken");
    assert_eq!((mfc.a_ap[1], mfc.a_dp[0]), (-0.2, 0.1));
    for (road, expected) in [
        ("X,Y\n0,0\n0.001,0.01\n", "expected a lap of 1 to 1000000 m, found 0.001"),
        ("X,Y\n0,0\n1e300,0.01\n", "expected at most 1000000000 m in size, found 1"),
        (
            "position_m,sin_grade\n-9e307,0\n9e307,0.01\n",
            "grade.csv:2:1: column position_m: expected at most 1000000000 m in size",
        ),
    ] {
        let folder = write("road", &[("pair.csv", &pair(20.0, |_| ())), ("grade.csv", road)]);
        let (done, said) = calibrate(
            &[text(&folder.join("pair.csv"))],
            &["--grade", text(&folder.join("grade.csv"))],
            &folder.join("fit"),
        );
        assert!(!done && said.contains(expected), "{expected}\n{said}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn devices_without_end_are_refused_by_every_reader() {
    let folder = write("endless", &[("pair.csv", &pair(20.0, |_| ()))]);
    let file = folder.join("pair.csv");
    std::os::unix::fs::symlink("/dev/zero", folder.join("zero.toml")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.join("zero.csv")).unwrap();
    std::os::unix::fs::symlink("/dev/zero", folder.join("zero.wgsl")).unwrap();
    let [toml, csv, wgsl] = ["zero.toml", "zero.csv", "zero.wgsl"].map(|name| folder.join(name).display().to_string());
    let calibrate = ["calibrate", text(&file), "--model", "idm", "--out", "never"];
    for extra in [
        vec!["--bounds", toml.as_str()],
        vec!["--columns", toml.as_str()],
        vec!["--grade", csv.as_str()],
        vec!["--extend", wgsl.as_str()],
    ] {
        let (_, said) = fails(&[&calibrate[..], &extra].concat());
        assert!(
            said.contains("expected at most") || said.contains("longer than") || said.contains("byte 0x00"),
            "{extra:?}: {said}"
        );
    }
    for arguments in [
        vec!["report", csv.as_str(), "-o", "never.html"],
        vec!["evaluate", csv.as_str(), "--data", text(&folder)],
        vec!["inspect", csv.as_str()],
        vec!["study", "plan", toml.as_str(), "--out", "never"],
    ] {
        let (_, said) = fails(&arguments);
        assert!(!said.is_empty(), "{arguments:?}");
    }
}

#[test]
fn names_with_escapes_are_shown_and_not_obeyed() {
    let table = tracks(None).replace("\n2,", "\n2\u{9b}2J\u{202e},");
    let said = mapped("escapes", &table, TRACKS);
    assert!(said.contains("vehicle 2\\u009b2J\\u202e") && !said.contains(['\u{9b}', '\u{202e}']), "{said}");
}

#[test]
fn who_drives_by_a_column_decides_what_is_said_of_the_bounds() {
    let said = |test: &str, word: &str| {
        let table = pair(60.0, |_| {}).replace("spacing_m\n", "spacing_m,driver\n");
        let row = |(k, row): (usize, &str)| if k == 0 { format!("{row}\n") } else { format!("{row},{word}\n") };
        let table: String = table.lines().enumerate().map(row).collect();
        let folder = write(test, &[("pair.csv", &table)]);
        let (file, out) = (folder.join("pair.csv"), folder.join("fit"));
        let search = ["--model", "idm", "--max-evaluations", "200", "--no-intervals", "--out", text(&out)];
        stdout(&succeeds(&[&["calibrate", text(&file)], &search[..]].concat()))
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ")
    };
    assert!(said("by_acc", "ACC").contains("acc: Table 3, because the file says who drives"));
    assert!(said("by_human", "0").contains("although the file says that a human drives"));
    assert!(said("by_name", "Anna").contains("the file names drivers, but not whether they are human"));
}
