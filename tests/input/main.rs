//! Files that are read: sound ones, broken ones, and what is said about them.

#[path = "../common/all_steps.rs"]
mod all_steps;
#[path = "../common/mod.rs"]
mod common;

mod bad_input;
mod bombs;
mod columns;
mod false_alarms;
mod faults;
mod importers;
mod mutated_files;
