//! Tables of other layouts, read by column maps: made-up drives written in the layouts that NGSIM, highD and SUMO document.

use leadlag::internal::trajectory::import::{self, ColumnMap, read_mapped_from};
use leadlag::internal::trajectory::{Note, Preparation, Recording, Trajectory, driver_id, inspect, prepare};
use leadlag::{Pairs, Reading};
use std::fmt::Write;

const FOOT: f64 = 0.3048;
/// Lengths of the two vehicles \[m\].
const LENGTHS: [f64; 2] = [4.5, 5.2];

/// A leader whose speed oscillates around 15 m/s and a follower behind it: position of the front and speed at each time \[m, m/s\].
fn drive(t: f64) -> [(f64, f64); 2] {
    let lead = (100.0 + 15.0 * t + 20.0 * (1.0 - (0.2 * t).cos()), 15.0 + 4.0 * (0.2 * t).sin());
    let ego = (70.0 + 15.0 * t + 20.0 * (0.2f64.cos() - (0.2 * (t - 1.0)).cos()), 15.0 + 4.0 * (0.2 * (t - 1.0)).sin());
    [lead, ego]
}

fn gap(t: f64) -> f64 {
    let [lead, ego] = drive(t);
    lead.0 - LENGTHS[0] - ego.0
}

fn read(text: &str, map: &str) -> Recording {
    let map = ColumnMap::find(map).unwrap_or_else(|error| panic!("{error}"));
    read_mapped_from(text.as_bytes(), "table.csv", &map).unwrap_or_else(|error| panic!("{error}"))
}

fn only(recording: &Recording) -> Trajectory {
    let mut all = prepare(recording, 1, &Preparation::default()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(all.len(), 1, "trajectories");
    all.remove(0)
}

/// The trajectory is the drive, to the digits that the table writes.
fn assert_is_drive(trajectory: &Trajectory, start: f64, tolerance: f64) {
    for (i, t) in trajectory.t.iter().enumerate() {
        let [lead, ego] = drive(t - start);
        for (what, found, expected) in [
            ("speed", trajectory.v_f[i], ego.1),
            ("lead speed", trajectory.v_l[i], lead.1),
            ("spacing", trajectory.s[i], gap(t - start)),
        ] {
            assert!((found - expected).abs() < tolerance, "{what} at {t} s: {found}, expected {expected}");
        }
    }
    assert!((trajectory.len_l - LENGTHS[0]).abs() < 1e-5, "length of the vehicle ahead: {} m", trajectory.len_l);
}

/// NGSIM: feet, feet per second, milliseconds since 1970, rows by vehicle. Vehicle 9 only meets vehicle 8 for a second.
fn ngsim() -> String {
    let mut text =
        "Vehicle_ID,Frame_ID,Total_Frames,Global_Time,Local_X,Local_Y,Global_X,Global_Y,v_length,v_Width,v_Class,\
                    v_Vel,v_Acc,Lane_ID,Preceding,Following,Space_Headway,Time_Headway\n"
            .to_owned();
    for (car, id, ahead) in [(0, 7, 0), (1, 8, 7)] {
        for frame in 0..300_u32 {
            let t = f64::from(frame) / 10.0;
            let (x, v) = drive(t)[car];
            let headway = if car == 0 { 0.0 } else { drive(t)[0].0 - x };
            let [x, v, length, headway] = [x, v, LENGTHS[car], headway].map(|si| si / FOOT);
            let time = 1_118_846_980_200_u64 + 100 * u64::from(frame);
            let row = format!(
                "{id},{},300,{time},16.4,{x:.5},0,0,{length:.5},6,2,{v:.5},0,2,{ahead},0,{headway:.5},2",
                frame + 13
            );
            writeln!(text, "{row}").unwrap();
        }
    }
    for frame in 0..10 {
        let time = 1_118_846_980_200_u64 + 100 * frame;
        writeln!(text, "9,{},300,{time},16,{},0,0,15,6,2,49,0,2,8,0,100,2", frame + 13, 10 + 5 * frame).unwrap();
    }
    text
}

#[test]
fn feet_and_milliseconds_become_si() {
    let recording = read(&ngsim(), "ngsim");
    let trajectory = only(&recording);
    assert_eq!((trajectory.len(), trajectory.dt), (300, 0.1));
    assert_eq!(trajectory.label, "table follower 1 trajectory 8-7");
    assert_eq!(trajectory.name, "vehicle 8");
    let start = 1_118_846_980.2;
    assert_is_drive(&trajectory, start, 1e-4);
    let notes: Vec<String> = recording.platoons[0].notes.iter().map(Note::to_string).collect();
    assert_eq!(notes[0], "read by the column map ngsim, pair 8-7");
    assert_eq!(notes[1], "gap derived from headway minus the length of the vehicle ahead");
    assert!(notes.contains(&"1 more pairs of the file are shorter than 2 s".to_owned()), "{notes:?}");
    assert!(notes[2].starts_with("columns not read: Frame_ID, Total_Frames, Local_X,"), "{notes:?}");
    // The spelling of the older release.
    let older = ngsim().replacen("v_length", "v_Length", 1).replacen("Space_Headway", "Space_Hdwy", 1);
    assert_eq!(only(&read(&older, "ngsim")).s, trajectory.s);
}

/// Each pair of a fleet has a row, and what has none is counted.
#[test]
fn short_pairs_of_a_fleet_are_counted() {
    let mut reading = Reading::default();
    reading.columns = Some("ngsim".to_owned());
    let pairs = Pairs::of_text(&reading, ngsim().as_bytes(), "table.csv").expect("a pair");
    assert_eq!(pairs.len(), 1);
    let said = "table.csv: 1 more pairs of the file are shorter than 2 s".to_owned();
    assert!(pairs.warnings().contains(&said), "{:?}", pairs.warnings());
}

/// highD: frames of 25 Hz, bounding boxes, `x` its corner. `sign` -1: the upper lanes, towards lower positions.
fn highd(sign: f64) -> String {
    let mut text = "frame,id,x,y,width,height,xVelocity,yVelocity,xAcceleration,yAcceleration,frontSightDistance,\
                    backSightDistance,dhw,thw,ttc,precedingXVelocity,precedingId,followingId,leftPrecedingId,\
                    leftAlongsideId,leftFollowingId,rightPrecedingId,rightAlongsideId,rightFollowingId,laneId\n"
        .to_owned();
    for (car, id, ahead) in [(0, 1, 0), (1, 2, 1)] {
        for frame in 1..=500 {
            let (front, v) = drive(f64::from(frame) / 25.0)[car];
            let corner = if sign > 0.0 { front - LENGTHS[car] } else { -front };
            let v = sign * v;
            let row = format!("{frame},{id},{corner:.4},8.5,{},2.0,{v:.4},0,0.1,0", LENGTHS[car]);
            writeln!(text, "{row},0,0,0,0,0,0,{ahead},0,0,0,0,0,0,0,2").unwrap();
        }
    }
    text
}

#[test]
fn both_directions_of_a_motorway_are_the_same_drive() {
    for sign in [1.0, -1.0] {
        let recording = read(&highd(sign), "highd");
        let trajectory = only(&recording);
        assert_eq!((trajectory.len(), trajectory.dt), (500, 0.04), "direction {sign}");
        assert_is_drive(&trajectory, 0.0, 2e-4);
        // Accelerations turn with the speeds.
        assert_eq!(recording.platoons[0].cars[1].a.as_ref().unwrap()[0], sign * 0.1);
    }
}

/// exiD: frames of 25 Hz, velocities along the lane, the vehicle ahead and its distance by separate columns.
#[test]
fn a_table_of_lanes_that_curve_is_read_by_its_own_gap() {
    let mut text =
        "recordingId,trackId,frame,trackLifetime,xCenter,yCenter,heading,width,length,lonVelocity,latVelocity,\
                    lonAcceleration,latAcceleration,laneletId,leadDHW,leadDV,leadTHW,leadTTC,leadId,rearId\n"
            .to_owned();
    for (car, id, ahead) in [(0, 4, -1), (1, 5, 4)] {
        for frame in 0..500 {
            let t = f64::from(frame) / 25.0;
            let (_, v) = drive(t)[car];
            let dhw = if ahead < 0 { -1.0 } else { gap(t) };
            let row =
                format!("39,{id},{frame},{frame},0,0,12,1.9,{},{v:.4},0,0.1,0,{}", LENGTHS[car], 1500 + frame / 100);
            writeln!(text, "{row},{dhw:.4},0,1.5,-1,{ahead},-1").unwrap();
        }
    }
    let trajectory = only(&read(&text, "exid"));
    assert_eq!((trajectory.len(), trajectory.dt, trajectory.name.as_str()), (500, 0.04, "vehicle 5"));
    assert_is_drive(&trajectory, 0.0, 2e-4);
    // Of inD, which has the same columns except for the vehicle ahead.
    let ind = text.replace("leadDHW", "a").replace("leadId", "b");
    assert!(refused(&ind, examples("exid").as_str()).contains("inD and rounD do not name the vehicle ahead"));
}

/// I-24 MOTION as a table: rears in feet, both directions, lanes and speeds added; no column names the vehicle ahead.
#[test]
fn a_table_of_rears_in_both_directions_is_read() {
    for sign in [1.0, -1.0] {
        let mut text = "_id,timestamp,x_position,y_position,direction,length,lane,speed\n".to_owned();
        for frame in 0..500 {
            let t = f64::from(frame) / 25.0;
            for (car, id) in [(0, "62a"), (1, "62b")] {
                let (front, v) = drive(t)[car];
                let [rear, length, v] =
                    [300_000.0 + sign * (front - LENGTHS[car]), LENGTHS[car], v].map(|si| si / FOOT);
                let time = 1_669_000_000.0 + t;
                writeln!(text, "{id},{time:.2},{rear:.5},18.1,{sign},{length:.5},2,{v:.5}").unwrap();
            }
        }
        let trajectory = only(&read(&text, "i24-motion"));
        assert_eq!((trajectory.len(), trajectory.name.as_str()), (500, "vehicle 62b"), "direction {sign}");
        assert_is_drive(&trajectory, 1_669_000_000.0, 2e-4);
        assert!(
            refused(&text.replace("speed", "s"), examples("i24-motion").as_str()).contains("the release has no speeds")
        );
    }
}

/// Pairs of the MODES lab: the columns of ULTra-AV, in ms and with positions of three coordinates.
#[test]
fn a_table_of_pairs_in_milliseconds_is_read() {
    let mut text =
        "Trajectory_ID,Time_Index,ID_LV,Type_LV,Pos_LV,Speed_LV,Acc_LV,ID_FAV,Pos_FAV,Speed_FAV,Acc_FAV,Spatial_Gap,\
                    Spatial_Headway,Speed_Diff\n"
            .to_owned();
    for trajectory in 0..2 {
        for step in 0..200 {
            let t = f64::from(step) / 10.0;
            let [lead, ego] = drive(t);
            let row = format!("{trajectory},{},12,1,\"[1.5, 2.5, 0.1]\",{:.4},0", 100 * step, lead.1);
            writeln!(text, "{row},7,\"[0, 0, 0]\",{:.4},0,{:.4},{:.4},0", ego.1, gap(t), lead.0 - ego.0).unwrap();
        }
    }
    let recording = read(&text, "waymo-pairs");
    assert_eq!(recording.platoons.len(), 2);
    let trajectories = prepare(&recording, 1, &Preparation::default()).unwrap_or_else(|error| panic!("{error}"));
    for trajectory in &trajectories {
        assert_eq!((trajectory.len(), trajectory.dt), (200, 0.1));
        for (i, t) in trajectory.t.iter().enumerate() {
            assert!((trajectory.s[i] - gap(*t)).abs() < 2e-4 && (trajectory.v_f[i] - drive(*t)[1].1).abs() < 2e-4);
        }
    }
}

/// Pairs of FHWA: the released columns that are read, and one that is not.
#[test]
fn a_table_of_pairs_with_positions_is_read() {
    let mut text =
        "run_no,timestamp,xLeaderReal,vLeaderReal,xFollowerReal,vFollowerReal,aFollowerReal,spacing\n".to_owned();
    for step in 0..200 {
        let t = f64::from(step) / 10.0;
        let [lead, ego] = drive(t);
        let x = lead.0 - 5.0 - gap(t);
        writeln!(text, "3,{t:.1},{:.4},{:.4},{x:.4},{:.4},0,{:.4}", lead.0, lead.1, ego.1, gap(t)).unwrap();
    }
    let recording = read(&text, "fhwa-cav");
    let trajectory = only(&recording);
    // Drivers of one run are different ones.
    assert_eq!(driver_id(&trajectory.name, trajectory.id.as_deref()), None);
    assert_eq!((trajectory.len(), trajectory.dt, trajectory.len_l), (200, 0.1, 5.0));
    for (i, t) in trajectory.t.iter().enumerate() {
        assert!((trajectory.s[i] - gap(*t)).abs() < 2e-4 && (trajectory.v_f[i] - drive(*t)[1].1).abs() < 2e-4);
    }
}

/// The text of a shipped map.
fn examples(name: &str) -> String {
    let (_, text) = ColumnMap::shipped().iter().find(|(known, _)| *known == name).expect("a shipped map");
    (*text).to_owned()
}

/// The measured point of the vehicle ahead is its rear on one side of the road and its front on the other one.
#[test]
fn another_length_of_the_vehicle_ahead_leaves_the_follower_its_own() {
    for (sign, shorter) in [(1.0, 0.0), (-1.0, 6.0 - LENGTHS[0])] {
        let map = ColumnMap::find("highd").unwrap().with_lead_length(Some(6.0));
        let recording = read_mapped_from(highd(sign).as_bytes(), "table.csv", &map).unwrap();
        let [lead, ego] = [0, 1].map(|car| &recording.platoons[0].cars[car]);
        assert_eq!((lead.length, ego.length), (Some(6.0), Some(LENGTHS[1])), "direction {sign}");
        let (found, expected) = (ego.gap.as_ref().unwrap()[249], gap(10.0) - shorter);
        assert!((found - expected).abs() < 1e-3, "direction {sign}: {found} m, expected {expected} m");
    }
}

/// Positions fall, speeds have no sign: if the first position is missing, the second one decides.
#[test]
fn a_missing_position_does_not_turn_a_vehicle_round() {
    let map = "rows = \"vehicles\"\ndirection = \"by-position\"\nnobody = [\"0\"]\n[columns]\n\
               time = { name = \"t\", unit = \"s\" }\nid = { name = \"id\" }\nahead = { name = \"ahead\" }\n\
               position = { name = \"x\", unit = \"m\" }\nspeed = { name = \"v\", unit = \"m/s\" }\n\
               length = { name = \"l\", unit = \"m\" }\n";
    let mut text = "t,id,ahead,x,v,l\n".to_owned();
    for (car, ahead) in [(0, 0), (1, 1)] {
        for step in 0..200 {
            let t = f64::from(step) / 10.0;
            let (front, v) = drive(t)[car];
            let x = if step == 0 { String::new() } else { format!("{:.4}", 900.0 - front) };
            writeln!(text, "{t},{},{ahead},{x},{v:.4},{}", car + 1, LENGTHS[car]).unwrap();
        }
    }
    let map = ColumnMap::parse(map, "map.toml").unwrap_or_else(|error| panic!("{error}"));
    let recording = read_mapped_from(text.as_bytes(), "table.csv", &map).unwrap_or_else(|error| panic!("{error}"));
    let gaps = recording.platoons[0].cars[1].gap.as_ref().expect("from the positions");
    assert!(gaps[0].is_nan() && (gaps[100] - gap(10.0)).abs() < 1e-3, "{} m, {} m", gaps[0], gaps[100]);
}

#[test]
fn a_missing_position_on_a_ring_is_missing_once() {
    let map = "rows = \"vehicles\"\nlap_length = 160\nlength = 4.5\nnobody = [\"0\"]\n[columns]\ntime = { name = \"t\" }\n\
               id = { name = \"id\" }\nahead = { name = \"ahead\" }\nposition = { name = \"x\" }\nspeed = { name = \"v\" }\n";
    let mut text = "t,id,ahead,x,v\n".to_owned();
    for (id, ahead, start) in [(1, 0, 40.0), (2, 1, 0.0)] {
        for step in 0..400 {
            let t = f64::from(step) / 10.0;
            let x = if (id, step) == (2, 50) { String::new() } else { format!("{:.1}", (start + 10.0 * t) % 160.0) };
            writeln!(text, "{t},{id},{ahead},{x},10").unwrap();
        }
    }
    let map = ColumnMap::parse(map, "map.toml").unwrap_or_else(|error| panic!("{error}"));
    let recording = read_mapped_from(text.as_bytes(), "table.csv", &map).unwrap_or_else(|error| panic!("{error}"));
    for (car, start) in recording.platoons[0].cars.iter().zip([40.0, 0.0]) {
        for (step, x) in car.x.as_ref().expect("positions").iter().enumerate() {
            let expected = start + step as f64;
            assert!(if step == 50 { x.is_nan() } else { (x - expected).abs() < 1e-6 }, "{x} m, expected {expected} m");
        }
    }
}

#[test]
fn a_change_of_lane_or_of_the_vehicle_ahead_ends_a_pair() {
    let mut rows: Vec<String> = highd(1.0).lines().map(str::to_owned).collect();
    // The second vehicle's rows are 501 to 1000: the lane changes at its frame 201, no vehicle is ahead from frame 401.
    for row in &mut rows[701..901] {
        row.replace_range(row.len() - 1.., "3");
    }
    for row in &mut rows[901..] {
        *row = row.replacen(",1,0,0,0,0,0,0,0,2", ",0,0,0,0,0,0,0,0,3", 1);
    }
    let recording = read(&rows.join("\n"), "highd");
    let pairs: Vec<(Option<&str>, usize)> =
        recording.platoons.iter().map(|platoon| (platoon.id.as_deref(), platoon.t.len())).collect();
    assert_eq!(pairs, [(Some("2-1"), 200), (Some("2-1.2"), 200)]);
    assert!(inspect(&recording).to_string().contains("trajectory 2-1.2"));
}

#[test]
fn a_table_of_many_pairs_is_shown_by_its_longest() {
    let mut text = "timestep_time;vehicle_id;vehicle_leaderGap;vehicle_leaderID;vehicle_speed\n".to_owned();
    for step in 0..400 {
        let t = f64::from(step) / 10.0;
        for car in 0..25 {
            // Car k follows car k - 1, for 3 + k seconds.
            let ahead = if car > 0 && t <= 3.0 + f64::from(car) { format!("c{}", car - 1) } else { String::new() };
            writeln!(text, "{t};c{car};20;{ahead};10").unwrap();
        }
    }
    let recording = read(&text, "sumo-fcd");
    assert_eq!(recording.platoons.len(), 24);
    let shown = inspect(&recording).to_string();
    assert!(shown.contains("24 pairs of a follower and the vehicle ahead, the longest first:"), "{shown}");
    let row = |name: &str| shown.lines().position(|line| line.starts_with(name)).unwrap_or_else(|| panic!("{shown}"));
    assert!(row("vehicle c24 ") < row("vehicle c23 ") && row("vehicle c23 ") < row("vehicle c6 "));
    assert!(shown.contains("... and 4 shorter ones") && !shown.contains("\nvehicle c4 "), "{shown}");
    assert_eq!(shown.matches("rows incomplete").count(), 1, "only the longest in full");
    assert!(shown.lines().all(|line| line.chars().count() <= 80), "{shown}");
}

#[test]
fn followers_are_chosen_by_their_id() {
    let mut recording = read(&ngsim(), "ngsim");
    assert!(!recording.keep_follower("7"), "vehicle 7 follows no other");
    assert_eq!(recording.platoons.len(), 1);
    assert!(recording.keep_follower("8"));
}

#[test]
fn semicolons_and_names_of_a_simulator_are_read() {
    let mut text = "timestep_time;vehicle_id;vehicle_lane;vehicle_leaderGap;vehicle_leaderID;vehicle_leaderSpeed;\
                    vehicle_speed\n"
        .to_owned();
    for step in 0..100 {
        let t = f64::from(step) / 10.0;
        let [lead, ego] = drive(t);
        writeln!(text, "{t:.2};lead;e_0;-1;;-1;{}", lead.1).unwrap();
        writeln!(text, "{t:.2};ego.0;e_0;{};lead;{};{}", gap(t), lead.1, ego.1).unwrap();
    }
    let recording = read(&text, "sumo-fcd");
    let trajectory = only(&recording);
    assert_eq!((trajectory.name.as_str(), trajectory.len()), ("vehicle ego.0", 100));
    for (i, t) in trajectory.t.iter().enumerate() {
        assert!((trajectory.s[i] - gap(*t)).abs() < 1e-9 && (trajectory.v_f[i] - drive(*t)[1].1).abs() < 1e-12);
    }
}

/// A table as a spreadsheet writes it in countries with decimal commas.
#[test]
fn decimal_commas_are_read_where_the_map_says_so_and_points_beside_them_refused() {
    let body = "[columns]\ntime = { name = \"t\" }\nspeed = { name = \"v\" }\nlead_speed = { name = \"vl\" }\n\
                gap = { name = \"gap\" }\n";
    let start = "rows = \"pairs\"\nseparator = \"semicolon\"\n";
    let map = |decimal: &str| ColumnMap::parse(&format!("{start}{decimal}{body}"), "map.toml").unwrap();
    let table = (0..100).fold("t;v;vl;gap\n".to_owned(), |mut text, step| {
        let t = f64::from(step) / 10.0;
        let [lead, ego] = drive(t);
        let row = format!("{t};{};{};{}\n", ego.1, lead.1, gap(t));
        text += &row.replace('.', ",");
        text
    });
    let comma = map("decimal = \"comma\"\n");
    let trajectory = only(&read_mapped_from(table.as_bytes(), "table.csv", &comma).unwrap());
    for (i, t) in trajectory.t.iter().enumerate() {
        assert_eq!((trajectory.s[i], trajectory.v_f[i]), (gap(*t), drive(*t)[1].1), "{t} s");
    }
    let refused = |table: &str, map: &ColumnMap| {
        read_mapped_from(table.as_bytes(), "table.csv", map).expect_err("a number is wrong").to_string()
    };
    let said = refused(&table.replacen(";15;", ";1.500;", 1), &comma);
    let expected = "table.csv:2:22: column vl: expected a number with a decimal comma and no point, found \"1.500\"";
    assert!(said.starts_with(expected), "{said}");
    let said = refused(&table, &map(""));
    assert!(said.contains("or set decimal = \"comma\" in the column map"), "{said}");
}

#[test]
fn a_mapped_table_without_its_header_line_is_told_so() {
    let map = ColumnMap::parse(&PAIRS.replacen("header =", "# header =", 1), "map.toml").unwrap();
    let said = read_mapped_from(pairs(FOOT).as_bytes(), "table.txt", &map).unwrap_err().to_string();
    assert!(said.contains("table.txt:1: the header line is missing") && said.contains("header = [...]"), "{said}");
}

/// A map for tables of pairs without a header line, between blanks.
const PAIRS: &str = r#"
rows = "pairs"
separator = "whitespace"
header = ["clock", "v", "vl", "hw"]
[columns]
time = { name = "clock", unit = "ms" }
speed = { name = "v", unit = "km/h" }
lead_speed = { name = "vl", unit = "mph" }
gap = { name = "hw", unit = "ft" }
"#;

fn pairs(gap_unit: f64) -> String {
    (0..300).fold(String::new(), |mut text, step| {
        let t = f64::from(step) / 10.0;
        let [lead, ego] = drive(t);
        let (v, v_l) = (ego.1 * 3.6, lead.1 * 3600.0 / 1609.344);
        writeln!(text, "{}  {v:.6}\t{v_l:.6} {:.6}", 100 * step, gap(t) / gap_unit).unwrap();
        text
    })
}

#[test]
fn a_table_of_pairs_is_the_same_as_our_own_pair_file() {
    let map = ColumnMap::parse(PAIRS, "map.toml").unwrap();
    let recording = read_mapped_from(pairs(FOOT).as_bytes(), "table.txt", &map).unwrap();
    let mapped = only(&recording);
    let mut own = "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned();
    for i in 0..mapped.len() {
        writeln!(own, "{},{},{},{}", mapped.t[i], mapped.v_l[i], mapped.v_f[i], mapped.s[i]).unwrap();
    }
    let own = only(&import::read_bytes(own.as_bytes(), "pair.csv", None).unwrap());
    assert_eq!((&mapped.v_f, &mapped.v_l, &mapped.s), (&own.v_f, &own.v_l, &own.s));
    assert!((mapped.s[10] - gap(1.0)).abs() < 1e-5);
}

#[test]
fn noise_is_not_taken_for_a_wrong_unit() {
    let map = ColumnMap::parse(&PAIRS.replace("\"ft\"", "\"m\""), "map.toml").unwrap();
    let mut noisy = String::new();
    for (i, line) in pairs(1.0).lines().enumerate() {
        let fields: Vec<f64> = line.split_whitespace().map(|field| field.parse().unwrap()).collect();
        // A gap that jumps by 3 m from sample to sample, as bad trackers make it.
        let jump = [1.7, -1.1, 0.4, -1.6, 1.3][i * i % 5];
        writeln!(noisy, "{} {} {} {}", fields[0], fields[1], fields[2], fields[3] + jump).unwrap();
    }
    read_mapped_from(noisy.as_bytes(), "table.txt", &map).unwrap_or_else(|error| panic!("{error}"));
}

/// Error of a table read by a map.
fn refused(text: &str, map: &str) -> String {
    let map = ColumnMap::parse(map, "map.toml").unwrap_or_else(|error| panic!("{error}"));
    read_mapped_from(text.as_bytes(), "table.csv", &map).expect_err("a wrong unit").to_string()
}

#[test]
fn units_that_look_wrong_are_refused_with_what_they_look_like() {
    let shipped = |name: &str| {
        let all = ColumnMap::shipped();
        all.iter().find(|(n, _)| *n == name).unwrap().1.to_owned()
    };
    let (ngsim_map, highd_map) = (shipped("ngsim"), shipped("highd"));
    let cases = [
        (
            "a gap in feet",
            pairs(FOOT),
            PAIRS.replace("\"ft\"", "\"m\""),
            "table.csv:1: columns hw (m) and v (km/h) contradict each other: the first changes 3.281 times as much as the \
             second implies; 3.2808 is feet per metre: check both units in the column map; check_units = false there accepts \
             them unchanged",
        ),
        (
            "a gap in metres called feet",
            pairs(1.0),
            PAIRS.to_owned(),
            "table.csv:1: columns hw (ft) and v (km/h) contradict each other: the first changes 0.305 times as much as the \
             second implies; 1/3.2808 is the inverse of feet per metre: check both units in the column map; check_units = \
             false there accepts them unchanged",
        ),
        (
            "times in seconds called milliseconds",
            pairs(FOOT).lines().enumerate().fold(String::new(), |all, (i, line)| {
                let rest = line.split_once(' ').unwrap().1;
                format!("{all}{} {rest}\n", i as f64 / 10.0)
            }),
            PAIRS.to_owned(),
            "table.csv:1: column clock (ms): expected a usual step of 0.001 to 5 s, found 0.0001 s; \
             correct its unit in the column map",
        ),
        ("a speed of 100 m/s", pairs(FOOT).replace("54.", "400."), PAIRS.to_owned(), ""),
        (
            "lengths in feet called metres",
            ngsim(),
            ngsim_map.replace("\"v_length\"], unit = \"ft\"", "\"v_length\"], unit = \"m\""),
            "table.csv:1: column v_length (m): expected that half of the vehicles are 1.5 to 12 m long, found 15.00 m; \
             correct its unit in the column map, or set check_units = false there",
        ),
        (
            "positions in feet called metres",
            ngsim(),
            ngsim_map.replace("\"Local_Y\", unit = \"ft\"", "\"Local_Y\", unit = \"m\""),
            "table.csv:1: columns Local_Y (m) and v_Vel (ft/s) contradict each other: the first changes 3.282 times as \
             much as the second implies; 3.2808 is feet per metre: check both units, and the unit of time or frame_rate_hz, \
             in the column map; check_units = false there accepts them unchanged",
        ),
        (
            "a wrong frame rate",
            highd(1.0),
            highd_map.replace("frame_rate_hz = 25", "frame_rate_hz = 10"),
            "table.csv:1: columns x (m) and xVelocity (m/s) contradict each other: the first changes 0.400 times as much \
             as the second implies; 1/2.5000 is the inverse of 25 frames per second mistaken for 10: check both units, and the \
             unit of time or frame_rate_hz, in the column map; check_units = false there accepts them unchanged",
        ),
        (
            "the wrong direction",
            highd(-1.0),
            highd_map.replace("by-speed", "increasing"),
            "table.csv:2: column xVelocity (m/s): expected at least -0.5 m/s forwards, found -15.032; for vehicles that \
             drive towards lower positions set direction = \"by-speed\" in the column map",
        ),
    ];
    for (what, text, map, expected) in cases {
        let found = refused(&text, &map);
        let first = found.lines().next().unwrap_or_default();
        if expected.is_empty() {
            assert!(first.contains("no road vehicle is faster: correct its unit in the column map"), "{what}: {first}");
        } else {
            assert_eq!(first, expected, "{what}");
        }
    }
    // The remedy for a user who is sure of the table.
    let unchecked = PAIRS.replace("\"ft\"", "\"m\"").replace("rows =", "check_units = false\nrows =");
    let map = ColumnMap::parse(&unchecked, "map.toml").unwrap();
    assert!(read_mapped_from(pairs(FOOT).as_bytes(), "table.csv", &map).is_ok());
}

#[test]
fn a_column_of_one_car_is_not_read_as_that_of_every_car() {
    let map = |speed: &str, gap: &str| {
        let text = format!(
            "rows = \"platoon\"\n[columns]\ntime = {{ name = \"t\" }}\nspeed = {{ name = \"{speed}\" }}\ngap = {{ name = \"{gap}\" }}\n"
        );
        ColumnMap::parse(&text, "map.toml").map_err(|error| error.to_string())
    };
    assert!(map("v{}", "d{}").is_ok() && map("v{}", "d{-1}").is_ok());
    for (speed, gap, expected) in [("v", "d{}", "speed = { name = \"speed{}\" }, found v"), ("v{}", "d", "found d:")] {
        let said = map(speed, gap).expect_err("it is that of one car");
        assert!(
            said.contains("expected a name with {} for the number of the car") && said.contains(expected),
            "{said}"
        );
    }
}

#[test]
fn a_problem_of_one_car_names_its_own_column() {
    let map = "rows = \"platoon\"\n[columns]\ntime = { name = \"t\" }\nspeed = { name = \"v{}\" }\ngap = { name = \"d{}\" }\n";
    let table = |third: f64, unit: f64| {
        (0..300).fold("t,v1,v2,v3,d2,d3\n".to_owned(), |mut text, step| {
            let t = f64::from(step) / 10.0;
            let [lead, ego] = drive(t);
            let last = if step == 100 { third } else { ego.1 };
            writeln!(text, "{t},{:.4},{:.4},{last:.4},{:.4},20", lead.1, ego.1, gap(t) / unit).unwrap();
            text
        })
    };
    let said = refused(&table(15.0, FOOT), map);
    assert!(said.starts_with("table.csv:1: columns d2 (m) and v2 (m/s) contradict each other"), "{said}");
    let map = ColumnMap::parse(map, "map.toml").unwrap();
    let recording = read_mapped_from(table(-7.0, 1.0).as_bytes(), "table.csv", &map).unwrap();
    let said = recording.platoons[0].cars[2].faults.listed("table.csv");
    assert!(said.contains("table.csv:102: column v3 (m/s): expected at least -0.5 m/s forwards, found -7"), "{said}");
}

#[test]
fn every_shipped_map_is_sound() {
    for (name, _) in ColumnMap::shipped() {
        let map = ColumnMap::find(name).unwrap_or_else(|error| panic!("{error}"));
        assert!(!map.title.is_empty() && map.column_names().len() >= 6, "{name}");
    }
}
