//! Road grade as a function of the position along the road.

use super::Source;
use super::error::{ImportError, ProblemKind};
use super::import::{
    Field, GRADE_LIMIT, Header, Lines, POSITION_LIMIT, Problems, Stop, column_of, open, present, split,
};
use std::io::Read;
use std::path::Path;

/// Sine of the road grade over the position along the road; looked up at the *simulated* position of the ego vehicle.
#[derive(Debug, Clone, PartialEq)]
pub struct Grade {
    /// Positions \[m\], strictly increasing.
    pub x: Vec<f64>,
    /// Sine of the grade at these positions.
    pub sin: Vec<f64>,
    /// Length of a closed track \[m\]: positions are taken modulo it. `None`: an open road, held constant beyond its ends.
    pub period: Option<f64>,
    /// The file it was read from, if any.
    pub source: Option<Source>,
}

/// Range of the length of a closed track \[m\]: from a tabletop model to beyond any test track.
pub(super) const LAPS_M: std::ops::RangeInclusive<f64> = 1.0..=1e6;

impl Grade {
    /// A level road.
    pub fn level() -> Self {
        Grade { x: vec![0.0], sin: vec![0.0], period: None, source: None }
    }

    /// Sine of the grade at position `x` \[m\]: linear between the two positions around it, after taking `x` modulo a
    /// closed track; constant beyond the ends of an open road.
    pub fn at(&self, x: f64) -> f64 {
        let x = self.period.map_or(x, |period| x.rem_euclid(period));
        let above = self.x.partition_point(|&x_i| x_i <= x);
        let (Some(below), Some(&x_1)) = (above.checked_sub(1), self.x.get(above)) else {
            let end = if above == 0 { self.sin.first() } else { self.sin.last() };
            return end.copied().unwrap_or(0.0);
        };
        let (x_0, sin_0, sin_1) = (self.x[below], self.sin[below], self.sin[above]);
        sin_0 + (sin_1 - sin_0) * (x - x_0) / (x_1 - x_0)
    }

    /// Reads a grade profile: columns `X,Y` describe a closed track whose length is the last `X` (as the authors'
    /// `Slope.csv`), `position_m,sin_grade` an open road.
    pub fn read_csv(path: &Path) -> Result<Self, ImportError> {
        Self::read_from(open(path)?, &path.display().to_string())
    }

    /// Reads a grade profile from a stream; `name` stands for the file in messages.
    pub fn read_from(input: impl Read, name: &str) -> Result<Self, ImportError> {
        let mut problems = Problems::default();
        let mut lines = Lines::new(input);
        let result = profile(&mut lines, &mut problems);
        let mut grade = problems.finish(name, result)?;
        grade.source = Some(Source { path: name.to_owned(), sha256: lines.sha256() });
        Ok(grade)
    }
}

fn profile<R: Read>(lines: &mut Lines<R>, problems: &mut Problems) -> Result<Grade, Stop> {
    let Some(text) = lines.next(problems)?.map(str::to_owned) else {
        return Err(problems.stop(1, None, ProblemKind::Empty));
    };
    let header = Header::parse(&text, 1, problems)?;
    let closed = header.find("X").is_some() || header.find("Y").is_some();
    let needed = if closed { ["X", "Y"] } else { ["position_m", "sin_grade"] };
    header.require(&needed, &needed, "", problems);
    problems.check()?;
    let column = needed.map(|name| header.find(name).unwrap_or_default());
    let (mut x, mut sin): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    while let Some(text) = lines.next(problems)?.map(str::to_owned) {
        let line = lines.number();
        let mut fields: Vec<Field> = Vec::new();
        split(&text, &mut fields);
        if fields.iter().all(|field| field.text.is_empty()) {
            continue;
        }
        if fields.len() != header.names.len() {
            let kind =
                ProblemKind::FieldCount { expected: header.names.len(), found: fields.len(), last: !lines.terminated };
            problems.add(line, Some(1), kind);
            continue;
        }
        let place = |i: usize| Some(column_of(&text, fields[column[i]].start));
        match position(fields[column[0]].text, needed[0], x.last().copied(), closed) {
            Ok(value) => x.push(value),
            Err(kind) => {
                problems.add(line, place(0), kind);
                x.push(f64::NAN);
            }
        }
        match sine(fields[column[1]].text, needed[1]) {
            Ok(value) => sin.push(value),
            Err(kind) => {
                problems.add(line, place(1), kind);
                sin.push(f64::NAN);
            }
        }
    }
    problems.check()?;
    match x.len() {
        0 => return Err(problems.stop(1, None, ProblemKind::NoRows)),
        1 => return Err(problems.stop(lines.number(), None, ProblemKind::OneRow)),
        _ => {}
    }
    let period = x.last().copied().filter(|_| closed);
    if let Some(found) = period.filter(|period| !LAPS_M.contains(period)) {
        let column = needed[0].to_owned();
        let (shortest, longest) = (*LAPS_M.start(), *LAPS_M.end());
        return Err(problems.stop(lines.number(), None, ProblemKind::Lap { column, shortest, longest, found }));
    }
    Ok(Grade { x, sin, period, source: None })
}

fn position(text: &str, name: &str, previous: Option<f64>, closed: bool) -> Result<f64, ProblemKind> {
    let found = present(text, name)?;
    let column = name.to_owned();
    match previous {
        _ if found.abs() > POSITION_LIMIT => Err(ProblemKind::TooLong { column, limit: POSITION_LIMIT, found }),
        Some(previous) if found <= previous => Err(ProblemKind::PositionBack { column, previous, found }),
        None if closed && found != 0.0 => Err(ProblemKind::TrackStart { column, found }),
        _ => Ok(found),
    }
}

fn sine(text: &str, name: &str) -> Result<f64, ProblemKind> {
    let found = present(text, name)?;
    if found.abs() > GRADE_LIMIT {
        return Err(ProblemKind::Grade { column: name.to_owned(), limit: GRADE_LIMIT, found });
    }
    Ok(found)
}
