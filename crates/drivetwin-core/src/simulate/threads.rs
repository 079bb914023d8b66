// SPDX-License-Identifier: MIT
//! Work that is shared out among threads.

use crate::solver::{asks, token, with_token};
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::sync::{Arc, Condvar, Mutex, PoisonError, TryLockError};
use std::time::Duration;
use std::{process, thread};

/// Threads that wait for the next work, with the memory that they have come to.
struct Helpers {
    /// A process forked off another has the threads of that no longer.
    process: u32,
    count: usize,
    pool: Arc<ThreadPool>,
}

static HELPERS: Mutex<Vec<Helpers>> = Mutex::new(Vec::new());

/// Do `work` to every item, or to fewer where the call is interrupted, on so many threads at most (0: as many as there are processors). The calling
/// one is among them: it stays where it runs, and the scheduler sees at once that the others belong
/// elsewhere, which it would take milliseconds to find out of threads that are all woken.
pub(super) fn share_out<I>(threads: usize, items: I, work: impl Fn(I::Item) + Sync)
where
    I: ExactSizeIterator + Send,
{
    let threads = number(threads);
    let others = threads.min(items.len()).saturating_sub(1);
    let (items, token) = (Mutex::new(items), token());
    let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
    let take = || {
        while !asks()
            && let Some(item) = next()
        {
            work(item);
        }
    };
    // Helpers that cannot be had are done without.
    match (others > 0).then(|| helpers(threads - 1)).flatten() {
        Some(pool) => pool.in_place_scope(|scope| {
            let helping = Helping::new(others);
            for _ in 0..others {
                let end = helping.start();
                let (take, token) = (&take, &token);
                scope.spawn(move |_| {
                    let _end = end;
                    with_token(token, take);
                });
            }
            take();
            helping.wait();
        }),
        None => take(),
    }
}

/// Number of helpers that are at work.
#[derive(Clone)]
struct Helping(Arc<(Mutex<usize>, Condvar)>);

impl Helping {
    fn new(count: usize) -> Self {
        Self(Arc::new((Mutex::new(count), Condvar::new())))
    }

    /// Give a helper what ends its work when it is dropped, also by a panic.
    fn start(&self) -> HelperEnd {
        HelperEnd(self.clone())
    }

    /// Wait until all helpers have ended, and ask meanwhile whether they are to.
    fn wait(&self) {
        let (count, ended) = &*self.0;
        let mut left = count.lock().unwrap_or_else(PoisonError::into_inner);
        while *left > 0 {
            left = ended.wait_timeout(left, WAIT).unwrap_or_else(PoisonError::into_inner).0;
            asks();
        }
    }
}

/// End of the work of a helper.
struct HelperEnd(Helping);

impl Drop for HelperEnd {
    fn drop(&mut self) {
        let (count, ended) = &*self.0.0;
        *count.lock().unwrap_or_else(PoisonError::into_inner) -= 1;
        ended.notify_all();
    }
}

/// Time between two questions while others work.
const WAIT: Duration = Duration::from_millis(20);

fn number(threads: usize) -> usize {
    if threads == 0 { thread::available_parallelism().map_or(1, usize::from) } else { threads }
}

/// So many threads, of old or new. Those of another process stay in the list: to end them would mean to wait
/// for them. Nor is the list waited for: another thread may have had it when it forked this process off.
fn helpers(count: usize) -> Option<Arc<ThreadPool>> {
    let new = || ThreadPoolBuilder::new().num_threads(count).build().ok().map(Arc::new);
    let mut all = match HELPERS.try_lock() {
        Ok(all) => all,
        Err(TryLockError::Poisoned(fault)) => fault.into_inner(),
        Err(TryLockError::WouldBlock) => return new(),
    };
    let process = process::id();
    if let Some(one) = all.iter().find(|one| (one.process, one.count) == (process, count)) {
        return Some(one.pool.clone());
    }
    let pool = new()?;
    all.push(Helpers { process, count, pool: pool.clone() });
    Some(pool)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;
    use std::sync::Barrier;

    #[test]
    fn every_item_is_done_once() {
        for threads in 0..5 {
            let mut items = [0; 100];
            share_out(threads, items.iter_mut(), |item| *item += 1);
            assert_eq!(items, [1; 100]);
        }
        share_out(3, std::iter::empty(), |(): ()| unreachable!("nothing to do"));
    }

    #[test]
    fn a_list_that_is_never_given_back_is_done_without() {
        let _kept = HELPERS.lock().unwrap_or_else(PoisonError::into_inner);
        let mut items = [0; 100];
        share_out(3, items.iter_mut(), |item| *item += 1);
        assert_eq!(items, [1; 100]);
    }

    #[test]
    fn threads_are_as_many_as_asked_for_and_one_of_them_is_the_calling_one() {
        let (together, seen) = (Barrier::new(3), Mutex::new(HashSet::new()));
        share_out(3, 0..3, |_| {
            together.wait();
            seen.lock().unwrap().insert(thread::current().id());
        });
        let seen = seen.into_inner().unwrap();
        assert_eq!(seen.len(), 3);
        assert!(seen.contains(&thread::current().id()));
    }
}
