//! Block programs over populations: `simd` runs instructions over rows of lanes, [`time_loop`] is the time loop of shaders/kernel.wgsl
//! around it, [`core`] spreads the blocks over threads.

mod binary;
pub mod core;
pub mod exponential;
pub mod operation;
mod plan;
pub mod power;
pub mod power_f64;
pub mod products;
pub mod real;
mod rows;
pub mod simd;
pub mod stream;
pub mod sums;
mod tables;
pub mod time_loop;
