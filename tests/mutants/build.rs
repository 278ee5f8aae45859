//! The copy of the crate with the mutants in it: written only where it differs, so that a second run compiles nothing.

use crate::schemata::{Mutant, SWITCH, instrument};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The compiled copy.
pub struct Built {
    pub folder: PathBuf,
    /// The judging test program.
    pub judge: PathBuf,
    pub mutants: Vec<Mutant>,
}

/// What is changed, below `src`: the reference, and what its numbers pass through.
const MUTATED: [&str; 3] = ["reference/", "score.rs", "evaluator/case.rs"];

/// Entries of the package that the copy does without. `tests` is copied separately.
const LEFT_OUT: [&str; 10] =
    [".git", ".ci", "target", "tests", "benches", "examples", "fuzz", "shared", "out", "Cargo.toml"];

fn write(path: &Path, text: &[u8]) {
    if fs::read(path).is_ok_and(|old| old == text) {
        return;
    }
    fs::create_dir_all(path.parent().expect("a file has a folder")).expect("the copy's folder can be made");
    fs::write(path, text).expect("the copy can be written");
}

/// What becomes of a file: its new text, or nothing.
type Change<'a> = dyn FnMut(&Path, Vec<u8>) -> Option<Vec<u8>> + 'a;

fn copy(from: &Path, to: &Path, change: &mut Change<'_>) {
    if from.is_dir() {
        let mut entries: Vec<_> =
            fs::read_dir(from).expect("the package is readable").map(|e| e.expect("readable").file_name()).collect();
        entries.sort();
        for name in entries {
            copy(&from.join(&name), &to.join(&name), change);
        }
    } else if let Some(text) = change(from, fs::read(from).expect("the package is readable")) {
        write(to, &text);
    }
}

/// The manifest of the copy: another name, the library only, no lints; dependencies, features and profiles as they are, so that the
/// compiled dependencies are shared.
fn manifest(original: &str) -> String {
    let mut table: toml::Table = original.parse().expect("Cargo.toml is valid");
    for key in ["lints", "bin", "bench", "test", "example", "workspace"] {
        table.remove(key);
    }
    let set = |table: &mut toml::Table, section: &str, pairs: &[(&str, toml::Value)]| {
        let section = table.entry(section).or_insert_with(|| toml::Table::new().into());
        let section = section.as_table_mut().expect("a section is a table");
        for (key, value) in pairs {
            section.insert((*key).to_owned(), value.clone());
        }
    };
    set(&mut table, "package", &[("name", "leadlag-mutants".into()), ("autobins", false.into())]);
    set(&mut table, "lib", &[("name", "leadlag_mutants".into()), ("doctest", false.into())]);
    set(&mut table, "workspace", &[]);
    table.to_string()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("source files are UTF-8")
}

/// Copies, instruments and compiles.
pub fn build() -> Built {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let scratch = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let folder = scratch.join("mutants");
    let mut mutants = Vec::new();

    for entry in fs::read_dir(root).expect("the package is readable") {
        let name = entry.expect("the package is readable").file_name();
        if LEFT_OUT.iter().any(|left_out| name == *left_out) {
            continue;
        }
        copy(&root.join(&name), &folder.join(&name), &mut |path, bytes| {
            let inside = path.strip_prefix(root).expect("found below the root");
            let file = inside.to_string_lossy().replace('\\', "/");
            if let Some(file) = file.strip_prefix("src/").filter(|file| MUTATED.iter().any(|m| file.starts_with(m))) {
                return Some(instrument(file, text(&bytes), &mut mutants).into_bytes());
            }
            match inside.to_str() {
                Some("src/main.rs") => None,
                Some("src/lib.rs") => {
                    Some(format!("#![allow(warnings)]\n{}\npub mod mutant_switch;\n", text(&bytes)).into_bytes())
                }
                Some("Cargo.lock") => {
                    Some(text(&bytes).replace("name = \"leadlag\"\n", "name = \"leadlag-mutants\"\n").into_bytes())
                }
                _ => Some(bytes),
            }
        });
    }
    let switch = format!(
        "//! The mutant switched on.\nuse std::sync::LazyLock;\n\
         static ON: LazyLock<usize> = LazyLock::new(|| std::env::var(\"{SWITCH}\").map_or(0, |id| id.parse().unwrap()));\n\
         /// True for the mutant that the environment names.\n\
         pub fn on(id: usize) -> bool {{ *ON == id }}\n"
    );
    write(&folder.join("src/mutant_switch.rs"), switch.as_bytes());
    let original = fs::read_to_string(root.join("Cargo.toml")).expect("Cargo.toml is readable");
    write(&folder.join("Cargo.toml"), manifest(&original).as_bytes());
    for name in ["reference_paper.rs", "reference_paper", "common"] {
        copy(&root.join("tests").join(name), &folder.join("tests").join(name), &mut |path, bytes| {
            if path.ends_with("tests/reference_paper.rs") {
                let renamed = "#![allow(warnings)]\nextern crate leadlag_mutants as leadlag;\n";
                let (docs, code) = text(&bytes).split_once("\nmod ").expect("the test has modules");
                return Some(format!("{docs}\n{renamed}mod {code}").into_bytes());
            }
            Some(bytes)
        });
    }

    // The build lock of the outer cargo is free while tests run, so its target folder can be shared.
    let target = scratch.parent().expect("the scratch folder lies in the target folder");
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo
        .args([
            "test",
            "--offline",
            "--test",
            "reference_paper",
            "--no-run",
            "--message-format=json-render-diagnostics",
        ])
        .current_dir(&folder)
        .env("CARGO_TARGET_DIR", target);
    let own = std::env::current_exe().expect("this test is a file");
    if own.components().any(|c| c.as_os_str() == "release") {
        cargo.arg("--release");
    }
    let output = cargo.output().expect("cargo starts");
    assert!(
        output.status.success(),
        "the mutated copy in {} does not compile:\n{}",
        folder.display(),
        String::from_utf8_lossy(&output.stderr)
    );
    let judge = text(&output.stdout)
        .lines()
        .filter_map(|line| serde_json::from_str::<serde_json::Value>(line).ok())
        .filter(|message| message["target"]["name"] == "reference_paper")
        .find_map(|message| message["executable"].as_str().map(PathBuf::from))
        .expect("cargo names the test program");
    Built { folder, judge, mutants }
}
