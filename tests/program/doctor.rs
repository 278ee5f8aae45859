//! `leadlag doctor`: its output with and without an adapter.

use leadlag::internal::gpu::{Probe, ProbeStatus, modes};
use serde_json::Value;
use std::process::{Command, Output};

fn doctor(arguments: &[&str], without_drivers: bool) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leadlag"));
    command.arg("doctor").args(arguments);
    if without_drivers {
        // The Vulkan loader reads either name, by its age.
        command.env("VK_DRIVER_FILES", "/nowhere.json").env("VK_ICD_FILENAMES", "/nowhere.json");
    }
    command.output().expect("the program starts")
}

fn stdout(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).expect("UTF-8")
}

fn skipped(test_name: &str) -> bool {
    let skipped = std::env::var_os("LEADLAG_NO_GPU").is_some();
    if skipped {
        println!("SKIPPED {test_name}: LEADLAG_NO_GPU");
    }
    skipped
}

#[test]
#[cfg(target_os = "linux")]
fn without_an_adapter_it_says_what_to_install() {
    let text = stdout(&doctor(&[], true));
    assert!(text.contains("No GPU adapter found") && text.contains("apt-get install mesa-vulkan-drivers libvulkan1"));
    let json: Value = serde_json::from_str(&stdout(&doctor(&["--json"], true))).expect("JSON");
    assert_eq!(json, serde_json::json!({"schema_version": 1, "adapters": [], "probes": [], "chosen": null}));
}

#[test]
fn json_has_adapters_and_probes() {
    if skipped("json_has_adapters_and_probes") {
        return;
    }
    let json: Value = serde_json::from_str(&stdout(&doctor(&["--json"], false))).expect("JSON");
    let chosen = json["chosen"].as_u64().expect("an adapter, or LEADLAG_NO_GPU=1");
    let adapter = &json["adapters"][chosen as usize];
    println!("{adapter:#}");
    for key in ["index", "name", "type", "backend", "driver", "pci", "features", "limits", "safe_modes"] {
        assert!(!adapter[key].is_null(), "{key}");
    }
    let probes = json["probes"].as_array().expect("a list");
    assert!(probes.len() >= 12, "{probes:?}");
    for probe in probes {
        let status = probe["status"].as_str().expect("a word");
        assert!(["ok", "trap"].contains(&status), "{probe}");
        assert!(probe["detail"].as_str().is_some_and(|detail| detail.len() > 20), "{probe}");
    }
    let safe: Vec<&str> = adapter["safe_modes"].as_array().expect("a list").iter().filter_map(Value::as_str).collect();
    assert!(safe.starts_with(&["plain", "compensated"]), "{safe:?}");
    assert!(safe.contains(&"same_bits") || adapter["type"] != "software", "{safe:?}");
    // Properties that results rely on; a software adapter also gives the CPU's bits.
    for name in ["nan_by_bits", "hidden_error_terms", "own_power", "own_exponential", "own_logarithm"] {
        let probe = probes.iter().find(|p| p["name"] == name).unwrap_or_else(|| panic!("no probe {name}"));
        assert!(probe["status"] == "ok" || name.starts_with("own") && adapter["type"] != "software", "{probe}");
    }
}

#[test]
fn what_a_probe_finds_decides_what_is_safe() {
    let probes = |found: [ProbeStatus; 4]| -> Vec<Probe> {
        let names = ["nan_by_bits", "own_power", "hidden_error_terms", "unfused_products"];
        let probe = |(name, status)| Probe { name, status, detail: String::new() };
        let others = ["own_exponential", "own_logarithm", "rounded_quotients", "rounded_roots"];
        let others = others.map(|name| (name, ProbeStatus::Ok));
        names.into_iter().zip(found).chain(others).map(probe).collect()
    };
    let safe = |found: [ProbeStatus; 4]| modes(&probes(found)).map(|mode| mode.safe);
    use ProbeStatus::{Fail, Ok, Trap};
    assert_eq!(safe([Ok, Ok, Ok, Ok]), [true, true, true]);
    assert_eq!(safe([Ok, Ok, Ok, Trap]), [true, true, false], "products are fused: other bits");
    assert_eq!(safe([Ok, Trap, Ok, Ok]), [true, true, false], "other powers: other bits");
    assert_eq!(safe([Ok, Ok, Fail, Ok]), [true, false, true], "no error terms");
    assert_eq!(safe([Ok, Fail, Ok, Ok]), [false; 3], "wrong powers");
    assert_eq!(safe([Fail, Ok, Ok, Ok]), [false; 3], "NaN unnoticed");
    for operation in ["rounded_quotients", "rounded_roots"] {
        let mut inexact = probes([Ok; 4]);
        let found = inexact.iter_mut().find(|probe| probe.name == operation).expect("among them");
        found.status = Trap;
        assert_eq!(modes(&inexact).map(|mode| mode.safe), [true, true, false], "{operation}: other bits");
    }
    assert_eq!(modes(&[]).map(|mode| mode.safe), [false; 3], "nothing was probed");
}

#[test]
fn text_fits_80_columns_and_a_wrong_name_is_told() {
    if skipped("text_fits_80_columns_and_a_wrong_name_is_told") {
        return;
    }
    let text = stdout(&doctor(&[], false));
    for line in text.lines() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    let wrong = doctor(&["--gpu", "Voodoo 2"], false);
    assert_eq!(wrong.status.code(), Some(1));
    let message = String::from_utf8_lossy(&wrong.stderr).into_owned();
    assert!(
        wrong.stdout.is_empty() && message.contains("no GPU adapter `Voodoo 2`") && message.contains("\n  0  "),
        "{message}"
    );
}
