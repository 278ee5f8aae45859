//! Which state of the diagnosis a result is of.

use std::sync::LazyLock;

/// State of the diagnosis. To be raised whenever a diagnosis of the same data may end otherwise: with another name, another number,
/// after another search. Journals hold it, so that results of two states never stand side by side as
/// if they were of one. What came before 2 wrote none down.
pub const DIAGNOSIS_REVISION: u32 = 27;

/// Program, version and state of the diagnosis, `leadlag 0.1.0+diagnosis2`.
pub static PROGRAM: LazyLock<String> =
    LazyLock::new(|| format!("leadlag {}+diagnosis{DIAGNOSIS_REVISION}", env!("CARGO_PKG_VERSION")));
