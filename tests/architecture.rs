//! Rules that the compiler does not check: modules import only those below them in ARCHITECTURE.md, some import nothing, and the facade is small. The crates enforce that a
//! layer uses lower ones only: `leadlag` above `src/diagnosis`, `src/models`, `src/data` and `shaders`.
//!
//! It reads the paths that begin with `crate::` or the name of a crate in src/**/*.rs outside of comments.

use leadlag::internal::wgsl::library;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The crates below `leadlag`, each a folder of `src`.
const CRATES: [&str; 3] = ["data", "models", "diagnosis"];

/// Modules that import nothing of the library but their neighbours: they are independent of cars, or of all other
/// modules.
const ALONE: [(&str, &[&str], &str); 3] = [
    ("judge", &["statistics"], "the tests know numbers only"),
    ("optimize", &[], "the optimisers know no cars"),
    ("synthetic", &[], "synthetic drives are an independent truth and share no code with what they judge"),
];

/// Pairs that must not use each other although their layers would allow it.
const STRANGERS: [(&str, &str, &str); 2] = [
    ("reference", "wgsl", "the oracle and the definition are two transcriptions"),
    ("wgsl", "reference", "the oracle and the definition are two transcriptions"),
];

#[derive(Debug)]
struct Import {
    from: String,
    to: String,
    file: PathBuf,
    line: usize,
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("src is readable") {
        let path = entry.expect("src is readable").path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
    files.sort();
}

/// Top-level names after `crate::`: one name, or the names of a group `{a::b, c}`.
fn names_after(rest: &str) -> Vec<String> {
    let name = |text: &str| text.trim().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let Some(group) = rest.strip_prefix('{') else { return vec![name(rest)] };
    let (mut depth, mut names, mut start) = (0, Vec::new(), 0);
    for (i, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            ',' | '}' if depth == 0 => {
                names.push(name(&group[start..i]));
                start = i + 1;
                if c == '}' {
                    break;
                }
            }
            _ => {}
        }
    }
    names
}

/// Comments blanked, lines kept.
fn without_comments(text: &str) -> String {
    text.lines().map(|line| line.split("//").next().unwrap_or_default()).collect::<Vec<_>>().join("\n")
}

fn imports() -> Vec<Import> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let src = root.join("src");
    let mut files = Vec::new();
    rust_files(&src, &mut files);
    let mut imports = Vec::new();
    for path in files {
        let Some(from) = module_of(path.strip_prefix(&src).expect("found below src")) else { continue };
        let text = without_comments(&std::fs::read_to_string(&path).expect("source files are readable"));
        let paths = ["crate::", "leadlag_data::", "leadlag_models::", "leadlag_diagnosis::"];
        for (at, prefix) in paths.into_iter().flat_map(|path| text.match_indices(path)) {
            if text[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '$') {
                continue;
            }
            let line = text[..at].matches('\n').count() + 1;
            for to in names_after(&text[at + prefix.len()..]) {
                let file = path.strip_prefix(root).expect("found below the root").to_owned();
                imports.push(Import { from: from.clone(), to, file, line });
            }
        }
    }
    imports
}

/// The module of the crate's root that a file below `src` is in; none for the root itself.
fn module_of(inside: &Path) -> Option<String> {
    let name =
        |part: &std::ffi::OsStr| Path::new(part).file_stem().expect("a file has a name").to_string_lossy().into_owned();
    let mut parts = inside.iter().map(name);
    let first = parts.next()?;
    let module = if CRATES.contains(&first.as_str()) { parts.next()? } else { first };
    (!["lib", "main"].contains(&module.as_str())).then_some(module)
}

fn modules() -> BTreeSet<String> {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    rust_files(&src, &mut files);
    files.iter().filter_map(|path| module_of(path.strip_prefix(&src).expect("found below src"))).collect()
}

#[test]
fn some_modules_know_nobody() {
    let modules = modules();
    let mut broken = Vec::new();
    for Import { from, to, file, line } in imports() {
        if from == to || !modules.contains(&to) {
            continue;
        }
        let place = format!("{}:{line}: {from} imports {to}", file.display());
        if let Some((.., reason)) = ALONE.iter().find(|(a, may, _)| *a == from && !may.contains(&to.as_str())) {
            broken.push(format!("{place}, but {reason}"));
        } else if let Some((.., reason)) = STRANGERS.iter().find(|(a, b, _)| *a == from && *b == to) {
            broken.push(format!("{place}, but {reason}"));
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// The file of a cause determines how it is searched, judged and described, so that a user's own cause has the same treatment as a built-in
/// one.
#[test]
fn a_diagnosis_knows_no_cause_by_its_name() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut files = Vec::new();
    for room in ["diagnosis", "report"] {
        rust_files(&root.join("src").join(room), &mut files);
    }
    let is_test = |path: &PathBuf| ["tests.rs", "made_up.rs"].iter().any(|name| path.ends_with(name));
    let causes: Vec<&str> = library().iter().filter(|e| e.cause.is_some()).map(|e| e.name.as_str()).collect();
    let mut named = Vec::new();
    for path in files.iter().filter(|path| !is_test(path)) {
        let text = std::fs::read_to_string(path).expect("readable");
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        let names = causes.iter().filter(|name| code.contains(&format!("\"{name}\"")));
        named.extend(names.map(|name| format!("{}: {name}", path.display())));
    }
    assert!(causes.len() > 20 && files.len() > 50);
    assert!(named.is_empty(), "{}", named.join("\n"));
}

/// Layers of the diagnosis, the lowest first: each may use those before it.
const OF_A_DIAGNOSIS: [&str; 14] = [
    "revision",
    "policy",
    "data",
    "drive",
    "question",
    "watching",
    "likelihood",
    "search",
    "judge",
    "outcome",
    "select",
    "describe",
    "answer",
    "infer",
];

#[test]
fn imports_of_the_diagnosis_go_down() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/diagnosis/diagnose");
    let mut files = Vec::new();
    rust_files(&root, &mut files);
    let floor = |room: &str| OF_A_DIAGNOSIS.iter().position(|other| *other == room);
    let (mut seen, mut broken) = (0, Vec::new());
    for path in &files {
        let room = path.strip_prefix(&root).expect("below").iter().next().expect("a name").to_string_lossy();
        let room = room.trim_end_matches(".rs");
        let text = without_comments(&std::fs::read_to_string(path).expect("readable"));
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        if ["mod", "made_up"].contains(&room) {
            continue;
        }
        for rest in code.split("crate::diagnose::").skip(1) {
            let other: String = rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            seen += 1;
            // A test file may use whatever it tests.
            if !path.ends_with("tests.rs") && (floor(&other).is_none() || floor(&other) > floor(room)) {
                broken.push(format!("{}: {room} uses {other}", path.display()));
            }
        }
    }
    assert!(seen > 100, "{seen}");
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// The modules in each row of the tables of ARCHITECTURE.md, from the top down.
fn rows() -> Vec<Vec<String>> {
    let page = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("ARCHITECTURE.md"));
    let page = page.expect("ARCHITECTURE.md is readable");
    let cells = page.lines().filter_map(|line| line.strip_prefix("| `")?.split(" |").next());
    cells.map(|cell| cell.split(", ").map(|name| name.trim_matches('`').to_owned()).collect()).collect()
}

#[test]
fn imports_go_down_the_rows_of_the_page() {
    let rows = rows();
    let row = |module: &String| rows.iter().position(|row| row.contains(module));
    let listed: BTreeSet<String> = rows.iter().flatten().cloned().collect();
    assert_eq!(listed, modules(), "ARCHITECTURE.md lists every module");
    let up = imports().into_iter().filter(|i| i.from != i.to && row(&i.to).is_some_and(|to| Some(to) <= row(&i.from)));
    let places: Vec<_> =
        up.map(|Import { from, to, file, line }| format!("{}:{line}: {from} imports {to}", file.display())).collect();
    assert!(places.is_empty(), "not below in ARCHITECTURE.md:\n{}", places.join("\n"));
}

#[test]
fn the_reader_of_imports_reads_groups() {
    assert_eq!(names_after("score::{A, B};"), ["score"]);
    assert_eq!(
        names_after("{catalog::{Variant, Base}, score, trajectory::Grade};"),
        ["catalog", "score", "trajectory"]
    );
    assert!(imports().iter().any(|i| i.from == "evaluator" && i.to == "catalog"), "known imports are found");
}

/// Files of a room that may use each other in a circle, and why.
const CIRCLES: [(&[&str], &str); 8] = [
    (
        &["api/calibration", "api/diagnosis", "api/drive", "api/fit", "api/fleet", "api/folds", "api/model"],
        "methods of the facade lead from each of its types to the next: `Drive::diagnose`, `Fit::simulate`",
    ),
    (&["report/diagnosis/causes", "report/diagnosis/short"], "both texts show a parameter in the same way"),
    (&["models/calibrate/search", "models/calibrate/settled"], "a search and its end"),
    (&["models/evaluator/course", "models/evaluator/table"], "one error of both"),
    (&["models/gpu/own_functions", "models/gpu/probe"], "probes of one kind beside the others"),
    (&["models/lanes/run/core", "models/lanes/run/plan"], "work and its plan"),
    (
        &["rows", "simd", "sums", "tables", "time_loop"],
        "the time loop is compiled once for each instruction set, and its parts use the registers of that set",
    ),
    (
        &["check", "compose", "extension", "limits", "lint", "own_names", "parameters", "stages"],
        "a text is composed to be checked, and checked to be composed",
    ),
];

/// The path of a module below its crate, and the paths that a file imports by `crate::` and `super::`; re-exports and tests are left out.
fn imported(path: &Path, root: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    use syn::{Item, UseTree, Visibility};
    fn leaves(tree: &UseTree, before: &[String], found: &mut Vec<Vec<String>>) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => leaves(&path.tree, &with(&path.ident), found),
            UseTree::Name(name) => found.push(with(&name.ident)),
            UseTree::Rename(name) => found.push(with(&name.ident)),
            UseTree::Glob(_) => found.push(before.to_vec()),
            UseTree::Group(group) => group.items.iter().for_each(|tree| leaves(tree, before, found)),
        }
    }
    let inside = path.strip_prefix(root).expect("below its crate").with_extension("");
    let mut own: Vec<String> = inside.iter().map(|part| part.to_string_lossy().into_owned()).collect();
    own.pop_if(|name| name == "mod");
    let text = std::fs::read_to_string(path).expect("source files are readable");
    let (mut trees, mut paths) = (Vec::new(), Vec::new());
    for item in syn::parse_file(&text).expect("it compiles").items {
        match item {
            Item::Use(one) if matches!(one.vis, Visibility::Inherited) => leaves(&one.tree, &[], &mut trees),
            _ => {}
        }
    }
    for tree in trees {
        let up = tree.iter().take_while(|name| *name == "super").count();
        let rest = &tree[up.max(usize::from(tree[0] == "crate" || tree[0] == "self"))..];
        let from = match tree[0].as_str() {
            "crate" => &[][..],
            "super" => &own[..own.len() - up],
            _ => &own[..],
        };
        paths.push([from, rest].concat());
    }
    (own, paths)
}

/// Files that reach themselves by imports, without those of the items of a `mod.rs` above them.
#[test]
fn files_use_each_other_in_no_circle_without_a_reason() {
    let src = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let of_crate = |path: &Path| CRATES.iter().map(|name| src.join(name)).find(|root| path.starts_with(root));
    let mut files = Vec::new();
    rust_files(&src, &mut files);
    files.retain(|path| !path.ends_with("tests.rs"));
    let roots: Vec<PathBuf> = files.iter().map(|path| of_crate(path).unwrap_or_else(|| src.clone())).collect();
    let read: Vec<_> = files.iter().zip(&roots).map(|(path, root)| imported(path, root)).collect();
    let at = |root: &PathBuf, path: &[String]| {
        let mut found = (0..files.len()).filter(|&k| roots[k] == *root && path.starts_with(&read[k].0));
        let first = found.next()?;
        Some(found.fold(first, |best, k| if read[k].0.len() > read[best].0.len() { k } else { best }))
    };
    let uses: Vec<Vec<usize>> = (0..files.len())
        .map(|k| {
            let others = read[k].1.iter().filter_map(|path| at(&roots[k], path));
            others.filter(|&other| !read[k].0.starts_with(&read[other].0)).collect()
        })
        .collect();
    assert!(uses.iter().map(Vec::len).sum::<usize>() > 1000, "known imports are found");
    let reached = |from: usize| {
        let (mut seen, mut open) = (BTreeSet::new(), uses[from].clone());
        while let Some(next) = open.pop() {
            if seen.insert(next) {
                open.extend(&uses[next]);
            }
        }
        seen
    };
    let all: Vec<BTreeSet<usize>> = (0..files.len()).map(reached).collect();
    let name = |k: usize| files[k].strip_prefix(&src).expect("below src").with_extension("").display().to_string();
    let mut circles = BTreeSet::new();
    for k in (0..files.len()).filter(|&k| all[k].contains(&k)) {
        circles.insert(
            (0..files.len()).filter(|&j| all[k].contains(&j) && all[j].contains(&k)).map(name).collect::<Vec<_>>(),
        );
    }
    let is_known = |circle: &Vec<String>| {
        CIRCLES.iter().any(|(known, _)| circle.iter().all(|file| known.iter().any(|known| file.ends_with(known))))
    };
    let new: Vec<_> = circles.iter().filter(|circle| !is_known(circle)).collect();
    assert!(new.is_empty(), "files in a circle:\n{new:#?}");
    assert_eq!(circles.len(), CIRCLES.len(), "{circles:#?}");
}

/// Number of types, functions and methods that a user of the library can reach, without those of traits. A larger facade is hard to learn.
const FACADE: usize = 300;

#[test]
fn the_facade_is_small() {
    use syn::{ImplItem, Item, Visibility};
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = vec![root.join("study/table.rs"), root.join("cli/mod.rs")];
    rust_files(&root.join("api"), &mut files);
    let is_public = |visibility: &Visibility| matches!(visibility, Visibility::Public(_));
    let count = |path: &PathBuf| -> usize {
        let text = std::fs::read_to_string(path).expect("source files are readable");
        let of = |item: &Item| match item {
            Item::Impl(of) if of.trait_.is_none() => {
                of.items.iter().filter(|item| matches!(item, ImplItem::Fn(f) if is_public(&f.vis))).count()
            }
            Item::Struct(one) => usize::from(is_public(&one.vis)),
            Item::Enum(one) => usize::from(is_public(&one.vis)),
            Item::Fn(one) => usize::from(is_public(&one.vis)),
            _ => 0,
        };
        syn::parse_file(&text).expect("it compiles").items.iter().map(of).sum()
    };
    let reached: usize = files.iter().map(count).sum();
    assert!((50..=FACADE).contains(&reached), "{reached} types, functions and methods");
}
