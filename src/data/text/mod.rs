//! Untrusted text: read to a limit, displayed safely, and compared with known words.

pub mod bounded;
pub mod option;
pub mod shown;
pub mod spelling;
