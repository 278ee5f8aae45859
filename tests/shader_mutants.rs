//! Are the proofs of the shaders sharp? Every constant, operator, comparison, minimum, maximum, selection and sign of the files in
//! `shaders/` is changed, one at a time, and the comparison with the reference must fail each time. What survives is listed
//! below, with the reason.
//!
//! Shaders are texts that are composed at run time, so nothing is compiled again. `target/tmp/shader_mutants.csv` lists
//! every mutant and what became of it.

#[path = "shader_mutants/text.rs"]
mod text;
