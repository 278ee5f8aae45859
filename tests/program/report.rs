//! Output for people: the demo, which reads files only and reports honestly whether it found the hidden effect; pages and text charts.

use crate::common::program::{fails, json_of, leadlag, ok, refused, scratch, stderr, succeeds, text};
use serde_json::Value;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Length in seconds that is enough for most causes, and short enough for a test.
const SHORT: u32 = 240;
/// Length in seconds that shows both settings of the gap on the two thirds for training.
const LONG: u32 = 600;

fn demo(hide: &str, seconds: u32) -> (String, PathBuf) {
    let name: String = hide.chars().take_while(|c| *c != ':').collect();
    let folder = scratch("report", &name);
    let said = ok(&["demo", "--hide", hide, "--seed", "1", "--duration", &seconds.to_string(), "--out", text(&folder)]);
    (said, folder)
}

/// The last lines agree with the files, and the report carries the diagnosis.
fn check_ending(said: &str, folder: &Path) -> Value {
    let ending = said.split("== Planted effect and result").nth(1).expect("an ending");
    for words in [
        "found ",
        "hidden ",
        "so ",
        "report.html",
        "$ leadlag inspect FILE.csv",
        "$ leadlag diagnose --data FILE.csv",
        "--lead-start POSITION: ",
    ] {
        assert!(ending.contains(words), "{words}: {said}");
    }
    let diagnosis = json_of(folder.join("diagnosis").join("diagnosis.json"));
    let page = fs::read_to_string(folder.join("report.html")).expect("written");
    let reason = diagnosis["reason"].as_str().expect("a sentence");
    assert!(page.contains(&reason.replace('<', "&lt;").replace('>', "&gt;")) && page.len() < 5_000_000, "{reason}");
    // Each printed command can be typed: it names existing files of this folder.
    for line in said.lines().filter(|line| line.starts_with("$ leadlag ") && line.contains(" > ")) {
        let log = line.rsplit(" > ").next().expect("a file");
        assert!(Path::new(log).exists(), "{line}");
    }
    diagnosis
}

fn found(hide: &str, seconds: u32) {
    let (said, folder) = demo(hide, seconds);
    let diagnosis = check_ending(&said, &folder);
    let name: String = hide.chars().take_while(|c| *c != ':').collect();
    assert_eq!(diagnosis["verdict"], "named", "{said}");
    assert_eq!(diagnosis["causes"][0]["name"], name.as_str(), "{said}");
    assert!(said.contains("so      right, "), "{said}");
    // The input of the analysis does not contain the hidden effect; only truth.json does, which no command names.
    let truth = fs::read_to_string(folder.join("truth.json")).expect("written");
    assert!(truth.contains(&name) && !said.contains("truth.json"), "{said}");
    for file in ["platoon.csv", "Slope.csv"] {
        assert!(!fs::read_to_string(folder.join(file)).expect("written").contains(&name), "{file}");
    }
    // The extended model was calibrated on the same stretch, and both were tested on the rest.
    let [base, extended] = ["base", "extended"].map(|model| {
        let result = json_of(folder.join(model).join("result.json"));
        let run = json_of(folder.join(format!("{model}_held_back.json")));
        let (trained, held) = (&result["data"][0]["window_s"], run["runs"][0]["preparation"].to_string());
        assert_eq!(
            (trained[0].as_f64(), trained[1].as_f64()),
            (Some(0.0), Some(f64::from(seconds * 2 / 3))),
            "{trained}"
        );
        assert!(held.contains(&(seconds * 2 / 3).to_string()), "{held}");
        (result, run["runs"][0]["score"]["nrmse_sva"].as_f64().expect("a score"))
    });
    assert_eq!(extended.0["extensions"][0]["name"], name.as_str());
    assert!(base.0["extensions"].as_array().is_some_and(Vec::is_empty));
    assert!(extended.1 < base.1, "on what was held back: base {}, extended {}", base.1, extended.1);
    // A recommended model is for the whole file; a named one was only tested on the training data.
    if diagnosis["recommended"].is_null() {
        go_on(&folder, &diagnosis["causes"], "on the training data, ", &base.0["data"][0]["window_s"]);
    } else {
        let whole = serde_json::json!([0.0, f64::from(seconds)]);
        go_on(&folder, &diagnosis["recommended"]["causes"], "on whole files", &whole);
    }
}

/// The last command of the diagnosis can be pasted into a shell, and calibrates on what it says.
fn go_on(folder: &Path, causes: &Value, on: &str, trained: &Value) {
    let said = fs::read_to_string(folder.join("diagnosis.txt")).expect("kept");
    let (_, rest) = said.split_once(&format!("\nTo calibrate it {on}")).expect("a next command");
    let (_, rest) = rest.split_once(":\n  leadlag ").expect("a command");
    let typed: Vec<&str> =
        rest.split_inclusive('\n').take_while(|line| line.starts_with("    ") || rest.starts_with(line)).collect();
    let command = format!(
        "'{}' {} --max-evaluations 200 --no-intervals",
        env!("CARGO_BIN_EXE_leadlag"),
        typed.concat().trim_end()
    );
    let output = Command::new("sh").args(["-c", &command]).output().expect("a shell");
    assert!(output.status.success(), "{command}\n{}", String::from_utf8_lossy(&output.stderr));
    let warned = String::from_utf8_lossy(&output.stderr);
    assert!(!warned.contains("changes nothing: variant idm+grade"), "{warned}");
    let result = json_of(folder.join("diagnosis").join("extended").join("result.json"));
    assert_eq!((&result["data"][0]["window_s"], result["data"][0]["follower"].as_u64()), (trained, Some(1)));
    let names = |list: &Value| -> Vec<String> {
        list.as_array().expect("a list").iter().map(|one| one["name"].as_str().expect("a name").to_owned()).collect()
    };
    assert_eq!(names(&result["extensions"]), names(causes));
    if result["extensions"][0]["name"] == "grade" {
        let table = result["data"][0]["grade"]["path"].as_str().expect("a table of the slope");
        assert!(table.ends_with("Slope.csv"), "{table}");
    }
}

#[test]
fn a_slope_that_is_not_made_up_for_is_found() {
    found("grade:gg=0.8", SHORT);
}

#[test]
fn another_gap_setting_is_found() {
    found("headway_mode_change", LONG);
}

#[test]
fn a_weak_engine_is_found() {
    found("accel_cap", SHORT);
}

#[test]
fn nothing_is_found_where_nothing_is_hidden() {
    let (said, folder) = demo("none", SHORT);
    let diagnosis = check_ending(&said, &folder);
    assert_eq!(diagnosis["verdict"], "nothing", "{said}");
    assert!(said.contains("so      right: nothing was hidden, and nothing is named"), "{said}");
    assert!(!folder.join("extended").exists() && !said.contains("--extend"), "nothing to extend by");
}

#[test]
fn a_calibration_is_shown_in_the_terminal_and_as_a_page() {
    let drive = scratch("report", "drive");
    ok(&["synth", "--out", text(&drive), "--duration", "150"]);
    let (folder, file) = (drive.join("fit"), drive.join("platoon.csv"));
    let result = folder.join("result.json");
    let calibrate = ["calibrate", text(&file), "--follower", "1", "--model", "l-cth", "--max-evaluations", "1000"];
    ok(&[&calibrate[..], &["--out", text(&folder)]].concat());
    let simulate = ["simulate", text(&file), "--follower", "1", "--result", text(&result)];
    let plain = ok(&simulate);
    let drawn = ok(&[&simulate[..], &["--plot"]].concat());
    let charts = drawn.strip_prefix(&plain).expect("the charts come last");
    for words in ["spacing s [m]  . measured  x simulated", "speed v [m/s]", "150 s"] {
        assert!(charts.contains(words), "{words}: {charts}");
    }
    // Into a file: 80 columns, no colours.
    assert!(charts.lines().all(|line| line.chars().count() <= 80) && !charts.contains('\x1b'), "{charts}");
    let output = leadlag(&[&simulate[..], &["--plot", "--json"]].concat());
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));

    let page = folder.join("page.html");
    ok(&["report", text(&folder), "-o", text(&page)]);
    let html = fs::read_to_string(&page).expect("written");
    let carried = html.split("id=\"result\">").nth(1).and_then(|rest| rest.split("</script>").next()).expect("a twin");
    let written = fs::read_to_string(&result).expect("written");
    assert_eq!(carried.replace("\\u003c", "<"), written);
    // Nothing is loaded or run from elsewhere, and a browser without scripts shows what is missing.
    let policy = html.find("Content-Security-Policy\" content=\"default-src 'none'; ").expect("a policy");
    assert!(["<style", "<script", "<link"].iter().all(|tag| html.find(tag).is_some_and(|at| at > policy)));
    assert!(!html[policy..].lines().next().expect("a line").contains("http"));
    assert_eq!(html.matches("<noscript>").count(), html.matches("data-chart=\"").count() + 1);
    for words in ["Error by driving state", "Residuals over speed", "class=\"number share\""] {
        assert!(html.contains(words), "{words}");
    }
    // Intervals of the parameters, as on the terminal: bounds in parentheses, samples, the most correlated parameter of each.
    let fitted: Value = serde_json::from_str(&written).expect("JSON");
    let known = fitted["identifiability"]["parameters"].as_object().expect("intervals");
    let is_determined = |known: &Value| known["determined"] == true;
    let is_open = |known: &Value| is_determined(known) && known["open"] != serde_json::json!([false, false]);
    assert!(known.values().any(is_determined), "{known:?}");
    assert_eq!(html.contains("in parentheses: a bound of the search"), known.values().any(is_open));
    for (name, known) in known {
        let row = html.split(&format!("<tr><td>{name}</td>")).nth(1).and_then(|row| row.split("</tr>").next());
        let cells: Vec<&str> = row.expect("a row").split("</td>").collect();
        let samples = known["effective_samples"].as_f64().expect("a number");
        assert_eq!(cells[1].contains('('), is_open(known), "{name}: {}", cells[1]);
        let said = cells.iter().any(|cell| cell.contains("not determined"));
        assert_eq!(said, !is_determined(known), "{name}: {cells:?}");
        assert!(cells[4].ends_with(&format!(">{samples:.0}")), "{name}: {}", cells[4]);
    }
    assert!(html.contains("goes with (correlation)"));
    // The budget's shares of the time are those of the file: standing time of the measured car.
    let simulation = fs::read_to_string(folder.join("simulation.csv")).expect("written");
    let first =
        serde_json::from_str::<Value>(&written).expect("JSON")["data"][0]["first_scored"].as_u64().expect("a number");
    let speeds: Vec<f64> = simulation
        .lines()
        .skip(1 + first as usize)
        .map(|line| line.split(',').nth(3).and_then(|v| v.parse().ok()).expect("a speed"))
        .collect();
    let standing = speeds.iter().filter(|v| **v < 0.5).count() as f64 / speeds.len() as f64;
    assert!(html.contains(&format!(
        "<td>standstill</td><td class=\"number share\" style=\"--share:{:.1}%\">",
        100.0 * standing
    )));
}

/// Two drives as pair files, and a very short calibration of one of them.
fn two_drives(name: &str) -> (PathBuf, [String; 2]) {
    let folder = scratch("report", name);
    let drive = |seed: &str| {
        let own = folder.join(seed);
        ok(&["synth", "--pairs", "--out", text(&own), "--seed", seed, "--duration", "120"]);
        text(&own.join("pair_follower1.csv")).to_owned()
    };
    let files = ["3", "5"].map(drive);
    (folder, files)
}

const QUICK: [&str; 5] = ["--model", "idm", "--max-evaluations", "300", "--no-intervals"];

/// One error with one meaning, and its parts by file.
#[test]
fn a_joint_calibration_is_told_as_a_whole_and_file_by_file() {
    let (folder, files) = two_drives("joint");
    let (fit, page) = (folder.join("fit"), folder.join("page.html"));
    let more = ["--joint", "--fix", "delta=4", "--out", text(&fit)];
    ok(&[&["calibrate", &files[0], &files[1]][..], &QUICK, &more].concat());
    ok(&["report", text(&fit), "-o", text(&page)]);
    let html = fs::read_to_string(&page).expect("written");
    let number = |before: &str, unit: &str| {
        let rest = html.split(before).nth(1).expect("an error");
        rest.split(unit).next().expect("a number").to_owned()
    };
    let off = number("root mean square: spacing ", " m");
    let [head, budget] =
        [number("<strong>Spacing is off by ", " m"), off.clone()].map(|x| x.parse::<f64>().expect("a number"));
    assert!((head / budget - 1.0).abs() < 0.05, "the headline and the budget say the same, but for the digits");
    let row = format!("<td class=\"words\">RMSE [m, m/s, m/s²]</td><td class=\"number\">{off}</td>");
    assert!(html.contains(&row), "{row}");
    for file in &files {
        let name = format!("{}, follower 1", file.replace('/', "/<wbr>"));
        assert!(html.contains(&format!("RMSE of {name}</td>")) && html.contains(&format!("of {name}</td>")), "{name}");
    }
    assert!(html.contains("<p>Bounds: acc: ") && html.contains("<p>Fixed, so not calibrated: delta.</p>"));
    assert!(html.contains("data-of=\"replicate\"") && html.contains("data-of=\"show\""));
}

#[test]
fn a_simulation_of_another_drive_is_neither_mixed_with_a_calibration_nor_drawn_with_it() {
    let (folder, [own, other]) = two_drives("mixed");
    let (fit, page) = (folder.join("fit"), folder.join("page.html"));
    ok(&[&["calibrate", &own][..], &QUICK, &["--out", text(&fit)]].concat());
    let kept = fs::read(fit.join("simulation.csv")).expect("written");
    let (code, said) = fails(&["simulate", &other, "--result", text(&fit), "--out", text(&fit)]);
    let instead = fit.join("pair_follower1");
    assert!(code == 2 && said.contains("holds the result.json of a calibration"), "{said}");
    assert!(said.contains(&format!("--out {}", instead.display())), "{said}");
    assert_eq!(fs::read(fit.join("simulation.csv")).expect("still there"), kept);
    refused(2, &["diagnose", &other, "--base", "idm", "--out", text(&fit)])
        .says("holds the result.json of a calibration");
    let diagnosis = folder.join("diagnosis");
    fs::create_dir(&diagnosis).expect("made");
    fs::write(diagnosis.join("diagnosis.json"), "{}").expect("written");
    let calibrate = [&["calibrate", &other][..], &QUICK].concat();
    for words in [calibrate, vec!["simulate", &other, "--result", text(&fit)]] {
        refused(2, &[&words[..], &["--out", text(&diagnosis)]].concat())
            .says("holds the diagnosis.json of a diagnosis");
    }

    // A drive as long as that of the result, and a shorter one.
    let report = || stderr(&succeeds(&["report", text(&fit), "-o", text(&page)]));
    assert!(!report().contains("warning"));
    for (cut, told) in
        [(&[][..], "expected an error of the spacing of"), (&["--to", "80"], "found 801 from 0.0 to 80.0 s")]
    {
        ok(&[&["simulate", &other, "--result", text(&fit), "--out", text(&instead)][..], cut].concat());
        fs::copy(instead.join("simulation.csv"), fit.join("simulation.csv")).expect("copied");
        let said = report();
        assert!(said.contains(told) && said.contains("its charts are left out"), "{said}");
        let html = fs::read_to_string(&page).expect("written");
        assert!(
            html.contains("The folder has no simulation of this result") && !html.contains("Error by driving state")
        );
    }
}

#[test]
fn a_calibration_leaves_no_file_of_the_one_before_it_in_its_folder() {
    let (folder, [one, two]) = two_drives("left_over");
    let out = folder.join("fit");
    let calibrate = |files: &[&str]| leadlag(&[&["calibrate"][..], files, &QUICK, &["--out", text(&out)]].concat());
    let names = || {
        let entries = fs::read_dir(&out).expect("a folder");
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("a file").file_name().into_string().expect("UTF-8")).collect();
        names.sort();
        names
    };
    assert!(calibrate(&[&one, &two, "--joint"]).status.success());
    fs::write(out.join("plot_of_mine.svg"), "").expect("written");
    let said = stderr(&calibrate(&[&one]));
    assert!(
        said.contains("files of an earlier result: plot_1.svg, plot_2.svg, simulation_1.csv, simulation_2.csv\n"),
        "{said}"
    );
    assert_eq!(names(), ["plot.svg", "plot_of_mine.svg", "result.json", "run.json", "simulation.csv", "timing.json"]);
    let said = stderr(&calibrate(&[&one]));
    assert!(!said.contains("files of an earlier result"), "{said}");
    // Files that do not come from a result must not be removed, whatever their names, and least of all input files.
    let own = folder.join("own");
    fs::create_dir(&own).expect("made");
    let inputs = ["simulation_1.csv", "simulation_2.csv"].map(|name| own.join(name));
    for input in &inputs {
        fs::copy(&one, input).expect("copied");
    }
    let before = fs::read(&inputs[0]).expect("an input");
    let into_own = |words: &[&str]| leadlag(&[words, &["--out", text(&own)]].concat());
    let refused = into_own(&[&["calibrate", text(&inputs[0])][..], &QUICK].concat());
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    assert!(stderr(&refused).contains("would replace the input "), "{}", stderr(&refused));
    let refused = into_own(&["diagnose", text(&inputs[1]), "--base", "idm", "--effort", "quick"]);
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    assert!(into_own(&[&["calibrate", &one][..], &QUICK].concat()).status.success());
    assert!(inputs.iter().all(|input| fs::read(input).is_ok_and(|bytes| bytes == before)));

    let refused = calibrate(&[&one, &two]);
    let said = stderr(&refused);
    assert_eq!(refused.status.code(), Some(2), "several would lie beside one: {said}");
    assert!(said.contains("holds the result.json of a calibration"), "{said}");
}

#[test]
fn a_report_says_of_what_it_can_be_and_is_html() {
    let (folder, [one, two]) = two_drives("several");
    let (out, page) = (folder.join("fits"), folder.join("page.html"));
    ok(&[&["calibrate", &one, &two][..], &QUICK, &["--out", text(&out)]].concat());
    let (code, said) = fails(&["report", text(&out), "-o", text(&page)]);
    let [first, second] = ["", "_2"].map(|number| out.join(format!("pair_follower1_follower1{number}")));
    let expected = format!("found none of them; {}, {} hold one each: ", first.display(), second.display());
    assert!(code == 2 && said.contains(&expected), "{said}");
    ok(&["report", text(&first), "-o", text(&page)]);
    let said = refused(1, &["report", &one, "-o", text(&page)])
        .says("or its result.json or diagnosis.json; this file is not JSON")
        .0;
    assert!(!said.contains("because:"), "{said}");
    let pdf = folder.join("page.pdf");
    refused(2, &["report", text(&first), "-o", text(&pdf)]).says("expected an ending .html or .htm, found .pdf");
    assert!(!pdf.exists());
}
