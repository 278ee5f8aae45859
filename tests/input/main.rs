//! Files that are read: sound ones, broken ones, and their messages.

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
