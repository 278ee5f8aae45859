//! Values of options on the command line: an error gives what is expected.

use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use std::fmt::Display;
use std::str::FromStr;

/// A whole number from `lowest` to `highest`.
pub fn whole<T>(lowest: T, highest: T) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync + 'static
where
    T: FromStr + PartialOrd + Display + Copy + Send + Sync + 'static,
{
    move |text| {
        let number = text.trim().parse().ok().filter(|n| (lowest..=highest).contains(n));
        number.ok_or_else(|| format!("expected a whole number from {lowest} to {highest}"))
    }
}

/// A number from `lowest` to `highest`, in `unit`.
pub fn real(
    [lowest, highest]: [f64; 2],
    unit: &'static str,
) -> impl Fn(&str) -> Result<f64, String> + Clone + Send + Sync + 'static {
    move |text| {
        let number = text.trim().parse().ok().filter(|x| (lowest..=highest).contains(x));
        number.ok_or_else(|| format!("expected {lowest} to {highest} {unit}"))
    }
}

/// A number that is neither infinite nor NaN.
pub fn finite(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.trim().parse().ok();
    value.filter(|x| x.is_finite()).ok_or_else(|| format!("expected a finite number, found `{text}`"))
}

/// One of these words, each with its value and its meaning for the help.
pub fn one_of<T: Copy + Send + Sync>(
    words: &'static [(&'static str, T, &'static str)],
) -> impl TypedValueParser<Value = T> {
    let known = words.iter().map(|(word, _, meaning)| PossibleValue::new(*word).help(*meaning));
    PossibleValuesParser::new(known).map(|word| words.iter().find(|(own, ..)| *own == word).expect("one of them").1)
}

/// The seed of random numbers.
pub fn seed(text: &str) -> Result<u64, String> {
    text.trim().parse().map_err(|_| format!("expected a whole number from 0 to {}, such as 7", u64::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_refused_is_told_the_range() {
        let whole = whole(100_u64, 1000);
        assert_eq!(whole("100"), Ok(100));
        for text in ["99", "1001", "-5", "1.5", "18446744073709551616", "x", ""] {
            assert_eq!(whole(text), Err("expected a whole number from 100 to 1000".to_owned()), "{text}");
        }
        let real = real([0.0, 30.0], "m");
        assert_eq!(real("4.5"), Ok(4.5));
        for text in ["-3", "30.1", "nan", "inf", "4,5"] {
            assert_eq!(real(text), Err("expected 0 to 30 m".to_owned()), "{text}");
        }
        assert_eq!(seed("7"), Ok(7));
        assert!(seed("x").is_err_and(|message| message.starts_with("expected a whole number from 0 to ")));
    }
}
