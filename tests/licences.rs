//! Every package of the dependency tree has a licence that `scripts/allowed-licences.txt` allows.

use std::collections::BTreeSet;
use std::process::Command;

const ALLOWED: &str = include_str!("../scripts/allowed-licences.txt");

fn allowed() -> BTreeSet<&'static str> {
    ALLOWED.lines().map(str::trim).filter(|line| !line.is_empty() && !line.starts_with('#')).collect()
}

/// An SPDX licence expression under evaluation: `WITH` binds closest, then `AND`, then `OR`.
///
/// `/` is the old notation of `OR`, which older manifests still use.
struct Expression<'a> {
    tokens: Vec<&'a str>,
    next: usize,
    allowed: &'a BTreeSet<&'a str>,
}

impl<'a> Expression<'a> {
    fn peek(&self) -> Option<&'a str> {
        self.tokens.get(self.next).copied()
    }

    fn take(&mut self, token: &str) -> bool {
        let found = self.peek() == Some(token);
        self.next += usize::from(found);
        found
    }

    fn alternatives(&mut self) -> Result<bool, String> {
        let mut satisfied = self.conjunction()?;
        while self.take("OR") || self.take("/") {
            satisfied |= self.conjunction()?;
        }
        Ok(satisfied)
    }

    fn conjunction(&mut self) -> Result<bool, String> {
        let mut satisfied = self.licence()?;
        while self.take("AND") {
            satisfied &= self.licence()?;
        }
        Ok(satisfied)
    }

    fn licence(&mut self) -> Result<bool, String> {
        if self.take("(") {
            let satisfied = self.alternatives()?;
            return if self.take(")") { Ok(satisfied) } else { Err("expected )".to_owned()) };
        }
        let id = self.identifier()?;
        if self.take("WITH") {
            let exception = self.identifier()?;
            return Ok(self.allowed.contains(format!("{id} WITH {exception}").as_str()));
        }
        Ok(self.allowed.contains(id))
    }

    fn identifier(&mut self) -> Result<&'a str, String> {
        match self.peek() {
            Some(token) if !["(", ")", "/", "AND", "OR", "WITH"].contains(&token) => {
                self.next += 1;
                Ok(token)
            }
            Some(token) => Err(format!("expected a licence, found {token}")),
            None => Err("expected a licence, found the end".to_owned()),
        }
    }
}

/// Whether one of the alternatives of an SPDX expression consists only of allowed licences.
fn satisfied(expression: &str, allowed: &BTreeSet<&str>) -> Result<bool, String> {
    let spaced = expression.replace('(', " ( ").replace(')', " ) ").replace('/', " / ");
    let mut parse = Expression { tokens: spaced.split_whitespace().collect(), next: 0, allowed };
    let satisfied = parse.alternatives()?;
    match parse.peek() {
        None => Ok(satisfied),
        Some(token) => Err(format!("unexpected {token}")),
    }
}

/// `cargo metadata` of the whole tree; without a network, of the part that is on this machine.
fn metadata() -> serde_json::Value {
    let host = Command::new("rustc").arg("-vV").output().expect("rustc runs");
    let host = String::from_utf8(host.stdout).expect("rustc writes UTF-8");
    let host = host.lines().find_map(|line| line.strip_prefix("host: ")).expect("rustc names its host");
    let attempts: [&[&str]; 3] = [&["--offline"], &[], &["--offline", "--filter-platform", host]];
    let mut failures = String::new();
    for attempt in attempts {
        let output = Command::new(env!("CARGO"))
            .args(["metadata", "--format-version", "1", "--locked"])
            .args(["--manifest-path", concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml")])
            .args(attempt)
            .env("CARGO_NET_RETRY", "0")
            .output()
            .expect("cargo runs");
        if output.status.success() {
            return serde_json::from_slice(&output.stdout).expect("cargo metadata writes JSON");
        }
        failures += &String::from_utf8_lossy(&output.stderr);
    }
    panic!("cargo metadata failed:\n{failures}");
}

#[test]
fn every_dependency_has_an_allowed_licence() {
    let allowed = allowed();
    let metadata = metadata();
    let packages = metadata["packages"].as_array().expect("a list of packages");
    assert!(packages.len() > 1, "no dependency found");
    let mut refused = Vec::new();
    for package in packages {
        let name =
            format!("{} {}", package["name"].as_str().unwrap_or("?"), package["version"].as_str().unwrap_or("?"));
        match package["license"].as_str() {
            None => refused.push(format!("{name}: no licence expression in its manifest")),
            Some(expression) => match satisfied(expression, &allowed) {
                Ok(true) => {}
                Ok(false) => refused.push(format!("{name}: {expression}")),
                Err(why) => refused.push(format!("{name}: {expression}: {why}")),
            },
        }
    }
    assert!(refused.is_empty(), "not allowed by scripts/allowed-licences.txt:\n  {}", refused.join("\n  "));
}

#[test]
fn expressions_are_read_as_spdx_defines_them() {
    let allowed = BTreeSet::from(["MIT", "Zlib", "Apache-2.0 WITH LLVM-exception"]);
    for (expression, expected) in [
        ("MIT", Ok(true)),
        ("GPL-3.0-only", Ok(false)),
        ("GPL-3.0-only OR MIT", Ok(true)),
        ("GPL-3.0-only/MIT", Ok(true)),
        ("GPL-3.0-only AND MIT", Ok(false)),
        ("MIT AND Zlib", Ok(true)),
        ("MIT OR Zlib AND GPL-3.0-only", Ok(true)), // AND binds closer than OR
        ("(MIT OR Zlib) AND GPL-3.0-only", Ok(false)),
        ("(GPL-3.0-only OR MIT) AND Zlib", Ok(true)),
        ("((MIT))", Ok(true)),
        ("Apache-2.0", Ok(false)), // allowed only with its exception
        ("Apache-2.0 WITH LLVM-exception", Ok(true)),
        ("MIT WITH LLVM-exception", Ok(false)),
        ("", Err("expected a licence, found the end")),
        ("MIT OR", Err("expected a licence, found the end")),
        ("MIT Zlib", Err("unexpected Zlib")),
        ("(MIT", Err("expected )")),
        ("MIT)", Err("unexpected )")),
        ("OR MIT", Err("expected a licence, found OR")),
    ] {
        assert_eq!(satisfied(expression, &allowed), expected.map_err(str::to_owned), "{expression}");
    }
}
