// SPDX-License-Identifier: MIT
//! Hybrid state: continuous state, friction states and the compiled mode.

use crate::network::nonlinear_torque::ChannelSeries;
use crate::network::{Branch, GearState, Mode, ModeKey, Network, RowId};
use crate::number::{Number, Series, TERMS, Values, evaluate};
use crate::solver::hybrid::event::{Event, EventCause, FrictionState};
use crate::solver::hybrid::impulse::ImpulseEnergy;
use crate::solver::hybrid::mode_cache::ModeCache;
use crate::solver::hybrid::taylor::TaylorExpansion;
use crate::solver::settings::Accuracy;
use crate::solver::simd::{Kernel, dispatch_simd};
use crate::solver::status::Status;
use std::sync::Arc;

/// State and friction modes of a run, or of several side by side for as long as these decide alike.
pub struct HybridState<'a, T> {
    /// Network.
    pub network: &'a Network<T>,
    /// State (speeds, twists) at the end of the last step.
    pub x: Vec<T>,
    /// Friction modes during the last step.
    pub rows: Vec<FrictionState>,
    /// States of lossy gears during the last step.
    pub gears: Vec<GearState>,
    /// Active mode during the last step.
    pub mode: Arc<Mode<T>>,
    /// Expansion of the last step.
    pub expansion: TaylorExpansion<T>,
    /// Events so far.
    pub events: Vec<Event<T>>,
    /// Energy account of the starting impulse.
    pub starting_impulse: ImpulseEnergy<T>,
    /// Compiled modes, including those of this run.
    pub(crate) modes: ModeCache<T>,
    pub(crate) t: T,
    /// Time to the end of the segment, s, without derivatives.
    pub(crate) remaining: T,
    pub(crate) branches: Vec<Branch>,
    /// Elements and gears that leave exact zero speed at the start of the step.
    pub(crate) released: Vec<bool>,
    /// Elements with a normal load.
    pub(crate) pressed: Vec<bool>,
    /// Gears at their torque bound whose speed other elements hold at zero.
    pub(crate) blocked: Vec<bool>,
    /// Inputs and state that decisions are based on.
    pub(crate) inputs_plus: Vec<Series<T>>,
    pub(crate) x_plus: Vec<T>,
    pub(crate) channel_plus: ChannelSeries<T>,
}

impl<'a, T: Number> HybridState<'a, T> {
    /// State `x` at time `t` [s], nothing decided yet.
    pub(crate) fn start(
        network: &'a Network<T>,
        mut modes: ModeCache<T>,
        x: Vec<T>,
        t: T,
    ) -> Result<Self, Status> {
        let frictions = network.frictions.len();
        let key = ModeKey::default();
        let mode = modes
            .cached_mode(key)
            .or_else(|| modes.compile_mode(network, key, &vec![T::zero_(); frictions]));
        let mode = mode.ok_or_else(|| undetermined(network, t.re().leading()))?;
        Ok(Self {
            rows: vec![FrictionState::Open; frictions],
            expansion: TaylorExpansion::new(network),
            events: Vec::new(),
            starting_impulse: ImpulseEnergy { lost: T::zero_(), source: T::zero_() },
            t,
            remaining: T::zero_(),
            branches: vec![Branch::Off; network.channels.len()],
            released: vec![false; frictions + network.losses.len()],
            pressed: vec![false; frictions],
            blocked: vec![false; network.losses.len()],
            x_plus: x.clone(),
            channel_plus: ChannelSeries::default(),
            x,
            inputs_plus: vec![[T::zero_(); TERMS]; network.mechanism.inputs.len()],
            gears: vec![
                GearState::Meshing { sign: 1.0, power_reversed: false };
                network.losses.len()
            ],
            network,
            mode,
            modes,
        })
    }

    /// Expand the motion of the runs `runs`, as bits, from here on: [`TaylorExpansion::expand`].
    pub(crate) fn expand(&mut self, runs: u32, h: T::Values, accuracy: Accuracy) -> T::Values {
        dispatch_simd(ExpandKernel { state: self, runs, h, accuracy })
    }

    /// State of the runs `runs`, as bits, `h` [s] after the start of the expansion.
    pub(crate) fn advance_state(&mut self, runs: u32, h: T) {
        let Self { expansion, x, .. } = self;
        for (x, series) in x.iter_mut().zip(&expansion.states) {
            *x = x.replace_where(runs, evaluate(series, expansion.order, h));
        }
    }

    /// Time for messages, s.
    pub(crate) fn time(&self) -> f64 {
        self.t.re().leading()
    }

    /// Mode of a key, compiled once.
    pub(crate) fn mode(&mut self, key: ModeKey) -> Result<Arc<Mode<T>>, Status> {
        if let Some(mode) = self.modes.cached_mode(key) {
            return Ok(mode);
        }
        let mode = self.modes.compile_mode(self.network, key, &self.capacities());
        mode.ok_or_else(|| undetermined(self.network, self.time()))
    }

    /// Name of the element that an event is about.
    pub(crate) fn element_name_of(&self, cause: EventCause) -> String {
        let row = match cause {
            EventCause::SlipZero(row)
            | EventCause::TorqueLimit(row, _)
            | EventCause::TorqueLimitAtKnot(row) => row,
            EventCause::LoadOnset(j) => RowId::Friction(j),
            EventCause::PowerReversal(i) => RowId::Gear(i),
            EventCause::BranchBoundary(channel, _) if channel < self.rows.len() => {
                RowId::Friction(channel)
            }
            EventCause::BranchBoundary(channel, _) => return format!("torque law {channel}"),
            EventCause::Stalled => return "several elements at once".to_owned(),
        };
        self.network.element_of(row).to_owned()
    }

    /// Position of a row in lists that hold friction elements first, then lossy gears.
    pub(crate) fn index_of(&self, row: RowId) -> usize {
        match row {
            RowId::Friction(j) => j,
            RowId::Gear(i) => self.rows.len() + i,
        }
    }
}

/// [`HybridState::expand`], to be dispatched.
struct ExpandKernel<'r, 'a, T: Number> {
    state: &'r mut HybridState<'a, T>,
    runs: u32,
    h: T::Values,
    accuracy: Accuracy,
}

impl<T: Number> Kernel for ExpandKernel<'_, '_, T> {
    type Output = T::Values;

    #[inline(always)]
    fn run<const F: bool>(self) -> T::Values {
        let Self { state, runs, h, accuracy } = self;
        let HybridState { expansion, network, mode, branches, x, .. } = state;
        expansion.set_start(x);
        expansion.expand(network, mode, branches, runs, h, accuracy)
    }
}

/// Status where a lossy gear or, without one, the inertias leave the motion undetermined.
pub(super) fn undetermined<T>(network: &Network<T>, time: f64) -> Status {
    if let Some(gear) = network.losses.first() {
        return Status::SelfLocking { time, element: gear.element.to_string() };
    }
    let nodes = network.coordinates.independent.iter();
    let members = nodes.map(|&node| network.mechanism.nodes[node].to_string()).collect();
    Status::Undetermined { time, members }
}
