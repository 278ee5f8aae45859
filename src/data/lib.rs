//! Measured trajectories: import, checks, preparation; vehicles; statistics, words and files that every layer needs.
//!
//! Part of leadlag. Its interface may change with any version; depend on `leadlag`.

pub mod fourier;
pub mod numbers;
pub mod statistics;
pub mod text;
pub mod trajectory;
pub mod vehicle;
pub mod whole;
