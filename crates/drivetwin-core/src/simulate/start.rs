// SPDX-License-Identifier: MIT
//! The state a run starts from, stated by names.

use crate::network::Network;
use crate::network::channel::form;
use crate::network::linalg::{Matrix, independent_rows, least_norm};
use crate::number::Real;
use thiserror::Error;

/// Speeds of nodes, twists of shafts, and the elements that start without slip.
#[derive(Clone, Debug, Default)]
pub struct Start<T> {
    /// Node and its speed, rad/s.
    pub speeds: Vec<(String, T)>,
    /// Shaft and its twist, rad; 0 where not stated.
    pub twists: Vec<(String, T)>,
    /// Friction elements brought to zero slip.
    pub locked: Vec<String>,
}

/// A start resolved against a network.
#[derive(Clone, Debug)]
pub struct State<T> {
    /// States (speeds, twists, lagging torques).
    pub x: Vec<T>,
    /// Indices of the friction elements without slip.
    pub locked: Vec<usize>,
}

/// Why a start does not define a state.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StartError {
    /// A name that the network does not have.
    #[error("{kind} {name:?} is unknown; known are {known}")]
    Unknown {
        /// What kind of name.
        kind: &'static str,
        /// The name.
        name: String,
        /// What would be accepted.
        known: String,
    },
    /// Too few speeds.
    #[error("the start leaves speeds undetermined: state the speed of one of {free} as well")]
    Undetermined {
        /// Nodes whose speeds are not implied.
        free: String,
    },
    /// A one-way clutch would slip in the direction that it blocks.
    #[error("{element} starts with a slip of {slip} rad/s in the direction that it blocks")]
    Overrun {
        /// The one-way clutch.
        element: String,
        /// Slip, rad/s.
        slip: f64,
    },
    /// Speeds that contradict the rigid couplings.
    #[error("the start speed {stated} rad/s of {node:?} contradicts the others: {implied} rad/s")]
    Contradiction {
        /// Node.
        node: String,
        /// As stated.
        stated: f64,
        /// As the other speeds imply.
        implied: f64,
    },
}

impl<T: Real> Start<T> {
    /// The state of a network.
    pub fn state(&self, network: &Network<T>) -> Result<State<T>, StartError> {
        let elements = network.frictions.iter().map(|f| &f.element);
        let locked = self
            .locked
            .iter()
            .map(|name| find("friction element", name, elements.clone()))
            .collect::<Result<Vec<_>, _>>()?;
        let mut x = self.speeds_of(network)?;
        for friction in network.frictions.iter().filter(|friction| friction.one_way) {
            let slip = form(&friction.slip, &x).re();
            if slip > 1e-9 && !self.locked.contains(&friction.element) {
                return Err(StartError::Overrun { element: friction.element.clone(), slip });
            }
        }
        x.resize(network.states(), T::zero_());
        let springs = network.mechanism.springs.iter().map(|s| &s.element);
        for (name, twist) in &self.twists {
            x[network.speeds() + find("shaft", name, springs.clone())?] = *twist;
        }
        Ok(State { x, locked })
    }

    fn speeds_of(&self, network: &Network<T>) -> Result<Vec<T>, StartError> {
        let nodes = &network.mechanism.nodes;
        let n = &network.coordinates.speeds;
        let mut rows = Vec::new();
        let mut values = Matrix::zeros(self.speeds.len(), 1);
        for (i, (name, speed)) in self.speeds.iter().enumerate() {
            rows.push(find("node", name, nodes.iter())?);
            values[(i, 0)] = *speed;
        }
        let stated = n.select_rows(&rows);
        let keep = independent_rows(&stated);
        if keep.len() < network.speeds() {
            let free = network.coordinates.independent.iter().map(|&i| nodes[i].as_str());
            return Err(StartError::Undetermined { free: free.collect::<Vec<_>>().join(", ") });
        }
        let v = least_norm(&stated.select_rows(&keep), &values.select_rows(&keep));
        let v: Vec<T> = (0..v.rows).map(|i| v[(i, 0)]).collect();
        for (i, (name, speed)) in self.speeds.iter().enumerate() {
            let (stated, implied) = (speed.re(), form(stated.row(i), &v).re());
            if (stated - implied).abs() > 1e-6 * (1.0 + stated.abs()) {
                return Err(StartError::Contradiction { node: name.clone(), stated, implied });
            }
        }
        Ok(v)
    }
}

/// Index of a name among the known ones.
pub(super) fn find<'n>(
    kind: &'static str,
    name: &str,
    known: impl Iterator<Item = &'n String> + Clone,
) -> Result<usize, StartError> {
    known.clone().position(|k| k == name).ok_or_else(|| StartError::Unknown {
        kind,
        name: name.to_owned(),
        known: known.map(String::as_str).collect::<Vec<_>>().join(", "),
    })
}
