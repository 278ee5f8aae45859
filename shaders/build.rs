//! Lists every WGSL file of this folder with its text, so that a new file needs no entry elsewhere.

use std::fmt::Write;
use std::path::{Path, PathBuf};

fn main() {
    let here = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").expect("cargo names the folder"));
    let mut files = Vec::new();
    walk(&here, &mut files);
    let named = |file: PathBuf| {
        let path = file.strip_prefix(&here).expect("found below").to_str().expect("names are UTF-8").replace('\\', "/");
        (path, file)
    };
    let mut files: Vec<_> = files.into_iter().map(named).collect();
    files.sort();
    let mut list = String::from("[\n");
    for (path, file) in &files {
        writeln!(list, "(\"shaders/{path}\", include_str!({file:?})),").expect("a String takes all");
    }
    list.push(']');
    let out = PathBuf::from(std::env::var_os("OUT_DIR").expect("cargo names the folder"));
    std::fs::write(out.join("files.rs"), list).expect("the list can be written");
}

fn walk(folder: &Path, files: &mut Vec<PathBuf>) {
    println!("cargo:rerun-if-changed={}", folder.display());
    for entry in std::fs::read_dir(folder).expect("the folder is readable") {
        let path = entry.expect("the folder is readable").path();
        if path.is_dir() {
            walk(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "wgsl") {
            files.push(path);
        }
    }
}
