//! Batches: many independent units of work, several at a time, whose results outlive an interruption.

mod journal;
mod workers;

pub use journal::{Entry, Journal, JournalError};
pub use workers::{NoThread, in_batches};
