// SPDX-License-Identifier: MIT
//! Impulses of a run: that of its start, and the round-off of everything at rest.

use crate::network::linalg::Matrix;
use crate::network::nonlinear_torque::form;
use crate::network::{Demand, GearState, Impulse, ImpulseFault, ModeKey, RowId};
use crate::number::{Number, Values};
use crate::solver::hybrid::event::{Event, EventKind, FrictionState};
use crate::solver::hybrid::state::{HybridState, undetermined};
use crate::solver::status::Status;
use crate::solver::tolerances::{
    FORCED_ACCELERATION_RTOL, JUMP_ENERGY_RTOL, SPEED_FLOOR, START_SPEED_RTOL,
};

/// Energy of an impulse, J.
#[derive(Clone, Copy, Debug)]
pub struct ImpulseEnergy<T> {
    /// Lost in elements brought to rest and in gears.
    pub lost: T,
    /// Brought in by prescribed speeds.
    pub source: T,
}

impl<T: Number> HybridState<'_, T> {
    /// Set prescribed speeds and bring rows to rest by an impulse that no one-way clutch overruns in and that
    /// passes lossy gears as torques do, each in the direction of its own. Where no directions agree with
    /// their impulses, the last are taken. Returns an event for every element that loses energy.
    pub(super) fn apply_starting_impulse(
        &mut self,
        rows: &[RowId],
    ) -> Result<Vec<Event<T>>, Status> {
        let network = self.network;
        let inputs = &self.expansion.inputs;
        let prescribed: Vec<T> =
            network.prescribed.iter().map(|&(_, input)| inputs[input][0]).collect();
        let before = self.x.clone();
        let demand = Demand { rows, speeds: &before, prescribed: &prescribed };
        if self.is_round_off(rows, &network.excess(rows, &before, &prescribed)) {
            if T::DERIVATIVES && !network.losses.is_empty() {
                self.turn_gears();
                let impulse = self.impulse(demand)?;
                self.add_to_speeds(&impulse.change);
            }
            self.apply_locking_impulse(rows)?;
            return Ok(Vec::new());
        }
        self.turn_gears();
        let mut impulse = self.impulse(demand)?;
        for _ in 0..2 * self.gears.len() {
            if !self.turn_power(&impulse.entering) {
                break;
            }
            impulse = self.impulse(demand)?;
        }
        self.add_to_speeds(&impulse.change);
        self.apply_locking_impulse(&impulse.rows)?;
        let events = self.account(&before, &impulse);
        let ImpulseEnergy { lost, source } = self.starting_impulse;
        let (gain, energy) = self.kinetic_gain(&before, &impulse.change);
        let moved = energy + lost.re().magnitude() + source.re().magnitude();
        self.check_energy(&impulse.rows, gain + lost.re() - source.re(), moved)?;
        Ok(events)
    }

    fn impulse(&self, demand: Demand<'_, T>) -> Result<Impulse<T>, Status> {
        let key = ModeKey::new(std::iter::empty(), &self.gears);
        self.network.impulse(key, demand).map_err(|fault| match fault {
            ImpulseFault::Undetermined => undetermined(self.network, self.time()),
            ImpulseFault::Conflict { element, with } => {
                Status::Blocked { time: self.time(), element, with }
            }
        })
    }

    /// Return true if the speeds that are to vanish, of `rows` and then of prescribed speeds, are the round-off
    /// of the speeds of their members.
    fn is_round_off(&self, rows: &[RowId], excess: &Matrix<T>) -> bool {
        let (network, floor) = (self.network, T::Values::of(SPEED_FLOOR));
        let speed = |node| form(network.coordinates.speeds.row(node), &self.x);
        let (_, nodes) = network.build_held_speeds(rows);
        nodes.iter().enumerate().all(|(i, terms)| {
            let terms = terms.iter().map(|&(node, c)| (c * speed(node)).re().magnitude());
            let scale = terms.fold(floor, |largest, term| term.larger(largest));
            let excess = excess[(i, 0)].re().magnitude();
            excess.decide_with(scale, |excess, scale| excess <= START_SPEED_RTOL * scale)
        })
    }

    /// Gain of the kinetic energy by a change of the speeds `before`, and the energy that its round-off is
    /// relative to, J.
    fn kinetic_gain(&self, before: &[T], change: &Matrix<T>) -> (T::Values, T::Values) {
        let (mut gain, mut energy) = (T::Values::zero_(), T::Values::zero_());
        for i in 0..change.rows {
            let mut momentum = T::Values::zero_();
            for (j, mass) in self.network.mass.row(i).iter().enumerate() {
                momentum += mass.re() * (before[j].re() + change[(j, 0)].re() * 0.5);
            }
            gain += change[(i, 0)].re() * momentum;
            let speed = before[i].re().magnitude().larger(T::Values::of(SPEED_FLOOR));
            energy += self.network.mass[(i, i)].re() * speed * speed * 0.5;
        }
        (gain, energy)
    }

    /// Refuse an impulse on `rows` and prescribed speeds that leaves an `error` in the balance of `energy` [J].
    fn check_energy(
        &self,
        rows: &[RowId],
        error: T::Values,
        energy: T::Values,
    ) -> Result<(), Status> {
        if !error.decide_with(energy, |error, energy| error.abs() > JUMP_ENERGY_RTOL * energy) {
            return Ok(());
        }
        let network = self.network;
        let resting = rows.iter().map(|&row| network.element_of(row).to_owned());
        let prescribed = network.mechanism.prescribed.iter().map(|p| p.element.to_string());
        let elements = resting.chain(prescribed).collect();
        let (error, energy) = (error.leading(), energy.leading());
        Err(Status::Unbalanced { time: self.time(), elements, error, energy })
    }

    fn add_to_speeds(&mut self, change: &Matrix<T>) {
        for i in 0..self.network.speeds() {
            self.x[i] += change[(i, 0)];
        }
    }

    /// Set the direction of power in lossy gears by the impulses that enter them; whether one has changed.
    fn turn_power(&mut self, entering: &Matrix<T>) -> bool {
        let before = self.gears.clone();
        for (i, gear) in self.gears.iter_mut().enumerate() {
            if let GearState::Meshing { sign, power_reversed } = gear
                && self.network.losses[i].loss.is_directional()
            {
                *power_reversed = entering[(i, 0)].re().decide(|impulse| impulse * *sign < 0.0);
            }
        }
        self.gears != before
    }

    /// Book the energy of an impulse from the speeds `before`: prescribed speeds do work at their speed, and
    /// every element takes its impulse at the mean of what its speed is changed by. The loss is divided
    /// among the elements by the magnitudes of their shares.
    fn account(&mut self, before: &[T], impulse: &Impulse<T>) -> Vec<Event<T>> {
        let network = self.network;
        let half = |a: T, b: T| (a + b) * 0.5;
        let mut shares: Vec<(usize, T)> = Vec::new();
        for (i, &row) in impulse.rows.iter().enumerate() {
            let change = form(network.slip_of(row), before);
            shares.push((self.index_of(row), impulse.impulses[(i, 0)] * half(change, T::zero_())));
        }
        for (i, gear) in network.losses.iter().enumerate() {
            if let GearState::Meshing { sign, power_reversed } = self.gears[i] {
                let torque = |through| gear.loss.loss_torque(through, sign, power_reversed);
                let lost = torque(impulse.entering[(i, 0)]) - torque(T::zero_());
                let mean = half(form(&gear.speed, before), form(&gear.speed, &self.x));
                shares.push((self.rows.len() + i, lost * mean));
            }
        }
        let mut source = T::zero_();
        for (i, (speed, _)) in network.prescribed.iter().enumerate() {
            let pushed = impulse.impulses[(impulse.rows.len() + i, 0)];
            let (from, to) = (form(speed, before), form(speed, &self.x));
            source -= pushed * to;
            let element = self.rows.len() + network.losses.len() + i;
            shares.push((element, pushed * half(from, -to)));
        }
        let lost = shares.iter().fold(T::zero_(), |sum, &(_, share)| sum + share);
        self.starting_impulse = ImpulseEnergy { lost, source };
        let size = |share: &T| T::promote(share.re().magnitude());
        let all = shares.iter().fold(T::zero_(), |sum, (_, share)| sum + size(share));
        let (time, kind) = (self.t, EventKind::Impulse);
        let counts = |(_, share): &&(usize, T)| share.re().decide(|share| share != 0.0);
        let event = |(element, share): &(usize, T)| Event {
            time,
            element: *element,
            kind,
            energy: lost * (size(share) / all),
        };
        shares.iter().filter(counts).map(event).collect()
    }

    /// Return true if a row cannot be released in a direction: prescribed speeds can ask for it where another
    /// row gives way to them.
    pub(super) fn is_blocked(&self, row: RowId, sign: f64) -> bool {
        sign > 0.0 && self.network.is_one_way(row)
    }

    /// Refuse prescribed speeds that a one-way clutch at rest blocks, whatever gives way.
    pub(super) fn check_forced(&self, candidates: &[RowId]) -> Result<(), Status> {
        let network = self.network;
        let one_way = candidates.iter().copied().filter(|&row| network.is_one_way(row));
        let one_way: Vec<RowId> = one_way.collect();
        if network.prescribed.is_empty() || one_way.is_empty() {
            return Ok(());
        }
        let inputs = &self.inputs_plus;
        let rates: Vec<T> = network.prescribed.iter().map(|&(_, input)| inputs[input][1]).collect();
        match network.check_forced(&one_way, &rates, FORCED_ACCELERATION_RTOL) {
            Err(ImpulseFault::Conflict { element, with }) => {
                Err(Status::Blocked { time: self.time(), element, with })
            }
            _ => Ok(()),
        }
    }

    /// Set prescribed speeds and remove the round-off speed of everything at rest and of `more`,
    /// changing the momentum least.
    pub(super) fn apply_locking_impulse(&mut self, more: &[RowId]) -> Result<(), Status> {
        let network = self.network;
        let resting = |j: usize| {
            matches!(self.rows[j], FrictionState::Sticking | FrictionState::Saturated { .. })
        };
        let frictions = (0..self.rows.len()).filter(|&j| resting(j)).map(RowId::Friction);
        let held = |i: &usize| self.gears[*i] == GearState::Locked;
        let gears = (0..self.gears.len()).filter(held).map(RowId::Gear);
        let mut rows: Vec<RowId> = frictions.chain(gears).collect();
        rows.extend(more.iter().filter(|row| !rows.contains(row)).copied().collect::<Vec<_>>());
        if rows.is_empty() && network.prescribed.is_empty() {
            return Ok(());
        }
        let inputs = &self.expansion.inputs;
        let prescribed: Vec<T> =
            network.prescribed.iter().map(|&(_, input)| inputs[input][0]).collect();
        let excess = network.excess(&rows, &self.x, &prescribed);
        let change = network.hold_by_mass(&rows).stop(&excess);
        let change = change.ok_or_else(|| undetermined(network, self.time()))?;
        let (gain, energy) = self.kinetic_gain(&self.x, &change);
        self.check_energy(&rows, gain, energy)?;
        self.add_to_speeds(&change);
        Ok(())
    }
}
