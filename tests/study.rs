//! Studies: whatever happens to the processes that compute one, the merged bytes are those of an uninterrupted run.
//!
//! Everything runs on two synthetic platoons of a minute each, with the program itself.

#[path = "study/common.rs"]
mod common;
#[path = "study/disk.rs"]
mod disk;
#[path = "study/extend.rs"]
mod extend;
#[path = "study/front_end.rs"]
mod front_end;
#[path = "study/kill.rs"]
mod kill;
#[path = "study/parts.rs"]
mod parts;
#[path = "study/plans.rs"]
mod plans;
#[path = "study/progress.rs"]
mod progress;
#[path = "study/report.rs"]
mod report;
#[allow(dead_code, reason = "other tests use the rest")]
#[path = "common/sample.rs"]
mod sample;
#[path = "study/schema.rs"]
mod schema;
#[path = "study/shards.rs"]
mod shards;
#[path = "study/submit.rs"]
mod submit;
#[path = "study/verify.rs"]
mod verify;
