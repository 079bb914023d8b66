// SPDX-License-Identifier: MIT
//! Work that is shared out among threads.

use std::sync::{Mutex, PoisonError};
use std::thread;

/// Do `work` to every item, on so many threads at most (0: as many as there are processors). The calling
/// one is among them: it stays where it runs, and the scheduler sees at once that the others belong
/// elsewhere, which it would take milliseconds to find out of threads that are woken.
pub(super) fn share_out<I>(threads: usize, items: I, work: impl Fn(I::Item) + Sync)
where
    I: ExactSizeIterator + Send,
{
    let others = number(threads).min(items.len()).saturating_sub(1);
    let items = Mutex::new(items);
    let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
    let take = || {
        while let Some(item) = next() {
            work(item);
        }
    };
    thread::scope(|scope| {
        for _ in 0..others {
            // Those that cannot be had are done without.
            let _ = thread::Builder::new().spawn_scoped(scope, take);
        }
        take();
    });
}

fn number(threads: usize) -> usize {
    if threads == 0 { thread::available_parallelism().map_or(1, usize::from) } else { threads }
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
