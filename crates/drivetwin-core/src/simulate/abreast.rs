// SPDX-License-Identifier: MIT
//! Chosen outputs of several runs side by side.

use super::trajectory::{Column, Entry, Target, passing_terms, value};
use crate::network::Network;
use crate::number::{FOUR, Lane, Number, transpose};
use crate::solver::{
    BLOCK, HybridState, Inputs, Kernel, LANES, LaneSink, Lanes, NO_POINT, SampleBlock, Samples,
    dispatch_simd,
};
use smallvec::SmallVec;

/// Fills columns while runs advance, each at its own samples.
pub(super) struct Recorder<'p, 'v> {
    /// Inputs of every run.
    inputs: [&'p Inputs<f64>; LANES],
    /// Point of the grid at every knot, or [`NO_POINT`]; number of points.
    points: (&'p [usize], usize),
    columns: Vec<Column<Lanes>>,
    /// Of every run, outputs × points.
    values: Vec<&'v mut [f64]>,
    /// Working space: the basis at an instant, and one output over a block of samples, of every run.
    basis: Vec<Lanes>,
    block: Block,
}

impl<'p, 'v> Recorder<'p, 'v> {
    /// Columns of a network, to be filled into `values`, outputs × points of every run; with the point at
    /// every knot and their number.
    pub fn new(
        network: &Network<Lanes>,
        targets: &[Target],
        (inputs, points): ([&'p Inputs<f64>; LANES], (&'p [usize], usize)),
        values: Vec<&'v mut [f64]>,
    ) -> Self {
        let columns = targets.iter().map(|&target| Column::of(network, target)).collect();
        let (basis, block) = (Vec::new(), [[0.0; BLOCK + FOUR]; LANES]);
        Self { inputs, points, columns, values, basis, block }
    }
}

impl LaneSink for Recorder<'_, '_> {
    fn write_block(
        &mut self,
        state: &HybridState<'_, Lanes>,
        active: &[usize],
        samples: Samples<'_, Lanes>,
        stretch: &SampleBlock,
    ) {
        dispatch_simd(Passed { recorder: self, state, active, samples, stretch });
    }

    fn write_sample(
        &mut self,
        state: &HybridState<'_, Lanes>,
        (runs, knots): (u32, &[usize; LANES]),
        h: Lanes,
    ) {
        state.expansion.basis_at(state.network, h, &mut self.basis);
        let (points, count) = self.points;
        for (output, column) in self.columns.iter().enumerate() {
            let now = value(column, state, &self.basis);
            for (run, values) in self.values.iter_mut().enumerate() {
                let point = points[knots[run % LANES]];
                if runs >> run & 1 == 1 && point != NO_POINT {
                    values[output * count + point] = now.0[run % LANES];
                }
            }
        }
    }
}

/// Samples to be added to the columns, with the widest instructions.
struct Passed<'r, 'p, 'v, 'a> {
    recorder: &'r mut Recorder<'p, 'v>,
    state: &'r HybridState<'a, Lanes>,
    active: &'r [usize],
    samples: Samples<'r, Lanes>,
    stretch: &'r SampleBlock,
}

impl Kernel for Passed<'_, '_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<const F: bool>(self) {
        let Self { recorder, state, active, samples, stretch } = self;
        let Recorder { inputs, points, columns, values, block, .. } = recorder;
        let (points, per_output) = (&points.0[stretch.first..][..stretch.count], points.1);
        if points.iter().all(|&point| point == NO_POINT) {
            return;
        }
        for (output, column) in columns.iter().enumerate() {
            let terms = &*passing_terms(column, state);
            let entry = |position| Entry::at(position, state.network, active);
            let given: Vec<Vec<Lanes>> = terms
                .iter()
                .filter_map(|&(position, _)| other_entry(entry(position), inputs, stretch))
                .collect();
            let mut given = given.iter();
            let mut sum: Terms<'_> = SmallVec::new();
            for &(position, factor) in terms {
                let samples = match entry(position) {
                    Entry::State(i) => &samples.states[i],
                    Entry::Torque(slot) => &samples.torques[slot],
                    _ => &**given.next().expect("what is neither is given"),
                };
                sum.push((samples, factor));
            }
            transpose(
                #[inline(always)]
                |at| total(&sum, at),
                block,
                stretch.count,
            );
            for (run, values) in values.iter_mut().enumerate() {
                let (from, to) = stretch.spans[run];
                let values = &mut values[output * per_output..][..per_output];
                hand_out(&block[run % LANES][from..to], &points[from..to], values);
            }
        }
    }
}

/// One output over a block of samples, of every run.
type Block = [[f64; BLOCK + FOUR]; LANES];

/// Terms of an output: entries of the basis over samples, in whole fours, and their factors.
type Terms<'s> = SmallVec<[(&'s [Lanes], Lanes); 8]>;

/// An entry of the basis over a stretch, in whole fours, unless it is a state or a torque.
fn other_entry(
    entry: Entry,
    inputs: &[&Inputs<f64>; LANES],
    &SampleBlock { first, count, .. }: &SampleBlock,
) -> Option<Vec<Lanes>> {
    let fours = count.next_multiple_of(FOUR);
    match entry {
        Entry::State(_) | Entry::Torque(_) => None,
        Entry::Input(i) => {
            let at = |knot| Lanes::gathered(|run| inputs[run].knot_value(knot, i));
            let mut values: Vec<Lanes> = (first..first + count).map(at).collect();
            values.resize(fours, Lanes::zero_());
            Some(values)
        }
        Entry::One => Some(vec![Lanes::all(1.0); fours]),
        Entry::Nothing => Some(vec![Lanes::zero_(); fours]),
    }
}

/// Sum of terms at four samples.
#[inline(always)]
fn total(terms: &Terms<'_>, at: usize) -> [Lanes; FOUR] {
    let Some((&(samples, factor), others)) = terms.split_first() else {
        return [Lanes::zero_(); FOUR];
    };
    let mut sums = *four(samples, at);
    for sum in &mut sums {
        *sum *= factor;
    }
    for &(samples, factor) in others {
        for (sum, &sample) in sums.iter_mut().zip(four(samples, at)) {
            *sum += sample * factor;
        }
    }
    sums
}

#[inline(always)]
fn four(samples: &[Lanes], at: usize) -> &[Lanes; FOUR] {
    samples[at..].first_chunk().expect("entries in whole fours")
}

/// Give one run its values at the points of the grid.
#[inline(always)]
fn hand_out(samples: &[f64], points: &[usize], values: &mut [f64]) {
    let [Some(&first), Some(&last)] = [points.first(), points.last()] else { return };
    if first != NO_POINT && last != NO_POINT && last - first == points.len() - 1 {
        values[first..=last].copy_from_slice(samples);
        return;
    }
    for (&sample, &point) in samples.iter().zip(points) {
        if let Some(to) = values.get_mut(point) {
            *to = sample;
        }
    }
}
