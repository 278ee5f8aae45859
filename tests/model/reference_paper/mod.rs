//! Hand-worked numbers for each equation of the paper, Eqs. 1 to 16 and 18.
//!
//! The comments show the arithmetic, worked from the printed equations and not from the code. The parts are private, so every number is
//! checked through a run of one or a few steps, which tests the time loop as well.

#![allow(clippy::excessive_precision, reason = "all digits that were worked by hand are shown")]
#![allow(clippy::approx_constant, reason = "a hand-worked sqrt(1/2) is checked as a number")]

mod bench;

mod constraints;
mod controllers;
mod delay;
mod dynamics;
mod evaluator;
mod failures;
mod goodness_of_fit;
mod lookups;
mod motion;
mod prepared;
mod start;
