// SPDX-License-Identifier: MIT
//! Loss torques by tables: that of a gear depends on the torque through its gear, which depends on all of them.
//!
//! In one cell of every table, at every order of time, the loss torques are `φ = c + g T` over the torques T that
//! enter the gears; in one mode `T = r + B φ`. Together `(1 - B g) T = r + B c`.

use super::compile::Network;
use super::linalg::{Matrix, solve};
use super::mode::Mode;
use super::nonlinear_torque::form;
use crate::number::Number;

/// The solved coupling of the loss torques in one mode and one cell of every table.
#[derive(Clone, Debug)]
pub struct LossCoupling<T> {
    /// `(1 - B g)⁻¹`.
    inverse: Matrix<T>,
    /// g, loss torque per torque that enters.
    slopes: Vec<T>,
}

impl<T: Number> Mode<T> {
    /// Torques that enter the gears with tables of losses, over the basis; in the order of
    /// [`Network::table_losses`]. Computed when first asked for.
    pub fn table_torque(&self, network: &Network<T>) -> &Matrix<T> {
        self.table_torque.get_or_init(|| {
            let constraints: Vec<usize> =
                network.table_losses.iter().map(|loss| loss.constraint).collect();
            let mut entering = self.multipliers(network).select_rows(&constraints);
            for (i, loss) in network.table_losses.iter().enumerate() {
                entering[(i, network.first_channel() + loss.channel)] += 1.0;
            }
            entering
        })
    }
}

impl<T: Number> LossCoupling<T> {
    /// Solve for loss torques that grow by `slopes` per torque; `None` if these leave the torques undetermined.
    pub fn new(network: &Network<T>, mode: &Mode<T>, slopes: Vec<T>) -> Option<Self> {
        let count = slopes.len();
        let entering = mode.table_torque(network);
        let (mut left, mut unit) = (Matrix::zeros(count, count), Matrix::zeros(count, count));
        for i in 0..count {
            for (j, loss) in network.table_losses.iter().enumerate() {
                left[(i, j)] = -(entering[(i, network.first_channel() + loss.channel)] * slopes[j]);
            }
            left[(i, i)] += 1.0;
            unit[(i, i)] = T::of(1.0);
        }
        let inverse = solve(left, unit).ok()?;
        Some(Self { inverse, slopes })
    }

    /// Torques T of one order. The basis of that order holds c in place of the loss torques, and then these.
    pub fn close(&self, network: &Network<T>, mode: &Mode<T>, basis: &mut [T]) -> Vec<T> {
        let entering = mode.table_torque(network);
        let given: Vec<T> = (0..self.slopes.len()).map(|i| form(entering.row(i), basis)).collect();
        let torques: Vec<T> =
            (0..self.slopes.len()).map(|i| form(self.inverse.row(i), &given)).collect();
        for ((loss, &slope), &torque) in network.table_losses.iter().zip(&self.slopes).zip(&torques)
        {
            basis[network.first_channel() + loss.channel] += slope * torque;
        }
        torques
    }
}
