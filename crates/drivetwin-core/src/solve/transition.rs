// SPDX-License-Identifier: MIT
//! Changes of mode at events and at jumps of the inputs.

use super::guard::Cause;
use super::integrator::{Event, EventKind, Integrator, RowState, sign_of};
use super::status::Status;
use crate::network::channel::{ChannelSeries, form};
use crate::network::linalg::{Matrix, least_norm, solve};
use crate::number::Real;

impl<T: Real> Integrator<'_, T> {
    /// Carry out what the last event caused.
    pub(super) fn change_mode(&mut self) -> Result<(), Status> {
        let Some(cause) = self.pending.take() else { return Ok(()) };
        self.inputs.at(self.segment, self.t, &mut self.expansion.inputs);
        match cause {
            Cause::SlipZero(j) => {
                self.bring_to_rest(&[j]);
                self.decide(None)
            }
            Cause::Fill(j) => self.fill(j),
            Cause::Vent(j) => self.vent(j),
            Cause::Overload(j) => {
                self.bring_to_rest(&[]);
                let sign = self.holding_sign(j);
                self.decide(Some((j, sign)))
            }
            Cause::PowerReversal(i) => {
                self.backward ^= 1 << i;
                self.decide(None)
            }
            Cause::SpeedReversal(i) => {
                self.gear_speed_sign[i] = -self.gear_speed_sign[i];
                self.decide(None)
            }
            Cause::Border(channel, cell) => {
                self.cells[channel] = cell;
                Ok(())
            }
        }
    }

    /// Take up everything anew at this instant, as after a jump of an input.
    pub(super) fn refresh(&mut self) -> Result<(), Status> {
        self.inputs.at(self.segment, self.t, &mut self.expansion.inputs);
        let mut rows = self.rows.clone();
        for (j, row) in self.network.frictions.iter().enumerate() {
            let [normal, rate] = row.normal.line(&self.expansion.inputs).map(|n| n.re());
            let pressed = normal > 0.0 || (normal == 0.0 && rate > 0.0);
            let slip = form(&row.slip, &self.x).re();
            rows[j] = match (pressed, rows[j]) {
                (false, _) => RowState::Open,
                (true, RowState::Open) => RowState::Slipping { sign: sign_of(slip) },
                (true, state) => state,
            };
        }
        self.record_changes(&rows);
        self.rows = rows;
        for i in self.network.frictions.len()..self.network.channels.len() {
            let channel = &self.network.channels[i];
            let speed = form(&channel.speed, &self.x).re();
            self.cells[i] = channel.cell_at(speed, sign_of(speed), &self.expansion.inputs);
        }
        self.decide(None)
    }

    /// Locks of which one carries its full capacity, or whose split follows the capacities, are
    /// decided anew at every sample; accelerations do not depend on the split.
    pub(super) fn refresh_split(&mut self) -> Result<(), Status> {
        let saturated = |row: &RowState| matches!(row, RowState::Saturated { .. });
        if self.mode.redundant || self.rows.iter().any(saturated) {
            self.decide(None)?;
        }
        Ok(())
    }

    fn fill(&mut self, j: usize) -> Result<(), Status> {
        let slip = form(&self.network.frictions[j].slip, &self.x).re();
        let mut rows = self.rows.clone();
        rows[j] = RowState::Slipping { sign: sign_of(slip) };
        self.record_changes(&rows);
        self.rows = rows;
        self.decide(None)
    }

    fn vent(&mut self, j: usize) -> Result<(), Status> {
        let mut rows = self.rows.clone();
        rows[j] = RowState::Open;
        self.record_changes(&rows);
        self.rows = rows;
        self.decide(None)
    }

    /// Remove the round-off slip of everything stuck and of `more`, changing the momentum least.
    pub(super) fn bring_to_rest(&mut self, more: &[usize]) {
        let at_rest = |j: &usize| {
            more.contains(j)
                || matches!(self.rows[*j], RowState::Stuck | RowState::Saturated { .. })
        };
        let rows: Vec<usize> = (0..self.rows.len()).filter(at_rest).collect();
        if rows.is_empty() {
            return;
        }
        let mut g = Matrix::zeros(rows.len(), self.network.speeds());
        let mut slip = Matrix::zeros(rows.len(), 1);
        for (i, &j) in rows.iter().enumerate() {
            g.row_mut(i).copy_from_slice(&self.network.frictions[j].slip);
            slip[(i, 0)] = form(g.row(i), &self.x);
        }
        let response = solve(&self.network.mass, &g.transposed()).expect("the mass is regular");
        let change = response.times(&least_norm(&g.times(&response), &slip));
        for i in 0..self.network.speeds() {
            self.x[i] -= change[(i, 0)];
        }
    }

    /// Sign of the torque that a stuck element holds now.
    fn holding_sign(&self, j: usize) -> f64 {
        let position = self.mode.stuck.iter().position(|&s| s == j);
        let row = self.mode.stuck_torque.row(position.expect("the element is stuck"));
        let mut basis = self.x.clone();
        basis.extend(self.expansion.inputs.iter().map(|input| input[0]));
        basis.push(T::of(1.0));
        basis.extend((0..self.cells.len()).map(|i| self.channel_now(i)));
        sign_of(form(row, &basis).re())
    }

    /// Torque of a channel at this instant, in its present cell.
    pub(super) fn channel_now(&self, i: usize) -> T {
        let channel = &self.network.channels[i];
        let mut series = ChannelSeries::default();
        series.speed[0] = form(&channel.speed, &self.x);
        channel.term(self.cells[i], &self.expansion.inputs, &mut series, 0);
        series.torque[0]
    }

    /// Note every difference between the friction modes and `rows` as an event.
    pub(super) fn record_changes(&mut self, rows: &[RowState]) {
        use RowState::{Open, Saturated, Slipping, Stuck};
        for (element, (&before, &after)) in self.rows.iter().zip(rows).enumerate() {
            let kind = match (before, after) {
                (Open, Open) => continue,
                (_, Open) => EventKind::Vent,
                (Open, _) => EventKind::Fill,
                (Slipping { .. }, Stuck | Saturated { .. }) => EventKind::Lock,
                (Stuck | Saturated { .. }, Slipping { .. }) => EventKind::BreakAway,
                (Slipping { sign: a }, Slipping { sign: b }) if a != b => EventKind::Reverse,
                _ => continue,
            };
            self.events.push(Event { time: self.t, element, kind });
        }
    }
}
