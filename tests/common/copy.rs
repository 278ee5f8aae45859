//! A copy of the crates that compute, with changes, compiled in the same target folder, so that the compiled dependencies are shared. Files
//! are written only if they differ: a second run compiles nothing.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The files to copy. Tests of the copy find it as `leadlag::internal`, as they find the library.
const COPIED: [&str; 3] = ["shaders", "src/data", "src/models"];

/// The crate of the tests, above the copied ones.
const FACADE: &str =
    "//! Stands in for leadlag.\npub mod internal {\n    pub use leadlag_data::*;\n    pub use leadlag_models::*;\n}\n";

/// New text of a file, given its path in the repository, or nothing.
pub type Change<'a> = dyn FnMut(&str, Vec<u8>) -> Option<Vec<u8>> + 'a;

/// Writes a file unless it is there already.
pub fn write(path: &Path, text: &[u8]) {
    if fs::read(path).is_ok_and(|old| old == text) {
        return;
    }
    fs::create_dir_all(path.parent().expect("a file has a folder")).expect("the copy's folder can be made");
    fs::write(path, text).expect("the copy can be written");
}

/// Copies a file or folder of the repository.
pub fn copy(inside: &str, to: &Path, change: &mut Change<'_>) {
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join(inside);
    if from.is_dir() {
        let mut entries: Vec<_> =
            fs::read_dir(from).expect("the sources are readable").map(|e| e.expect("readable").file_name()).collect();
        entries.sort();
        for name in entries {
            copy(&format!("{inside}/{}", name.to_string_lossy()), to, change);
        }
    } else if let Some(text) = change(inside, fs::read(from).expect("the sources are readable")) {
        write(&to.join(inside), &text);
    }
}

/// Copies the computing crates to the folder `name` below `to`; `change` sees every file. Surplus files of an earlier copy are removed. `level` is the
/// optimisation of the models. Cargo distinguishes crates of one target folder by their path from the top of the workspace, which `name` changes.
pub fn crates(name: &str, to: &Path, features: &[&str], level: i64, change: &mut Change<'_>) {
    let list = to.join("copied.txt");
    let sources = to.join(name);
    let before = fs::read_to_string(&list).unwrap_or_default();
    if before.is_empty() && to.exists() {
        fs::remove_dir_all(to).expect("the copy's folder can be cleared");
    }
    let mut copied = Vec::new();
    let mut change = |inside: &str, bytes: Vec<u8>| {
        let text = change(inside, bytes);
        copied.extend(text.as_ref().map(|_| inside.to_owned()));
        text
    };
    for folder in COPIED {
        copy(folder, &sources, &mut change);
    }
    let is_gone = |file: &&str| !copied.iter().any(|now| now == file) && sources.join(file).exists();
    for gone in before.lines().filter(is_gone) {
        fs::remove_file(sources.join(gone)).expect("a file of the copy can be removed");
    }
    write(&list, copied.join("\n").as_bytes());
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let original = fs::read_to_string(root.join("Cargo.toml")).expect("Cargo.toml is readable");
    write(&to.join("Cargo.toml"), manifest(&original, name, features, level).as_bytes());
    write(&to.join("Cargo.lock"), &fs::read(root.join("Cargo.lock")).expect("Cargo.lock is readable"));
    write(&to.join("src/lib.rs"), FACADE.as_bytes());
}

/// The manifest above the copied crates: the dependencies and profiles of the original, without its lints. All dependencies are listed for
/// any features: a missing one may change how others are compiled, and all are compiled already.
fn manifest(original: &str, copy: &str, features: &[&str], level: i64) -> String {
    let mut table: toml::Table = original.parse().expect("Cargo.toml is valid");
    table.retain(|key, _| matches!(key, "workspace" | "profile" | "dependencies" | "dev-dependencies" | "target"));
    let workspace = table["workspace"].as_table_mut().expect("there is a workspace");
    let members = COPIED.map(|folder| format!("{copy}/{folder}"));
    workspace.insert("members".to_owned(), toml::Value::try_from(members).expect("a list of paths"));
    let shared = workspace["dependencies"].as_table_mut().expect("the workspace has dependencies");
    for (_, dependency) in shared.iter_mut() {
        if let Some(toml::Value::String(path)) = dependency.get_mut("path") {
            *path = format!("{copy}/{path}");
        }
    }
    workspace.insert("lints".to_owned(), toml::Table::new().into());
    for (name, level) in [("leadlag-models", level), ("leadlag-data", 0)] {
        let profile = table["profile"]["dev"]["package"][name].as_table_mut().expect("it has a profile");
        profile.insert("opt-level".to_owned(), level.into());
    }
    // Cargo would warn of a profile that fits no package.
    table["profile"]["dev"]["package"].as_table_mut().expect("packages have profiles").remove("leadlag-diagnosis");
    let unix = table["target"]["cfg(unix)"]["dependencies"].as_table_mut().expect("some are for Unix").clone();
    table.remove("target");
    let dependencies = table["dependencies"].as_table_mut().expect("there are dependencies");
    dependencies.extend(unix);
    dependencies.remove("leadlag-diagnosis");
    for (_, dependency) in dependencies.iter_mut() {
        dependency.as_table_mut().expect("all are those of the workspace").remove("optional");
    }
    let models = dependencies["leadlag-models"].as_table_mut().expect("all are those of the workspace");
    models.insert("features".to_owned(), toml::Value::try_from(features).expect("a list of names"));
    let own = "package = { name = \"leadlag\", edition.workspace = true, autobins = false }\nlib = { doctest = false }";
    table.extend(own.parse::<toml::Table>().expect("it is valid"));
    table.to_string()
}

/// Source files are text.
pub fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).expect("source files are UTF-8")
}

/// Compiles tests of the copy, and returns the test programs.
pub fn compile<const N: usize>(folder: &Path, tests: [&str; N]) -> [PathBuf; N] {
    // The build lock of the outer cargo is free while tests run, so its target folder can be shared.
    let target = Path::new(env!("CARGO_TARGET_TMPDIR")).parent().expect("the scratch folder lies in the target folder");
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo
        .args(["test", "--offline", "--no-run", "--message-format=json-render-diagnostics"])
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
