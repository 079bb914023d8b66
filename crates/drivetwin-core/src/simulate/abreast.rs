// SPDX-License-Identifier: MIT
//! Chosen outputs of several runs side by side.

use super::trajectory::{Column, Entry, Target, passing_terms, value};
use crate::network::Network;
use crate::number::{Lane, Number};
use crate::solve::{
    BLOCK, Inputs, Lanes, NO_POINT, Record, Regime, Samples, Stretch, Task, WIDTH, dispatch,
};
use std::borrow::Borrow;
use std::hint::black_box;

/// Fills columns while runs advance, each at its own samples.
pub(super) struct Recorder<'p, 'v> {
    /// Inputs of every run.
    inputs: [&'p Inputs<f64>; WIDTH],
    /// Point of the grid at every knot, or [`NO_POINT`]; number of points.
    points: (&'p [usize], usize),
    columns: Vec<Column<Lanes>>,
    /// Of every run, outputs × points.
    values: Vec<&'v mut [f64]>,
    /// Working space: the basis at an instant, and one output over a block of samples.
    basis: Vec<Lanes>,
    block: Vec<Lanes>,
}

impl<'p, 'v> Recorder<'p, 'v> {
    /// Columns of a network, to be filled into `values`, outputs × points of every run; with the point at
    /// every knot and their number.
    pub fn new(
        network: &Network<Lanes>,
        targets: &[Target],
        (inputs, points): ([&'p Inputs<f64>; WIDTH], (&'p [usize], usize)),
        values: Vec<&'v mut [f64]>,
    ) -> Self {
        let columns = targets.iter().map(|&target| Column::of(network, target)).collect();
        let (basis, block) = (Vec::new(), vec![Lanes::zero_(); BLOCK + 1]);
        Self { inputs, points, columns, values, basis, block }
    }
}

impl Record for Recorder<'_, '_> {
    fn passed(
        &mut self,
        regime: &Regime<'_, Lanes>,
        active: &[usize],
        samples: Samples<'_, Lanes>,
        stretch: &Stretch,
    ) {
        dispatch(Passed { recorder: self, regime, active, samples, stretch });
    }

    fn reached(
        &mut self,
        regime: &Regime<'_, Lanes>,
        (runs, knots): (u32, &[usize; WIDTH]),
        h: Lanes,
    ) {
        regime.expansion.basis_at(regime.network, h, &mut self.basis);
        let (points, count) = self.points;
        for (output, column) in self.columns.iter().enumerate() {
            let now = value(column, regime, &self.basis);
            for (run, values) in self.values.iter_mut().enumerate() {
                let point = points[knots[run % WIDTH]];
                if runs >> run & 1 == 1 && point != NO_POINT {
                    values[output * count + point] = now.0[run % WIDTH];
                }
            }
        }
    }
}

/// Samples to be added to the columns, with the widest instructions.
struct Passed<'r, 'p, 'v, 'a> {
    recorder: &'r mut Recorder<'p, 'v>,
    regime: &'r Regime<'a, Lanes>,
    active: &'r [usize],
    samples: Samples<'r, Lanes>,
    stretch: &'r Stretch,
}

impl Task for Passed<'_, '_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn run<const F: bool>(self) {
        let Self { recorder, regime, active, samples, stretch } = self;
        let Recorder { inputs, points: (points, per_output), columns, values, block, .. } =
            recorder;
        let numbers = stretch.first..stretch.first + stretch.count;
        let block = &mut block[..stretch.count];
        let points = &points[numbers.clone()];
        if points.iter().all(|&point| point == NO_POINT) {
            return;
        }
        for (output, column) in columns.iter().enumerate() {
            let mut begun = false;
            for &(position, factor) in &*passing_terms(column, regime) {
                let how = (factor, begun);
                match Entry::at(position, regime.network, active) {
                    Entry::State(i) => add(block, samples.states[i].iter(), how),
                    Entry::Input(i) => {
                        let at = |knot| Lanes::gathered(|run| inputs[run].at_knot(knot, i));
                        add(block, numbers.clone().map(at), how);
                    }
                    Entry::One => add(block, std::iter::repeat(Lanes::all(1.0)), how),
                    Entry::Torque(slot) => add(block, samples.torques[slot].iter(), how),
                    Entry::Nothing => add(block, std::iter::repeat(Lanes::zero_()), how),
                }
                begun = true;
            }
            if !begun {
                block.fill(Lanes::zero_());
            }
            for (run, values) in values.iter_mut().enumerate() {
                let (from, to) = stretch.spans[run];
                let values = &mut values[output * *per_output..][..*per_output];
                hand_out((&block[from..to], run), &points[from..to], values);
            }
        }
    }
}

/// Give one run its values at the points of the grid.
#[inline(always)]
fn hand_out((block, run): (&[Lanes], usize), points: &[usize], values: &mut [f64]) {
    let [Some(&first), Some(&last)] = [points.first(), points.last()] else { return };
    if first != NO_POINT && last != NO_POINT && last - first == points.len() - 1 {
        for (to, from) in values[first..=last].iter_mut().zip(block) {
            *to = from.0[run % WIDTH];
        }
        return;
    }
    for (from, &point) in block.iter().zip(points) {
        if let Some(to) = values.get_mut(point) {
            *to = from.0[run % WIDTH];
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
    // Hidden, the compiler does not take several samples at once, and gather what is a vector already.
    let pairs = block.iter_mut().zip(samples);
    if begun {
        pairs.for_each(|(sum, sample)| *sum += *black_box(sample.borrow()) * factor);
    } else {
        pairs.for_each(|(sum, sample)| *sum = *black_box(sample.borrow()) * factor);
    }
}
