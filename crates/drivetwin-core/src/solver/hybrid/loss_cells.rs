// SPDX-License-Identifier: MIT
//! Cells of the tables of gear losses in which the torques of a mode lie.

use crate::network::loss_coupling::LossCoupling;
use crate::network::nonlinear_torque::form;
use crate::network::{Branch, Mode, TableLoss};
use crate::number::{Number, Values};
use crate::solver::hybrid::state::HybridState;
use crate::solver::status::Status;
use std::sync::Arc;

/// The first border on the way to a solution.
struct Crossing<V> {
    /// Table that leaves its cell.
    index: usize,
    /// Cell beyond.
    next: Branch,
    /// Share of the way up to it.
    share: V,
}

impl<T: Number> HybridState<'_, T> {
    /// Enter the loss torques of a mode into the basis, which holds everything else a moment from now, and
    /// adopt the cells in which they lie.
    ///
    /// From torques of zero on, the torques follow the straight line to the solution of the present cells up to
    /// the first border, and on from there in the next cell (Katzenelson 1965): the residual falls throughout.
    pub(crate) fn settle_losses(&mut self, mode: &Mode<T>, basis: &mut [T]) -> Result<(), Status> {
        let network = self.network;
        let losses = &network.table_losses;
        let Some(first) = losses.first() else { return Ok(()) };
        let mut cells: Vec<Branch> =
            losses.iter().map(|loss| self.cell_without_torque(loss)).collect();
        let mut torques = vec![T::Values::zero_(); cells.len()];
        let borders: usize = losses.iter().map(|loss| loss.map.throttle.len()).sum();
        for _ in 0..=4 * borders {
            let Some(ahead) = self.solve_cells(mode, basis, &cells) else { break };
            let Some(border) = first_border(losses, &cells, &torques, &ahead) else {
                return Ok(());
            };
            for (torque, ahead) in torques.iter_mut().zip(&ahead) {
                *torque += (ahead.re() - *torque) * border.share;
            }
            cells[border.index] = border.next;
        }
        Err(Status::SelfLocking { time: self.time(), element: first.element.to_string() })
    }

    /// Adopt the cells anew, as where a gear turns round.
    pub(crate) fn settle_cells(&mut self) -> Result<(), Status> {
        self.evaluate_at_t_plus()?;
        let (trial, candidates) = (self.assignment(), self.list_at_zero_speed());
        let mode = Arc::clone(&self.mode);
        self.basis_now(&trial, &candidates, &mode).map(drop)
    }

    fn cell_without_torque(&self, loss: &TableLoss) -> Branch {
        let slip = form(&self.network.channels[loss.channel].arguments[0], &self.x_plus).re();
        loss.cell_without_torque(slip, self.branches[loss.channel])
    }

    /// Torques if all lie in these cells, with the loss torques entered; `None` if they are undetermined.
    fn solve_cells(&mut self, mode: &Mode<T>, basis: &mut [T], cells: &[Branch]) -> Option<Vec<T>> {
        let network = self.network;
        let mut slopes = Vec::with_capacity(cells.len());
        for (loss, &cell) in network.table_losses.iter().zip(cells) {
            self.branches[loss.channel] = cell;
            basis[network.first_channel() + loss.channel] = self.channel_plus(loss.channel);
            let slip = self.channel_plus.arguments[0][0];
            slopes.push(network.channels[loss.channel].loss_slope(cell, slip));
        }
        Some(LossCoupling::new(network, mode, slopes)?.close(network, mode, basis))
    }
}

/// The first border between torques and those ahead.
fn first_border<T: Number>(
    losses: &[TableLoss],
    cells: &[Branch],
    torques: &[T::Values],
    ahead: &[T],
) -> Option<Crossing<T::Values>> {
    let mut first: Option<Crossing<T::Values>> = None;
    for (index, (loss, &cell)) in losses.iter().zip(cells).enumerate() {
        let (now, then) = (torques[index], ahead[index].re());
        let Some((border, next)) = loss.border_before(cell, then) else { continue };
        let share = ((border - now) / (then - now)).larger(T::Values::zero_());
        let earlier = first
            .as_ref()
            .is_none_or(|first| share.decide_with(first.share, |share, least| share < least));
        if earlier {
            first = Some(Crossing { index, next, share });
        }
    }
    first
}
