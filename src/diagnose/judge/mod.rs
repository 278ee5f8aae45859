//! Whether a cause counts as found.

pub mod decide;
pub mod fate;
pub mod gate;
pub mod oracle;
