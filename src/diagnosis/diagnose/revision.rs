//! The revision of the diagnosis that made a result.

use std::sync::LazyLock;

/// Revision of the diagnosis. Raise it whenever a diagnosis of the same data may change: another name, another number, another search.
/// Journals contain it, so that they never mix results of two revisions. Journals without a revision are older than 2.
pub const DIAGNOSIS_REVISION: u32 = 41;

/// Program, version and revision of the diagnosis, `leadlag 0.1.0+diagnosis2`.
pub static PROGRAM: LazyLock<String> =
    LazyLock::new(|| format!("leadlag {}+diagnosis{DIAGNOSIS_REVISION}", env!("CARGO_PKG_VERSION")));
