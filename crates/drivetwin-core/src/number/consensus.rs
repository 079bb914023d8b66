// SPDX-License-Identifier: MIT
//! Common decisions of several runs side by side. The first run that takes part decides for all. Runs for
//! which another answer holds are recorded: the result of the common action is invalid for them.

use std::cell::Cell;

thread_local! {
    /// Runs that take part, and those of them that part with the first, as bits.
    static CONSENSUS: Cell<(u32, u32)> = const { Cell::new((1, 0)) };
}

/// Do something for the runs `runs`, as bits, of which there is at least one. Returns also those for which
/// it would have gone otherwise.
pub fn with_consensus<R>(runs: u32, act: impl FnOnce() -> R) -> (R, u32) {
    debug_assert!(runs != 0, "nobody decides");
    let outer = CONSENSUS.replace((runs, 0));
    let result = act();
    let (_, diverged) = CONSENSUS.replace(outer);
    (result, diverged)
}

/// The run that decides.
pub(super) fn leader_lane() -> usize {
    CONSENSUS.get().0.trailing_zeros() as usize
}

/// Value of `predicate` for the run that decides. Runs with another value are recorded as diverged.
#[inline]
pub(super) fn branch<R: PartialEq>(predicate: impl Fn(usize) -> R) -> R {
    let (runs, mut diverged) = CONSENSUS.get();
    let answer = predicate(runs.trailing_zeros() as usize);
    let mut others = runs & runs.wrapping_sub(1);
    while others != 0 {
        let run = others.trailing_zeros();
        diverged |= u32::from(predicate(run as usize) != answer) << run;
        others &= others - 1;
    }
    CONSENSUS.set((runs, diverged));
    answer
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::number::{SimdVector, Values};

    #[test]
    fn the_first_that_takes_part_decides_and_those_that_disagree_are_named() {
        let values = SimdVector::<4>([-5.0, 1.0, -1.0, 2.0]);
        let (positive, diverged) = with_consensus(0b1110, || values.decide(|v| v > 0.0));
        assert!(positive);
        assert_eq!(diverged, 0b0100);
    }

    #[test]
    fn who_has_parted_once_is_not_forgotten_by_later_decisions() {
        let (one, other) =
            (SimdVector::<4>([1.0, 2.0, 1.0, 1.0]), SimdVector([3.0, 3.0, 3.0, 4.0]));
        let ((), diverged) = with_consensus(0b1111, || {
            one.decide(|v| v == 1.0);
            other.decide_with(one, |a, b| a > b);
            other.decide(|v| v == 3.0);
        });
        assert_eq!(diverged, 0b1010);
    }
}
