//! Of samples closer than a pixel, the visible ones: the extremes of every pixel column.

/// Lines of (time, value), at most two points per pixel column, broken where values are missing.
///
/// A gap within one column is too narrow to be seen and does not break the line.
pub(super) fn lines(t: &[f64], values: &[f64], columns: usize) -> Vec<Vec<(f64, f64)>> {
    let (Some(begin), Some(end)) = (t.first(), t.last()) else {
        return Vec::new();
    };
    let per_second = columns as f64 / (end - begin);
    let mut lines: Vec<Vec<(f64, f64)>> = Vec::new();
    let mut column: Option<Column> = None;
    let mut broken = true;
    for (&time, &value) in t.iter().zip(values) {
        if !value.is_finite() {
            broken = true;
            continue;
        }
        let number = ((time - begin) * per_second) as usize;
        match &mut column {
            Some(column) if column.number == number => column.add((time, value)),
            _ => {
                if let (Some(full), Some(line)) = (&column, lines.last_mut()) {
                    full.append_to(line);
                }
                if broken {
                    lines.push(Vec::new());
                }
                column = Some(Column { number, low: (time, value), high: (time, value) });
            }
        }
        broken = false;
    }
    if let (Some(full), Some(line)) = (&column, lines.last_mut()) {
        full.append_to(line);
    }
    lines
}

/// Samples that fall on one column of pixels.
struct Column {
    number: usize,
    low: (f64, f64),
    high: (f64, f64),
}

impl Column {
    fn add(&mut self, point: (f64, f64)) {
        if point.1 < self.low.1 {
            self.low = point;
        }
        if point.1 > self.high.1 {
            self.high = point;
        }
    }

    fn append_to(&self, line: &mut Vec<(f64, f64)>) {
        let (first, second) = if self.low.0 <= self.high.0 { (self.low, self.high) } else { (self.high, self.low) };
        line.push(first);
        if second.0 > first.0 {
            line.push(second);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_samples_are_all_kept_and_gaps_break_the_line() {
        let t = [0.0, 1.0, 2.0, 3.0, 4.0];
        let values = [1.0, 2.0, f64::NAN, 4.0, 5.0];
        let expected = vec![vec![(0.0, 1.0), (1.0, 2.0)], vec![(3.0, 4.0), (4.0, 5.0)]];
        assert_eq!(lines(&t, &values, 900), expected);
    }

    #[test]
    fn extremes_survive() {
        let t: Vec<f64> = (0..20_000).map(f64::from).collect();
        let mut values: Vec<f64> = t.iter().map(|t| (t * 0.01).sin()).collect();
        values[7_777] = 9.0;
        values[7_779] = -9.0;
        let found = lines(&t, &values, 100);
        assert_eq!(found.len(), 1);
        assert!(found[0].len() <= 202);
        assert!(found[0].contains(&(7_777.0, 9.0)) && found[0].contains(&(7_779.0, -9.0)));
        assert!(found[0].is_sorted_by(|a, b| a.0 < b.0));
    }

    #[test]
    fn a_gap_narrower_than_a_pixel_does_not_break() {
        let t: Vec<f64> = (0..1000).map(f64::from).collect();
        let mut values = vec![1.0; 1000];
        values[505] = f64::NAN;
        assert_eq!(lines(&t, &values, 100).len(), 1);
        values[500..520].fill(f64::NAN);
        assert_eq!(lines(&t, &values, 100).len(), 2);
        assert!(lines(&t, &vec![f64::NAN; 1000], 100).is_empty());
    }
}
