// SPDX-License-Identifier: MIT
//! Chosen outputs of several runs side by side.

use super::output::Target;
use super::trajectory::{Column, Entry, output_terms, value};
use crate::network::Network;
use crate::number::{FOUR, KernelFloat, Number, transpose};
use crate::solver::{
    BLOCK, HybridState, Inputs, Kernel, LANES, LaneSink, Lanes, NO_POINT, SampleBlock, Samples,
    dispatch_simd,
};
use smallvec::SmallVec;

/// Points of a grid at the knots of the inputs.
#[derive(Clone, Copy)]
pub(super) struct GridPoints<'p> {
    /// Point of the grid at every knot, or [`NO_POINT`].
    pub at_knots: &'p [usize],
    /// Number of points.
    pub count: usize,
}

/// Fills columns while runs advance, each at its own samples.
pub(super) struct Recorder<'p, 'v> {
    /// Inputs of every run.
    inputs: [&'p Inputs<f64>; LANES],
    /// Points of the grid at the knots.
    points: GridPoints<'p>,
    columns: Vec<Column<Lanes>>,
    /// Of every run, outputs × points.
    values: Vec<&'v mut [f64]>,
    /// Working space: the basis at an instant, and one output over a block of samples, of every run.
    basis: Vec<Lanes>,
    block: OutputBlock,
}

impl<'p, 'v> Recorder<'p, 'v> {
    /// Columns of a network, to be filled into `values`, outputs × points of every run.
    pub fn new(
        network: &Network<Lanes>,
        targets: &[Target],
        inputs: [&'p Inputs<f64>; LANES],
        points: GridPoints<'p>,
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
        dispatch_simd(BlockWriter { recorder: self, state, active, samples, stretch });
    }

    fn write_sample(
        &mut self,
        state: &HybridState<'_, Lanes>,
        runs: u32,
        knots: &[usize; LANES],
        h: Lanes,
    ) {
        state.expansion.basis_at(state.network, h, &mut self.basis);
        let GridPoints { at_knots: points, count } = self.points;
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
struct BlockWriter<'r, 'p, 'v, 'a> {
    recorder: &'r mut Recorder<'p, 'v>,
    state: &'r HybridState<'a, Lanes>,
    active: &'r [usize],
    samples: Samples<'r, Lanes>,
    stretch: &'r SampleBlock,
}

impl Kernel for BlockWriter<'_, '_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<const F: bool>(self) {
        let Self { recorder, state, active, samples, stretch } = self;
        let Recorder { inputs, points, columns, values, block, .. } = recorder;
        let per_output = points.count;
        let points = &points.at_knots[stretch.first..][..stretch.count];
        if points.iter().all(|&point| point == NO_POINT) {
            return;
        }
        for (output, column) in columns.iter().enumerate() {
            let terms = &*output_terms(column, state);
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
                |at| sum_terms(&sum, at),
                block,
                stretch.count,
            );
            for (run, values) in values.iter_mut().enumerate() {
                let (from, to) = stretch.spans[run];
                let values = &mut values[output * per_output..][..per_output];
                scatter_to_grid(&block[run % LANES][from..to], &points[from..to], values);
            }
        }
    }
}

/// One output over a block of samples, of every run.
type OutputBlock = [[f64; BLOCK + FOUR]; LANES];

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
            let at = |knot| Lanes::from_lanes(|run| inputs[run].knot_value(knot, i));
            let mut values: Vec<Lanes> = (first..first + count).map(at).collect();
            values.resize(fours, Lanes::zero_());
            Some(values)
        }
        Entry::One => Some(vec![Lanes::splat(1.0); fours]),
        Entry::Nothing => Some(vec![Lanes::zero_(); fours]),
    }
}

/// Sum of terms at four samples.
#[inline(always)]
fn sum_terms(terms: &Terms<'_>, at: usize) -> [Lanes; FOUR] {
    let Some((&(samples, factor), others)) = terms.split_first() else {
        return [Lanes::zero_(); FOUR];
    };
    let mut sums = *read_four(samples, at);
    for sum in &mut sums {
        *sum *= factor;
    }
    for &(samples, factor) in others {
        for (sum, &sample) in sums.iter_mut().zip(read_four(samples, at)) {
            *sum += sample * factor;
        }
    }
    sums
}

#[inline(always)]
fn read_four(samples: &[Lanes], at: usize) -> &[Lanes; FOUR] {
    samples[at..].first_chunk().expect("entries in whole fours")
}

/// Give one run its values at the points of the grid.
#[inline(always)]
fn scatter_to_grid(samples: &[f64], points: &[usize], values: &mut [f64]) {
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
