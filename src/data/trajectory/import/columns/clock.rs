//! Times in human notation: dates with a time of day, and the time of day alone.

/// Seconds of a day.
const DAY_S: f64 = 86_400.0;

/// Seconds since the beginning of 1970 of `2019-10-09T14:58:30.1Z`: a blank instead of the T, slashes between the parts of the date, and a
/// difference to UTC (`+02:00`) are read, too. `None` for anything else.
pub(super) fn iso(text: &str) -> Option<f64> {
    let (date, rest) = text.split_at_checked(text.find(['T', 't', ' '])?)?;
    let mut parts = date.split(['-', '/']).map(|part| part.parse::<i64>().ok());
    let (year, month, day) = (parts.next()??, parts.next()??, parts.next()??);
    if parts.next().is_some()
        || !(1900..=2200).contains(&year)
        || !(1..=12).contains(&month)
        || !(1..=31).contains(&day)
    {
        return None;
    }
    let rest = rest[1..].trim();
    let zone = rest.find(['Z', 'z', '+', '-']);
    let (time, zone) = rest.split_at(zone.unwrap_or(rest.len()));
    let (hours, minutes, seconds) = parts_of_a_day(time.trim())?;
    let zone = match zone.strip_prefix(['Z', 'z']).unwrap_or(zone) {
        "" => 0.0,
        zone => {
            let sign = if zone.starts_with('-') { -1.0 } else { 1.0 };
            let digits = zone.strip_prefix(['+', '-'])?.replace(':', "");
            let of = |range: std::ops::Range<usize>| digits.get(range)?.parse::<f64>().ok();
            sign * (3600.0 * of(0..2)? + if digits.len() > 2 { 60.0 * of(2..4)? } else { 0.0 })
        }
    };
    // Whole seconds first, so that the fraction keeps its digits.
    let whole = days(year, month, day) as f64 * DAY_S + 3600.0 * hours + 60.0 * minutes - zone;
    Some(whole + seconds)
}

/// Seconds since midnight of `145830.1` or `14:58:30.1`; `None` if it is not a time of day.
pub(super) fn of_day(text: &str) -> Option<f64> {
    let (hours, minutes, seconds) = parts_of_a_day(text)?;
    Some(3600.0 * hours + 60.0 * minutes + seconds)
}

fn parts_of_a_day(text: &str) -> Option<(f64, f64, f64)> {
    let (hours, minutes, seconds) = if text.contains(':') {
        let mut parts = text.split(':');
        let (hours, minutes) = (parts.next()?, parts.next()?);
        let seconds = parts.next().unwrap_or("0").replace(',', ".");
        if parts.next().is_some() {
            return None;
        }
        (hours.parse::<u32>().ok()?, minutes.parse::<u32>().ok()?, decimal(&seconds)?)
    } else {
        let (whole, fraction) = text.split_at(text.find('.').unwrap_or(text.len()));
        let whole: u32 = whole.parse().ok()?;
        (whole / 10_000, whole / 100 % 100, decimal(&format!("{}{fraction}", whole % 100))?)
    };
    let is_time = hours < 24 && minutes < 60 && (0.0..61.0).contains(&seconds);
    is_time.then_some((f64::from(hours), f64::from(minutes), seconds))
}

fn decimal(text: &str) -> Option<f64> {
    let plain = !text.is_empty() && text.bytes().all(|b| b.is_ascii_digit() || b == b'.');
    if plain { text.parse().ok() } else { None }
}

/// Days since the beginning of 1970, by the Gregorian calendar.
fn days(year: i64, month: i64, day: i64) -> i64 {
    // Years that begin in March, so that the leap day is the last one.
    let year = if month <= 2 { year - 1 } else { year };
    let (era, of_era) = (year.div_euclid(400), year.rem_euclid(400));
    let of_year = (153 * ((month + 9) % 12) + 2) / 5 + day - 1;
    era * 146_097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year - 719_468
}

/// The time of day, continued over midnight: on the day nearest to the previous time.
pub(super) fn going_on(seconds: f64, before: Option<f64>) -> f64 {
    before.map_or(seconds, |before| seconds + DAY_S * ((before - seconds) / DAY_S).round())
}

/// A number of days in seconds, to the millisecond, the resolution of such a number; whole hundreds of days are left out, because
/// a double with them would not resolve milliseconds.
pub(super) fn of_days(days: f64) -> f64 {
    (days.rem_euclid(100.0) * 86_400_000.0).round() / 1000.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_become_seconds() {
        for (text, expected) in [
            ("1970-01-01T00:00:00Z", 0.0),
            ("2019-10-09T14:58:30.1Z", 1_570_633_110.1),
            ("2019-10-09 16:58:30.1+02:00", 1_570_633_110.1),
            ("2019/10/09 14:58:30.1", 1_570_633_110.1),
            ("2000-02-29T12:00", 951_825_600.0),
        ] {
            let found = iso(text).unwrap_or_else(|| panic!("{text}"));
            assert!((found - expected).abs() < 1e-6, "{text}: {found}");
        }
        for text in [
            "",
            "2019-10-09",
            "T",
            "2019-13-09T00:00:00",
            "145830.1",
            "2019-10-09T25:00:00",
            "09.10.2019 14:58:30",
            "2019-10-09T14:58:30Zé",
            "é T",
        ] {
            assert_eq!(iso(text), None, "{text}");
        }
    }

    #[test]
    fn the_time_of_day_goes_on_over_midnight() {
        assert_eq!(of_day("145830.5"), Some(53_910.5));
        assert_eq!(of_day("14:58:30.5"), Some(53_910.5));
        assert_eq!(of_day("000001.5"), Some(1.5));
        for text in ["", "146061", "250000", "1e5", "-1", "14:58:30:1", "12:x"] {
            assert_eq!(of_day(text), None, "{text}");
        }
        assert_eq!(going_on(1.0, Some(86_399.0)), 86_401.0);
        assert_eq!(going_on(86_399.0, Some(86_401.0)), 86_399.0);
        assert_eq!(going_on(7.0, None), 7.0);
    }
}
