//! Studies: many trajectories x variants x goodness-of-fit functions x replicates, each winner validated on other trajectories.
//!
//! ```text
//!  plan.toml --Plan--> Drives, tasks.jsonl        one task = one calibration with its validation runs
//!  task --compute--> parts/ID.json                written once, whole or not at all, by any number of processes
//!  parts --merge--> tables                        a pure function of the parts
//! ```
//!
//! Only finished parts count. A task's id is a hash of all inputs of its result, so that a part is valid wherever it was computed, and the
//! merged bytes do not depend on processes, times, order or interruptions. `docs/STUDY.md` describes files and columns.

mod claim;
mod compute;
pub mod drive;
mod error;
mod fingerprint;
pub mod folder;
pub mod inventory;
mod log;
pub mod merge;
pub mod outcome;
pub mod paper;
pub mod part;
pub mod plan;
mod run;
mod several;
pub mod table;
mod task;
mod verify;

pub use claim::{count as claimed, locks};
pub use error::{DriveError, StudyError};
pub(crate) use fingerprint::fingerprint;
pub use log::{PastRuns, Progress, past_runs};
pub use plan::{Plan, PlanError};
pub use run::{Assignment, Event, RunSettings, Summary, run};
pub use task::{NotAShard, Shard, Study, Task, chosen};
pub use verify::{Verified, drawn, verify};

use crate::calibrate::PROGRAM;

/// Version of the tables, parts and tasks; raise it when a column or its meaning changes.
pub const SCHEMA_VERSION: u32 = 1;

/// SHA-256 of bytes, in lower-case hexadecimal.
fn sha256(bytes: &[u8]) -> String {
    use sha2::{Digest, Sha256};
    crate::trajectory::hexadecimal(&Sha256::digest(bytes))
}
