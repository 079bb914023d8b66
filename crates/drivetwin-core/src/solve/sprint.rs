// SPDX-License-Identifier: MIT
//! Many samples in one mode by exact operators, while no guard comes near its fall.
//!
//! A sample in which a guard could fall is left to the Taylor expansion, which locates the event.

use super::inputs::Inputs;
use super::integrator::{Integrator, RowState};
use super::lanes::{Task, dispatch};
use super::march::{BLOCK, Carry, Room, Source, Trail, march, room};
use super::operators::{MAX_ACTIVE, MAX_WATCHED, Operators};
use crate::network::channel::{self, Channel};
use crate::network::smooth::{Law, Line, MAX_INPUTS, Sample, line_of};
use crate::network::{Cell, GearState, ModeKey, Network, Row};
use crate::number::Real;
use std::borrow::Borrow;
use std::sync::Arc;

/// Operators for the number of states at hand.
#[derive(Clone, Debug)]
pub(super) enum AnySize<T> {
    /// Up to 4.
    Four(Arc<Operators<T, 4>>),
    /// Up to 8.
    Eight(Arc<Operators<T, 8>>),
    /// Up to 12; not with derivatives, for which the gain no longer pays for the code.
    Twelve(Arc<Operators<T, 12>>),
    /// Up to [`MAX_STATES`]; likewise.
    Many(Arc<Operators<T, MAX_STATES>>),
}

/// Most states of a network that is marched.
const MAX_STATES: usize = 24;
/// The same with derivatives.
const MAX_DERIVED: usize = 8;

/// Whether a network is of the kind that passes samples by exact operators.
pub fn can_march<T: Real>(network: &Network<T>) -> bool {
    let smooth = |channel: &Channel<T>| {
        matches!(channel.law, channel::Law::Friction { .. } | channel::Law::Quadratic(_))
    };
    network.states() <= if T::DERIVATIVES { MAX_DERIVED } else { MAX_STATES }
        && network.prescribed.is_empty()
        && network.mechanism.inputs.len() <= MAX_INPUTS
        && network.channels.iter().all(smooth)
}

impl AnySize<f64> {
    /// The operators over `N` states, if these are they.
    pub fn of_size<const N: usize>(&self) -> Option<&Operators<f64, N>> {
        let any: &dyn std::any::Any = match self {
            Self::Four(operators) => &**operators,
            Self::Eight(operators) => &**operators,
            Self::Twelve(operators) => &**operators,
            Self::Many(operators) => &**operators,
        };
        any.downcast_ref()
    }
}

/// What operators belong to: mode, active channels with their branches, and step length.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Key {
    mode: ModeKey,
    /// Bits of the active channels, of their directions, and of what is watched or pressed.
    branches: [u64; 3],
    pieces: [u8; MAX_ACTIVE],
    /// Step length, ps: times that differ by round-off share their operators.
    step: u64,
}

/// A sprint that is possible.
pub(super) struct Ready<T> {
    /// Operators of the present mode.
    pub operators: AnySize<T>,
    /// Channels that are not off.
    pub active: Vec<usize>,
    /// Step length, s.
    pub h: f64,
    /// Samples ahead.
    pub count: usize,
}

/// Takes samples that were passed in one mode.
pub trait Sink<T> {
    /// Samples `(first, count)` with the channels `active`; see [`Samples`].
    fn passed(
        &mut self,
        run: &Integrator<'_, T>,
        active: &[usize],
        samples: &impl Samples<T>,
        range: (usize, usize),
    );
}

/// States and torques of the active channels at the start of samples, at least of those passed.
pub trait Samples<T> {
    /// State `i`.
    fn states(&self, i: usize) -> impl Iterator<Item: Borrow<T>>;

    /// Torque of the active channel number `slot`.
    fn torques(&self, slot: usize) -> impl Iterator<Item: Borrow<T>>;
}

impl<T: Real, const N: usize> Samples<T> for Trail<T, N> {
    fn states(&self, i: usize) -> impl Iterator<Item: Borrow<T>> {
        self.states(i).iter()
    }
    fn torques(&self, slot: usize) -> impl Iterator<Item: Borrow<T>> {
        self.torques(slot).iter()
    }
}

/// Samples that a run without derivatives passes before it looks at their guards.
const AHEAD: usize = 16;

/// Fewest samples of equal length that make operators worth while.
pub const WORTH_WHILE: usize = 8;

impl<T: Real> Integrator<'_, T> {
    /// Advance over as many whole samples as possible.
    pub(super) fn sprint(&mut self, sink: &mut impl Sink<T>) {
        let mut passed = false;
        while let Some(ready) = self.ready_to_sprint() {
            passed = true;
            if !self.pass_stretch(&ready, sink) || self.is_at_end() {
                break;
            }
        }
        if passed {
            self.resume();
        }
    }

    /// Pass samples of equal length; false where a guard could fall before their end.
    fn pass_stretch(&mut self, ready: &Ready<T>, sink: &mut impl Sink<T>) -> bool {
        match &ready.operators {
            AnySize::Four(operators) => self.pass(operators, ready, sink),
            AnySize::Eight(operators) => self.pass(operators, ready, sink),
            AnySize::Twelve(operators) if !T::DERIVATIVES => self.pass(operators, ready, sink),
            AnySize::Many(operators) if !T::DERIVATIVES => self.pass(operators, ready, sink),
            AnySize::Twelve(_) | AnySize::Many(_) => false,
        }
    }

    /// Take up the Taylor expansion where a sprint has ended.
    pub(super) fn resume(&mut self) {
        if !self.is_at_end() {
            self.inputs.expand(self.segment, self.t, &mut self.expansion.inputs);
        }
    }

    /// What a sprint from here on needs, if one is possible.
    pub(super) fn ready_to_sprint(&mut self) -> Option<Ready<T>> {
        let (from, to) = self.inputs.span(self.segment);
        let h = to - from;
        let count = self.inputs.equal_from(self.segment);
        let at_start = self.t.re() == from && h > 0.0 && h <= self.settings.max_step;
        let worth_while = count >= WORTH_WHILE || self.inputs.recurs(self.segment);
        if !at_start || !worth_while || !self.is_simple() {
            return None;
        }
        let on = |j: &usize| self.cells[*j] != Cell::Off;
        let active: Vec<usize> = (0..self.cells.len()).filter(on).collect();
        let operators = self.operators(&active, h)?;
        Some(Ready { operators, active, h, count })
    }

    /// Pass samples with operators of known size.
    fn pass<const N: usize>(
        &mut self,
        operators: &Operators<T, N>,
        ready: &Ready<T>,
        sink: &mut impl Sink<T>,
    ) -> bool {
        let (run, active, steps) = (self, &ready.active[..], (ready.h, ready.count));
        match operators.channels.len() {
            0 => dispatch(Sprint::<_, _, N, 0> { run, operators, active, steps, sink }),
            1 => dispatch(Sprint::<_, _, N, 1> { run, operators, active, steps, sink }),
            2 => dispatch(Sprint::<_, _, N, 2> { run, operators, active, steps, sink }),
            _ => dispatch(Sprint::<_, _, N, 4> { run, operators, active, steps, sink }),
        }
    }

    /// Operators of the present mode, if they apply.
    fn operators(&mut self, active: &[usize], h: f64) -> Option<AnySize<T>> {
        if active.len() > MAX_ACTIVE {
            return None;
        }
        let key = self.key(active, h);
        if let Some(known) = self.known.operators.get(&key) {
            return known.clone();
        }
        let laws = active.iter().map(|&j| Law::of(&self.network.channels[j], self.cells[j]));
        let built = laws.collect::<Option<Vec<_>>>().and_then(|laws| match self.network.states() {
            0..=4 => self.build::<4>(active, &laws, h).map(|o| AnySize::Four(Arc::new(o))),
            5..=MAX_DERIVED => {
                self.build::<8>(active, &laws, h).map(|o| AnySize::Eight(Arc::new(o)))
            }
            9..=12 if !T::DERIVATIVES => {
                self.build::<12>(active, &laws, h).map(|o| AnySize::Twelve(Arc::new(o)))
            }
            13..=MAX_STATES if !T::DERIVATIVES => {
                self.build::<MAX_STATES>(active, &laws, h).map(|o| AnySize::Many(Arc::new(o)))
            }
            _ => None,
        });
        self.known.operators.insert(key, built.clone());
        built
    }

    fn key(&self, active: &[usize], h: f64) -> Key {
        let mut branches = [0; 3];
        let mut pieces = [0; MAX_ACTIVE];
        for (slot, &j) in active.iter().enumerate() {
            branches[0] |= 1 << j;
            if let Cell::Moving { sign, piece } = self.cells[j] {
                branches[1] |= u64::from(sign < 0.0) << j;
                pieces[slot] = piece as u8;
            }
        }
        for (j, row) in self.rows.iter().enumerate() {
            branches[2] |= u64::from(self.pressed[j]) << j;
            branches[2] |= u64::from(matches!(row, RowState::Slipping { .. })) << (32 + j);
        }
        Key { mode: self.mode.key, branches, pieces, step: (h * 1e12).round() as u64 }
    }

    /// Whether the present mode has only what a sprint covers.
    fn is_simple(&self) -> bool {
        let saturated = |row: &RowState| matches!(row, RowState::Saturated { .. });
        self.network.prescribed.is_empty()
            && self.inputs.is_sampled()
            && self.network.mechanism.inputs.len() <= MAX_INPUTS
            && !self.mode.redundant
            && !self.blocked.contains(&true)
            && !self.released.contains(&true)
            && !self.rows.iter().any(saturated)
            && self.gears.iter().all(|gear| *gear != GearState::Held)
    }

    /// Build operators that watch all guards of the present mode.
    fn build<const N: usize>(
        &self,
        active: &[usize],
        laws: &[Law<T>],
        h: f64,
    ) -> Option<Operators<T, N>> {
        let mut operators = Operators::build(self.network, &self.mode, (active, laws), h)?;
        self.watch_frictions(active, &mut operators);
        self.watch_gears(active, &mut operators);
        (operators.watched.len() <= MAX_WATCHED).then_some(operators)
    }

    fn watch_frictions<const N: usize>(&self, active: &[usize], operators: &mut Operators<T, N>) {
        for (j, row) in self.network.frictions.iter().enumerate() {
            let side = if self.pressed[j] { 1.0 } else { -1.0 };
            let load = line_of(&row.normal);
            operators.loads.push(load.map(|v| v * side));
            match self.rows[j] {
                RowState::Stuck => {
                    let mu = if self.pressed[j] {
                        row.law.at(T::zero_()) * row.peak
                    } else {
                        T::zero_()
                    };
                    let position = self.mode.stuck.iter().position(|&s| s == Row::Friction(j));
                    let position = position.expect("a stuck element belongs to the mode");
                    let torque = self.mode.stuck_torque.row(position);
                    let limit = load.map(|v| v * mu);
                    operators.watch(self.network, active, torque, (j, limit, !row.one_way));
                }
                RowState::Slipping { sign } if !active.contains(&j) => {
                    let speed: Vec<T> = row.slip.iter().map(|&c| c * sign).collect();
                    let limit = load.map(|_| T::zero_());
                    operators.watch(self.network, active, &speed, (j, limit, false));
                }
                _ => {}
            }
        }
    }

    fn watch_gears<const N: usize>(&self, active: &[usize], operators: &mut Operators<T, N>) {
        for (i, gear) in self.network.losses.iter().enumerate() {
            let GearState::Rolling { sign, backward } = self.gears[i] else { continue };
            if !gear.loss.is_directional() {
                continue;
            }
            let side = if backward { -1.0 } else { 1.0 };
            let scaled = |row: &[T], by: f64| row.iter().map(|&c| c * by).collect::<Vec<T>>();
            let power = scaled(self.mode.gear_torque(self.network).row(i), sign * side);
            let limit = constant(-gear.loss.threshold() * side);
            let id = self.rows.len() + 2 * i;
            operators.watch(self.network, active, &power, (id, limit, false));
            let speed = scaled(&gear.speed, sign);
            operators.watch(self.network, active, &speed, (id + 1, constant(T::zero_()), false));
        }
    }
}

fn constant<T: Real>(value: T) -> Line<T> {
    Line { input: 0, gain: T::zero_(), offset: value }
}

/// Pass samples with the widest instructions, `A` channels at a time.
struct Sprint<'r, 'a, T, S, const N: usize, const A: usize> {
    run: &'r mut Integrator<'a, T>,
    operators: &'r Operators<T, N>,
    active: &'r [usize],
    /// Step length [s] and number of samples.
    steps: (f64, usize),
    sink: &'r mut S,
}

impl<T: Real, S: Sink<T>, const N: usize, const A: usize> Task for Sprint<'_, '_, T, S, N, A> {
    type Output = bool;

    #[inline(always)]
    fn run<const F: bool>(self) -> bool {
        let inputs = self.run.inputs;
        if T::DERIVATIVES && inputs.jumps() {
            self.pass::<F, _>(&Shifted(inputs))
        } else {
            self.pass::<F, _>(&Lines(inputs))
        }
    }
}

impl<T: Real, S: Sink<T>, const N: usize, const A: usize> Sprint<'_, '_, T, S, N, A> {
    #[inline(always)]
    fn pass<const F: bool, U: Source<T>>(self, source: &U) -> bool {
        let Self { run, operators, active, steps: (h, mut count), sink } = self;
        let mut room = room();
        let first = source.read(run.segment, &mut room);
        let n = run.x.len();
        let mut x = [T::zero_(); N];
        x[..n].copy_from_slice(&run.x);
        let mut carry: [Carry<T>; A] = Carry::start::<F, N, A, _>(operators, (first, h), &x);
        let mut guards = operators.guards::<_, F, A>(first, (&x, &carry));
        let mut trail = Trail::in_columns(std::mem::take(&mut run.trail), A);
        let mut whole = true;
        while count > 0 && whole {
            let samples = (run.segment, count.min(BLOCK));
            let at = (&mut x, &mut carry, &mut guards);
            // Samples with derivatives are dear.
            let to = (&mut trail, 0, 1);
            let (passed, fallen) = if T::DERIVATIVES {
                march::<U, T, F, N, A, 1>(operators, (source, h), samples, at, to)
            } else {
                march::<U, T, F, N, A, AHEAD>(operators, (source, h), samples, at, to)
            };
            sink.passed(run, active, &trail, (run.segment, passed));
            run.segment += passed;
            count -= passed;
            if fallen != 0 {
                x = std::array::from_fn(|i| trail.states(i)[passed]);
                whole = false;
            }
        }
        run.x.copy_from_slice(&x[..n]);
        run.t = T::of(run.inputs.knot(run.segment));
        if run.segment == run.inputs.segments() {
            trail.put(operators, 0, (&x, &carry));
            sink.passed(run, active, &trail, (run.segment, 1));
            run.segment -= 1;
        }
        run.trail = trail.into_columns();
        whole
    }
}

/// The inputs of one run.
pub(super) struct Lines<'a, T>(pub &'a Inputs<T>);

impl<T: Real> Source<T> for Lines<'_, T> {
    type Input = f64;

    #[inline(always)]
    fn read<'s>(&'s self, segment: usize, _: &'s mut Room<f64>) -> &'s Sample<f64> {
        self.0.lines(segment)
    }

    #[inline(always)]
    fn bounds(&self, input: usize, samples: (usize, usize)) -> [f64; 2] {
        self.0.bounds(input, samples)
    }
}

/// The inputs of one run where a delay is a parameter.
struct Shifted<'a, T>(&'a Inputs<T>);

impl<T: Real> Source<T> for Shifted<'_, T> {
    type Input = T;

    #[inline(always)]
    fn read<'s>(&'s self, segment: usize, room: &'s mut Room<T>) -> &'s Sample<T> {
        for (to, line) in room.iter_mut().zip(self.0.lines_at(segment)) {
            *to = line;
        }
        &room[..self.0.lines(segment).len()]
    }

    #[inline(always)]
    fn bounds(&self, input: usize, samples: (usize, usize)) -> [f64; 2] {
        self.0.bounds(input, samples)
    }
}
