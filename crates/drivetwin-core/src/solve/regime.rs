// SPDX-License-Identifier: MIT
//! What holds at an instant: the state, who sticks and who slips, and the mode that follows.

use super::expansion::{Accuracy, Expansion};
use super::guard::Cause;
use super::known::Known;
use super::lanes::{Task, dispatch};
use super::status::Status;
use crate::network::channel::ChannelSeries;
use crate::network::{Cell, GearState, Mode, ModeKey, Network, Row};
use crate::number::{Number, Pack, Series, TERMS, Values, evaluate};
use std::sync::Arc;

/// Friction mode of one element (paper eqs. 4-6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RowState {
    /// No capacity.
    Open,
    /// Slip in one direction.
    Slipping {
        /// Sign of the slip and of the torque.
        sign: f64,
    },
    /// No slip, torque within the static capacity.
    Stuck,
    /// No slip because other elements hold the same speeds; torque at the static capacity.
    Saturated {
        /// Sign of the torque.
        sign: f64,
    },
}

impl RowState {
    /// Whether it carries all it can at zero speed while others hold the rest.
    pub(super) fn is_saturated(&self) -> bool {
        matches!(self, Self::Saturated { .. })
    }
}

/// What happened at an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EventKind {
    /// Slip came to rest.
    Lock,
    /// The holding torque exceeded the static capacity.
    BreakAway,
    /// Slip passed through zero.
    Reverse,
    /// The pressure rose above the fill pressure.
    Fill,
    /// The pressure fell below the fill pressure.
    Vent,
}

/// A change of friction mode.
#[derive(Clone, Debug)]
pub struct Event<T> {
    /// When, s; carries derivatives.
    pub time: T,
    /// Index of the friction element, or after these of the lossy gear.
    pub element: usize,
    /// What.
    pub kind: EventKind,
}

impl<const K: usize> Event<Pack<K>> {
    /// That of one run.
    pub(super) fn of_run(&self, run: usize) -> Event<f64> {
        Event { time: self.time.0[run], element: self.element, kind: self.kind }
    }
}

/// State and friction modes of a run, or of several side by side for as long as these decide alike.
pub struct Regime<'a, T> {
    /// Network.
    pub network: &'a Network<T>,
    /// State (speeds, twists) at the end of the last step.
    pub x: Vec<T>,
    /// Friction modes during the last step.
    pub rows: Vec<RowState>,
    /// States of lossy gears during the last step.
    pub gears: Vec<GearState>,
    /// Active mode during the last step.
    pub mode: Arc<Mode<T>>,
    /// Expansion of the last step.
    pub expansion: Expansion<T>,
    /// Events so far.
    pub events: Vec<Event<T>>,
    /// Modes and operators, also those of this run.
    pub known: Known<'a, T>,
    pub(super) t: T,
    /// Time to the end of the segment, s, without derivatives.
    pub(super) remaining: T,
    pub(super) cells: Vec<Cell>,
    /// Whether an element or gear moves off from exact zero at the start of the step.
    pub(super) released: Vec<bool>,
    /// Whether an element has a normal load.
    pub(super) pressed: Vec<bool>,
    /// Whether a gear that carries all it can is kept from rolling by others.
    pub(super) blocked: Vec<bool>,
    /// Inputs and state as decisions see them.
    pub(super) ahead: Vec<Series<T>>,
    pub(super) x_ahead: Vec<T>,
    pub(super) channel_ahead: ChannelSeries<T>,
}

impl<'a, T: Number> Regime<'a, T> {
    /// State `x` at time `t` [s], nothing decided yet.
    pub(super) fn start(mut known: Known<'a, T>, x: Vec<T>, t: T) -> Result<Self, Status> {
        let network = known.network;
        let frictions = network.frictions.len();
        let key = ModeKey::default();
        let mode =
            known.known_mode(key).or_else(|| known.new_mode(key, &vec![T::zero_(); frictions]));
        let mode = mode.ok_or_else(|| self_locking(network, t.re().leading()))?;
        Ok(Self {
            rows: vec![RowState::Open; frictions],
            expansion: Expansion::new(network),
            events: Vec::new(),
            t,
            remaining: T::zero_(),
            cells: vec![Cell::Off; network.channels.len()],
            released: vec![false; frictions + network.losses.len()],
            pressed: vec![false; frictions],
            blocked: vec![false; network.losses.len()],
            x_ahead: x.clone(),
            channel_ahead: ChannelSeries::default(),
            x,
            ahead: vec![[T::zero_(); TERMS]; network.mechanism.inputs.len()],
            gears: vec![GearState::Rolling { sign: 1.0, backward: false }; network.losses.len()],
            network,
            mode,
            known,
        })
    }

    /// Expand the motion of the runs `runs`, as bits, from here on: [`Expansion::expand`].
    pub(super) fn expand(&mut self, runs: u32, step: (T::Values, Accuracy)) -> T::Values {
        dispatch(Expand { regime: self, runs, step })
    }

    /// State of the runs `runs`, as bits, `h` [s] after the start of the expansion.
    pub(super) fn move_on(&mut self, runs: u32, h: T) {
        let Self { expansion, x, .. } = self;
        for (x, series) in x.iter_mut().zip(&expansion.states) {
            *x = x.with(runs, evaluate(series, expansion.order, h));
        }
    }

    /// Time for messages, s.
    pub(super) fn time(&self) -> f64 {
        self.t.re().leading()
    }

    /// Mode of a key, compiled once.
    pub(super) fn mode(&mut self, key: ModeKey) -> Result<Arc<Mode<T>>, Status> {
        if let Some(mode) = self.known.known_mode(key) {
            return Ok(mode);
        }
        let mode = self.known.new_mode(key, &self.capacities());
        mode.ok_or_else(|| self_locking(self.network, self.time()))
    }

    /// Name of the element that an event is about.
    pub(super) fn culprit(&self, cause: Cause) -> String {
        let row = match cause {
            Cause::AtRest(row) | Cause::Overload(row, _) | Cause::OverloadAtKnot(row) => row,
            Cause::Pressed(j) => Row::Friction(j),
            Cause::PowerReversal(i) => Row::Gear(i),
            Cause::Border(channel, _) if channel < self.rows.len() => Row::Friction(channel),
            Cause::Border(channel, _) => return format!("torque law {channel}"),
            Cause::Stalled => return "several elements at once".to_owned(),
        };
        self.network.element_of(row).to_owned()
    }

    /// Position of a row in lists that hold friction elements first, then lossy gears.
    pub(super) fn index_of(&self, row: Row) -> usize {
        match row {
            Row::Friction(j) => j,
            Row::Gear(i) => self.rows.len() + i,
        }
    }
}

/// [`Regime::expand`], to be dispatched.
struct Expand<'r, 'a, T: Number> {
    regime: &'r mut Regime<'a, T>,
    runs: u32,
    step: (T::Values, Accuracy),
}

impl<T: Number> Task for Expand<'_, '_, T> {
    type Output = T::Values;

    #[inline(always)]
    fn run<const F: bool>(self) -> T::Values {
        let Regime { expansion, network, mode, cells, x, .. } = self.regime;
        expansion.expand(network, mode, cells, (self.runs, x), self.step)
    }
}

/// Sign with zero counted as positive.
pub(super) fn sign_of<V: Values>(value: V) -> f64 {
    value.decide(|value| if value < 0.0 { -1.0 } else { 1.0 })
}

pub(super) fn self_locking<T>(network: &Network<T>, time: f64) -> Status {
    let element = network.losses.first().map_or_else(String::new, |l| l.element.to_string());
    Status::SelfLocking { time, element }
}
