//! Flags for reading and preparing measured files.

use super::change::settle;
use super::number::{finite, real, whole};
use crate::api::reading::Reading;
use crate::trajectory::import::ColumnMap;
use crate::trajectory::{Layout, Preparation, Reconcile};
use clap::ValueEnum;
use std::path::{Path, PathBuf};

/// How measured files are read and prepared.
#[derive(Debug, Clone, clap::Args)]
#[command(next_help_heading = "Data")]
pub struct DataArgs {
    /// Layout: openacc, astazero-rebuilt, astazero-processed, ultra-av, pair [default: by the header]
    #[arg(long)]
    pub layout: Option<Layout>,
    #[arg(long, value_name = "NAME|FILE.toml", conflicts_with = "layout", help = columns_help())]
    pub columns: Option<String>,
    /// Trajectory id in a file with several, or several ids separated by commas
    #[arg(long, value_name = "ID")]
    pub trajectory: Option<String>,
    /// Number of the segment, as listed by `leadlag inspect` [default: the longest]
    #[arg(long, value_name = "K", value_parser = whole(1, u32::MAX), allow_negative_numbers = true)]
    pub segment: Option<u32>,
    /// First time to use, in the file's own seconds
    #[arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true)]
    pub from: Option<f64>,
    /// Last time to use, in the file's own seconds
    #[arg(long, value_name = "T", value_parser = finite, allow_negative_numbers = true)]
    pub to: Option<f64>,
    /// Interpolate missing samples over at most this many seconds; longer interruptions split the file
    #[arg(long, value_name = "S", default_value_t = 1.0, value_parser = real(Preparation::MAX_GAP_S, "s"),
          allow_negative_numbers = true)]
    pub max_gap: f64,
    /// Smooth as the paper's authors did: two Savitzky-Golay passes, 51 points, cubic
    #[arg(long)]
    pub smooth: bool,
    /// Resample to this time step, in seconds
    #[arg(long, value_name = "DT", value_parser = real(Preparation::RESAMPLE_S, "s"), allow_negative_numbers = true)]
    pub resample: Option<f64>,
    /// Correct faults of the data where possible
    #[arg(long)]
    pub correct: bool,
    /// Anchor of the spacing if the measured spacing and the speeds contradict each other
    #[arg(long, value_enum, default_value_t = ReconcileArg::Gap)]
    pub reconcile: ReconcileArg,
    /// The follower: a built-in vehicle or FILE#NAME [default: by its name in the file]
    #[arg(long, value_name = "NAME|FILE#NAME")]
    pub vehicle: Option<String>,
    /// Grade table: X,Y of a closed track, or position_m,sin_grade of an open road; or `level`
    #[arg(long, value_name = "FILE|level")]
    pub grade: Option<String>,
    /// Length of the preceding vehicle in m [default: from the file, else unknown]
    #[arg(long, value_name = "M", value_parser = real(Preparation::LEAD_LENGTH_M, "m"), allow_negative_numbers = true)]
    pub lead_length: Option<f64>,
    /// Position of the preceding vehicle on the grade table at the first row of the file, in m
    #[arg(long, value_name = "M", value_parser = real(Preparation::LEAD_START_M, "m"), allow_negative_numbers = true)]
    pub lead_start: Option<f64>,
}

/// Help text of --columns.
pub fn columns_help() -> String {
    let shipped: Vec<&str> = ColumnMap::shipped().iter().map(|(name, _)| *name).collect();
    let shipped = shipped.join(", ");
    format!("Column map of a table of another layout: {shipped} (`leadlag list columns`), or your own file")
}

/// Anchor of the spacing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ReconcileArg {
    /// The measured spacing; the position of the preceding vehicle is derived from it
    Gap,
    /// The integrated speed difference, starting from the first measured spacing
    Speeds,
}

impl DataArgs {
    /// The same without flags.
    pub fn reading(&self) -> Reading {
        Reading {
            layout: self.layout,
            columns: self.columns.clone(),
            trajectory: self.trajectory.clone(),
            segment: self.segment,
            from: self.from,
            to: self.to,
            max_gap_s: self.max_gap,
            smooth: self.smooth,
            resample_s: self.resample,
            correct: self.correct,
            reconcile: match self.reconcile {
                ReconcileArg::Gap => Reconcile::Gap,
                ReconcileArg::Speeds => Reconcile::Speeds,
            },
            vehicle: self.vehicle.clone(),
            grade: self.grade.clone(),
            lead_length_m: self.lead_length,
            lead_start_m: self.lead_start,
            measure: None,
        }
    }
}

/// The result of a calibration, by its file or by the folder of `calibrate`.
pub fn result_file(given: &Path) -> anyhow::Result<PathBuf> {
    let file = if given.is_dir() { given.join("result.json") } else { given.to_owned() };
    file.parent().map_or(Ok(()), settle)?;
    Ok(file)
}
