//! Malicious files and environments: each ends in a message, in bounded memory, never in a panic or a signal.

use crate::common::parquet_table::table;
use crate::common::program::{json_of, ok, refused, scratch, stderr, text};
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::OnceLock;

/// A drive and its calibration, made once.
fn calibrated() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = scratch("hostile", "calibrated");
        ok(&["synth", "--out", text(&folder), "--duration", "60"]);
        let (file, fit) = (folder.join("platoon.csv"), folder.join("fit"));
        let model = ["calibrate", text(&file), "--follower", "1", "--model", "idm+linear"];
        ok(&[&model[..], &["--max-evaluations", "300", "--no-intervals", "--out", text(&fit)]].concat());
        folder
    })
}

#[test]
fn a_result_that_contradicts_itself_is_refused() {
    type Change = fn(&mut Value);
    let changes: [(&str, Change, &str); 18] = [
        (
            "negative",
            |r| r["parameters"]["v_0"] = json!(-5.0),
            "v_0: expected a number above 0 and below 1e9, found -5.0",
        ),
        ("huge", |r| r["parameters"]["v_0"] = json!(1e308), "and below 1e9, found 1e308"),
        ("zero", |r| r["parameters"]["t_h"] = json!(0.0), "and below 1e9, found 0.0"),
        (
            "reversed",
            |r| r["bounds"]["t_h"] = json!([2.0, 1.0]),
            "bounds: t_h: expected a lower and an upper end, found [2, 1]",
        ),
        ("touched", |r| r["at_bound"] = json!(["zz"]), "at_bound: found zz, which variant idm+linear does not have"),
        (
            "interval",
            |r| r["intervals"] = json!({"zz": [0.0, 1.0]}),
            "intervals: found zz, which variant idm+linear does not have",
        ),
        ("law", |r| r["law"] = json!({"name": "w99"}), "law: found w99, which is not the base of variant idm+linear"),
        ("matrix", |r| r["identifiability"] = known(json!([[1.0, 0.9]])), "matrix: expected 2 rows of 2 numbers"),
        ("narrow", |r| r["identifiability"] = known(json!([[1.0], [0.9]])), "matrix: expected 2 rows of 2 numbers"),
        ("id", |r| r["model_id"] = json!(2), "model_id: expected 4, the id of variant idm+linear, found 2"),
        ("no_id", |r| r["model_id"] = json!(4711), "found 4711"),
        ("variant", |r| r["variant"] = json!("idn"), "idn"),
        ("unit", |r| r["units"]["v_0"] = json!("km/h"), "units: expected v_0 in m/s, found km/h"),
        (
            "foreign_unit",
            |r| r["units"]["k_s"] = json!("-"),
            "units: found k_s, which variant idm+linear does not have",
        ),
        (
            "foreign",
            |r| r["parameters"]["k_s"] = json!(1.0),
            "parameters: found k_s, which variant idm+linear does not have",
        ),
        ("missing", |r| drop(r["parameters"].as_object_mut().unwrap().remove("v_0")), "parameter v_0 is missing"),
        ("bounds", |r| drop(r["bounds"].as_object_mut().unwrap().remove("v_0")), "bounds: v_0 is missing"),
        (
            "extension",
            |r| r["extensions"] = json!([{"name": "none"}]),
            "extension none: no built-in extension has this name",
        ),
    ];
    let (file, fit) = (calibrated().join("platoon.csv"), calibrated().join("fit"));
    let result = json_of(fit.join("result.json"));
    for (name, change, expected) in changes {
        let folder = scratch("hostile", name);
        let (changed, page) = (folder.join("result.json"), folder.join("page.html"));
        let mut content = result.clone();
        change(&mut content);
        fs::write(&changed, serde_json::to_vec(&content).unwrap()).unwrap();
        let verbs: [&[&str]; 3] = [
            &["report", text(&changed), "--out", text(&page)],
            &["simulate", text(&file), "--follower", "1", "--result", text(&changed)],
            &["export", "sumo", text(&changed), "--no-run"],
        ];
        for verb in verbs {
            refused(1, verb).says("does not fit together").says(expected);
        }
        assert!(!page.exists());
    }
}

#[test]
fn a_result_without_end_is_not_read_to_its_end() {
    let folder = scratch("hostile", "large");
    for name in ["result.json", "diagnosis.json"] {
        let file = folder.join(name);
        fs::File::create(&file).unwrap().set_len(200 << 20).unwrap();
        let said = limited("ulimit -v 1500000", &["report", text(&file), "--out", text(&folder.join("page.html"))]);
        let expected = ["cannot read the result file", "expected at most 67108864 bytes, found more"];
        assert!(expected.iter().all(|part| said.contains(part)), "{said}");
        fs::remove_file(&file).unwrap();
    }
}

/// Identifiability of two parameters, with these correlations.
fn known(matrix: Value) -> Value {
    json!({"confidence": 0.95, "parameters": {}, "replicate_range": {}, "evaluations": 1, "note": null,
        "correlation": {"parameters": ["v_0", "t_h"], "matrix": matrix}})
}

#[test]
fn tables_without_line_ends_are_not_read_to_their_end() {
    let (fit, folder) = (calibrated().join("fit"), scratch("hostile", "no_ends"));
    let result = fs::read(fit.join("result.json")).unwrap();
    let fleet = folder.join("fleet");
    let platoon = calibrated().join("platoon.csv");
    let all = ["calibrate", text(&platoon), "--all", "--model", "idm", "--max-evaluations", "100"];
    ok(&[&all[..], &["--no-intervals", "--out", text(&fleet)]].concat());
    let (one, study) = (folder.join("one"), folder.join("study"));
    fs::create_dir_all(&one).unwrap();
    fs::create_dir_all(&study).unwrap();
    fs::write(one.join("result.json"), result).unwrap();
    let page = folder.join("page.html");
    for table in
        [one.join("simulation.csv"), fleet.join("fits.csv"), fleet.join("parameters.csv"), study.join("tasks.jsonl")]
    {
        fs::File::create(&table).unwrap().set_len(3 << 30).unwrap();
        let said = limited("ulimit -v 1500000", &["report", text(table.parent().unwrap()), "--out", text(&page)]);
        assert!(said.contains("expected lines of at most 1048576 bytes, found a longer one"), "{said}");
        assert!(said.contains(text(&table)) && !page.exists(), "{said}");
    }
}

/// Twice as many take twice as long; reading all rows for each cell took as long for a tenth of them.
#[test]
fn a_page_of_many_replicates_is_made_in_seconds() {
    let folder = scratch("hostile", "replicates");
    let mut result = json_of(calibrated().join("fit/result.json"));
    let mut one = result["replicates"][0].clone();
    one["convergence"] = json!([[10, 0.5]]);
    let all = (0..40_000).map(|number| {
        one["replicate"] = json!(number);
        one.clone()
    });
    result["replicates"] = Value::Array(all.collect());
    fs::write(folder.join("result.json"), serde_json::to_vec(&result).unwrap()).unwrap();
    let (page, began) = (folder.join("page.html"), std::time::Instant::now());
    ok(&["report", text(&folder), "--out", text(&page)]);
    assert!(began.elapsed().as_secs() < 60, "{:?}", began.elapsed());
}

#[test]
fn what_a_killed_process_was_writing_goes_with_the_next_file() {
    let folder = scratch("hostile", "left_over");
    let page = folder.join("page.html");
    let (left, other) = (folder.join("page.4711-18af-0.tmp"), folder.join("page.tmp"));
    fs::write(&left, "half").unwrap();
    fs::write(&other, "of a user").unwrap();
    ok(&["report", text(&calibrated().join("fit")), "--out", text(&page)]);
    assert!(page.exists() && !left.exists() && other.exists());
}

#[test]
fn a_table_of_cases_of_many_columns_is_refused_in_a_line() {
    let folder = scratch("hostile", "wide");
    let cases = folder.join("cases.csv");
    fs::write(&cases, vec!["column"; 130_000].join(",") + "\n").unwrap();
    let said = refused(1, &["evaluate", text(&cases), "--data", text(&folder)])
        .says("expected at most 1000 columns, found 130000")
        .0;
    assert!(said.len() < 400, "{said}");
}

/// Message of a command that must fail under a limit of the shell, with an exit code and not by a signal.
#[cfg(unix)]
fn limited(limit: &str, arguments: &[&str]) -> String {
    let mut command = Command::new("sh");
    // A heap per thread takes address space that is irrelevant to the test.
    command.env("RAYON_NUM_THREADS", "1");
    command.args(["-c", &format!("{limit}; exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_leadlag")]).args(arguments);
    refusal(command.output().expect("a shell"))
}

#[cfg(not(unix))]
fn limited(_: &str, arguments: &[&str]) -> String {
    refusal(Command::new(env!("CARGO_BIN_EXE_leadlag")).args(arguments).output().expect("it starts"))
}

fn refusal(output: Output) -> String {
    let said = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(!said.contains("panicked"), "{said}");
    said
}

/// Stacks that are too large for any machine represent a system in which a process cannot start a thread.
#[test]
fn without_threads_there_is_a_message() {
    let file = calibrated().join("platoon.csv");
    let out = scratch("hostile", "threads");
    let mut command = Command::new(env!("CARGO_BIN_EXE_leadlag"));
    command.env("RUST_MIN_STACK", (1_u64 << 50).to_string());
    let arguments = ["calibrate", text(&file), "--follower", "1", "--model", "idm", "--out", text(&out)];
    let said = refusal(command.args(arguments).output().expect("it starts"));
    assert!(said.contains("cannot start the threads") && said.contains("ulimit -u"), "{said}");
}

/// The pool of the program has its thread, and there is no room for the stack of another one.
#[cfg(target_os = "linux")]
#[test]
fn without_a_thread_for_its_pairs_a_fleet_says_so() {
    let file = calibrated().join("platoon.csv");
    let out = scratch("hostile", "fleet");
    let arguments = ["calibrate", text(&file), "--all", "--model", "idm", "--out", text(&out)];
    let said = limited("export RUST_MIN_STACK=1073741824; ulimit -v 2600000", &arguments);
    assert!(said.contains("cannot start a thread for the calibrations") && said.contains("ulimit -u"), "{said}");
}

/// A finished change leaves an empty folder behind if it is killed at its end; a process that may only read the result need not remove it.
#[cfg(unix)]
#[test]
fn a_reader_needs_no_right_to_write() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    use std::os::unix::process::CommandExt;
    let mode = |path: &Path, mode| fs::set_permissions(path, fs::Permissions::from_mode(mode)).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let (program, fit) = (folder.path().join("leadlag"), folder.path().join("fit"));
    fs::copy(env!("CARGO_BIN_EXE_leadlag"), &program).unwrap();
    fs::create_dir_all(fit.join(".leadlag-ready")).unwrap();
    fs::copy(calibrated().join("fit/result.json"), fit.join("result.json")).unwrap();
    let mut command = Command::new(&program);
    command.current_dir(folder.path()).args(["report", "fit", "--out", "page.html"]);
    if fs::metadata(folder.path()).unwrap().uid() == 0 {
        // Root may write everywhere.
        command.uid(65534).gid(65534);
    }
    [(folder.path(), 0o777), (&program, 0o755), (&fit, 0o555)].into_iter().for_each(|(path, bits)| mode(path, bits));
    let done = command.output().unwrap();
    mode(&fit, 0o755);
    assert!(done.status.success(), "{}", stderr(&done));
    assert!(folder.path().join("page.html").exists());
}

/// Software Vulkan ends the program with a signal if it gets too little address space.
#[cfg(target_os = "linux")]
#[test]
fn drivers_are_not_loaded_into_too_little_memory() {
    let said = limited("ulimit -v 1000000", &["doctor"]);
    let expected = "drivers need an address space of ";
    assert!(said.contains(expected) && said.contains("MiB, found a limit of 976 MiB; raise it"), "{said}");
    let file = calibrated().join("platoon.csv");
    let out = scratch("hostile", "memory");
    let arguments =
        ["calibrate", text(&file), "--follower", "1", "--model", "idm", "--evaluator", "gpu", "--out", text(&out)];
    let said = limited("ulimit -v 1000000", &arguments);
    assert!(said.contains(expected), "{said}");
}

/// Such a process may have less memory than some hundred thousand rows take: the message says so, and nothing aborts.
#[cfg(unix)]
#[test]
fn a_table_beyond_the_memory_of_the_process_is_refused() {
    let folder = scratch("hostile", "memory_of_rows");
    let (file, out) = (folder.join("long.csv"), folder.join("fit"));
    let row = |k: u32| {
        let t = f64::from(k) / 10.0;
        let [v_l, v] = [0.0, 1.0].map(|late| 20.0 + 3.0 * ((t - late) / 3.0).sin());
        format!("{t:.1},{v_l:.4},{v:.4},{:.4}\n", 30.0 + 9.0 * (((t - 1.0) / 3.0).cos() - (t / 3.0).cos()))
    };
    let rows: Vec<String> = (0..450_000).map(row).collect();
    let write = |rows: &[String]| {
        fs::write(&file, "time_s,lead_speed_mps,speed_mps,spacing_m\n".to_owned() + &rows.concat()).unwrap();
    };
    write(&rows);
    let search = ["--model", "idm", "--max-evaluations", "100", "--no-intervals", "--out", text(&out)];
    let calibrate = [&["calibrate", text(&file)], &search[..]].concat();
    for verb in [&["inspect", text(&file)], &calibrate[..]] {
        let said = limited("ulimit -v 524288", verb);
        let expected = ["expected at most 419430 lines, which take 64 MiB", "split the file", "`ulimit -v`"];
        assert!(expected.iter().all(|part| said.contains(part)), "{said}");
    }
    // What is allowed fits.
    write(&rows[..419_000]);
    let mut command = Command::new("sh");
    command.env("RAYON_NUM_THREADS", "1");
    command.args(["-c", "ulimit -v 524288; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_leadlag")]).args(calibrate);
    let output = command.output().expect("a shell");
    assert!(output.status.success(), "{}", stderr(&output));
}

/// A column of numbers by their changes that has a first value and claims to have none: the library panics, and the user reads an error.
#[test]
fn a_panic_of_the_parquet_library_is_an_error() {
    use parquet::basic::Encoding;
    use parquet::data_type::Int32Type;
    use parquet::file::properties::WriterProperties;
    let properties = WriterProperties::builder().set_dictionary_enabled(false);
    let properties = properties.set_column_encoding("n".into(), Encoding::DELTA_BINARY_PACKED).build();
    let mut file = table::<Int32Type>("int32 n", 1, properties);
    // Blocks of 128 values in 4 parts, 300 values, the first of which is 1.
    let start = [0x80, 0x01, 0x04, 0xAC, 0x02, 0x02];
    let at = file.windows(start.len()).position(|bytes| bytes == start).expect("a page of changes");
    file[at + 3..at + 5].copy_from_slice(&[0x80, 0x00]);
    let path = scratch("hostile", "panic").join("changes.parquet");
    fs::write(&path, file).expect("room");
    let said = refused(1, &["inspect", text(&path)]).says("its contents contradict each other").0;
    assert!(!said.contains("panicked"), "{said}");
}
