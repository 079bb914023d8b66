// SPDX-License-Identifier: MIT
//! Many samples in one mode by exact operators, while no guard comes near its fall.
//!
//! The channels of slipping elements are cubics through value and rate at both ends of the sample; the
//! end is predicted with the linear part, which leaves an error of fourth order. A sample in which a
//! guard could fall is left to the Taylor expansion, which locates the event.

use super::integrator::{Integrator, RowState};
use super::operators::{CUBIC, Operators};
use crate::network::channel::form;
use crate::network::{Cell, GearState, Mode, Network, Row};
use crate::number::Real;
use std::collections::HashMap;
use std::sync::Arc;

/// Operators by mode, active channels and step length.
pub(super) type Cache<T> = HashMap<(crate::network::ModeKey, u64, u64), Option<Arc<Operators<T>>>>;

/// Fewest samples of equal length ahead that make operators worth while.
const WORTH_WHILE: usize = 8;
/// What torques may deviate from their chord within a sample, relative to their size.
const BOW: f64 = 0.05;
/// Most passes over the end of a sample; the first knows the linear part of the channels only.
const MAX_CORRECTIONS: usize = 4;
/// Relative change of the cubics within a pass that counts as none.
const CONVERGED: f64 = 1e-6;
/// Most channels that a sprint can carry.
pub(super) const MAX_ACTIVE: usize = 16;
/// Largest cubic part of a channel over a step, relative to its size.
const MAX_CUBIC: f64 = 2e-4;

impl<T: Real> Integrator<'_, T> {
    /// Advance over as many whole samples as possible; `sink` gets time and basis at the start of each.
    pub(super) fn sprint(&mut self, sink: &mut impl FnMut(f64, &[T], &Self)) {
        let Some(operators) = self.operators() else { return };
        match self.network.states() {
            0..=4 => self.run::<4>(&operators, sink),
            5..=8 => self.run::<8>(&operators, sink),
            9..=12 => self.run::<12>(&operators, sink),
            _ => self.run::<16>(&operators, sink),
        }
        self.inputs.expand(self.segment, self.t, &mut self.expansion.inputs);
    }

    /// Operators of the present mode for the samples ahead, if they apply.
    fn operators(&mut self) -> Option<Arc<Operators<T>>> {
        let (from, to) = self.inputs.span(self.segment);
        let h = to - from;
        let equal = |k: usize| {
            let (a, b) = self.inputs.span(self.segment + k);
            ((b - a) - h).abs() <= 1e-9 * h
        };
        let ahead = self.segment + WORTH_WHILE < self.inputs.segments();
        let at_start = self.t.re() == from && h > 0.0 && h <= self.settings.max_step;
        if !at_start || !ahead || !(1..WORTH_WHILE).all(equal) || !self.is_simple() {
            return None;
        }
        let on = |j: &usize| self.cells[*j] != Cell::Off;
        let active: Vec<usize> = (0..self.cells.len()).filter(on).collect();
        let mask = active.iter().fold(0, |mask, j| mask | 1_u64 << j);
        // Times that differ by round-off share their operators.
        let key = (self.mode.key, mask, (h * 1e12).round() as u64);
        if let Some(known) = self.sprints.get(&key) {
            return known.clone();
        }
        let (network, mode) = (self.network, &self.mode);
        let built = match network.states() {
            0..=4 => Operators::build::<4>(network, mode, &active, h),
            5..=8 => Operators::build::<8>(network, mode, &active, h),
            9..=12 => Operators::build::<12>(network, mode, &active, h),
            13..=16 => Operators::build::<16>(network, mode, &active, h),
            _ => None,
        };
        let built = built.map(Arc::new);
        self.sprints.insert(key, built.clone());
        built
    }

    /// Whether the present mode has only what a sprint covers.
    fn is_simple(&self) -> bool {
        let saturated = |row: &RowState| matches!(row, RowState::Saturated { .. });
        self.network.prescribed.is_empty()
            && self.inputs.is_sampled()
            && self.cells.len() <= MAX_ACTIVE
            && !self.mode.redundant
            && !self.blocked.contains(&true)
            && !self.released.contains(&true)
            && !self.rows.iter().any(saturated)
            && self.gears.iter().all(|gear| *gear != GearState::Held)
            && self
                .network
                .channels
                .iter()
                .zip(&self.cells)
                .all(|(channel, &cell)| cell == Cell::Off || channel.is_smooth())
    }

    fn run<const N: usize>(
        &mut self,
        operators: &Operators<T>,
        sink: &mut impl FnMut(f64, &[T], &Self),
    ) {
        let mode = Arc::clone(&self.mode);
        let watches = self.watches(&mode);
        let n = self.network.states();
        let (columns, _) = operators.step.as_chunks::<N>();
        let mut x = [T::zero_(); N];
        x[..n].copy_from_slice(&self.x);
        let mut before = x;
        let mut now = Sample::new(self.network, columns.len(), watches.len());
        let mut verified = now.clone();
        let first = self.segment;
        loop {
            self.begin(operators, &x[..n], &mut now);
            for (value, watch) in now.guards.iter_mut().zip(&watches) {
                *value = watch.value(&now.basis);
            }
            if self.segment > first {
                if !all_safe(&verified.guards, &now.guards) {
                    // The last sample may hold an event: go back to its start.
                    self.segment -= 1;
                    x = before;
                    break;
                }
                sink(self.inputs.span(self.segment - 1).0, &verified.basis, self);
            }
            let (from, to) = self.inputs.span(self.segment);
            let last = self.segment + 1 == self.inputs.segments();
            let equal = ((to - from) - operators.h).abs() <= 1e-9 * operators.h;
            if last || !equal || !self.cubics(operators, &mut now) {
                break;
            }
            before = x;
            x = [T::zero_(); N];
            for (column, &weight) in columns.iter().zip(&now.y) {
                for i in 0..N {
                    x[i] += column[i] * weight;
                }
            }
            std::mem::swap(&mut now, &mut verified);
            self.segment += 1;
        }
        self.x.copy_from_slice(&x[..n]);
        self.t = T::of(self.inputs.span(self.segment).0);
    }

    /// Basis at the start of the present segment and the part of y that is known there.
    fn begin(&self, operators: &Operators<T>, x: &[T], sample: &mut Sample<T>) {
        let network = self.network;
        let (n, inputs) = (x.len(), network.mechanism.inputs.len());
        sample.basis[..n].copy_from_slice(x);
        sample.y[..n].copy_from_slice(x);
        for (i, &[start, rate]) in self.inputs.lines(self.segment).iter().enumerate() {
            sample.basis[network.first_input() + i] = start;
            sample.y[n + i] = start;
            sample.y[n + inputs + i] = start + rate * operators.h;
        }
        sample.basis[network.one()] = T::of(1.0);
        sample.y[n + 2 * inputs] = T::of(1.0);
        for (i, &j) in operators.active.iter().enumerate() {
            let channel = &network.channels[j];
            let s = form(&channel.arguments[0], x);
            let partials = channel.partials(self.cells[j], s, self.normal_line(j)[0]);
            sample.basis[network.first_channel() + j] = partials[0];
            sample.partials[i] = partials;
        }
    }

    /// Fit the cubics of the active channels; false where one bends too much.
    fn cubics(&self, operators: &Operators<T>, sample: &mut Sample<T>) -> bool {
        let fixed = self.network.states() + 2 * self.network.mechanism.inputs.len() + 1;
        for (i, &j) in operators.active.iter().enumerate() {
            let ds = form(&operators.rate_now[i], &sample.basis);
            let [value, by_argument, by_normal] = sample.partials[i];
            let rate = by_argument * ds + by_normal * self.normal_line(j)[1];
            let cubic = [value, rate, T::zero_(), T::zero_()];
            sample.y[fixed + CUBIC * i..][..CUBIC].copy_from_slice(&cubic);
        }
        if operators.active.is_empty() {
            return true;
        }
        for pass in 1..=MAX_CORRECTIONS {
            let change = self.correct(operators, &mut sample.y[..], fixed);
            if pass > 1 && change <= CONVERGED {
                let h = operators.h;
                return sample.y[fixed..].chunks_exact(CUBIC).all(|cubic| {
                    (cubic[3].re() * h * h * h).abs() <= MAX_CUBIC * (cubic[0].re().abs() + 1.0)
                });
            }
        }
        false
    }

    /// One pass over the active channels: from the end that the present cubics lead to, new cubics.
    /// Returns their largest change at the end, relative to their size.
    fn correct(&self, operators: &Operators<T>, y: &mut [T], fixed: usize) -> f64 {
        let network = self.network;
        let (n, inputs) = (network.states(), network.mechanism.inputs.len());
        let h = operators.h;
        let mut ends = [[T::zero_(); 3]; MAX_ACTIVE];
        let mut rates = [T::zero_(); MAX_ACTIVE];
        let mut change = 0.0_f64;
        for (i, &j) in operators.active.iter().enumerate() {
            let s = form(&operators.argument[i], y);
            rates[i] = form(&operators.rate[i], y);
            let [start, rate] = self.normal_line(j);
            ends[i] = network.channels[j].partials(self.cells[j], s, start + rate * h);
        }
        for (i, &j) in operators.active.iter().enumerate() {
            let row = &operators.rate_now[i];
            let mut ds = rates[i] + row[network.one()];
            ds += form(&row[network.first_input()..][..inputs], &y[n + inputs..]);
            for (end, &other) in ends.iter().zip(&operators.active) {
                ds += row[network.first_channel() + other] * end[0];
            }
            let [value, by_argument, by_normal] = ends[i];
            let rate = by_argument * ds + by_normal * self.normal_line(j)[1];
            let cubic = &mut y[fixed + CUBIC * i..][..CUBIC];
            let (rise, mean) = ((value - cubic[0]) / h, (cubic[1] + rate) / 2.0);
            let (third, second) =
                ((mean - rise) * (2.0 / (h * h)), (rise * 3.0 - cubic[1] * 2.0 - rate) / h);
            let bend = (second - cubic[2]).re().abs() * h * h;
            let twist = (third - cubic[3]).re().abs() * h * h * h;
            change = change.max((bend + twist) / (value.re().abs() + 1.0));
            (cubic[2], cubic[3]) = (second, third);
        }
        change
    }

    /// Normal load of a friction channel at the start of the segment and its rate.
    fn normal_line(&self, j: usize) -> [T; 2] {
        let lines = self.inputs.lines(self.segment);
        self.network.frictions.get(j).map_or([T::zero_(); 2], |row| row.normal.line(lines))
    }

    /// All guards of the present mode.
    fn watches<'m>(&self, mode: &'m Mode<T>) -> Vec<Watch<'m, T>>
    where
        Self: 'm,
    {
        let network = self.network;
        let mut all = Vec::new();
        for (j, row) in network.frictions.iter().enumerate() {
            let (input, gain, p0) = network.load_of(j);
            let side = if self.pressed[j] { 1.0 } else { -1.0 };
            let load = Load { input, gain: gain.re() * side, p0: p0.re() };
            all.push(Watch::Load(load));
            match self.rows[j] {
                RowState::Open | RowState::Saturated { .. } => {}
                RowState::Slipping { sign } => {
                    all.push(Watch::Speed { row: self.owned(&row.slip), sign });
                }
                RowState::Stuck => {
                    let position = mode.stuck.iter().position(|&s| s == Row::Friction(j));
                    let position = position.expect("a stuck element belongs to the mode");
                    let mu = if self.pressed[j] { row.law.at(T::zero_()).re() } else { 0.0 };
                    let load = Load { gain: gain.re() * mu * row.peak.re(), ..load };
                    let row_of_torque = mode.stuck_torque.row(position);
                    all.push(Watch::Hold { row: row_of_torque, load, sign: 1.0 });
                    if !row.one_way {
                        all.push(Watch::Hold { row: row_of_torque, load, sign: -1.0 });
                    }
                }
            }
        }
        for (i, gear) in network.losses.iter().enumerate() {
            if let (true, GearState::Rolling { sign, backward }) =
                (gear.loss.is_directional(), self.gears[i])
            {
                let side = if backward { -1.0 } else { 1.0 };
                let threshold = gear.loss.threshold().re() * side;
                let row = mode.gear_torque.row(i);
                all.push(Watch::Power { row, sign: sign * side, threshold });
                all.push(Watch::Speed { row: self.owned(&gear.speed), sign });
            }
        }
        for (j, channel) in network.channels.iter().enumerate().skip(self.rows.len()) {
            if let Cell::Moving { sign, .. } = self.cells[j] {
                all.push(Watch::Speed { row: self.owned(&channel.arguments[0]), sign });
            }
        }
        all
    }

    fn owned(&self, row: &[T]) -> Vec<f64> {
        row.iter().map(|c| c.re()).collect()
    }
}

/// What a run of samples works on.
#[derive(Clone)]
struct Sample<T> {
    /// Basis (x, u, 1, φ) at the start.
    basis: Vec<T>,
    /// Step vector.
    y: Vec<T>,
    /// Channels at the start with their partial derivatives.
    partials: [[T; 3]; MAX_ACTIVE],
    /// Guards at the start.
    guards: Vec<Guard>,
}

impl<T: Real> Sample<T> {
    fn new(network: &Network<T>, columns: usize, guards: usize) -> Self {
        Self {
            basis: vec![T::zero_(); network.basis()],
            y: vec![T::zero_(); columns],
            partials: [[T::zero_(); 3]; MAX_ACTIVE],
            guards: vec![(0.0, 0.0); guards],
        }
    }
}

/// Value of a guard and the size that bounds its bow within a sample.
type Guard = (f64, f64);

/// `gain (input - p0)`.
#[derive(Clone, Copy)]
struct Load {
    input: usize,
    gain: f64,
    p0: f64,
}

impl Load {
    fn at<T: Real>(&self, basis: &[T]) -> f64 {
        self.gain * (basis[self.input].re() - self.p0)
    }
}

/// A guard as a form over the basis.
enum Watch<'m, T> {
    /// Normal load; linear within a sample.
    Load(Load),
    /// A speed in its direction.
    Speed { row: Vec<f64>, sign: f64 },
    /// Static capacity less a holding torque of either sign.
    Hold { row: &'m [T], load: Load, sign: f64 },
    /// Torque through a lossy gear beyond its threshold.
    Power { row: &'m [T], sign: f64, threshold: f64 },
}

impl<T: Real> Watch<'_, T> {
    fn value(&self, basis: &[T]) -> Guard {
        let dot = |row: &[T]| row.iter().zip(basis).fold(0.0, |sum, (c, b)| sum + c.re() * b.re());
        match self {
            Self::Load(load) => (load.at(basis), LINEAR),
            Self::Speed { row, sign } => {
                let speed = row.iter().zip(basis).fold(0.0, |sum, (c, b)| sum + c * b.re());
                (speed * sign, 0.0)
            }
            Self::Hold { row, load, sign } => {
                let torque = dot(row);
                (load.at(basis) + torque * sign, torque.abs())
            }
            Self::Power { row, sign, threshold } => {
                let torque = dot(row);
                (torque * sign - threshold, torque.abs())
            }
        }
    }
}

/// Marks a guard that is exactly linear within a sample.
const LINEAR: f64 = -1.0;

/// Whether no guard can fall between two samples: both values lie above zero by more than their
/// difference and the bow between them. A linear guard needs only both values.
fn all_safe(before: &[Guard], after: &[Guard]) -> bool {
    before.iter().zip(after).all(|(&(a, size_a), &(b, size_b))| {
        let lower = a.min(b);
        if size_a == LINEAR {
            lower > 0.0 || (a == 0.0 && b == 0.0)
        } else {
            lower > (a - b).abs() + BOW * size_a.max(size_b)
        }
    })
}
