// SPDX-License-Identifier: MIT
//! From the stated mechanism to matrices in minimal coordinates.

use super::channel::Channel;
use super::constraints::{Coordinates, coordinates};
use super::error::CompileError;
use super::linalg::{Matrix, solve};
use crate::model::mechanism::{Account, ForceLaw, LossLaw, Mechanism, Normal, Row};
use crate::model::{Driveline, FrictionLaw};
use crate::number::Real;

/// Most friction elements a mode key can hold.
pub const MAX_FRICTIONS: usize = 32;

/// A friction element as the solver sees it.
#[derive(Clone, Debug)]
pub struct FrictionRow<T> {
    /// Name for messages and events.
    pub element: String,
    /// Slip over the independent speeds.
    pub slip: Vec<T>,
    /// Slip over the nodes; its negative is the direction of the torque.
    pub nodes: Row<T>,
    /// μ over |slip|.
    pub law: FrictionLaw<T>,
    /// What μ is multiplied by.
    pub normal: Normal<T>,
    /// Static over kinetic capacity.
    pub peak: T,
    /// Index of its channel.
    pub channel: usize,
}

/// A gear whose efficiency depends on the direction of power.
#[derive(Clone, Debug)]
pub struct LossyGear<T> {
    /// Index of its constraint.
    pub constraint: usize,
    /// Name for messages.
    pub element: String,
    /// Law.
    pub law: LossLaw,
    /// Efficiency.
    pub eta: T,
    /// Speed of the driving side over the independent speeds.
    pub speed: Vec<T>,
}

/// A compiled mechanism; immutable.
#[derive(Clone, Debug)]
pub struct Network<T> {
    /// What it was compiled from.
    pub mechanism: Mechanism<T>,
    /// Independent speeds and their map to all nodes.
    pub coordinates: Coordinates<T>,
    /// Kinetic energy over the nodes, `½ ωᵀ I ω`.
    pub inertia: Matrix<T>,
    /// Kinetic energy over the independent speeds, `½ vᵀ M v`.
    pub mass: Matrix<T>,
    /// Rates of twist over the independent speeds, springs × speeds.
    pub twist_rates: Matrix<T>,
    /// Friction elements.
    pub frictions: Vec<FrictionRow<T>>,
    /// Lossy gears.
    pub losses: Vec<LossyGear<T>>,
    /// Scalar channels: frictions first, then force laws that are not linear.
    pub channels: Vec<Channel<T>>,
    /// Account and node of every channel after the frictions.
    pub channel_accounts: Vec<(usize, Account)>,
    /// Node torques of everything but rigid couplings and stuck friction, over the basis
    /// (x, u, 1, φ): nodes × basis.
    pub node_torques: Matrix<T>,
}

impl<T: Real> Network<T> {
    /// Compile a driveline.
    pub fn compile(driveline: &Driveline<T>) -> Result<Self, CompileError> {
        Self::from_mechanism(driveline.mechanism()?)
    }

    /// Compile a stated mechanism.
    pub fn from_mechanism(mechanism: Mechanism<T>) -> Result<Self, CompileError> {
        if mechanism.frictions.len() > MAX_FRICTIONS {
            let (count, limit) = (mechanism.frictions.len(), MAX_FRICTIONS);
            return Err(CompileError::TooManyFrictions { count, limit });
        }
        let coordinates = coordinates(&mechanism)?;
        let inertia = node_inertia(&mechanism);
        let n = &coordinates.speeds;
        let mut network = Self {
            mass: n.transposed().times(&inertia).times(n),
            inertia,
            twist_rates: Matrix::zeros(mechanism.springs.len(), coordinates.independent.len()),
            coordinates,
            mechanism,
            frictions: Vec::new(),
            losses: Vec::new(),
            channels: Vec::new(),
            channel_accounts: Vec::new(),
            node_torques: Matrix::zeros(0, 0),
        };
        network.refuse_massless()?;
        network.add_springs();
        network.add_frictions();
        network.add_losses();
        network.add_force_channels();
        network.node_torques = network.assemble_node_torques();
        Ok(network)
    }

    /// Number of independent speeds.
    pub fn speeds(&self) -> usize {
        self.coordinates.independent.len()
    }

    /// Number of states: speeds and twists.
    pub fn states(&self) -> usize {
        self.speeds() + self.mechanism.springs.len()
    }

    /// Length of the basis (x, u, 1, φ).
    pub fn basis(&self) -> usize {
        self.one() + 1 + self.channels.len()
    }

    /// Position of the first input in the basis.
    pub fn first_input(&self) -> usize {
        self.states()
    }

    /// Position of the constant 1 in the basis.
    pub fn one(&self) -> usize {
        self.states() + self.mechanism.inputs.len()
    }

    /// Position of the first channel in the basis.
    pub fn first_channel(&self) -> usize {
        self.one() + 1
    }

    /// A linear form over nodes, expressed over the independent speeds.
    pub fn over_speeds(&self, row: &Row<T>) -> Vec<T> {
        let n = &self.coordinates.speeds;
        (0..n.cols)
            .map(|j| row.iter().fold(T::zero_(), |sum, &(node, c)| sum + c * n[(node, j)]))
            .collect()
    }

    fn refuse_massless(&self) -> Result<(), CompileError> {
        let n = &self.coordinates.speeds;
        let nothing = Matrix::zeros(self.mass.rows, 1);
        let Err(column) = solve(&self.mass, &nothing) else { return Ok(()) };
        let moved = |&node: &usize| n[(node, column)].re() != 0.0;
        let members = (0..n.rows).filter(moved).map(|i| self.mechanism.nodes[i].clone()).collect();
        Err(CompileError::Massless { members })
    }

    fn add_springs(&mut self) {
        for (i, spring) in self.mechanism.springs.clone().iter().enumerate() {
            let rate = self.over_speeds(&spring.row);
            self.twist_rates.row_mut(i).copy_from_slice(&rate);
        }
    }

    fn add_frictions(&mut self) {
        for (channel, friction) in self.mechanism.frictions.clone().into_iter().enumerate() {
            let slip = self.over_speeds(&friction.row);
            self.channels.push(Channel::friction(&friction, slip.clone()));
            self.frictions.push(FrictionRow {
                element: friction.element,
                slip,
                nodes: friction.row,
                law: friction.law,
                normal: friction.normal,
                peak: friction.peak,
                channel,
            });
        }
    }

    fn add_losses(&mut self) {
        for (constraint, c) in self.mechanism.constraints.iter().enumerate() {
            if let Some(loss) = &c.loss {
                self.losses.push(LossyGear {
                    constraint,
                    element: c.element.clone(),
                    law: loss.law,
                    eta: loss.eta,
                    speed: self.over_speeds(&vec![(loss.driving, T::of(1.0))]),
                });
            }
        }
    }

    fn add_force_channels(&mut self) {
        for force in self.mechanism.forces.clone() {
            let speed = self.over_speeds(&vec![(force.node, T::of(1.0))]);
            if let Some(channel) = Channel::force(&force.law, speed) {
                self.channels.push(channel);
                self.channel_accounts.push((force.node, force.account));
            }
        }
    }

    fn assemble_node_torques(&self) -> Matrix<T> {
        let mut f = Matrix::zeros(self.mechanism.nodes.len(), self.basis());
        for (i, spring) in self.mechanism.springs.iter().enumerate() {
            for &(node, direction) in &spring.row {
                f[(node, self.speeds() + i)] -= direction * spring.stiffness;
                for (j, &rate) in self.twist_rates.row(i).iter().enumerate() {
                    f[(node, j)] -= direction * spring.damping * rate;
                }
            }
        }
        for row in &self.frictions {
            for &(node, direction) in &row.nodes {
                f[(node, self.first_channel() + row.channel)] -= direction;
            }
        }
        for force in &self.mechanism.forces {
            match force.law {
                ForceLaw::Input(input) => f[(force.node, self.first_input() + input)] += 1.0,
                ForceLaw::Constant(torque) => f[(force.node, self.one())] += torque,
                ForceLaw::Quadratic(_) | ForceLaw::Map { .. } => {}
            }
        }
        for (i, &(node, _)) in self.channel_accounts.iter().enumerate() {
            f[(node, self.first_channel() + self.frictions.len() + i)] += 1.0;
        }
        f
    }
}

fn node_inertia<T: Real>(m: &Mechanism<T>) -> Matrix<T> {
    let mut inertia = Matrix::zeros(m.nodes.len(), m.nodes.len());
    for term in &m.inertias {
        for &(i, a) in &term.row {
            for &(j, b) in &term.row {
                inertia[(i, j)] += a * b * term.inertia;
            }
        }
    }
    inertia
}

impl<T> Network<T> {
    /// Whether the efficiency of lossy gear `i` depends on the direction of power.
    pub fn is_directional(&self, i: usize) -> bool {
        self.losses[i].law == LossLaw::Dissipative
    }
}
