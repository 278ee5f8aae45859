//! The proofs that all evaluators are equal: the reference, lanes and the GPU, with each other and with the authors' program.

#[path = "../common/mod.rs"]
mod common;

mod causes;
mod extensions;
mod golden;
mod gpu_lanes;
mod lanes;
mod power;
mod scores;
mod wgsl_reference;
