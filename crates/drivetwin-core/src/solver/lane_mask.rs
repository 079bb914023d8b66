// SPDX-License-Identifier: MIT
//! Sets of lanes as bit masks.

/// Collect answers by lane into a bit mask.
pub fn lane_mask(answers: impl Iterator<Item = bool>) -> u32 {
    answers.enumerate().fold(0, |mask, (run, answer)| mask | u32::from(answer) << run)
}

/// Iterate over the lanes of a mask.
pub(crate) fn lanes_in(mut runs: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let run = (runs != 0).then(|| runs.trailing_zeros() as usize);
        runs &= runs.wrapping_sub(1);
        run
    })
}
