//! The composed WGSL text on the CPU: naga's form of it becomes a straight-line program over blocks of candidates.
//!
//! `flatten` turns a text into that program, `simd` runs its instructions over a block, `run` is the time loop of
//! shaders/kernel.wgsl around it. No operation is fused or re-ordered, so that every instruction set gives the same bits.

mod power;

pub use power::power;
