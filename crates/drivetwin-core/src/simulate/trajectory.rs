// SPDX-License-Identifier: MIT
//! Chosen outputs on a time grid.

use super::element_power::{ElementPower, GAUSS, element_energy, evaluate_terms, terms};
use super::energy_balance::EnergyAudit;
use super::output::Target;
use super::output_buffer::{OutputBlock, OutputBuffer, OutputMask};
use crate::model::Name;
use crate::network::linalg::is_zero;
use crate::network::nonlinear_torque::form;
use crate::network::{Mode, Network, RowId};
use crate::number::{Dual, Number, Real};
use crate::solver::{
    Event, FrictionState, HybridState, Integrator, Kernel, SampleRange, SampleSink, Samples,
    Status, Step, dispatch_simd,
};
use std::borrow::Cow;

impl Target {
    /// The target over the basis of a mode; `friction` gives the row of a friction torque. An angle counts
    /// as its rate. `None` for a quantity that is no linear form.
    pub(super) fn row(
        self,
        network: &Network<f64>,
        mode: &Mode<f64>,
        friction: impl Fn(usize) -> Vec<f64>,
    ) -> Option<Vec<f64>> {
        let mut row = vec![0.0; network.basis()];
        match Column::of(network, self) {
            Column::Linear(terms) => terms.iter().for_each(|&(position, c)| row[position] += c),
            Column::Friction(j) => row = friction(j),
            Column::Angle(rate, _) => row[..rate.len()].copy_from_slice(&rate),
            Column::Torque(element, node) => row = mode.port_torque(network, &element, node),
            Column::Acceleration(node) => row = mode.acceleration(network, &[(node, 1.0)]),
            _ => return None,
        }
        Some(row)
    }
}

/// A target of one network over its basis.
pub(super) enum Column<T> {
    /// Linear form over the basis: position and coefficient of its terms.
    Linear(Vec<(usize, T)>),
    /// Speed of a node over the basis, and the angle at the start of the present step.
    Angle(Vec<T>, T),
    /// Torque of a friction element.
    Friction(usize),
    /// Torque of an element on a node.
    Torque(Name, usize),
    /// Acceleration of a node that is no follower.
    Acceleration(usize),
    /// Rate of a linear form over states and inputs.
    Rate(Vec<T>),
    /// Power of an element.
    Power(ElementPower<T>),
    /// Integral of a power, and its value at the start of the present step.
    Work(ElementPower<T>, T),
    /// Energy that an element stores.
    Energy(Name),
}

/// Result of a run. Columns in the order of the outputs asked for, each as long as `time`; NaN
/// after a failure.
#[derive(Clone, Debug)]
pub struct Trajectory<T: Real> {
    /// Grid, s.
    pub time: Vec<f64>,
    /// One column per output.
    pub columns: Vec<Vec<f64>>,
    /// Derivatives of every column by the parameters, where numbers carry any.
    pub derivatives: Vec<Vec<T::Slopes>>,
    /// Names of the elements that events refer to.
    pub elements: Vec<String>,
    /// Events of friction elements.
    pub events: Vec<Event<T>>,
    /// Status at the end of the run.
    pub status: Status,
    /// Time [s] and element of the first event that only grazed its guard: no derivatives after it.
    pub grazing: Option<(f64, String)>,
    /// Energy balance, where asked for.
    pub audit: Option<EnergyAudit>,
}

impl<const P: usize> Trajectory<Dual<P>> {
    /// Split into the run without derivatives and the derivatives of its columns: time × parameters.
    pub fn split_derivatives(self) -> (Trajectory<f64>, Vec<Vec<f64>>) {
        let event = |e: &Event<Dual<P>>| {
            let Event { time, element, kind, energy } = *e;
            Event { time: time.re, element, kind, energy: energy.re }
        };
        let values = Trajectory {
            time: self.time,
            columns: self.columns,
            derivatives: Vec::new(),
            elements: self.elements,
            events: self.events.iter().map(event).collect(),
            status: self.status,
            grazing: self.grazing,
            audit: self.audit,
        };
        (values, self.derivatives.into_iter().map(Vec::into_flattened).collect())
    }
}

/// Fills columns while a run advances.
pub(super) struct Recorder<'g, T: Real> {
    grid: &'g [f64],
    next: usize,
    columns: Vec<Column<T>>,
    buffer: OutputBuffer<T>,
    /// Working space: the basis, at an instant and over a block of samples.
    basis: Vec<T>,
    block: OutputBlock<T>,
}

impl<'g, T: Real> Recorder<'g, T> {
    /// Columns of a network.
    pub fn new(network: &Network<T>, targets: &[Target], grid: &'g [f64]) -> Self {
        let columns = targets.iter().map(|&target| Column::of(network, target)).collect();
        let buffer = OutputBuffer::new(targets.len(), grid.len());
        let (basis, block) = (Vec::new(), OutputBlock::new());
        Self { grid, next: 0, columns, buffer, basis, block }
    }

    /// Record the grid points before the end of the step; `last` includes the end.
    pub fn sample(&mut self, run: &Integrator<'_, T>, step: &Step<T>, last: bool) {
        // The time reached, not the sum of start and length, which may miss the last point by round-off.
        let (start, end) = (step.start.re(), run.time().re());
        for column in &mut self.columns {
            if let Column::Power(power) | Column::Work(power, _) = column {
                power.enter_mode(&run.state);
            }
        }
        while let Some(&t) = self.grid.get(self.next) {
            if t > end || (t == end && !last) {
                break;
            }
            let h = if t >= start { -step.start + t } else { T::zero_() };
            let state = &run.state;
            let mut works = self.works(state, h).into_iter();
            state.expansion.basis_at(state.network, h, &mut self.basis);
            for (output, column) in self.columns.iter().enumerate() {
                let value = match column {
                    Column::Angle(row, angle) => *angle + integral(state, row, h),
                    Column::Work(_, work) => *work + works.next().unwrap_or(T::zero_()),
                    Column::Rate(row) => rate(state, row, h),
                    other => value(other, state, &self.basis),
                };
                self.buffer.push(output, value);
            }
            self.next += 1;
        }
        let mut works = self.works(&run.state, step.length).into_iter();
        for column in &mut self.columns {
            match column {
                Column::Angle(row, angle) => *angle += integral(&run.state, row, step.length),
                Column::Work(_, work) => *work += works.next().unwrap_or(T::zero_()),
                _ => {}
            }
        }
    }

    /// Integrals of the powers of all works over the first `h` seconds of the present step, J.
    fn works(&mut self, state: &HybridState<'_, T>, h: T) -> Vec<T> {
        let works = self.columns.iter().filter_map(|column| match column {
            Column::Work(power, _) => Some(power),
            _ => None,
        });
        let works: Vec<_> = works.collect();
        let mut sums = vec![T::zero_(); works.len()];
        if works.is_empty() {
            return sums;
        }
        for (node, weight) in GAUSS {
            state.expansion.basis_at(state.network, h * node, &mut self.basis);
            for (sum, power) in sums.iter_mut().zip(&works) {
                *sum += power.at(state, &self.basis) * h * weight;
            }
        }
        sums
    }

    /// Run to the end and record.
    pub fn run_to_end(&mut self, run: &mut Integrator<'_, T>) -> Result<(), Status> {
        self.run_to_end_with(run, |_, _| {})
    }

    /// Run to the end, record, and call `also` after every step of the expansion.
    pub fn run_to_end_with(
        &mut self,
        run: &mut Integrator<'_, T>,
        mut also: impl FnMut(&Integrator<'_, T>, &Step<T>),
    ) -> Result<(), Status> {
        while let Some(step) = run.advance(self)? {
            self.sample(run, &step, run.is_at_end());
            also(run, &step);
        }
        Ok(())
    }

    /// Refuse a run that has ended without a value at every point of the grid.
    pub fn check_complete(&self) -> Result<(), Status> {
        match self.grid.get(self.next) {
            Some(&time) => Err(Status::Unrecorded { time }),
            None => Ok(()),
        }
    }

    /// Columns at full length and their derivatives, as in [`Trajectory`].
    pub fn finish(self) -> (Vec<Vec<f64>>, Vec<Vec<T::Slopes>>) {
        self.buffer.finish()
    }
}

impl<T: Real> SampleSink<T> for Recorder<'_, T> {
    fn write_block(
        &mut self,
        run: &Integrator<'_, T>,
        active: &[usize],
        samples: Samples<'_, T>,
        range: SampleRange,
    ) {
        let SampleRange { first, count } = range;
        let knots = &run.knots()[first..first + count];
        let alike = self.grid.len() == run.knots().len() && self.grid.last() == run.knots().last();
        let mask = if alike && self.next == first {
            // The knots contain the grid: as many are the same.
            OutputMask::all(count)
        } else {
            OutputMask::of(&self.grid[self.next..], knots)
        };
        self.next += mask.count();
        let (columns, buffer, block) = (&self.columns[..], &mut self.buffer, &mut self.block);
        dispatch_simd(BlockWriter { columns, buffer, block, run, active, samples, mask, first });
    }
}

/// Samples to be added to the columns, with the widest instructions.
struct BlockWriter<'p, 'a, T: Real> {
    columns: &'p [Column<T>],
    buffer: &'p mut OutputBuffer<T>,
    block: &'p mut OutputBlock<T>,
    run: &'p Integrator<'a, T>,
    active: &'p [usize],
    samples: Samples<'p, T>,
    mask: OutputMask,
    first: usize,
}

impl<T: Real> Kernel for BlockWriter<'_, '_, T> {
    type Output = ();

    #[inline(always)]
    fn run<const F: bool>(mut self) {
        let count = self.mask.count();
        for (output, column) in self.columns.iter().enumerate() {
            let from = self.buffer.length(output);
            for &(position, factor) in &*output_terms(column, &self.run.state) {
                self.add::<F>(output, position, factor);
            }
            self.buffer.move_slopes(output, self.block);
            self.buffer.pad_output(output, from + count);
        }
    }
}

impl<T: Real> BlockWriter<'_, '_, T> {
    /// Add a multiple of an entry of the basis to an output.
    #[inline(always)]
    fn add<const F: bool>(&mut self, output: usize, position: usize, factor: T) {
        let (buffer, mask) = (&mut *self.buffer, self.mask);
        let block = &mut *self.block;
        match Entry::at(position, self.run.state.network, self.active) {
            Entry::State(i) => {
                buffer.add::<F>(output, block, self.samples.states[i].iter(), mask, factor);
            }
            Entry::Input(i) => {
                let input = |k| self.run.input_at(self.first + k, i);
                buffer.add::<F>(output, block, (0..mask.span()).map(input), mask, factor);
            }
            Entry::One => {
                buffer.add::<F>(output, block, std::iter::repeat(T::of(1.0)), mask, factor)
            }
            Entry::Torque(slot) => {
                buffer.add::<F>(output, block, self.samples.torques[slot].iter(), mask, factor);
            }
            Entry::Nothing => {
                buffer.add::<F>(output, block, std::iter::repeat(T::zero_()), mask, factor);
            }
        }
    }
}

/// Source of an entry of the basis while samples are passed.
pub(super) enum Entry {
    /// State.
    State(usize),
    /// Input.
    Input(usize),
    /// The constant 1.
    One,
    /// Torque of an active channel, by its number among these.
    Torque(usize),
    /// A channel that is off.
    Nothing,
}

impl Entry {
    /// By the position, with the channels `active`.
    pub fn at<T: Number>(position: usize, network: &Network<T>, active: &[usize]) -> Self {
        let channel = |j: &usize| network.first_channel() + j == position;
        if position < network.states() {
            Self::State(position)
        } else if position < network.one() {
            Self::Input(position - network.first_input())
        } else if position == network.one() {
            Self::One
        } else {
            active.iter().position(channel).map_or(Self::Nothing, Self::Torque)
        }
    }
}

/// Terms of a column while the mode lasts: positions in the basis and coefficients.
pub(super) fn output_terms<'c, T: Number>(
    column: &'c Column<T>,
    state: &HybridState<'_, T>,
) -> Cow<'c, [(usize, T)]> {
    match column {
        Column::Linear(terms) => Cow::Borrowed(terms),
        Column::Torque(element, node) => {
            Cow::Owned(terms(&state.mode.port_torque(state.network, element, *node)))
        }
        Column::Acceleration(node) => {
            Cow::Owned(terms(&state.mode.acceleration(state.network, &[(*node, T::of(1.0))])))
        }
        // These need the expansion: plans with them pass no samples.
        Column::Angle(..)
        | Column::Rate(_)
        | Column::Power(_)
        | Column::Work(..)
        | Column::Energy(_) => Cow::Borrowed(&[]),
        Column::Friction(j) => Cow::Owned(match state.rows[*j] {
            FrictionState::Open => Vec::new(),
            FrictionState::Sticking => terms(holding_row(state, *j)),
            FrictionState::Slipping { .. } | FrictionState::Saturated { .. } => {
                vec![(state.network.first_channel() + j, T::of(1.0))]
            }
        }),
    }
}

impl<T: Number> Column<T> {
    /// Return the column of a target.
    pub fn of(network: &Network<T>, target: Target) -> Self {
        let speed = |node| network.over_basis(&[(node, T::of(1.0))]);
        let name = |element: usize| network.elements()[element].clone();
        let heat = |element| ElementPower::heat(name(element));
        let power = |element| ElementPower::entering(network, name(element));
        match target {
            Target::Speed(node) => Self::Linear(terms(&speed(node))),
            Target::Acceleration(node) if network.is_follower(node) => Self::Rate(speed(node)),
            Target::Acceleration(node) => Self::Acceleration(node),
            Target::Torque(element, node) => Self::Torque(name(element), node),
            Target::Power(element) => Self::Power(power(element)),
            Target::Loss(element) => Self::Power(heat(element)),
            Target::Work(element) => Self::Work(power(element), T::zero_()),
            Target::Heat(element) => Self::Work(heat(element), T::zero_()),
            Target::Energy(element) => Self::Energy(name(element)),
            Target::Angle(node) => Self::Angle(speed(node), T::zero_()),
            Target::Twist(shaft) => Self::Linear(vec![(network.speeds() + shaft, T::of(1.0))]),
            Target::ShaftTorque(shaft) => Self::Linear(terms(&network.spring_torque(shaft))),
            Target::Slip(element) => Self::Linear(terms(&network.frictions[element].slip)),
            Target::FrictionTorque(element) => Self::Friction(element),
        }
    }
}

/// Value of a column from the basis at an instant; an angle is that at the start of the step.
pub(super) fn value<T: Number>(column: &Column<T>, state: &HybridState<'_, T>, basis: &[T]) -> T {
    match column {
        Column::Linear(terms) => evaluate_terms(terms, basis),
        Column::Angle(_, sum) | Column::Work(_, sum) => *sum,
        Column::Torque(element, node) => {
            form(&state.mode.port_torque(state.network, element, *node), basis)
        }
        Column::Acceleration(node) => {
            form(&state.mode.acceleration(state.network, &[(*node, T::of(1.0))]), basis)
        }
        Column::Power(power) => power.at(state, basis),
        Column::Energy(element) => element_energy(state.network, element, basis),
        // The expansion has it.
        Column::Rate(_) => T::of(f64::NAN),
        Column::Friction(j) => match state.rows[*j] {
            FrictionState::Open => T::zero_(),
            FrictionState::Slipping { .. } | FrictionState::Saturated { .. } => {
                basis[state.network.first_channel() + j]
            }
            FrictionState::Sticking => form(holding_row(state, *j), basis),
        },
    }
}

/// Torque of a stuck element over the basis.
fn holding_row<'r, T: Number>(state: &'r HybridState<'_, T>, j: usize) -> &'r [T] {
    state.mode.holding_torque(RowId::Friction(j)).unwrap_or(&[])
}

/// Rate of a linear form over states and inputs, `h` seconds after the start of the present step.
fn rate<T: Real>(state: &HybridState<'_, T>, row: &[T], h: T) -> T {
    let given = state.expansion.inputs.iter();
    let series = state.expansion.states.iter().chain(given);
    row.iter().zip(series).filter(|(c, _)| !is_zero(**c)).fold(T::zero_(), |sum, (&c, series)| {
        let mut value = T::zero_();
        for k in (1..=state.expansion.order).rev() {
            value = value * h + series[k] * k as f64;
        }
        sum + c * value
    })
}

/// Angle turned within the first `h` seconds of the present step.
fn integral<T: Real>(state: &HybridState<'_, T>, row: &[T], h: T) -> T {
    let mut sum = row.get(state.network.one()).map_or(T::zero_(), |&c| c * h);
    let given = state.expansion.inputs.iter();
    for (&c, series) in row.iter().zip(state.expansion.states.iter().chain(given)) {
        if !is_zero(c) {
            let mut value = T::zero_();
            for k in (0..=state.expansion.order).rev() {
                value = value * h + series[k] / (k + 1) as f64;
            }
            sum += c * value * h;
        }
    }
    sum
}
