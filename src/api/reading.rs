//! The options of reading measured files.

use super::error::{Error, Usage, refuse, usage};
#[cfg(feature = "cli")]
use super::values::{finite, one_of, real, whole};
use crate::score::GoodnessOfFit;
use crate::trajectory::import::ColumnMap;
use crate::trajectory::{Layout, Preparation, Reconcile};
use std::num::NonZeroU32;

/// How measured files are read and prepared. By default the header decides on the layout, gaps of up to one second are interpolated, and
/// the longest segment between longer gaps is taken.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "cli", derive(clap::Args), command(next_help_heading = "Data"))]
#[non_exhaustive]
pub struct Reading {
    /// Layout: openacc, astazero-rebuilt, astazero-processed, ultra-av, pair [default: by the header]
    #[cfg_attr(feature = "cli", arg(long))]
    pub layout: Option<Layout>,
    /// Column map of a table of another layout, in place of a layout: the name of one that is built in, or your own file.
    #[cfg_attr(feature = "cli",
        arg(long, value_name = "NAME|FILE.toml", conflicts_with = "layout", help = columns_help()))]
    pub columns: Option<String>,
    /// Trajectory id in a file with several, or several ids separated by commas
    #[cfg_attr(feature = "cli", arg(long, value_name = "ID"))]
    pub trajectory: Option<String>,
    /// Number of the segment, as listed by `leadlag inspect` [default: the longest]
    #[cfg_attr(feature = "cli",
        arg(long, value_name = "K", value_parser = whole(1, u32::MAX), allow_negative_numbers = true))]
    pub segment: Option<u32>,
    /// First time to use, in the file's own seconds
    #[cfg_attr(feature = "cli", arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true))]
    pub from: Option<f64>,
    /// Last time to use, in the file's own seconds
    #[cfg_attr(feature = "cli", arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true))]
    pub to: Option<f64>,
    /// Interpolate missing samples over at most this many seconds; longer interruptions split the file
    #[cfg_attr(feature = "cli",
        arg(long = "max-gap", value_name = "S", default_value_t = Preparation::default().max_gap_s,
            value_parser = real(Preparation::MAX_GAP_S, "s"), allow_negative_numbers = true))]
    pub max_gap_s: f64,
    /// Smooth as the paper's authors did: two Savitzky-Golay passes, 51 points, cubic
    #[cfg_attr(feature = "cli", arg(long))]
    pub smooth: bool,
    /// Resample to this time step, in seconds
    #[cfg_attr(feature = "cli",
        arg(long = "resample", value_name = "DT", value_parser = real(Preparation::RESAMPLE_S, "s"),
            allow_negative_numbers = true))]
    pub resample_s: Option<f64>,
    /// Correct faults of the data where possible
    #[cfg_attr(feature = "cli", arg(long))]
    pub correct: bool,
    /// Anchor of the spacing if the measured spacing and the speeds contradict each other
    #[cfg_attr(feature = "cli", arg(long, default_value = "gap", value_parser = one_of(&[
        ("gap", Reconcile::Gap, "The measured spacing; the position of the preceding vehicle is derived from it"),
        ("speeds", Reconcile::Speeds, "The integrated speed difference, starting from the first measured spacing"),
    ])))]
    pub reconcile: Reconcile,
    /// The follower: a built-in vehicle or FILE#NAME [default: by its name in the file]
    #[cfg_attr(feature = "cli", arg(long, value_name = "NAME|FILE#NAME"))]
    pub vehicle: Option<String>,
    /// Grade table: X,Y of a closed track, or position_m,sin_grade of an open road; or `level`
    #[cfg_attr(feature = "cli", arg(long, value_name = "FILE|level"))]
    pub grade: Option<String>,
    /// Length of the preceding vehicle in m [default: from the file, else unknown]
    #[cfg_attr(feature = "cli",
        arg(long = "lead-length", value_name = "M", value_parser = real(Preparation::LEAD_LENGTH_M, "m"),
            allow_negative_numbers = true))]
    pub lead_length_m: Option<f64>,
    /// Position of the preceding vehicle on the grade table at the first row of the file, in m
    #[cfg_attr(feature = "cli",
        arg(long = "lead-start", value_name = "M", value_parser = real(Preparation::LEAD_START_M, "m"),
            allow_negative_numbers = true))]
    pub lead_start_m: Option<f64>,
    /// The measure that is minimised, if it is known: faults that do not change it are no warning.
    #[cfg_attr(feature = "cli", arg(skip))]
    pub(crate) measure: Option<GoodnessOfFit>,
}

impl Default for Reading {
    fn default() -> Reading {
        Reading {
            layout: None,
            columns: None,
            trajectory: None,
            segment: None,
            from: None,
            to: None,
            max_gap_s: Preparation::default().max_gap_s,
            smooth: false,
            resample_s: None,
            correct: false,
            reconcile: Reconcile::Gap,
            vehicle: None,
            grade: None,
            lead_length_m: None,
            lead_start_m: None,
            measure: None,
        }
    }
}

/// Help text of `--columns`.
#[cfg(feature = "cli")]
pub(crate) fn columns_help() -> String {
    let shipped: Vec<&str> = ColumnMap::shipped().iter().map(|(name, _)| *name).collect();
    let shipped = shipped.join(", ");
    format!("Column map of a table of another layout: {shipped} (`leadlag list columns`), or your own file")
}

impl Reading {
    /// The options, by the names that [`Reading::set`] takes.
    pub const OPTIONS: [&str; 15] = [
        "columns",
        "layout",
        "trajectory",
        "segment",
        "from",
        "to",
        "max_gap",
        "smooth",
        "correct",
        "resample",
        "reconcile",
        "vehicle",
        "grade",
        "lead_length",
        "lead_start",
    ];

    /// Sets an option from a text: `True` or `False` for what is on or off, numbers in SI units.
    ///
    /// # Errors
    /// What was expected instead of this value. Ranges are checked when a file is read.
    pub fn set(&mut self, option: &str, value: &str) -> Result<(), Error> {
        fn read<T: std::str::FromStr>(value: &str, expected: &str) -> Result<T, Error> {
            value.trim().parse().map_err(|_| Usage(format!("expected {expected}")).into())
        }
        let text = || Some(value.to_owned());
        let number = || read(value, "a number");
        match option {
            "columns" => self.columns = text(),
            "layout" => self.layout = Some(value.parse().map_err(usage)?),
            "trajectory" => self.trajectory = text(),
            "segment" => {
                self.segment = Some(read::<NonZeroU32>(value, "a whole number from 1 on")?.get());
            }
            "from" => self.from = Some(number()?),
            "to" => self.to = Some(number()?),
            "max_gap" => self.max_gap_s = number()?,
            "smooth" => self.smooth = read(&value.to_lowercase(), "True or False")?,
            "correct" => self.correct = read(&value.to_lowercase(), "True or False")?,
            "resample" => self.resample_s = Some(number()?),
            "reconcile" => self.reconcile = value.parse().map_err(usage)?,
            "vehicle" => self.vehicle = text(),
            "grade" => self.grade = text(),
            "lead_length" => self.lead_length_m = Some(number()?),
            "lead_start" => self.lead_start_m = Some(number()?),
            _ => refuse!("expected {}", Self::OPTIONS.join(", ")),
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A value of each option other than the default.
    fn changed(option: &str) -> &'static str {
        match option {
            "layout" => "pair",
            "smooth" | "correct" => "True",
            "reconcile" => "speeds",
            "columns" | "trajectory" | "vehicle" | "grade" => "some",
            _ => "2",
        }
    }

    #[test]
    fn every_option_can_be_set() {
        for option in Reading::OPTIONS {
            let mut reading = Reading::default();
            reading.set(option, changed(option)).unwrap_or_else(|error| panic!("{option}: {error}"));
            assert_ne!(reading, Reading::default(), "{option}");
        }
        let refused = |option, value| Reading::default().set(option, value).expect_err("refused").to_string();
        assert_eq!(refused("segment", "0"), "expected a whole number from 1 on");
        assert_eq!(refused("smooth", "1"), "expected True or False");
        assert!(refused("speed", "1").starts_with("expected columns, layout, "));
    }

    #[cfg(feature = "cli")]
    #[test]
    fn flags_and_names_are_the_same_options() {
        use clap::{Args, FromArgMatches};
        let command = Reading::augment_args(clap::Command::new("reading"));
        let of = |words: &[String]| {
            let matches = command.clone().try_get_matches_from([&["reading".to_owned()], words].concat());
            Reading::from_arg_matches(&matches.expect("valid")).expect("valid")
        };
        assert_eq!(of(&[]), Reading::default());
        for option in Reading::OPTIONS {
            let (flag, value) = (format!("--{}", option.replace('_', "-")), changed(option));
            let words = if value == "True" { vec![flag] } else { vec![format!("{flag}={value}")] };
            let mut reading = Reading::default();
            reading.set(option, value).expect("valid");
            assert_eq!(of(&words), reading, "{option}");
        }
        let flags = command.get_arguments().filter(|argument| argument.get_long() != Some("help"));
        assert_eq!(flags.count(), Reading::OPTIONS.len());
    }
}
