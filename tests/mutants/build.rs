//! The copy of the crates with the mutants in it.

use crate::Mutant;
use crate::copy::{compile, copy, crates, text, write};
use crate::schemata::{SWITCH, instrument};
use std::path::{Path, PathBuf};

/// The compiled copy.
pub struct Built {
    pub folder: PathBuf,
    /// The judging test programs, that of the paper first.
    pub judges: [PathBuf; 2],
    pub mutants: Vec<Mutant>,
}

/// Changed files, below `src/models`: the reference, and the code that its numbers pass through.
const MUTATED: [&str; 3] = ["reference/", "score/", "evaluator/case.rs"];

/// The judges: hand-worked numbers, and for the causes, which have none, their WGSL text (of which tests/shader_mutants.rs changes every place).
const JUDGES: [(&str, &str); 2] =
    [("reference_paper", "tests/model/reference_paper"), ("causes", "tests/equality/causes.rs")];

/// The modules of `tests/common` that the judges need.
const HELPERS: [&str; 4] = ["cars", "extended", "laws", "tolerance"];

/// Optimisation of the copy. The judges run so often that this makes compiling and judging together the shortest.
const LEVEL: i64 = 2;

/// The text of a `mod.rs` without the modules that are not needed.
fn needed(text: &str) -> String {
    let keep = |line: &&str| {
        let module = line.strip_prefix("pub mod ").and_then(|rest| rest.strip_suffix(';'));
        !line.starts_with("#[cfg(feature") && module.is_none_or(|name| HELPERS.contains(&name))
    };
    text.lines().filter(keep).map(|line| format!("{line}\n")).collect()
}

/// Copies, instruments and compiles.
pub fn build() -> Built {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("mutants");
    let mut mutants = Vec::new();
    crates("mutants", &folder, &[], LEVEL, &mut |inside, bytes| {
        let below = inside.strip_prefix("src/models/").filter(|file| MUTATED.iter().any(|m| file.starts_with(m)));
        if let Some(file) = below {
            return Some(instrument(file, text(&bytes), &mut mutants).into_bytes());
        }
        if inside == "src/models/lib.rs" {
            return Some(format!("#![allow(warnings)]\n{}\npub mod mutant_switch;\n", text(&bytes)).into_bytes());
        }
        Some(bytes)
    });
    // The first panic of a judge decides: the rest of its tests need not run.
    let switch = format!(
        "//! The mutant switched on.\nuse std::sync::LazyLock;\n\
         static ON: LazyLock<usize> = LazyLock::new(|| {{\n\
         \x20   std::panic::set_hook(Box::new(|_| std::process::exit(101)));\n\
         \x20   std::env::var(\"{SWITCH}\").map_or(0, |id| id.parse().unwrap())\n\
         }});\n\
         /// True for the mutant that the environment names.\n\
         pub fn on(id: usize) -> bool {{ *ON == id }}\n"
    );
    write(&folder.join("mutants/src/models/mutant_switch.rs"), switch.as_bytes());
    for name in JUDGES.map(|(_, file)| file).into_iter().chain(["tests/common"]) {
        copy(name, &folder, &mut |inside, bytes| match inside {
            "tests/common/mod.rs" => Some(needed(text(&bytes)).into_bytes()),
            _ => Some(bytes),
        });
    }
    for (name, file) in JUDGES {
        let module = file.strip_prefix("tests/").expect("judges are tests");
        let module = if module.ends_with(".rs") { module.to_owned() } else { format!("{module}/mod.rs") };
        let judge = format!("#![allow(warnings)]\nmod common;\n#[path = \"{module}\"]\nmod {name};\n");
        write(&folder.join(format!("tests/{name}.rs")), judge.as_bytes());
    }
    let judges = compile(&folder, JUDGES.map(|(name, _)| name));
    Built { folder, judges, mutants }
}
