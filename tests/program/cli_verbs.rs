//! The command line beyond `tests/program/cli.rs`: help, misspelt names, completions, manual pages, `--quiet`, extensions, reports, column
//! maps.

use crate::common::program::{
    edited, exits, json, json_of, leadlag, ok, quick, refused, scale, scratch, stderr, synth, text,
};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

fn pair() -> PathBuf {
    synth(60).join("pair_follower1.csv")
}

pub const SOFT: &str = "//! The car brakes less than commanded.
struct Parameters {
    /// share of the braking that is lost [-], 0 to 0.9, neutral 0
    lost: f32,
}

fn soft_command(own: Parameters, a_cmd: f32) -> f32 {
    return select(a_cmd, (1.0 - own.lost) * a_cmd, a_cmd < 0.0);
}
";

/// A calibration with a user's extension, made once.
fn extended() -> &'static Path {
    static FOLDER: OnceLock<PathBuf> = OnceLock::new();
    FOLDER.get_or_init(|| {
        let folder = scratch("cli_verbs", "extended");
        let own = folder.join("soft.wgsl");
        fs::write(&own, SOFT).unwrap();
        let out = folder.join("fit");
        let extensions = ["--extend", text(&own), "--extend", "actuation_lag"];
        let search = ["--max-evaluations", "300", "--optimizer", "ga", "--no-intervals", "--out", text(&out)];
        ok(&[&["calibrate", text(&pair()), "--model", "l-cth"][..], &extensions, &search].concat());
        out
    })
}

/// Every verb with its sub-verbs, by the help itself.
fn verbs(path: &[String], found: &mut Vec<Vec<String>>) {
    let words: Vec<&str> = path.iter().map(String::as_str).chain(["--help"]).collect();
    let help = ok(&words);
    let Some((_, commands)) = help.split_once("\nCommands:\n") else {
        found.push(path.to_vec());
        return;
    };
    let names = commands.lines().take_while(|line| line.starts_with(' ') || line.is_empty());
    let names = names.filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    for name in names.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help") {
        verbs(&[path, &[name.to_owned()]].concat(), found);
    }
}

#[test]
fn every_verb_has_an_example_that_starts_with_it() {
    let mut found = Vec::new();
    verbs(&[], &mut found);
    assert!(found.len() >= 20, "{found:?}");
    for verb in found {
        let words: Vec<&str> = verb.iter().map(String::as_str).chain(["--help"]).collect();
        let help = ok(&words);
        let Some((_, examples)) = help.split_once("\nExample") else { panic!("{verb:?} has no example:\n{help}") };
        let start = format!("leadlag {} ", verb.join(" "));
        assert!(examples.contains(start.trim_end()), "{verb:?}: no example starts with `{start}`:\n{examples}");
    }
}

/// Output of `leadlag WORDS --help`, in a terminal with at most COLUMNS columns.
fn help(words: &[String], columns: Option<&str>) -> String {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leadlag"));
    command.args(words).arg("--help").env_remove("COLUMNS").envs(columns.map(|columns| ("COLUMNS", columns)));
    String::from_utf8(command.output().expect("the program starts").stdout).expect("UTF-8")
}

#[test]
fn help_takes_80_columns_unless_the_terminal_says_otherwise() {
    let widest = |text: &str| text.lines().map(|line| line.chars().count()).max().expect("lines");
    let mut found = vec![Vec::new()];
    verbs(&[], &mut found);
    for verb in &found {
        let text = help(verb, None);
        assert!(widest(&text) <= 80, "{verb:?} takes {} columns:\n{text}", widest(&text));
        // A command that the margin cuts cannot be copied, so each has its full length in a wider terminal.
        let commands =
            |text: &str| text.lines().filter(|line| line.starts_with("  leadlag ")).map(str::to_owned).collect();
        let (narrow, wide): (Vec<String>, Vec<String>) = (commands(&text), commands(&help(verb, Some("100"))));
        assert_eq!(narrow, wide, "{verb:?}");
    }
    let calibrate = ["calibrate".to_owned()];
    assert!((81..=100).contains(&widest(&help(&calibrate, Some("200")))), "at most 100, also of a wide terminal");
    let narrow = help(&calibrate, Some("60"));
    let (_, options) = narrow.split_once("\nOptions:\n").expect("options");
    let (options, _) = options.split_once("\nExamples:\n").expect("examples");
    assert!(widest(options) <= 60, "{options}");
}

#[test]
fn the_place_of_results_has_a_short_form_wherever_there_is_one() {
    let mut found = Vec::new();
    verbs(&[], &mut found);
    let with: Vec<String> = found.iter().map(|verb| help(verb, None)).filter(|text| text.contains("--out <")).collect();
    assert!(with.len() >= 12, "{}", with.len());
    for text in with {
        assert!(text.contains("  -o, --out <"), "{text}");
    }
}

#[test]
fn a_name_that_is_nearly_right_is_suggested() {
    let drive = pair();
    let file = text(&drive);
    let with = |extra: &[&str]| exits(2, &[&["calibrate", file, "--out", "never"], extra].concat());
    for (what, message, expected) in [
        ("verb", exits(2, &["calibrte"]), "'calibrate'"),
        ("flag", with(&["--model", "idm", "--replicate", "2"]), "'--replicates'"),
        ("variant", with(&["--model", "gips"]), "did you mean `gipps`?"),
        ("parameter", with(&["--model", "idm", "--fix", "v0=30"]), "did you mean `v_0`?"),
        ("cause", with(&["--model", "idm", "--extend", "actuaton_lag"]), "did you mean `actuation_lag`?"),
        ("vehicle", with(&["--model", "idm+nonlinear", "--vehicle", "bmv_x5"]), "did you mean `bmw_x5`?"),
        ("layout", with(&["--model", "idm", "--layout", "opnacc"]), "did you mean `openacc`?"),
        ("column map", with(&["--model", "idm", "--columns", "higd"]), "did you mean highd?"),
        ("evaluator", with(&["--model", "idm", "--evaluator", "lane"]), "'lanes'"),
        ("goodness of fit", with(&["--model", "idm", "--gof", "nrsme-sva"]), "did you mean `nrmse-sva`?"),
        (
            "cause",
            exits(2, &["diagnose", "--data", file, "--base", "idm", "--causes", "grad"]),
            "did you mean `grade`?",
        ),
        ("shell", exits(2, &["completions", "bsh"]), "'bash'"),
    ] {
        assert!(message.contains(expected), "{what}: expected {expected:?} in:\n{message}");
    }
    let bounds = scratch("cli_verbs", "bounds").join("bounds.toml");
    fs::write(&bounds, "taup = 0.3\n").unwrap();
    let output = leadlag(&["calibrate", file, "--model", "idm", "--bounds", text(&bounds), "--out", "never"]);
    assert!(stderr(&output).contains("is not a parameter of any variant"), "{}", stderr(&output));
    assert!(stderr(&output).contains("did you mean `tau_p`?"), "{}", stderr(&output));
    // And a column of a file with a misspelt name in its header.
    let table = scratch("cli_verbs", "column").join("drive.csv");
    fs::write(&table, fs::read_to_string(pair()).unwrap().replacen("spacing_m", "spacng_m", 1)).unwrap();
    let output = leadlag(&["inspect", text(&table)]);
    assert!(stderr(&output).contains("rename spacng_m to spacing_m?"), "{}", stderr(&output));
}

#[test]
fn completions_and_manual_pages_know_every_verb() {
    let mut found = Vec::new();
    verbs(&[], &mut found);
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = ok(&["completions", shell]);
        for verb in &found {
            let last = verb.last().expect("a verb has a name");
            assert!(script.contains(last.as_str()), "{shell}: {verb:?}");
        }
    }
    assert!(ok(&["man"]).starts_with(".ie"), "troff");
    let folder = scratch("cli_verbs", "man");
    ok(&["man", "--out", text(&folder)]);
    for verb in &found {
        let page = folder.join(format!("leadlag-{}.1", verb.join("-")));
        let page = fs::read_to_string(&page).unwrap_or_else(|error| panic!("{}: {error}", page.display()));
        assert!(page.contains("Example"), "{verb:?}");
    }
}

#[test]
fn quiet_silences_stderr_but_for_errors() {
    let missing = scratch("cli_verbs", "quiet").join("no_simulation");
    fs::create_dir_all(&missing).unwrap();
    fs::copy(extended().join("result.json"), missing.join("result.json")).unwrap();
    let page = missing.join("page.html");
    let report = ["report", text(&missing), "-o", text(&page)];
    assert!(stderr(&leadlag(&report)).contains("simulation.csv"), "a missing table is worth a warning");
    let quiet = leadlag(&[&["--quiet"][..], &report].concat());
    assert!(quiet.status.success());
    assert_eq!(stderr(&quiet), "");
    let failed = leadlag(&["inspect", "-q", "nowhere.csv"]);
    assert_eq!(failed.status.code(), Some(1));
    assert!(stderr(&failed).starts_with("error: nowhere.csv"), "{}", stderr(&failed));
}

#[test]
fn every_environment_variable_is_documented() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut names = BTreeSet::new();
    let mut folders: Vec<PathBuf> = ["src", "tests", "scripts", ".ci"].map(|f| root.join(f)).to_vec();
    while let Some(folder) = folders.pop() {
        let Ok(entries) = fs::read_dir(&folder) else { continue };
        for path in entries.map(|entry| entry.expect("readable").path()) {
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let Ok(content) = fs::read_to_string(&path) else { continue };
            for (at, prefix) in content.match_indices(concat!("LEADLAG", "_")) {
                let rest = content[at + prefix.len()..].chars().take_while(|c| c.is_ascii_uppercase() || *c == '_');
                names.insert(format!("{prefix}{}", rest.collect::<String>()));
            }
        }
    }
    assert!(names.contains("LEADLAG_NO_GPU") && names.len() >= 4, "{names:?}");
    // Variables of the tests are documented for developers.
    let pages = ["docs/CLI.md", "CONTRIBUTING.md"].map(|page| fs::read_to_string(root.join(page)).expect(page));
    let missing: Vec<&String> =
        names.iter().filter(|name| !pages.iter().any(|page| page.contains(name.as_str()))).collect();
    assert!(missing.is_empty(), "neither docs/CLI.md nor CONTRIBUTING.md explains {missing:?}");
    let page = &pages[0];
    let mut found = Vec::new();
    verbs(&[], &mut found);
    let missing: Vec<&Vec<String>> = found.iter().filter(|verb| !page.contains(&format!("`{}", verb[0]))).collect();
    assert!(missing.is_empty(), "docs/CLI.md does not name {missing:?}");
}

#[test]
fn check_describes_a_good_extension_and_names_the_place_of_a_bad_one() {
    let folder = scratch("cli_verbs", "check");
    let [good, bad] = ["soft.wgsl", "bad.wgsl"].map(|name| folder.join(name));
    fs::write(&good, SOFT).unwrap();
    fs::write(&bad, SOFT.replace("own.lost", "own.lots")).unwrap();
    let printed = ok(&["check", text(&good)]);
    assert!(printed.starts_with("soft: valid, a cause\n"), "{printed}");
    assert!(printed.contains("lost [-] 0 to 0.9, neutral at 0: share of the braking that is lost"), "{printed}");
    let entries = json(&["check", text(&good), "--json"]);
    assert_eq!(entries[0]["parameters"][0]["bounds"], serde_json::json!([0.0, 0.9]));
    assert_eq!(entries[0]["bases"].as_array().unwrap().len(), 5);
    let misspelt = folder.join("misspelt.wgsl");
    fs::write(&misspelt, SOFT.replace("soft_", "misspelt_") + "fn misspelt_respons(a: f32) -> f32 { return a; }\n")
        .unwrap();
    let warned = leadlag(&["check", text(&misspelt)]);
    assert!(warned.status.success() && stderr(&warned).contains("did you mean `misspelt_response`?"), "{warned:?}");
    let failed = leadlag(&["check", text(&bad)]);
    assert_eq!(failed.status.code(), Some(1));
    let message = stderr(&failed);
    assert!(message.contains("bad.wgsl:8:") && message.contains("lots"), "{message}");
    assert!(exits(2, &["check", "soft"]).contains("no built-in extension is called `soft`"));
}

#[test]
fn an_extended_result_is_calibrated_written_and_simulated_again() {
    let result = json_of(extended().join("result.json"));
    let names: Vec<&str> = result["parameters"].as_object().unwrap().keys().map(String::as_str).collect();
    assert!(names.starts_with(&["k_s", "k_v", "k_0", "v_0", "d_0", "t_h"]), "{names:?}");
    assert!(names.len() == 8 && names.contains(&"lost") && names.contains(&"ta"), "{names:?}");
    let extension = |name: &str| {
        let all = result["extensions"].as_array().unwrap();
        all.iter().find(|entry| entry["name"] == name).unwrap_or_else(|| panic!("{name} in {all:?}")).clone()
    };
    assert_eq!(extension("soft")["text"], SOFT, "a user's own text travels with the result");
    assert!(extension("actuation_lag").get("text").is_none(), "that of a built-in one does not");
    // Moved away from the WGSL file, it is simulated to the same score.
    let elsewhere = scratch("cli_verbs", "elsewhere").join("result.json");
    fs::copy(extended().join("result.json"), &elsewhere).unwrap();
    let again = json(&["simulate", text(&pair()), "--result", text(&elsewhere), "--json"]);
    assert_eq!(again["runs"][0]["score"]["nrmse_sva"], result["score"]["nrmse_sva"]);
}

#[test]
fn a_report_of_a_calibration_is_one_page_without_network() {
    let page = scratch("cli_verbs", "report").join("page.html");
    ok(&["report", text(extended()), "-o", text(&page)]);
    let html = fs::read_to_string(&page).unwrap();
    assert!(html.trim_start().to_lowercase().starts_with("<!doctype html>") && html.contains("l-cth"));
    for word in ["lost", "ta", "k_v"] {
        assert!(html.contains(word), "the page lacks parameter {word}");
    }
    for outside in ["src=\"http", "href=\"http", "@import", "url(http"] {
        assert!(!html.contains(outside), "the page asks for {outside}");
    }
    // The heading has the score that was minimised, under its name.
    let fit = scratch("cli_verbs", "heading");
    let search = ["--model", "idm", "--gof", "rmse-s", "--max-evaluations", "300", "--no-intervals", "--json"];
    let json = ok(&[&["calibrate", text(&pair()), "--out", text(&fit)], &search[..]].concat());
    let result: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    ok(&["report", text(&fit), "-o", text(&page)]);
    let html = fs::read_to_string(&page).expect("written");
    let (_, heading) = html.split_once("; rmse-s = ").expect("the goodness of fit in the heading");
    let shown: f64 = heading.split_once(".</p>").expect("an end").0.parse().expect("a number");
    let minimised = result["score"]["rmse_s"].as_f64().expect("a score");
    assert!((shown / minimised - 1.0).abs() < 1e-3, "{shown} is not {minimised}");
    assert!(
        html.contains("<strong>Spacing is off by ") && html.contains(" %), speed by "),
        "errors in words come first"
    );
    // The command that made it, and its warnings.
    assert!(html.contains("The command: <code>leadlag calibrate ") && html.contains("--max-evaluations 300"));
    assert!(!html.contains("Warnings of the command"));
    ok(&[&["calibrate", text(&pair()), "--smooth", "--joint", "--out", text(&fit)], &search[..]].concat());
    let run = fit.join("run.json");
    let made =
        fs::read_to_string(&run).expect("written").replace("\"warnings\": []", "\"warnings\": [\"<b>doubt</b>\"]");
    fs::write(&run, made).expect("room");
    ok(&["report", text(&fit), "-o", text(&page)]);
    let html = fs::read_to_string(&page).expect("written");
    assert!(html.contains("<li>&lt;b&gt;doubt&lt;/b&gt;</li>"), "warnings are text");
    fs::write(&run, "{").expect("room");
    refused(1, &["report", text(&fit), "-o", text(&page)]).says("run.json: expected the command of a result");
    let empty = scratch("cli_verbs", "empty");
    assert!(exits(2, &["report", text(&empty), "-o", text(&page)]).contains("expected a folder with result.json"));
}

#[test]
fn what_is_likely_a_mistake_is_warned_of() {
    let folder = scratch("cli_verbs", "mistakes");
    let out = folder.join("fit");
    let calibrate = |file: &Path, extra: &[&str]| stderr(&quick(file, &out, extra));
    let file = &pair();
    assert!(!calibrate(file, &[]).contains("warning"));
    assert!(calibrate(file, &["--vehicle", "bmw_x5"]).contains("--vehicle changes nothing: variant idm has neither"));
    assert!(calibrate(file, &["--grade", "level"]).contains("--grade changes nothing: variant idm has neither"));
    // The unit differs from that in the name of the column.
    let feet = folder.join("feet.csv");
    let metres = fs::read_to_string(pair()).expect("a table");
    assert!(metres.starts_with("time_s,lead_speed_mps,speed_mps,spacing_m,"), "{metres}");
    fs::write(&feet, edited(&metres, |_, fields| scale(&mut fields[3], 1.0 / 0.3048))).expect("writable");
    for message in [calibrate(&feet, &[]), ok(&["inspect", text(&feet)])] {
        assert!(message.contains("times as much as the speeds imply (3.2808 is feet per metre)"), "{message}");
    }
}

#[test]
fn a_table_with_a_column_map_is_inspected_and_calibrated_by_vehicle_id() {
    let folder = scratch("cli_verbs", "columns");
    let (map, table) = (folder.join("mine.toml"), folder.join("mine.csv"));
    fs::write(
        &map,
        "rows = \"vehicles\"\n[columns]\ntime = { name = \"t\" }\nid = { name = \"car\" }\nahead = { name = \"front\" }\n\
         speed = { name = \"v\", unit = \"km/h\" }\ngap = { name = \"gap\", unit = \"ft\" }\n",
    )
    .unwrap();
    let mut reader = csv::Reader::from_path(pair()).unwrap();
    let mut rows = "t,car,front,v,gap\n".to_owned();
    for record in reader.records() {
        let record = record.unwrap();
        let [t, v_l, v, s] = [0, 1, 2, 3].map(|column| record[column].parse::<f64>().unwrap());
        rows += &format!("{t},first,,{},\n{t},second,first,{},{}\n", 3.6 * v_l, 3.6 * v, s / 0.3048);
        rows += &format!("{t},third,second,{},{}\n", 3.6 * v, 100.0);
    }
    fs::write(&table, rows).unwrap();
    let (map, table) = (text(&map), text(&table));
    let printed = ok(&["inspect", table, "--columns", map]);
    assert!(printed.contains("layout columns") && printed.contains("trajectory second-first"), "{printed}");
    refused(2, &["calibrate", table, "--columns", map, "--model", "idm", "--out", "never"])
        .says("--follower is needed: it has 2 pairs, first vehicle second (60.0 s)");
    refused(2, &["inspect", table, "--columns", map, "--follower", "first"])
        .says("--follower first: it has no car ahead");
    let search = ["--model", "idm", "--max-evaluations", "200", "--optimizer", "ga", "--no-intervals"];
    let [mapped, plain] = ["mapped", "plain"].map(|name| folder.join(name));
    let chosen = ["--columns", map, "--follower", "second", "--out", text(&mapped)];
    ok(&[&["calibrate", table][..], &chosen, &search].concat());
    ok(&[&["calibrate", text(&pair()), "--out", text(&plain)][..], &search].concat());
    let score = |folder: &Path| -> f64 {
        let result = json_of(folder.join("result.json"));
        result["score"]["nrmse_sva"].as_f64().unwrap()
    };
    let (mapped, plain) = (score(&mapped), score(&plain));
    // The same drive up to the rounding of two conversions, and the same random numbers.
    assert!((mapped - plain).abs() < 1e-3 * plain, "{mapped} by the map, {plain} by the pair file");
}

/// The requested number of candidates per generation, and no other optimiser's.
#[test]
fn the_population_of_a_genetic_algorithm_is_chosen() {
    let out = scratch("cli_verbs", "population").join("fit");
    let drive = pair();
    let common = ["calibrate", text(&drive), "--model", "idm", "--no-intervals", "--out", text(&out)];
    let ga = ["--optimizer", "ga", "--population", "400", "--max-evaluations", "1000"];
    ok(&[&common[..], &ga].concat());
    let result = json_of(out.join("result.json"));
    // 400, and, because the parents are carried over, 280 more in each generation.
    assert_eq!((&result["population"], &result["evaluations"]), (&400.into(), &960.into()));
    refused(2, &[&common[..], &["--population", "400"]].concat()).says("add --optimizer ga or lshade");
    let few = ["--optimizer", "lshade", "--population", "400", "--max-evaluations", "300"];
    refused(2, &[&common[..], &few].concat()).says("more candidates than --max-evaluations 300 allows");
}
