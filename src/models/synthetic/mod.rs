//! An independent truth: a platoon integrated with a fine step, and measured as a real one would be.
//!
//! A hilly closed road, a platoon leader on cruise control and followers with known parameters. Calibrations and diagnoses see the samples
//! only, and tests compare with the [`Truth`]. A follower may have [`Effect`]s that no base model has; [`at_amplitude`] chooses their size
//! by the change that they make.
//!
//! This folder is an independent transcription of the paper's continuous-time models. It shares no code with any evaluator and imports
//! nothing of this crate, so that a mistake in one does not hide in the other.
//!
//! ```
//! use leadlag_models::synthetic;
//!
//! let scenario = synthetic::Scenario { duration_s: 60.0, ..synthetic::Scenario::default() };
//! let drive = synthetic::run(&scenario)?;
//! assert_eq!((drive.v.len(), drive.gap.len(), drive.t.len()), (5, 4, 601));
//! let mut csv = Vec::new();
//! synthetic::write_openacc(&drive, &mut csv)?;
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod amplitude;
mod car;
mod controller;
mod default_cars;
mod drive;
mod effect;
mod error;
mod follower;
mod history;
mod integrate;
mod noise;
mod road;
mod sample;
mod scenario;
mod set_speed;
mod write;

pub use amplitude::at_amplitude;
pub use car::{CarTruth, Controller, Gusts, Lead, RoadLoad};
pub use default_cars::{Base, drawn};
pub use effect::{Effect, EffectError, EffectKind, EffectParameter};
pub use error::SyntheticError;
pub use noise::Noise;
pub use road::{GradeProfile, Road};
pub use sample::{Synthetic, run};
pub use scenario::{Scenario, Truth};
pub use set_speed::{Profile, Segment};
pub use write::{write_openacc, write_pair, write_slope};
