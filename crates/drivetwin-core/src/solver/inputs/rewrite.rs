// SPDX-License-Identifier: MIT
//! Inputs that are known for a part of the run only, and rewritten for the next.

use super::{Inputs, equal_lengths, extremes};

impl Inputs<f64> {
    /// Inputs over a part of the knots of `whole`, at first all zero, with its usual lengths of segments.
    pub fn part_of(whole: &Self, first: usize, last: usize) -> Self {
        let width = whole.width();
        let knots = whole.knots[first..=last].to_vec();
        let lines = vec![[0.0; 2]; (last - first) * width];
        let mut part = Self::of_lines(knots, lines, whole.shifts.clone(), whole.sines.clone());
        part.usual.copy_from_slice(&whole.usual[first..last]);
        part
    }

    /// Replace the knots by those of `whole` from `first` to `last`, and the lines by those through `values`,
    /// knots × inputs.
    pub fn rewrite(&mut self, whole: &Self, first: usize, last: usize, values: &[f64]) {
        let width = self.width();
        self.knots.clear();
        self.knots.extend_from_slice(&whole.knots[first..=last]);
        self.usual.clear();
        self.usual.extend_from_slice(&whole.usual[first..last]);
        self.lines.clear();
        for (i, span) in self.knots.windows(2).enumerate() {
            let at = |knot: usize, input: usize| values[knot * width + input];
            let length = span[1] - span[0];
            let line = |input| [at(i, input), (at(i + 1, input) - at(i, input)) / length];
            self.lines.extend((0..width).map(line));
        }
        self.equal = equal_lengths(&self.knots);
        self.extremes = extremes(&self.knots, &self.lines, width);
    }
}
