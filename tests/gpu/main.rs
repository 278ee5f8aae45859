//! The evaluator on a GPU, in a separate program. Its tests lose devices, which evaluators of a process share, so no others run beside them.

#[path = "../common/mod.rs"]
mod common;

mod derivatives;
mod evaluator;
mod work;
