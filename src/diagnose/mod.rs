//! From measured data to a named cause: is the data sound, what does the simulation get wrong, which cause explains it, what is gained.

pub mod data;
mod fourier;
