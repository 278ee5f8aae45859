//! The texts in WGSL of the models and kernels of leadlag.

/// Path, from `shaders/` on, and text of every file, sorted by path.
static FILES: &[(&str, &str)] = &include!(concat!(env!("OUT_DIR"), "/files.rs"));

/// Path and text of the file with this path, such as `shaders/law/helly.wgsl`.
#[must_use]
pub fn file(path: &str) -> Option<(&'static str, &'static str)> {
    FILES.binary_search_by_key(&path, |(path, _)| path).ok().map(|at| FILES[at])
}
