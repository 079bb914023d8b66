// SPDX-License-Identifier: MIT
//! Sets of lanes as bit masks.

/// Runs for which the answer is yes, as bits.
pub fn lane_mask(answers: impl Iterator<Item = bool>) -> u32 {
    answers.enumerate().fold(0, |mask, (run, answer)| mask | u32::from(answer) << run)
}

/// Numbers of the runs in a set of bits.
pub(crate) fn lanes_in(mut runs: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let run = (runs != 0).then(|| runs.trailing_zeros() as usize);
        runs &= runs.wrapping_sub(1);
        run
    })
}
