//! The evaluator on a GPU by itself. Its tests lose devices, which evaluators of a process share, so no others run beside them.

#[path = "../common/mod.rs"]
mod common;

mod evaluator;
mod work;
