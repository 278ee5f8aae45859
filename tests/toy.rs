//! The worked examples of CONTRIBUTING.md work: their changes are applied to a copy of the crates, word for word, and the new law and the new
//! cause are evaluated by every evaluator with the new measure, and they must agree.

#[path = "common/copy.rs"]
mod copy;

use std::path::Path;
use std::process::Command;

/// One change that CONTRIBUTING.md describes, with the text of its code block.
#[derive(Debug, PartialEq)]
enum Edit {
    /// New file `PATH`:
    New { path: String, text: String },
    /// In `PATH`, behind the line that begins with `LINE`, ...:
    Behind { path: String, line: String, text: String },
}

/// The changes in the sections on adding something, in order.
fn edits(document: &str) -> Vec<Edit> {
    let sections: Vec<&str> = document.split("\n## ").filter(|section| section.starts_with("Add a ")).collect();
    let mut edits = Vec::new();
    let mut quoted: Vec<String> = Vec::new();
    let mut lines = sections.iter().flat_map(|section| section.lines());
    while let Some(line) = lines.next() {
        if line.starts_with("New file `") || line.starts_with("In `") {
            quoted = line.split('`').skip(1).step_by(2).map(str::to_owned).collect();
        } else if line.starts_with("```") {
            let text: String = lines.by_ref().take_while(|l| *l != "```").map(|l| format!("{l}\n")).collect();
            match std::mem::take(&mut quoted).as_slice() {
                [path] => edits.push(Edit::New { path: path.clone(), text }),
                [path, line, ..] => edits.push(Edit::Behind { path: path.clone(), line: line.clone(), text }),
                [] => panic!("CONTRIBUTING.md: no line says where this goes:\n{text}"),
            }
        }
    }
    edits
}

#[test]
fn the_worked_examples_of_contributing_work() {
    let document = std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("CONTRIBUTING.md"));
    let edits = edits(&document.expect("CONTRIBUTING.md is readable"));
    let count = |is: fn(&Edit) -> bool| edits.iter().filter(|e| is(e)).count();
    let (new, behind) = (count(|e| matches!(e, Edit::New { .. })), count(|e| matches!(e, Edit::Behind { .. })));
    let expected = "a law is two files and a row, a cause a file and five rows, a measure a file and a row";
    assert_eq!((new, behind), (4, 7), "{expected}: {edits:#?}");

    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("toy");
    // Compiling takes far longer than the test: not optimised.
    copy::crates("toy", &folder, &["gpu"], 0, &mut |inside, bytes| {
        let mut text = String::from_utf8(bytes).ok()?;
        for edit in &edits {
            if let Edit::Behind { path, line, text: row } = edit
                && path == inside
            {
                let found: Vec<&str> = text.lines().filter(|l| l.trim_start().starts_with(line)).collect();
                let [found] = found[..] else { panic!("{path}: {} lines begin with {line}, not one", found.len()) };
                text = text.replace(found, &format!("{found}\n{}", row.trim_end()));
            }
        }
        Some(text.into_bytes())
    });
    for edit in &edits {
        if let Edit::New { path, text } = edit {
            copy::write(&folder.join("toy").join(path), text.as_bytes());
        }
    }
    for (from, to) in [("toy/agreement.rs", "agree/main.rs"), ("common/cars.rs", "common/cars.rs")] {
        let text = std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests").join(from));
        copy::write(&folder.join("tests").join(to), &text.expect("the test is readable"));
    }

    let [program] = copy::compile(&folder, ["agree"]);
    let output = Command::new(&program).arg("--nocapture").output().expect("the test program starts");
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{}:\n{out}\n{err}", program.display());
    eprintln!("{out}");
}

#[test]
fn changes_are_read_from_the_document() {
    let document = "# A\n\n## Add a law\n\nNew file `a/b.wgsl`:\n\n```wgsl\none\n\ntwo\n```\n\nIn `c.rs`, behind the line that \
                    begins with `Row, 1`, the row:\n\n```rust\n    Row, 2\n```\n\n## Another\n\n```sh\nno\n```\n";
    let new = Edit::New { path: "a/b.wgsl".to_owned(), text: "one\n\ntwo\n".to_owned() };
    let (path, line, text) = ("c.rs".to_owned(), "Row, 1".to_owned(), "    Row, 2\n".to_owned());
    assert_eq!(edits(document), [new, Edit::Behind { path, line, text }]);
}
