// SPDX-License-Identifier: MIT
//! The threads that batches run on.

use rayon::{ThreadPool, ThreadPoolBuilder};
use std::process;
use std::sync::{Arc, Mutex, PoisonError};

/// Threads that wait for the next batch.
struct Kept {
    /// A process forked off another has the threads of that no longer.
    process: u32,
    asked: usize,
    pool: Arc<ThreadPool>,
}

/// New threads begin on the processor of the one that starts them, and it takes the scheduler some of the
/// milliseconds that a batch needs to tell them apart. So those of the last batch are kept.
static KEPT: Mutex<Option<Kept>> = Mutex::new(None);

/// Do `work` on so many threads (0: as many as there are processors), or on those that are common to the
/// process where no others can be had.
pub(super) fn on_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    match pool(threads) {
        Some(pool) => pool.install(work),
        None => work(),
    }
}

fn pool(asked: usize) -> Option<Arc<ThreadPool>> {
    let process = process::id();
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(kept) = kept.as_ref().filter(|kept| (kept.process, kept.asked) == (process, asked))
    {
        return Some(kept.pool.clone());
    }
    let pool = Arc::new(ThreadPoolBuilder::new().num_threads(asked).build().ok()?);
    let before = kept.replace(Kept { process, asked, pool: pool.clone() });
    // To end threads that exist in another process only would mean to wait for their locks.
    std::mem::forget(before.filter(|before| before.process != process));
    Some(pool)
}
