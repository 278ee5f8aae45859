//! Threads of this process. A forked process has none of its parent's threads, so waiting for the work of rayon's global pool or of a GPU's
//! driver never ends. Pools of processes fork by default on Linux up to Python 3.13.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The process of an object: the first that uses it. 0 before.
pub struct Home(AtomicU32);

/// Owner of the threads of rayon's global pool.
pub static POOL: Home = Home(AtomicU32::new(0));

/// Owner of the driver of a GPU.
pub static GPU: Home = Home(AtomicU32::new(0));

impl Home {
    /// True in a process that was forked from the owner; without an owner, this process becomes it.
    pub fn is_elsewhere(&self) -> bool {
        let process = std::process::id();
        match self.0.compare_exchange(0, process, Ordering::Relaxed, Ordering::Relaxed) {
            Ok(_) => false,
            Err(home) => home != process,
        }
    }
}

/// The pool of a forked process.
static OWN: Mutex<Option<(u32, Arc<ThreadPool>)>> = Mutex::new(None);

/// Runs the work where its parallel parts find threads: a forked process creates a pool for it.
pub fn with_threads<T: Send>(work: impl FnOnce() -> Result<T, leadlag::Error> + Send) -> Result<T, leadlag::Error> {
    if !POOL.is_elsewhere() {
        return work();
    }
    own_pool()?.install(work)
}

fn own_pool() -> Result<Arc<ThreadPool>, leadlag::Error> {
    let process = std::process::id();
    let mut own = OWN.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some((_, pool)) = own.as_ref().filter(|(of, _)| *of == process) {
        return Ok(Arc::clone(pool));
    }
    let pool = Arc::new(ThreadPoolBuilder::new().build().map_err(anyhow::Error::from)?);
    // After a second fork, the threads of the parent's pool do not exist here and cannot be stopped.
    std::mem::forget(own.replace((process, Arc::clone(&pool))));
    Ok(pool)
}
