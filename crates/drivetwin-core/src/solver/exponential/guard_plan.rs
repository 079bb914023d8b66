// SPDX-License-Identifier: MIT
//! Guards that are added to the operators of a mode.

use crate::network::smooth_law::{AffineForm, MAX_INPUTS};
use crate::network::{Mode, Network};
use crate::number::Number;
use crate::solver::exponential::propagator::{
    Bound, Form, MAX_ACTIVE, MAX_GUARDS, Propagator, SampleGuard, over_basis,
};

/// A torque to be bounded over samples of length `h` [s] in a mode with the channels `active`.
#[derive(Clone, Copy)]
pub struct TorqueGuard<'w, T> {
    pub network: &'w Network<T>,
    pub mode: &'w Mode<T>,
    pub active: &'w [usize],
    /// Torque over the basis.
    pub row: &'w [T],
    pub h: f64,
}

impl<T: Number, const N: usize> Propagator<T, N> {
    /// Watch a torque over the basis (x, u, 1, φ), bounded in both signs or only the negative one.
    pub fn guard_torque(&mut self, guard: &TorqueGuard<'_, T>, limit: AffineForm<T>, both: bool) {
        let TorqueGuard { network, active, row, .. } = *guard;
        if !self.is_stiff {
            let side = T::of(if both { 1.0 } else { -1.0 });
            self.add_guard(network, active, row, Bound::Within { limit, side });
            return;
        }
        for sign in if both { &[1.0, -1.0][..] } else { &[1.0] } {
            self.add_guard(network, active, row, self.rising(guard, limit, *sign));
        }
    }

    fn rising(&self, guard: &TorqueGuard<'_, T>, limit: AffineForm<T>, side: f64) -> Bound<T, N> {
        let TorqueGuard { network, mode, active, row, h } = *guard;
        let mut states = [T::zero_(); N];
        for (to, &c) in states.iter_mut().zip(row).take(network.states()) {
            *to = c * side;
        }
        let third = over_basis::<T, false, N>(network, mode, &states, h / 3.0);
        let mut inputs = [T::zero_(); MAX_INPUTS];
        for (to, drive) in inputs.iter_mut().zip(&self.inputs) {
            *to = third[network.first_input() + drive.input];
        }
        let third = Form::over(network, active, &[T::of(1.0); MAX_ACTIVE], &third);
        Bound::Rising { limit, side: T::of(side), third, inputs }
    }

    /// Watch a speed over the states, which must stay above zero, over samples of length `h` [s].
    pub fn guard_speed(
        &mut self,
        network: &Network<T>,
        mode: &Mode<T>,
        active: &[usize],
        row: &[T],
        h: f64,
    ) {
        let mut speed = [T::zero_(); N];
        for (to, &c) in speed.iter_mut().zip(row).take(network.states()) {
            *to = c;
        }
        let third = over_basis::<T, false, N>(network, mode, &speed, h / 3.0);
        self.add_guard(network, active, &third, Bound::Above(speed));
    }

    fn add_guard(&mut self, network: &Network<T>, active: &[usize], row: &[T], bound: Bound<T, N>) {
        let place = self.guards.len();
        if place >= MAX_GUARDS {
            self.is_overfull = true;
            return;
        }
        for drive in &mut self.inputs {
            drive.guards[place] =
                row.get(network.first_input() + drive.input).map_or(T::zero_(), |&c| c);
        }
        let form = Form::over(network, active, &[T::of(1.0); MAX_ACTIVE], row);
        self.guards.push(SampleGuard { form, bound });
    }
}
