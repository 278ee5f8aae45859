//! The program as its users start it.

#[path = "../common/mod.rs"]
mod common;

mod bench;
mod bench_optimizers;
mod cli;
mod cli_mistakes;
mod cli_verbs;
mod cli_warnings;
mod doctor;
mod fleet;
mod fleet_faults;
mod fleet_use;
mod hostile;
mod killed;
mod library;
mod one_driver;
mod own_law;
mod own_parameters;
mod pairs_of_features;
mod report;
mod sumo;
mod what_people_have;
