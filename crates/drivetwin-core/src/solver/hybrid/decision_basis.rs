// SPDX-License-Identifier: MIT
//! The basis that decisions are taken on: inputs, state and torques a moment from now.

use crate::network::nonlinear_torque::form;
use crate::network::{FrictionElement, Mode, RowId};
use crate::number::{Number, Values, evaluate};
use crate::solver::hybrid::active_set::ActiveSet;
use crate::solver::hybrid::event::FrictionState;
use crate::solver::hybrid::state::HybridState;
use crate::solver::status::Status;
use crate::solver::tolerances::{T_PLUS, T_PLUS_CHANGE, T_PLUS_SHARE};
use std::sync::Arc;

impl<T: Number> HybridState<'_, T> {
    /// Inputs and state a moment from now, as the present mode would have them: where torques and
    /// capacities agree, or all start from zero, their rates decide.
    pub(super) fn evaluate_at_t_plus(&mut self) -> Result<(), Status> {
        let remaining = self.remaining.re().larger(T::Values::zero_());
        let moment = T::promote((remaining * T_PLUS_SHARE).smaller(T::Values::of(T_PLUS)));
        let order = self.expansion.input_order();
        for (ahead, now) in self.inputs_plus.iter_mut().zip(&self.expansion.inputs) {
            *ahead = *now;
            ahead[0] = evaluate(now, order, moment);
        }
        self.x_plus.clone_from(&self.x);
        let mut basis = self.basis_without_channels();
        basis.extend((0..self.network.channels.len()).map(|i| self.channel_plus(i)));
        let mode = Arc::clone(&self.mode);
        self.settle_losses(&mode, &mut basis)?;
        for (i, ahead) in self.x_plus.iter_mut().enumerate() {
            let change = form(self.mode.derivative.row(i), &basis) * moment;
            let most = (ahead.re().magnitude() + T::Values::of(1.0)) * T_PLUS_CHANGE;
            *ahead += change * T::promote(most / change.re().magnitude().larger(most));
        }
        Ok(())
    }

    /// The basis at this instant under a trial with its mode.
    pub(super) fn basis_now(
        &mut self,
        trial: &ActiveSet,
        candidates: &[RowId],
        mode: &Mode<T>,
    ) -> Result<Vec<T>, Status> {
        let mut basis = self.basis_without_channels();
        for (j, row) in self.network.frictions.iter().enumerate() {
            let at_rest = candidates.contains(&RowId::Friction(j));
            let slip = if at_rest { T::zero_() } else { form(&row.slip, &self.x_plus) };
            let normal = self.normal(j);
            basis.push(match trial.rows[j] {
                FrictionState::Slipping { sign } => row.law.at(slip * sign) * normal * sign,
                FrictionState::Saturated { sign } => {
                    row.law.at(T::zero_()) * row.peak * normal * sign
                }
                FrictionState::Sticking | FrictionState::Open => T::zero_(),
            });
        }
        let others = self.network.frictions.len()..self.network.channels.len();
        basis.extend(others.map(|i| self.channel_plus(i)));
        self.settle_losses(mode, &mut basis)?;
        Ok(basis)
    }

    /// Normal load of an element now, cut at zero.
    fn normal(&self, j: usize) -> T {
        let normal = self.network.frictions[j].normal.term(&self.inputs_plus, 0);
        if self.pressed[j] && normal.re().decide(|normal| normal > 0.0) {
            normal
        } else {
            T::zero_()
        }
    }

    /// Static capacities of the friction elements.
    pub(crate) fn capacities(&self) -> Vec<T> {
        let capacity = |(j, row): (usize, &FrictionElement<T>)| {
            row.law.at(T::zero_()) * row.peak * self.normal(j)
        };
        self.network.frictions.iter().enumerate().map(capacity).collect()
    }
}
