//! Many calibrations, some at a time: threads of which each works on its own share of the processors.

use rayon::ThreadPoolBuilder;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;

/// The longest time between two calls of `idle`.
const IDLE: Duration = Duration::from_millis(100);

/// The system does not let this process start a thread.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot start a thread for the calibrations: allow this process more threads or memory (`ulimit -u`, `ulimit -v`)"
)]
pub struct NoThread(#[source] Box<dyn std::error::Error + Send + Sync>);

/// Does `work` in this many threads until all have ended. They share the threads of this pool evenly: work that is parallel elsewhere is
/// sequential in them if there are as many. Meanwhile this thread calls `idle`.
///
/// # Errors
/// The first error of `work`, which has to end the other threads itself; [`NoThread`] if no thread can be started.
pub fn side_by_side<E: From<NoThread> + Send>(
    count: usize,
    work: &(dyn Fn() -> Result<(), E> + Sync),
    idle: &mut dyn FnMut(),
) -> Result<(), E> {
    let own = (rayon::current_num_threads() / count.max(1)).max(1);
    let alone = || -> Result<(), E> {
        let pool = ThreadPoolBuilder::new().num_threads(own).use_current_thread().build();
        pool.map_err(|error| NoThread(error.into()))?.install(work)
    };
    let (busy, ended) = channel::<()>();
    std::thread::scope(|scope| {
        let (mut workers, mut refused) = (Vec::new(), None);
        for _ in 0..count {
            let (busy, alone) = (busy.clone(), &alone);
            let worker = std::thread::Builder::new().spawn_scoped(scope, move || {
                let _busy = busy;
                alone()
            });
            match worker {
                Ok(worker) => workers.push(worker),
                Err(error) => refused = Some(error),
            }
        }
        drop(busy);
        // With fewer threads than requested it takes longer; the results are the same.
        if let Some(error) = refused.filter(|_| workers.is_empty()) {
            return Err(NoThread(error.into()).into());
        }
        while ended.recv_timeout(IDLE) == Err(RecvTimeoutError::Timeout) {
            idle();
        }
        workers
            .into_iter()
            .try_for_each(|worker| worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })
}
