//! Many calibrations, some at a time: threads of which each works on its own share of the processors.

use rayon::ThreadPoolBuilder;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::Duration;

/// The longest time between two calls of `idle`.
const IDLE: Duration = Duration::from_millis(100);

/// The system does not let this process start a thread.
#[derive(Debug, thiserror::Error)]
#[error(
    "cannot start a thread for the calibrations: allow this process more threads or memory (`ulimit -u`, `ulimit -v`)"
)]
pub struct NoThread(#[source] Box<dyn std::error::Error + Send + Sync>);

/// Stops the other threads when this one panics.
struct OnPanic<'a>(&'a AtomicBool);

impl Drop for OnPanic<'_> {
    fn drop(&mut self) {
        self.0.fetch_or(std::thread::panicking(), Ordering::SeqCst);
    }
}

/// Does the batches of `next` in this many threads, until there are no more or `stop` is true. `work` gets a batch, and a function that is true at a
/// request to stop and after an error of another thread. The threads share those of this pool evenly: work that is parallel elsewhere is sequential
/// in them if there are as many. This thread calls `idle` about ten times a second, and after each batch. Returns the first error of `work`.
pub fn in_batches<B, E: From<NoThread> + Send>(
    count: usize,
    stop: &(dyn Fn() -> bool + Sync),
    next: &(dyn Fn() -> Option<B> + Sync),
    work: &(impl Fn(B, &(dyn Fn() -> bool + Sync)) -> Result<(), E> + Sync),
    idle: &mut dyn FnMut(),
) -> Result<(), E> {
    let own = (rayon::current_num_threads() / count.max(1)).max(1);
    let failed = AtomicBool::new(false);
    let stopped = || failed.load(Ordering::SeqCst) || stop();
    let all = |to_main: &Sender<()>| {
        while !stopped()
            && let Some(batch) = next()
        {
            work(batch, &stopped).inspect_err(|_| failed.store(true, Ordering::SeqCst))?;
            // The receiver lives as long as the threads.
            let _ = to_main.send(());
        }
        Ok(())
    };
    let alone = |to_main: &Sender<()>| -> Result<(), E> {
        let _panic = OnPanic(&failed);
        let pool = ThreadPoolBuilder::new().num_threads(own).use_current_thread().build();
        pool.map_err(|error| NoThread(error.into()))?.install(|| all(to_main))
    };
    let (to_main, told) = channel();
    std::thread::scope(|scope| {
        let (mut workers, mut refused) = (Vec::new(), None);
        for _ in 0..count {
            let (to_main, alone) = (to_main.clone(), &alone);
            match std::thread::Builder::new().spawn_scoped(scope, move || alone(&to_main)) {
                Ok(worker) => workers.push(worker),
                Err(error) => refused = Some(error),
            }
        }
        drop(to_main);
        // With fewer threads than requested it takes longer; the results are the same.
        if let Some(error) = refused.filter(|_| workers.is_empty()) {
            return Err(NoThread(error.into()).into());
        }
        // The channel closes when the last thread ends.
        while told.recv_timeout(IDLE) != Err(RecvTimeoutError::Disconnected) {
            idle();
        }
        workers
            .into_iter()
            .try_for_each(|worker| worker.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    #[test]
    fn each_batch_is_reported_and_an_error_stops_the_other_threads() {
        let (given, mut heard) = (AtomicUsize::new(0), 0);
        let next = || Some(given.fetch_add(1, Ordering::SeqCst)).filter(|batch| *batch < 20);
        let done = in_batches(3, &|| false, &next, &|_, _| Ok::<(), NoThread>(()), &mut || heard += 1);
        assert!(done.is_ok() && heard >= 20, "{heard}");
        // One fails; the others work until `stop`.
        let work = |batch: usize, stop: &(dyn Fn() -> bool + Sync)| {
            if batch == 2 {
                return Err(NoThread("there is none".into()));
            }
            while !stop() {
                std::thread::yield_now();
            }
            Ok(())
        };
        given.store(0, Ordering::SeqCst);
        let failed = in_batches(3, &|| false, &next, &work, &mut || {}).expect_err("of one thread");
        assert!(failed.to_string().contains("ulimit -u"));
        // One panics.
        let work = |batch: usize, stop: &(dyn Fn() -> bool + Sync)| {
            assert_ne!(batch, 2, "a panic of one thread");
            while !stop() {
                std::thread::yield_now();
            }
            Ok::<(), NoThread>(())
        };
        given.store(0, Ordering::SeqCst);
        let panics = || in_batches(3, &|| false, &next, &work, &mut || {});
        std::panic::catch_unwind(std::panic::AssertUnwindSafe(panics)).expect_err("the panic of a thread");
        given.store(0, Ordering::SeqCst);
        in_batches(3, &|| true, &next, &work, &mut || {}).expect("no batch is taken");
        assert_eq!(given.load(Ordering::SeqCst), 0);
    }
}
