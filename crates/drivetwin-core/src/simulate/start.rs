// SPDX-License-Identifier: MIT
//! The state a run starts from, stated by names.

use crate::model::Name;
use crate::network::Network;
use crate::network::linalg::{Matrix, independent_rows, solve};
use crate::network::nonlinear_torque::form;
use crate::number::{Number, Values};
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

/// Reason why a start does not define a state.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StartError {
    /// A name that the network does not have.
    #[error("{kind} {name:?} is unknown; known are {known}")]
    Unknown {
        /// Kind of the name.
        kind: &'static str,
        /// The name.
        name: String,
        /// Accepted names.
        known: String,
    },
    /// A speed or twist that is no number.
    #[error("the start of {name:?} is not finite")]
    NotFinite {
        /// Node or shaft.
        name: String,
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

impl<T: Number> Start<T> {
    /// The state of a network.
    pub fn state(&self, network: &Network<T>) -> Result<State<T>, StartError> {
        let (speeds, twists) = (by_name(&self.speeds), by_name(&self.twists));
        state_of(network, &speeds, &twists, &self.locked)
    }
}

/// Values by the names of what has them.
type Stated<'n, T> = [(&'n str, T)];

fn by_name<T: Copy>(values: &[(String, T)]) -> Vec<(&str, T)> {
    values.iter().map(|(name, value)| (name.as_str(), *value)).collect()
}

/// The state of a network from speeds of nodes, twists of shafts and elements without slip, see [`Start`].
pub(super) fn state_of<T: Number>(
    network: &Network<T>,
    speeds: &Stated<'_, T>,
    twists: &Stated<'_, T>,
    locked: &[String],
) -> Result<State<T>, StartError> {
    let elements = network.frictions.iter().map(|f| &f.element);
    let indices = locked.iter().map(|name| find("friction element", name, elements.clone()));
    let indices = indices.collect::<Result<Vec<_>, _>>()?;
    let infinite = |(_, v): &&(&str, T)| v.re().decide(|v| !v.is_finite());
    if let Some((name, _)) = speeds.iter().chain(twists).find(infinite) {
        return Err(StartError::NotFinite { name: (*name).to_owned() });
    }
    let mut x = speeds_of(network, speeds)?;
    for (j, friction) in network.frictions.iter().enumerate().filter(|(_, f)| f.one_way) {
        let slip = form(&friction.slip, &x).re();
        if slip.decide(|slip| slip > 1e-9) && !indices.contains(&j) {
            let slip = slip.leading();
            return Err(StartError::Overrun { element: friction.element.to_string(), slip });
        }
    }
    x.resize(network.states(), T::zero_());
    let springs = network.mechanism.springs.iter().map(|s| &s.element);
    for &(name, twist) in twists {
        x[network.speeds() + find("shaft", name, springs.clone())?] = twist;
    }
    settle(network, &mut x);
    Ok(State { x, locked: indices })
}

/// Bring the twists on members without mass and dampers into balance.
fn settle<T: Number>(network: &Network<T>, x: &mut [T]) {
    let Some(map) = network.followers.as_ref().and_then(|followers| followers.twists.as_ref())
    else {
        return;
    };
    let mut twists = x[network.speeds()..network.first_lag()].to_vec();
    twists.push(T::of(1.0));
    for (i, twist) in x[network.speeds()..network.first_lag()].iter_mut().enumerate() {
        *twist = form(map.row(i), &twists);
    }
}

/// The independent speeds, from speeds of nodes.
fn speeds_of<T: Number>(
    network: &Network<T>,
    speeds: &Stated<'_, T>,
) -> Result<Vec<T>, StartError> {
    let nodes = &network.mechanism.nodes;
    let n = &network.coordinates.speeds;
    let rows = speeds.iter().map(|(name, _)| find("node", name, nodes.iter()));
    let stated = n.select_rows(&rows.collect::<Result<Vec<_>, _>>()?);
    let mut values = Matrix::zeros(speeds.len(), 1);
    for (i, &(_, speed)) in speeds.iter().enumerate() {
        values[(i, 0)] = speed;
    }
    let keep = independent_rows(&stated);
    let undetermined = || {
        let free = network.coordinates.independent.iter().map(|&i| nodes[i].as_str());
        StartError::Undetermined { free: free.collect::<Vec<_>>().join(", ") }
    };
    if keep.len() < network.speeds() {
        return Err(undetermined());
    }
    let v = solve(stated.select_rows(&keep), values.select_rows(&keep));
    let v = v.map_err(|_| undetermined())?;
    let mut x = Vec::with_capacity(network.states());
    x.extend((0..v.rows).map(|i| v[(i, 0)]));
    for (i, &(name, speed)) in speeds.iter().enumerate() {
        let (stated, implied) = (speed.re(), form(stated.row(i), &x).re());
        let contradicts =
            |stated: f64, implied: f64| (stated - implied).abs() > 1e-6 * (1.0 + stated.abs());
        if stated.decide_with(implied, contradicts) {
            let (stated, implied) = (stated.leading(), implied.leading());
            return Err(StartError::Contradiction { node: name.to_owned(), stated, implied });
        }
    }
    Ok(x)
}

/// Index of a name among the known ones.
pub(super) fn find<'n>(
    kind: &'static str,
    name: &str,
    known: impl Iterator<Item = &'n Name> + Clone,
) -> Result<usize, StartError> {
    known.clone().position(|k| k == name).ok_or_else(|| {
        let names: Vec<&str> = known.map(Name::as_str).collect();
        let known = if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        StartError::Unknown { kind, name: name.to_owned(), known }
    })
}
