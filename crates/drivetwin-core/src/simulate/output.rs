// SPDX-License-Identifier: MIT
//! Quantities that a run records.

use super::start::{StartError, find};
use crate::network::Network;
use crate::number::Number;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A quantity to record, by the name of its node or element.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Output {
    /// Speed of a node, rad/s.
    Speed(String),
    /// Acceleration of a node, rad/s².
    Acceleration(String),
    /// Angle that a node has turned since the start, rad.
    Angle(String),
    /// Twist of a shaft, rad.
    Twist(String),
    /// Torque of a shaft on its driven end, N·m.
    ShaftTorque(String),
    /// Slip of a friction element, rad/s.
    Slip(String),
    /// Torque of a friction element on its driven side, N·m.
    FrictionTorque(String),
    /// Torque of an element on a node, N·m.
    Torque(String, String),
    /// Power that enters an element at its nodes, W.
    Power(String),
    /// Power that becomes heat in an element, W.
    Loss(String),
    /// Integral of the power of an element since the start, J.
    Work(String),
    /// Integral of the loss of an element since the start, J.
    Heat(String),
    /// Energy that an element stores, J.
    Energy(String),
}

/// An output by the index of its node or element; that of an element is its place in
/// [`Network::elements`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Target {
    /// Node.
    Speed(usize),
    /// Node.
    Acceleration(usize),
    /// Node.
    Angle(usize),
    /// Shaft.
    Twist(usize),
    /// Shaft.
    ShaftTorque(usize),
    /// Friction element.
    Slip(usize),
    /// Friction element.
    FrictionTorque(usize),
    /// Element and node.
    Torque(usize, usize),
    /// Element.
    Power(usize),
    /// Element.
    Loss(usize),
    /// Element.
    Work(usize),
    /// Element.
    Heat(usize),
    /// Element.
    Energy(usize),
}

impl Output {
    pub(super) fn find<T: Number>(&self, network: &Network<T>) -> Result<Target, StartError> {
        let m = &network.mechanism;
        let node = |name| find("node", name, m.nodes.iter());
        let shaft = |name| find("shaft", name, m.springs.iter().map(|s| &s.element));
        let friction =
            |name| find("friction element", name, m.frictions.iter().map(|f| &f.element));
        let element = |name| find("element", name, network.elements().into_iter());
        Ok(match self {
            Self::Speed(name) => Target::Speed(node(name)?),
            Self::Acceleration(name) => Target::Acceleration(node(name)?),
            Self::Angle(name) => Target::Angle(node(name)?),
            Self::Twist(name) => Target::Twist(shaft(name)?),
            Self::ShaftTorque(name) => Target::ShaftTorque(shaft(name)?),
            Self::Slip(name) => Target::Slip(friction(name)?),
            Self::FrictionTorque(name) => Target::FrictionTorque(friction(name)?),
            Self::Torque(name, at) => Target::Torque(element(name)?, node(at)?),
            Self::Power(name) => Target::Power(element(name)?),
            Self::Loss(name) => Target::Loss(element(name)?),
            Self::Work(name) => Target::Work(element(name)?),
            Self::Heat(name) => Target::Heat(element(name)?),
            Self::Energy(name) => Target::Energy(element(name)?),
        })
    }
}

impl fmt::Display for Output {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (kind, name) = match self {
            Self::Speed(node) => ("speed", node),
            Self::Acceleration(node) => ("acceleration", node),
            Self::Angle(node) => ("angle", node),
            Self::Twist(shaft) => ("twist", shaft),
            Self::ShaftTorque(shaft) => ("shaft torque", shaft),
            Self::Slip(element) => ("slip", element),
            Self::FrictionTorque(element) => ("friction torque", element),
            Self::Torque(element, node) => return write!(f, "torque of {element} at {node}"),
            Self::Power(element) => ("power", element),
            Self::Loss(element) => ("loss", element),
            Self::Work(element) => ("work", element),
            Self::Heat(element) => ("heat", element),
            Self::Energy(element) => ("energy", element),
        };
        write!(f, "{kind} of {name}")
    }
}

impl Target {
    /// Return true for a quantity that is recorded from the expansion of the motion only: it needs the motion
    /// between samples or is no linear form of the basis.
    pub(super) fn needs_expansion<T: Number>(self, network: &Network<T>) -> bool {
        match self {
            Self::Angle(_)
            | Self::Power(_)
            | Self::Loss(_)
            | Self::Work(_)
            | Self::Heat(_)
            | Self::Energy(_) => true,
            Self::Acceleration(node) => network.is_follower(node),
            _ => false,
        }
    }
}
