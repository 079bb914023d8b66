// SPDX-License-Identifier: MIT
//! Changes of mode at events and at jumps of the inputs.

use crate::network::nonlinear_torque::form;
use crate::network::{Branch, GearState, RowId};
use crate::number::{Number, Values};
use crate::solver::hybrid::active_set::ActiveSet;
use crate::solver::hybrid::event::{Event, EventCause, EventKind, FrictionState, signum_nonneg};
use crate::solver::hybrid::state::HybridState;
use crate::solver::status::Status;
use crate::solver::tolerances::{STALLED_SLIP, VENT_TIME};

impl<T: Number> HybridState<'_, T> {
    /// Carry out what an event caused; the inputs are those about this instant.
    pub(crate) fn change(&mut self, cause: EventCause) -> Result<(), Status> {
        match cause {
            EventCause::SlipZero(row) => {
                self.apply_locking_impulse(&[row])?;
                self.decide(None)
            }
            EventCause::LoadOnset(j) => {
                self.press(j, !self.pressed[j]);
                self.decide(None)
            }
            EventCause::TorqueLimit(RowId::Friction(j), _)
            | EventCause::TorqueLimitAtKnot(RowId::Friction(j))
                if self.is_about_to_vent(j) =>
            {
                self.press(j, false);
                self.decide(None)
            }
            EventCause::TorqueLimit(row, sign) => {
                self.apply_locking_impulse(&[])?;
                self.decide(Some((row, sign)))
            }
            EventCause::TorqueLimitAtKnot(_) => {
                self.apply_locking_impulse(&[])?;
                self.decide(None)
            }
            EventCause::PowerReversal(i) => {
                if let GearState::Meshing { power_reversed, .. } = &mut self.gears[i] {
                    *power_reversed = !*power_reversed;
                }
                self.decide(None)
            }
            EventCause::Stalled => {
                self.apply_locking_impulse(&self.nearly_at_rest())?;
                for i in self.rows.len()..self.network.channels.len() {
                    self.branches[i] = self.cell_now(i);
                }
                self.decide(None)
            }
            EventCause::BranchBoundary(channel, branch) => {
                let before = std::mem::replace(&mut self.branches[channel], branch);
                if self.network.channels[channel].is_coupled() && turns(before, branch) {
                    return self.settle_cells();
                }
                Ok(())
            }
        }
    }

    /// Speed that a row keeps at zero where it is at rest.
    fn slip(&self, row: RowId) -> T {
        form(self.network.slip_of(row), &self.x)
    }

    /// Rows that can have moved only within the moment that a stalled run moved on.
    fn nearly_at_rest(&self) -> Vec<RowId> {
        let frictions = (0..self.rows.len()).filter(|&j| self.rows[j] != FrictionState::Open);
        let directional = |i: &usize| self.network.losses[*i].loss.is_directional();
        let gears = (0..self.gears.len()).filter(directional);
        let rows = frictions.map(RowId::Friction).chain(gears.map(RowId::Gear));
        rows.filter(|&row| self.slip(row).re().decide(|slip| slip.abs() < STALLED_SLIP)).collect()
    }

    /// True if the normal load vanishes within round-off of the time. The remaining capacity is then no
    /// larger than the round-off of the torque.
    fn is_about_to_vent(&self, j: usize) -> bool {
        let normal = &self.network.frictions[j].normal;
        let [now, rate] = [0, 1].map(|k| normal.term(&self.expansion.inputs, k).re());
        self.pressed[j] && now.decide_with(rate, |now, rate| now <= -rate * VENT_TIME)
    }

    /// The first element of which the normal load is gone from an instant on in some runs, as bits, by the values
    /// of inputs there and their rates: a load that ends at nothing falls through nothing.
    pub(crate) fn find_unloaded(
        &self,
        inputs: impl Fn(usize) -> [T::Values; 2],
    ) -> Option<(usize, u32)> {
        let pressed = (0..self.rows.len()).filter(|&j| self.pressed[j]);
        pressed
            .map(|j| (j, self.network.frictions[j].normal.is_unloaded(&inputs)))
            .find(|&(_, runs)| runs != 0)
    }

    /// Start of a run: prescribed speeds, elements at rest, directions of gears, branches.
    pub(crate) fn engage_initial(&mut self, locked: &[usize]) -> Result<(), Status> {
        let locked: Vec<RowId> = locked.iter().map(|&j| RowId::Friction(j)).collect();
        let events = self.apply_starting_impulse(&locked)?;
        self.turn_gears();
        for i in self.rows.len()..self.network.channels.len() {
            self.branches[i] = self.cell_now(i);
        }
        self.refresh()?;
        self.events = events;
        Ok(())
    }

    /// Update normal loads, branches and friction states from the inputs at this instant, as after
    /// a jump.
    pub(crate) fn refresh(&mut self) -> Result<(), Status> {
        for j in 0..self.rows.len() {
            let normal = &self.network.frictions[j].normal;
            let [now, rate] = [0, 1].map(|k| normal.term(&self.expansion.inputs, k).re());
            let there = now.decide_with(normal.load_tolerance().re(), |now, nothing| now > nothing);
            let sets_in = now.decide_with(rate, |now, rate| now >= 0.0 && rate > 0.0);
            self.press(j, there || sets_in);
        }
        for i in self.rows.len()..self.network.channels.len() {
            if self.network.channels[i].follows_inputs() {
                self.branches[i] = self.cell_now(i);
            }
        }
        self.decide(None)
    }

    /// True if one of the locks carries its full capacity, or their torque split follows the capacities.
    /// The locks are then decided anew at every sample; accelerations do not depend on the split.
    pub(crate) fn is_split(&self) -> bool {
        let saturated = self.rows.iter().any(FrictionState::is_saturated);
        self.mode.redundant || saturated || self.blocked.contains(&true)
    }

    /// Give an element a normal load or take it away.
    fn press(&mut self, j: usize, pressed: bool) {
        let row = &self.network.frictions[j];
        self.pressed[j] = pressed;
        let slip = form(&row.slip, &self.x).re();
        let state = match (pressed, self.rows[j]) {
            (_, FrictionState::Open) if row.one_way => FrictionState::Slipping { sign: -1.0 },
            (false, state) if row.one_way => state,
            (false, _) => FrictionState::Open,
            (true, FrictionState::Open) => FrictionState::Slipping { sign: signum_nonneg(slip) },
            (true, state) => state,
        };
        let mut after = ActiveSet { rows: self.rows.clone(), gears: self.gears.clone() };
        after.rows[j] = state;
        self.record_changes(&after);
        self.rows = after.rows;
    }

    /// Directions of lossy gears by their speeds, power taken to flow forward.
    pub(super) fn turn_gears(&mut self) {
        for (gear, loss) in self.gears.iter_mut().zip(&self.network.losses) {
            let sign = signum_nonneg(form(&loss.speed, &self.x).re());
            *gear = GearState::Meshing { sign, power_reversed: false };
        }
    }

    /// State and inputs of the basis for a decision, without the channels.
    pub(crate) fn basis_without_channels(&self) -> Vec<T> {
        let inputs = &self.inputs_plus;
        let mut basis = Vec::with_capacity(self.network.basis());
        basis.extend_from_slice(&self.x_plus);
        basis.extend(inputs.iter().map(|input| input[0]));
        basis.extend(self.network.prescribed.iter().map(|&(_, input)| inputs[input][1]));
        basis.push(T::of(1.0));
        basis
    }

    /// Torque of a channel for a decision, in its present branch; of a gear with a table of losses the part without
    /// torque.
    pub(crate) fn channel_plus(&mut self, i: usize) -> T {
        let (channel, series) = (&self.network.channels[i], &mut self.channel_plus);
        for (argument, row) in series.arguments.iter_mut().zip(&channel.arguments) {
            argument[0] = form(row, &self.x_plus);
        }
        if channel.is_coupled() {
            series.arguments[1][0] = T::zero_();
        }
        channel.term(self.branches[i], &self.inputs_plus, series, 0);
        series.torque[0]
    }

    fn cell_now(&self, i: usize) -> Branch {
        let channel = &self.network.channels[i];
        let mut arguments = [T::Values::zero_(); 2];
        for (argument, row) in arguments.iter_mut().zip(&channel.arguments) {
            *argument = form(row, &self.x).re();
        }
        channel.branch_at(arguments, signum_nonneg(arguments[0]), &self.expansion.inputs)
    }

    /// Note every difference between the present modes and `after` as an event.
    pub(crate) fn record_changes(&mut self, after: &ActiveSet) {
        use FrictionState::{Open, Saturated, Slipping, Sticking};
        let mut events = Vec::new();
        for (element, (&before, &after)) in self.rows.iter().zip(&after.rows).enumerate() {
            let kind = match (before, after) {
                (Open, Open) => continue,
                (_, Open) => EventKind::ClutchVented,
                (Open, _) => EventKind::ClutchFilled,
                (Slipping { .. }, Sticking | Saturated { .. }) => EventKind::Lock,
                (Sticking | Saturated { .. }, Slipping { .. }) => EventKind::BreakAway,
                (Slipping { sign: a }, Slipping { sign: b }) if a != b => EventKind::Reverse,
                _ => continue,
            };
            events.push((element, kind));
        }
        for (i, (&before, &after)) in self.gears.iter().zip(&after.gears).enumerate() {
            let kind = match (before, after) {
                (GearState::Meshing { .. }, GearState::Locked) => EventKind::Lock,
                (GearState::Locked, GearState::Meshing { .. }) => EventKind::BreakAway,
                (GearState::Meshing { sign: a, .. }, GearState::Meshing { sign: b, .. })
                    if a != b =>
                {
                    EventKind::Reverse
                }
                _ => continue,
            };
            events.push((self.rows.len() + i, kind));
        }
        let time = self.t;
        let energy = T::zero_();
        let event = |(element, kind)| Event { time, element, kind, energy };
        self.events.extend(events.into_iter().map(event));
    }
}

/// Return true if a gear with a table of losses turns round.
fn turns(before: Branch, after: Branch) -> bool {
    matches!((before, after), (Branch::Loss { sign: a, .. }, Branch::Loss { sign: b, .. }) if a != b)
}
