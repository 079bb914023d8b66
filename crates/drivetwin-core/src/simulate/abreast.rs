// SPDX-License-Identifier: MIT
//! Chosen outputs of several runs side by side.

use super::trajectory::{Column, Entry, Target, passing_terms, value};
use crate::network::Network;
use crate::number::{Lane, Number};
use crate::solve::{BLOCK, Inputs, Lanes, Record, Regime, Samples, Task, WIDTH, dispatch};
use std::borrow::Borrow;

/// Fills columns while runs advance, each at its own samples.
pub(super) struct Recorder<'p> {
    /// Inputs of every run.
    inputs: [&'p Inputs<f64>; WIDTH],
    /// Point of the grid at every knot, [`NONE`] where there is none.
    points: Vec<usize>,
    columns: Vec<Column<Lanes>>,
    /// Outputs × points.
    values: Vec<Vec<Lanes>>,
    /// Working space: the basis at an instant, and one output over a block of samples.
    basis: Vec<Lanes>,
    block: Vec<Lanes>,
}

/// No point of the grid.
const NONE: usize = usize::MAX;

impl<'p> Recorder<'p> {
    /// Columns of a network, on a grid of which the points stand at `knots`.
    pub fn new(
        network: &Network<Lanes>,
        targets: &[Target],
        inputs: [&'p Inputs<f64>; WIDTH],
        knots: &[usize],
    ) -> Self {
        let mut points = vec![NONE; inputs[0].knots().len()];
        knots.iter().enumerate().for_each(|(point, &knot)| points[knot] = point);
        let columns = targets.iter().map(|&target| Column::of(network, target)).collect();
        let values = vec![vec![Lanes::zero_(); knots.len()]; targets.len()];
        let (basis, block) = (Vec::new(), vec![Lanes::zero_(); BLOCK + 1]);
        Self { inputs, points, columns, values, basis, block }
    }

    /// An output of one run.
    pub fn values(
        &self,
        output: usize,
        run: usize,
    ) -> impl DoubleEndedIterator<Item = f64> + ExactSizeIterator {
        self.values[output].iter().map(move |values| values.0[run % WIDTH])
    }
}

impl Record for Recorder<'_> {
    fn passed(
        &mut self,
        regime: &Regime<'_, Lanes>,
        active: &[usize],
        samples: &impl Samples<Lanes>,
        range: (usize, &[u32]),
    ) {
        dispatch(Passed { recorder: self, regime, active, samples, range });
    }

    fn reached(
        &mut self,
        regime: &Regime<'_, Lanes>,
        (runs, knots): (u32, &[usize; WIDTH]),
        h: Lanes,
    ) {
        regime.expansion.basis_at(regime.network, h, &mut self.basis);
        for (column, values) in self.columns.iter().zip(&mut self.values) {
            let now = value(column, regime, &self.basis);
            for run in (0..WIDTH).filter(|run| runs >> run & 1 == 1) {
                if let Some(to) = values.get_mut(self.points[knots[run]]) {
                    to.0[run] = now.0[run];
                }
            }
        }
    }
}

/// Samples to be added to the columns, with the widest instructions.
struct Passed<'r, 'p, 'a, S> {
    recorder: &'r mut Recorder<'p>,
    regime: &'r Regime<'a, Lanes>,
    active: &'r [usize],
    samples: &'r S,
    range: (usize, &'r [u32]),
}

impl<S: Samples<Lanes>> Task for Passed<'_, '_, '_, S> {
    type Output = ();

    #[inline(always)]
    fn run<const F: bool>(self) {
        let Self { recorder, regime, active, samples, range: (first, runs) } = self;
        let Recorder { inputs, points, columns, values, block, .. } = recorder;
        let block = &mut block[..runs.len()];
        let points = &points[first..first + runs.len()];
        for (column, values) in columns.iter().zip(values) {
            let mut begun = false;
            for &(position, factor) in &*passing_terms(column, regime) {
                match Entry::at(position, regime.network, active) {
                    Entry::State(i) => add(block, samples.states(i), (factor, begun)),
                    Entry::Input(i) => {
                        let at = |knot| Lanes::gathered(|run| inputs[run].at_knot(knot, i));
                        add(block, (first..first + runs.len()).map(at), (factor, begun));
                    }
                    Entry::One => add(block, std::iter::repeat(Lanes::all(1.0)), (factor, begun)),
                    Entry::Torque(slot) => add(block, samples.torques(slot), (factor, begun)),
                    Entry::Nothing => {
                        add(block, std::iter::repeat(Lanes::zero_()), (factor, begun));
                    }
                }
                begun = true;
            }
            if !begun {
                block.fill(Lanes::zero_());
            }
            for k in 0..block.len() {
                if let Some(to) = values.get_mut(points[k]) {
                    *to = to.with(runs[k], block[k]);
                }
            }
        }
    }
}

/// Add a multiple of samples to a block, or begin it with that.
#[inline(always)]
fn add(
    block: &mut [Lanes],
    samples: impl Iterator<Item: Borrow<Lanes>>,
    (factor, begun): (Lanes, bool),
) {
    for (sum, sample) in block.iter_mut().zip(samples) {
        let term = *sample.borrow() * factor;
        *sum = if begun { *sum + term } else { term };
    }
}
