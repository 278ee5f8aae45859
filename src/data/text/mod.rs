//! Text of others: read to a limit, shown so that it does no harm, and compared with the words that are known.

pub mod bounded;
pub mod shown;
pub mod spelling;
