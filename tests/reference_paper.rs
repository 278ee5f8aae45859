//! Hand-worked numbers for each equation of the paper, Eqs. 1 to 16 and 18.
//!
//! The arithmetic is in the comments, worked from the printed equations and not from the code. The parts are private,
//! so every number is checked through a run of one or a few steps, which proves the time loop as well.

#![allow(clippy::excessive_precision, reason = "all digits that were worked by hand are shown")]
#![allow(clippy::approx_constant, reason = "a hand-worked sqrt(1/2) is checked as a number")]

mod common;

#[path = "reference_paper/bench.rs"]
mod bench;

#[path = "reference_paper/constraints.rs"]
mod constraints;
#[path = "reference_paper/controllers.rs"]
mod controllers;
#[path = "reference_paper/delay.rs"]
mod delay;
#[path = "reference_paper/dynamics.rs"]
mod dynamics;
#[path = "reference_paper/evaluator.rs"]
mod evaluator;
#[path = "reference_paper/failures.rs"]
mod failures;
#[path = "reference_paper/goodness_of_fit.rs"]
mod goodness_of_fit;
#[path = "reference_paper/lookups.rs"]
mod lookups;
#[path = "reference_paper/motion.rs"]
mod motion;
#[path = "reference_paper/prepared.rs"]
mod prepared;
#[path = "reference_paper/start.rs"]
mod start;
