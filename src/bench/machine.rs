//! The machine of the measurement.

use crate::text::shown::counted;
use std::fmt;

/// The machine in words, and its load.
#[derive(Debug, Clone, PartialEq)]
pub struct Machine {
    /// The processor as the system names it, or its architecture.
    pub cpu: String,
    /// The widest vector instructions of the processor, if known.
    pub vectors: &'static str,
    /// Threads that work.
    pub threads: usize,
    /// Processes that were running or waiting in the last minute, if the system reports them.
    pub load: Option<f64>,
}

impl Machine {
    /// This machine, now.
    pub fn here() -> Machine {
        let cpuinfo = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
        let model = cpuinfo.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
        let cpu = model.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned());
        let load = std::fs::read_to_string("/proc/loadavg").unwrap_or_default();
        let load = load.split_whitespace().next().and_then(|first| first.parse().ok());
        Machine { cpu, vectors: vectors(), threads: rayon::current_num_threads(), load }
    }
}

#[cfg(target_arch = "x86_64")]
fn vectors() -> &'static str {
    if std::is_x86_feature_detected!("avx512f") {
        "AVX-512"
    } else if std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma") {
        "AVX2"
    } else {
        "SSE2"
    }
}

#[cfg(not(target_arch = "x86_64"))]
fn vectors() -> &'static str {
    "baseline vectors"
}

impl fmt::Display for Machine {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let threads = counted(self.threads, "thread");
        write!(f, "{}, {}, {threads}, {}", self.cpu, self.vectors, std::env::consts::OS)
    }
}
