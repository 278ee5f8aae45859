//! Splitting a line into fields, and the names of the columns.

use super::problems::{Problems, Stop};
use crate::trajectory::error::ProblemKind;

/// One field of a line: its text without blanks and quotes around it, and where it starts.
#[derive(Debug, Clone, Copy)]
pub(in crate::trajectory) struct Field<'a> {
    pub text: &'a str,
    /// Byte of the line at which it starts.
    pub start: usize,
}

/// Splits `line` at its commas; a field may be in double quotes, which then hide commas.
pub(in crate::trajectory) fn split<'a>(line: &'a str, fields: &mut Vec<Field<'a>>) {
    split_at(line, ',', fields);
}

/// The same at another separator.
pub(in crate::trajectory) fn split_at<'a>(line: &'a str, separator: char, fields: &mut Vec<Field<'a>>) {
    fields.clear();
    let mut start = 0;
    loop {
        let rest = &line[start..];
        let blank = rest.len() - rest.trim_start_matches([' ', '\t']).len();
        // Where tabs separate, they are no blanks.
        let blank = if separator == '\t' { rest.len() - rest.trim_start_matches(' ').len() } else { blank };
        let body = &rest[blank..];
        let quoted = body.strip_prefix('"').and_then(|inner| inner.find('"')).map(|end| end + 2);
        let after = blank + quoted.unwrap_or(0);
        let end = rest[after..].find(separator).map(|place| place + after);
        let whole = &rest[..end.unwrap_or(rest.len())];
        let mut text = whole.trim();
        if text.len() >= 2 && text.starts_with('"') && text.ends_with('"') {
            text = text[1..text.len() - 1].trim();
        }
        fields.push(Field { text, start: start + if text.is_empty() { 0 } else { blank } });
        match end {
            Some(end) => start += end + 1,
            None => return,
        }
    }
}

/// Character of the line, counted from 1, at byte `start`.
pub(in crate::trajectory) fn column_of(line: &str, start: usize) -> usize {
    line[..start].chars().count() + 1
}

/// Stops if the line is separated by semicolons or tabs.
pub(in crate::trajectory) fn check_separator(line: &str, number: u64, problems: &mut Problems) -> Result<(), Stop> {
    let commas = line.matches(',').count();
    for (separator, found) in [(';', "semicolons"), ('\t', "tabs")] {
        if line.matches(separator).count() > commas {
            let column = line.find(separator).map(|byte| column_of(line, byte));
            return Err(problems.stop(number, column, ProblemKind::Separator { found }));
        }
    }
    Ok(())
}

/// The header line of a table.
#[derive(Debug, Clone)]
pub(in crate::trajectory) struct Header {
    /// Line of the file, counted from 1.
    pub line: u64,
    /// Names without blanks around them; trailing nameless columns are cut.
    pub names: Vec<String>,
    columns: Vec<usize>,
}

/// Nine cars of OpenACC have 71 columns; what is done per column and name must not grow into hours.
const COLUMNS_MAX: usize = 2000;

impl Header {
    pub fn parse(text: &str, line: u64, problems: &mut Problems) -> Result<Self, Stop> {
        check_separator(text, line, problems)?;
        let mut fields = Vec::new();
        split(text, &mut fields);
        Header::of(text, line, &fields, problems)
    }

    /// The header of a file that has none: these names, no line.
    pub fn named(names: &[String]) -> Self {
        Header { line: 0, names: names.to_vec(), columns: vec![1; names.len()] }
    }

    /// The header of a line that is split already.
    pub fn of(text: &str, line: u64, fields: &[Field], problems: &mut Problems) -> Result<Self, Stop> {
        let mut fields = fields.to_vec();
        while fields.last().is_some_and(|field| field.text.is_empty()) {
            fields.pop();
        }
        if fields.len() > COLUMNS_MAX {
            let kind = ProblemKind::TooManyColumns { limit: COLUMNS_MAX, found: fields.len() };
            return Err(problems.stop(line, None, kind));
        }
        let header = Header {
            line,
            names: fields.iter().map(|f| f.text.to_owned()).collect(),
            columns: fields.iter().map(|f| column_of(text, f.start)).collect(),
        };
        let mut seen = std::collections::HashSet::new();
        for (index, name) in header.names.iter().enumerate() {
            if !name.is_empty() && !seen.insert(name) {
                let column = name.clone();
                let kind = ProblemKind::DuplicateColumn { column };
                problems.add(line, Some(header.columns[index]), kind);
            }
        }
        Ok(header)
    }

    pub fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// Records one problem for every needed column that is missing; `known` columns are never its misspelling.
    pub fn require(&self, needed: &[&str], known: &[&str], problems: &mut Problems) {
        for column in needed {
            if self.find(column).is_none() {
                self.missing(column, needed, known, problems);
            }
        }
    }

    /// Records that `column` is missing.
    pub fn missing(&self, column: &str, needed: &[&str], known: &[&str], problems: &mut Problems) {
        let others = self.names.iter().map(String::as_str);
        let others = others.filter(|name| !known.contains(name));
        let kind = ProblemKind::MissingColumn {
            column: column.to_owned(),
            has: self.names.clone(),
            needed: needed.iter().map(|&n| n.to_owned()).collect(),
            near: nearest(column, others).map(str::to_owned),
        };
        problems.add(self.line.max(1), None, kind);
    }

    /// Records a problem for every unknown column that looks like a misspelt known one, and returns the other unknown ones.
    pub fn unknown(&self, needed: &[&str], known: &[&str], problems: &mut Problems) -> Vec<String> {
        let is_known = |name: &String| known.contains(&name.as_str());
        let mut ignored = Vec::new();
        for (index, name) in self.names.iter().enumerate() {
            if is_known(name) || name.is_empty() {
                continue;
            }
            // A needed column that is missing is reported by `require`, with the same suggestion.
            let free = known.iter().copied().filter(|k| self.find(k).is_none());
            match nearest(name, free) {
                Some(near) if needed.contains(&near) => {}
                Some(near) => self.suspect(index, near, problems),
                None => ignored.push(name.clone()),
            }
        }
        ignored
    }

    /// Records that column `index` is unknown but close to `near`.
    pub fn suspect(&self, index: usize, near: &str, problems: &mut Problems) {
        let kind = ProblemKind::UnknownColumn { column: self.names[index].clone(), near: near.to_owned() };
        problems.add(self.line, Some(self.columns[index]), kind);
    }
}

/// The candidate that `name` is a likely misspelling of: at most two edits apart, case and blanks not counted.
pub(in crate::trajectory) fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // The distance takes quadratic time; no known column is longer.
    if name.len() > 40 {
        return None;
    }
    let plain = |text: &str| text.to_lowercase().replace([' ', '-'], "_");
    let wanted = plain(name);
    candidates
        .filter(|candidate| candidate.len() <= 40)
        .map(|candidate| (strsim::osa_distance(&wanted, &plain(candidate)), candidate))
        .filter(|&(distance, candidate)| distance <= 2 && distance * 3 < candidate.len())
        .min_by_key(|&(distance, _)| distance)
        .map(|(_, candidate)| candidate)
}
