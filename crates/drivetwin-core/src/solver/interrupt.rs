// SPDX-License-Identifier: MIT
//! Interruption of runs from outside: a question that runs ask now and then.
//!
//! The question is asked on the thread that called [`with_interrupt`] only. Threads that help it see the
//! answer in the same token.

use std::cell::{Cell, RefCell};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Time between two questions: short against the 0.2 s after which a run must have ended.
const PERIOD: Duration = Duration::from_millis(20);
/// Calls of [`is_interrupted`] between two looks at the clock.
const CALLS: u32 = 8;

/// Token shared by the threads of one call.
#[derive(Clone, Debug, Default)]
pub(crate) struct Token(Option<Arc<AtomicBool>>);

impl Token {
    fn is_raised(&self) -> bool {
        self.0.as_ref().is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}

/// Question of the calling thread.
#[derive(Clone, Copy)]
struct Question {
    ask: fn() -> bool,
    last: Instant,
}

thread_local! {
    static TOKEN: RefCell<Token> = const { RefCell::new(Token(None)) };
    static QUESTION: Cell<Option<Question>> = const { Cell::new(None) };
    static CALLED: Cell<u32> = const { Cell::new(0) };
}

/// Work during which runs ask `ask` whether they are to end; they then end with status `interrupted`.
pub fn with_interrupt<R>(ask: fn() -> bool, work: impl FnOnce() -> R) -> R {
    let token = Token(Some(Arc::new(AtomicBool::new(false))));
    let before = QUESTION.replace(Some(Question { ask, last: Instant::now() }));
    let reset = Reset(before);
    let result = with_token(&token, work);
    drop(reset);
    result
}

/// Question before a call, set again at its end even where it panics.
struct Reset(Option<Question>);

impl Drop for Reset {
    fn drop(&mut self) {
        QUESTION.set(self.0);
    }
}

/// Token of this thread, for threads that help it.
pub(crate) fn token() -> Token {
    TOKEN.with_borrow(Clone::clone)
}

/// Work under the token of another thread.
pub(crate) fn with_token<R>(token: &Token, work: impl FnOnce() -> R) -> R {
    struct Restore(Token);
    impl Drop for Restore {
        fn drop(&mut self) {
            TOKEN.set(std::mem::take(&mut self.0));
        }
    }
    let _restore = Restore(TOKEN.replace(token.clone()));
    work()
}

/// Return true if the runs of this thread are to end; cheap enough for every step.
pub(crate) fn is_interrupted() -> bool {
    let calls = CALLED.get().wrapping_add(1);
    CALLED.set(calls);
    if calls.is_multiple_of(CALLS) { asks() } else { TOKEN.with_borrow(Token::is_raised) }
}

/// Ask now, where the last question is old enough.
pub(crate) fn asks() -> bool {
    TOKEN.with_borrow(|token| {
        let Some(flag) = &token.0 else { return false };
        if let Some(Question { ask, last }) = QUESTION.get()
            && !token.is_raised()
            && last.elapsed() >= PERIOD
        {
            QUESTION.set(Some(Question { ask, last: Instant::now() }));
            if ask() {
                flag.store(true, Ordering::Relaxed);
            }
        }
        token.is_raised()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_question_is_asked_within_its_call_only() {
        assert!(!asks());
        let asked = || {
            std::thread::sleep(2 * PERIOD);
            (0..CALLS).any(|_| is_interrupted())
        };
        assert!(with_interrupt(|| true, || asked() && is_interrupted()));
        assert!(!with_interrupt(|| false, asked));
        assert!(!asked());
    }

    #[test]
    fn threads_that_help_see_the_answer_and_do_not_ask() {
        with_interrupt(
            || true,
            || {
                let token = token();
                let helper = || with_token(&token, asks);
                assert!(!std::thread::scope(|scope| scope.spawn(helper).join().unwrap()));
                std::thread::sleep(2 * PERIOD);
                assert!(asks());
                assert!(std::thread::scope(|scope| scope.spawn(helper).join().unwrap()));
            },
        );
    }
}
