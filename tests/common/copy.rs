//! A copy of the crate with changes in it, compiled in the same target folder under another name, so that the compiled
//! dependencies are shared. Files are written only where they differ: a second run compiles nothing.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Entries of the package that a copy does without. `tests` is copied separately.
const LEFT_OUT: [&str; 13] = [
    ".git",
    ".github",
    ".ci",
    "target",
    "tests",
    "benches",
    "examples",
    "fuzz",
    "packaging",
    "python",
    "shared",
    "out",
    "Cargo.toml",
];

/// What becomes of a file, given its path in the package: its new text, or nothing.
pub type Change<'a> = dyn FnMut(&str, Vec<u8>) -> Option<Vec<u8>> + 'a;

/// Writes a file unless it is there already.
pub fn write(path: &Path, text: &[u8]) {
    if fs::read(path).is_ok_and(|old| old == text) {
        return;
    }
    fs::create_dir_all(path.parent().expect("a file has a folder")).expect("the copy's folder can be made");
    fs::write(path, text).expect("the copy can be written");
}

/// Copies a file or folder of the package.
pub fn copy(inside: &str, to: &Path, change: &mut Change<'_>) {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join(inside);
    if from.is_dir() {
        let mut entries: Vec<_> =
            fs::read_dir(from).expect("the package is readable").map(|e| e.expect("readable").file_name()).collect();
        entries.sort();
        for name in entries {
            copy(&format!("{inside}/{}", name.to_string_lossy()), to, change);
        }
    } else if let Some(text) = change(inside, fs::read(from).expect("the package is readable")) {
        write(&to.join(inside), &text);
    }
}

/// Copies the library as `leadlag-NAME`, without its tests, program and lints; `change` sees every file. What a copy of an earlier state
/// had beyond that goes. `level` is how far the copy itself is optimised.
pub fn package(name: &str, to: &Path, level: i64, change: &mut Change<'_>) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let list = to.join("copied.txt");
    let before = fs::read_to_string(&list).unwrap_or_default();
    if before.is_empty() && to.exists() {
        fs::remove_dir_all(to).expect("the copy's folder can be cleared");
    }
    let mut copied = Vec::new();
    let mut change = |inside: &str, bytes: Vec<u8>| {
        let text = match inside {
            "src/main.rs" => None,
            "Cargo.lock" => {
                Some(text(&bytes).replace("name = \"leadlag\"\n", &format!("name = \"leadlag-{name}\"\n")).into_bytes())
            }
            _ => change(inside, bytes),
        };
        copied.extend(text.as_ref().map(|_| inside.to_owned()));
        text
    };
    for entry in fs::read_dir(root).expect("the package is readable") {
        let entry = entry.expect("the package is readable").file_name().to_string_lossy().into_owned();
        if !LEFT_OUT.contains(&entry.as_str()) {
            copy(&entry, to, &mut change);
        }
    }
    // Of the examples, what the library has built in.
    copy("examples/columns", to, &mut change);
    for gone in before.lines().filter(|file| !copied.iter().any(|now| now == file)) {
        fs::remove_file(to.join(gone)).expect("a file of the copy can be removed");
    }
    write(&list, copied.join("\n").as_bytes());
    let original = fs::read_to_string(root.join("Cargo.toml")).expect("Cargo.toml is readable");
    write(&to.join("Cargo.toml"), manifest(&original, name, level).as_bytes());
}

/// The manifest of the copy: another name, the library only, no lints. All dependencies are there whatever the features: one
/// that is left out may change how others are compiled, and all are compiled already.
fn manifest(original: &str, name: &str, level: i64) -> String {
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
    set(&mut table, "package", &[("name", format!("leadlag-{name}").into()), ("autobins", false.into())]);
    set(&mut table, "lib", &[("name", format!("leadlag_{name}").into()), ("doctest", false.into())]);
    set(&mut table, "workspace", &[]);
    let targets = table["target"].as_table().expect("targets are a table").keys().cloned().collect::<Vec<_>>();
    let everywhere = [vec!["dependencies"]].into_iter();
    for path in everywhere.chain(targets.iter().map(|target| vec!["target", target, "dependencies"])) {
        let first = table.get_mut(path[0]).expect("the manifest has dependencies");
        let section = path[1..].iter().fold(first, |section, key| &mut section[*key]);
        for (_, dependency) in section.as_table_mut().expect("dependencies are a table") {
            dependency.as_table_mut().and_then(|settings| settings.remove("optional"));
        }
    }
    for (_, needs) in table["features"].as_table_mut().expect("features are a table") {
        let needs = needs.as_array_mut().expect("a feature has a list");
        needs.retain(|need| need.as_str().is_some_and(|need| !need.starts_with("dep:")));
    }
    let own: toml::Table =
        [("opt-level".to_owned(), level.into()), ("debug".to_owned(), false.into())].into_iter().collect();
    let dev = table["profile"]["dev"]["package"].as_table_mut().expect("packages have profiles");
    // No package of the copy is called so, and cargo would warn.
    dev.remove("leadlag");
    dev.insert(format!("leadlag-{name}"), own.into());
    table.to_string()
}

/// Source files are text.
pub fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("source files are UTF-8")
}

/// Compiles tests of the copy with these features only, and returns the test programs.
pub fn compile<const N: usize>(folder: &Path, features: &str, tests: [&str; N]) -> [PathBuf; N] {
    // The build lock of the outer cargo is free while tests run, so its target folder can be shared.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the scratch folder lies in the target folder");
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo
        .args(["test", "--offline", "--no-run", "--message-format=json-render-diagnostics"])
        .args(["--no-default-features", "--features", features])
        .args(tests.iter().flat_map(|test| ["--test", *test]))
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", target);
    let own = std::env::current_exe().expect("this test is a file");
    if own.components().any(|c| c.as_os_str() == "release") {
        cargo.arg("--release");
    }
    let output = cargo.output().expect("cargo starts");
    assert!(
        output.status.success(),
        "the changed copy in {} does not compile:\n{}",
        folder.display(),
        String::from_utf8_lossy(&output.stderr)
    );
    let messages: Vec<serde_json::Value> =
        text(&output.stdout).lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    tests.map(|test| {
        let mut of = messages.iter().filter(|message| message["target"]["name"] == test);
        of.find_map(|message| message["executable"].as_str().map(PathBuf::from)).expect("cargo names the test program")
    })
}
