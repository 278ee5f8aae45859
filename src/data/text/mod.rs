//! Foreign text: read to a limit, shown harmlessly, and compared with known words.

pub mod bounded;
pub mod shown;
pub mod spelling;
