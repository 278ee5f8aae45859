//! Splitting a line into fields, and the names of the columns.

use super::lines::Lines;
use super::problems::{Problems, Stop};
use crate::text::spelling::nearest_within;
use crate::trajectory::error::ProblemKind;
use std::io::Read;

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

/// The same with another separator.
pub(in crate::trajectory) fn split_at<'a>(line: &'a str, separator: char, fields: &mut Vec<Field<'a>>) {
    fields.clear();
    let mut start = 0;
    loop {
        let rest = &line[start..];
        let blank = rest.len() - rest.trim_start_matches([' ', '\t']).len();
        // If tabs separate, they are not blanks.
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

/// Stops if the line is separated by semicolons or tabs; `mapped`, the lines behind it, if a column map could read the file all the same.
pub(in crate::trajectory) fn check_separator<R: Read>(
    line: &str,
    number: u64,
    mapped: Option<&mut Lines<R>>,
    problems: &mut Problems,
) -> Result<(), Stop> {
    let commas = line.matches(',').count();
    for (separator, found, name) in [(';', "semicolons", "semicolon"), ('\t', "tabs", "tab")] {
        // Decimal commas are as frequent, if a line has numbers.
        let separates = line.contains(separator) && line.split(separator).all(is_number);
        if separates || line.matches(separator).count() > commas {
            let column = line.find(separator).map(|byte| column_of(line, byte));
            let is_mapped = mapped.is_some();
            let expected = line.split(separator).count();
            let next = mapped.map_or(Ok(None), |lines| lines.next(problems).map(|next| next.map(str::to_owned)))?;
            let fields = next.map_or(0, |next| next.split(separator).count());
            if is_whole_trajectory(expected, fields) {
                return Err(problems.stop(number + 1, None, ProblemKind::WholeTrajectory { expected, found: fields }));
            }
            let kind = ProblemKind::Separator { found, mapped: is_mapped.then_some(name) };
            return Err(problems.stop(number, column, kind));
        }
    }
    Ok(())
}

/// True if a row has so many fields that it must hold all samples of a vehicle; decimal commas at most double them.
fn is_whole_trajectory(expected: usize, found: usize) -> bool {
    found > 2 * expected
}

/// True for a number with a point or a comma before its fraction.
fn is_number(text: &str) -> bool {
    text.trim().replacen(',', ".", 1).parse::<f64>().is_ok()
}

/// Stops if the first line of a table, which names the columns, is one of numbers.
pub(in crate::trajectory) fn check_names(fields: &[Field], problems: &mut Problems) -> Result<(), Stop> {
    let mut texts = fields.iter().map(|field| field.text).filter(|text| !text.is_empty()).peekable();
    if texts.peek().is_some() && texts.all(is_number) {
        let found = fields.iter().map(|field| field.text.to_owned()).collect();
        return Err(problems.stop(1, None, ProblemKind::NoNames { found }));
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

/// Nine cars of OpenACC have 71 columns; more columns and names must not take hours.
const COLUMNS_MAX: usize = 2000;

impl Header {
    pub fn parse(text: &str, line: u64, problems: &mut Problems) -> Result<Self, Stop> {
        check_separator(text, line, None::<&mut Lines<&[u8]>>, problems)?;
        let mut fields = Vec::new();
        split(text, &mut fields);
        Header::of(text, line, &fields, problems)
    }

    /// The header of a file without one: these names, no line.
    pub fn named(names: &[String]) -> Self {
        Header { line: 0, names: names.to_vec(), columns: vec![1; names.len()] }
    }

    /// The header of a line that is already split.
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

    /// Stops at a row after which every row would be a problem of its own.
    pub fn check_row(&self, fields: &[Field], line: u64, problems: &mut Problems) -> Result<(), Stop> {
        if fields.iter().map(|field| field.text).eq(self.names.iter().map(String::as_str)) {
            return Err(problems.stop(line, None, ProblemKind::HeaderAgain));
        }
        let (expected, found) = (self.names.len(), fields.len());
        // Empty fields behind the last column are no data.
        if is_whole_trajectory(expected, found) && fields[2 * expected..].iter().any(|field| !field.text.is_empty()) {
            return Err(problems.stop(line, None, ProblemKind::WholeTrajectory { expected, found }));
        }
        Ok(())
    }

    pub fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// The same without regard to case, if no other column has that name.
    pub fn find_in_any_case(&self, name: &str) -> Option<usize> {
        self.find(name).or_else(|| {
            let mut alike = (0..self.names.len()).filter(|&place| self.names[place].eq_ignore_ascii_case(name));
            alike.next().filter(|_| alike.next().is_none())
        })
    }

    /// Records a problem if needed columns are missing; `known` columns are never their misspelling, and `advice` is what
    /// else helps.
    pub fn require(&self, needed: &[&str], known: &[&str], advice: &str, problems: &mut Problems) {
        let missing: Vec<&str> = needed.iter().copied().filter(|column| self.find(column).is_none()).collect();
        self.missing(&missing, needed, known, advice, problems);
    }

    /// Records missing columns, if any; `advice` is an additional remedy.
    pub fn missing(&self, columns: &[&str], needed: &[&str], known: &[&str], advice: &str, problems: &mut Problems) {
        if columns.is_empty() {
            return;
        }
        let others = || self.names.iter().map(String::as_str).filter(|name| !known.contains(name));
        let rename = |column: &&str| {
            let from = nearest(column, others()).or_else(|| synonym(column, others()))?;
            Some((from.to_owned(), (*column).to_owned()))
        };
        let owned = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        let kind = ProblemKind::MissingColumns {
            columns: owned(columns),
            has: self.names.clone(),
            needed: owned(needed),
            renames: columns.iter().filter_map(rename).collect(),
            advice: advice.to_owned(),
        };
        problems.add(self.line.max(1), None, kind);
    }

    /// Records a problem for every unknown column that looks like a misspelt known one.
    pub fn unknown(&self, needed: &[&str], known: &[&str], problems: &mut Problems) {
        let is_known = |name: &String| known.contains(&name.as_str());
        for (index, name) in self.names.iter().enumerate() {
            if is_known(name) || name.is_empty() {
                continue;
            }
            // A needed column that is missing is reported by `require`, with the same suggestion.
            let free = known.iter().copied().filter(|k| self.find(k).is_none());
            match nearest(name, free) {
                Some(near) if !needed.contains(&near) => self.suspect(index, near, problems),
                _ => {}
            }
        }
    }

    /// Records that column `index` is unknown but close to `near`.
    pub fn suspect(&self, index: usize, near: &str, problems: &mut Problems) {
        let kind = ProblemKind::UnknownColumn { column: self.names[index].clone(), near: near.to_owned() };
        problems.add(self.line, Some(self.columns[index]), kind);
    }
}

/// The likely correct name for `name`: at most two edits away, ignoring case and blanks.
pub(in crate::trajectory) fn nearest<'a>(name: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    // The distance takes quadratic time; no known column is longer.
    if name.len() > 40 {
        return None;
    }
    // Less than a third of the letters: a misspelt column is an error, so other words must not match.
    nearest_within(name, candidates, |candidate| (candidate.len().saturating_sub(1) / 3).min(2))
}

/// Content of a column by the names of the layouts, and by other common names. Numbers of cars are not part of them.
const SYNONYMS: [(&[&str], &[&str]); 4] = [
    (&["time_s", "Time", "Time_Index"], &["t", "time", "timestamp", "seconds", "sec", "clock"]),
    (
        &["speed_mps", "Speed_FAV"],
        &[
            "v",
            "v_f",
            "v_ego",
            "v_follow",
            "v_follower",
            "speed",
            "velocity",
            "ego_speed",
            "follow_speed",
            "follower_speed",
        ],
    ),
    (
        &["lead_speed_mps", "Speed_LV"],
        &["v_l", "v_lead", "v_leader", "lead_speed", "leader_speed", "speed_lead", "preceding_speed"],
    ),
    (
        &["spacing_m", "Spatial_Gap", "IVS", "Spacing"],
        &["s", "gap", "gap_m", "spacing", "distance", "distance_m", "range", "range_m", "clearance"],
    ),
];

/// True for a name that probably means this column: misspelt, or another word.
pub(super) fn stands_for(name: &str, column: &str) -> bool {
    nearest(name, std::iter::once(column)).is_some() || synonym(column, std::iter::once(name)).is_some()
}

/// The candidate that is another word for `name`, with the same number behind it.
fn synonym<'a>(name: &str, mut candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let parts = |text: &str| {
        let word = text.trim_end_matches(|c: char| c.is_ascii_digit());
        (plain(word), text[word.len()..].to_owned())
    };
    let (wanted, number) = parts(name);
    let words =
        SYNONYMS.iter().find(|(names, _)| names.iter().any(|known| plain(known) == wanted)).map(|(_, words)| words)?;
    candidates.find(|candidate| {
        let (word, its_number) = parts(candidate);
        words.contains(&word.as_str()) && its_number == number
    })
}

/// A name without its variable parts, such as case and separators.
fn plain(text: &str) -> String {
    text.to_lowercase().replace([' ', '-'], "_")
}
