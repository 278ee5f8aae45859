//! Changes of a text, and the table of those that no test can detect: file, line as written, change, reason.

/// One change of one place.
#[derive(Debug, Clone)]
pub struct Mutant<T> {
    pub file: String,
    /// Line and column, from 1.
    pub line: usize,
    pub column: usize,
    /// The line as written, trimmed.
    pub source: String,
    /// Such as `< -> <=`; the second one of its kind on a line is followed by ` (2)`, and so on.
    pub change: String,
    /// What makes it: the number of a switch, or the whole file with the change.
    pub made: T,
}

impl<T> Mutant<T> {
    /// True for a comparison that becomes strict, or no longer is: random states do not lie exactly on a limit, and on most limits both sides are
    /// the same.
    pub fn is_strictness(&self) -> bool {
        ["<", ">"].iter().any(|sign| {
            let (strict, loose) = (format!("{sign} -> {sign}="), format!("{sign}= -> {sign}"));
            self.change.starts_with(&strict) || self.change.starts_with(&loose)
        })
    }

    fn is(&self, [file, line, change, _]: &[&str; 4]) -> bool {
        (self.file.as_str(), self.source.as_str(), self.change.as_str()) == (*file, *line, *change)
    }
}

/// Every survivor is in the table, and every row of a file that is `judged` survives, or was `left` out of this run. `remedy` says what else a
/// survivor needs.
pub fn compare<T>(
    survivors: &[&Mutant<T>],
    left: &[Mutant<T>],
    table: &'static str,
    judged: impl Fn(&str) -> bool,
    remedy: &str,
) {
    let row = |row: &'static str| -> [&str; 4] {
        row.split('\t').collect::<Vec<_>>().try_into().unwrap_or_else(|_| panic!("four columns: {row}"))
    };
    let listed: Vec<[&str; 4]> = table.lines().skip(1).map(row).filter(|row| judged(row[0])).collect();
    let unlisted: Vec<String> = survivors
        .iter()
        .filter(|m| !listed.iter().any(|row| m.is(row)))
        .map(|m| format!("{}:{}:{}: {} in `{}`", m.file, m.line, m.column, m.change, m.source))
        .collect();
    assert!(
        unlisted.is_empty(),
        "{} changes make no test fail; {remedy}, or a row with the reason in survivors.tsv:\n{}",
        unlisted.len(),
        unlisted.join("\n")
    );
    for own in &listed {
        let [file, line, change, reason] = own;
        assert!(
            survivors.iter().any(|m| m.is(own)) || left.iter().any(|m| m.is(own)),
            "{file}: {change} in `{line}` is listed as a survivor ({reason}) but is noticed, or no longer exists"
        );
    }
}
