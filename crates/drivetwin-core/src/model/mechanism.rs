// SPDX-License-Identifier: MIT
//! The vocabulary in which elements state their laws: a mechanism that is linear in the node
//! speeds, with scalar force laws and set-valued friction (THEORY section 1).

use super::converter_map::ConverterMap;
use super::friction::FrictionLaw;
use super::torque_map::TorqueMap;
use super::{GROUND, Name};
use crate::number::Number;
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

/// A linear form over node speeds: `Σ coefficient · ω_node`; the ground has no entry. Most have one or two
/// entries, which stand in place.
pub type Row<T> = SmallVec<[(usize, T); 2]>;

/// Dependence of gear losses on the direction of power (THEORY section 3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LossLaw {
    /// φ = η T_g whatever the direction; creates energy in overrun.
    Paper,
    /// φ = η T_g for T_g ω ≥ 0, else T_g / η.
    Dissipative,
}

impl LossLaw {
    /// Names in JSON.
    pub const NAMES: &[&str] = &["paper", "dissipative"];
}

/// Loss of a constraint: the driven entries of its force row carry the efficiency.
#[derive(Clone, Debug, PartialEq)]
pub struct Loss<T> {
    /// Loss law.
    pub law: LossLaw,
    /// Efficiency with power from the driving to the driven side.
    pub eta: T,
    /// Efficiency with power from the driven to the driving side.
    pub eta_backward: T,
    /// Drag torque on the driving side with power forward, N·m.
    pub drag: T,
    /// Drag torque on the driving side with power backward, N·m.
    pub drag_backward: T,
    /// Node on the side where power is counted as entering.
    pub driving: usize,
}

/// `row · ω = 0`, with the torque of its first entry as multiplier.
#[derive(Clone, Debug, PartialEq)]
pub struct Constraint<T> {
    /// Element that states it.
    pub element: Name,
    /// Kinematic row.
    pub row: Row<T>,
    /// Loss, if the element has one.
    pub loss: Option<Loss<T>>,
}

/// Kinetic energy `½ inertia (row · ω)²`.
#[derive(Clone, Debug, PartialEq)]
pub struct Inertia<T> {
    /// Element that states it.
    pub element: Name,
    /// Speed that carries the inertia.
    pub row: Row<T>,
    /// kg·m².
    pub inertia: T,
}

/// Torque of a compliance over its twist.
#[derive(Clone, Debug, PartialEq)]
pub enum SpringLaw<T> {
    /// `k·twist + c·twist'`.
    Linear {
        /// Stiffness, N·m/rad.
        stiffness: T,
        /// Damping, N·m·s/rad.
        damping: T,
    },
    /// Piecewise linear in twist and rate of twist.
    Regions {
        /// Regions; a run starts in the first that holds.
        regions: Vec<Region<T>>,
        /// Stops that store the energy.
        stops: Vec<Stop<T>>,
    },
}

/// A stop with stored energy `½ stiffness · max(0, side · (twist - at))²`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop<T> {
    /// N·m/rad.
    pub stiffness: T,
    /// Start, rad.
    pub at: T,
    /// Direction in which it is pressed, ±1.
    pub side: f64,
}

/// A linear form `constant + per_twist · twist + per_rate · twist'`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistForm<T> {
    /// Constant part.
    pub constant: T,
    /// Coefficient of the twist.
    pub per_twist: T,
    /// Coefficient of its rate.
    pub per_rate: T,
}

/// One region of a piecewise linear compliance.
#[derive(Clone, Debug, PartialEq)]
pub struct Region<T> {
    /// Torque, N·m.
    pub torque: TwistForm<T>,
    /// Forms that stay positive within the region, and the region beyond each.
    pub borders: Vec<(TwistForm<T>, usize)>,
}

/// A compliance against `twist' = row · ω`; the twist is a state.
#[derive(Clone, Debug, PartialEq)]
pub struct Spring<T> {
    /// Element that states it.
    pub element: Name,
    /// Rate of twist.
    pub row: Row<T>,
    /// Torque law.
    pub law: SpringLaw<T>,
}

/// Normal load of a friction element: capacity = μ · normal, N·m.
#[derive(Clone, Debug, PartialEq)]
pub enum Normal<T> {
    /// `gain · max(0, P - P0)` with P an input.
    Pressure {
        /// Index of the pressure input.
        input: usize,
        /// N·D·A·r, m³.
        gain: T,
        /// Pressure at which the fill ends, Pa.
        p0: T,
    },
    /// Always the same.
    Constant(T),
}

/// A friction element: torque in `capacity · Sgn(slip)` against `slip = row · ω`.
#[derive(Clone, Debug, PartialEq)]
pub struct Friction<T> {
    /// Element that states it.
    pub element: Name,
    /// Slip.
    pub row: Row<T>,
    /// μ over |slip|.
    pub law: FrictionLaw<T>,
    /// Factor of μ.
    pub normal: Normal<T>,
    /// Static over kinetic capacity at zero slip, ≥ 1.
    pub peak: T,
    /// Positive slip is blocked whatever the torque (one-way clutch).
    pub one_way: bool,
}

/// Account of the energy balance that a torque belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Account {
    /// Brought in by an engine or motor.
    Source,
    /// Taken by the load.
    Load,
    /// Turned into heat by the slip of a torque converter or tyre.
    Converter,
    /// Turned into heat in a gear.
    Gear,
    /// Turned into heat by the drag of a clutch.
    Drag,
}

/// A scalar torque law over one or two node speeds and the inputs.
#[derive(Clone, Debug, PartialEq)]
pub enum ForceLaw<T> {
    /// The input itself, N·m.
    Input(usize),
    /// Always the same, N·m.
    Constant(T),
    /// `coefficient · ω |ω|` of a node.
    Quadratic {
        /// N·m·s²/rad².
        coefficient: T,
        /// The node.
        node: usize,
    },
    /// Map over an input (throttle) and a node's speed.
    Map {
        /// Index of the throttle input.
        input: usize,
        /// Node of the speed.
        node: usize,
        /// Torque over throttle and speed.
        map: TorqueMap,
    },
    /// Torque taken at the pump (or given at the turbine) of a converter.
    Converter {
        /// Node of the pump.
        pump: usize,
        /// Node of the turbine.
        turbine: usize,
        /// Its map.
        map: ConverterMap,
        /// True for the torque of the turbine.
        at_turbine: bool,
    },
    /// `stiffness · (ω_wheel - ω_road) / max(|ω_road|, least_speed)`.
    Slip {
        /// Node of the rim.
        wheel: usize,
        /// Node that moves with the road.
        road: usize,
        /// N·m.
        stiffness: T,
        /// rad/s.
        least_speed: f64,
    },
    /// Loss torque in the direction of a slip, by a table over its magnitude and a transmitted torque.
    Loss {
        /// Slip.
        slip: Row<T>,
        /// Index of the constraint that transmits the torque: that of its first entry; none for a table over
        /// the slip alone.
        constraint: Option<usize>,
        /// Loss torque over transmitted torque, in place of a throttle, and slip from zero on.
        map: TorqueMap,
    },
}

/// A torque on one node or, with opposite sign, on another as well.
#[derive(Clone, Debug, PartialEq)]
pub struct Force<T> {
    /// Element that states it.
    pub element: Name,
    /// Nodes it acts on; 1 where it is positive with the speed.
    pub nodes: Row<T>,
    /// Its value.
    pub law: ForceLaw<T>,
    /// Time constant of a first-order lag between law and torque, s.
    pub lag: Option<T>,
    /// Account of its work.
    pub account: Account,
}

/// A node whose speed is an input.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Prescribed {
    /// Element that states it.
    pub element: Name,
    /// The node.
    pub node: usize,
    /// Index of the speed input, rad/s.
    pub input: usize,
}

/// Everything the elements stated.
#[derive(Clone, Debug, PartialEq)]
pub struct Mechanism<T> {
    /// Node names, in order of appearance.
    pub nodes: Vec<Name>,
    /// Input names, in order of appearance.
    pub inputs: Vec<Name>,
    /// Kinetic energy.
    pub inertias: Vec<Inertia<T>>,
    /// Rigid couplings.
    pub constraints: Vec<Constraint<T>>,
    /// Compliances.
    pub springs: Vec<Spring<T>>,
    /// Clutches, brakes, dry friction.
    pub frictions: Vec<Friction<T>>,
    /// Sources and loads.
    pub forces: Vec<Force<T>>,
    /// Nodes whose speeds are inputs.
    pub prescribed: Vec<Prescribed>,
}

impl<T> SpringLaw<T> {
    /// Return true for a piecewise linear compliance.
    pub fn has_regions(&self) -> bool {
        matches!(self, Self::Regions { .. })
    }
}

impl<T: Number> TwistForm<T> {
    /// Value at a twist and its rate.
    pub fn at(&self, twist: T, rate: T) -> T {
        self.constant + self.per_twist * twist + self.per_rate * rate
    }

    /// The form with the opposite sign.
    pub fn negative(&self) -> Self {
        let Self { constant, per_twist, per_rate } = *self;
        Self { constant: -constant, per_twist: -per_twist, per_rate: -per_rate }
    }
}

impl<T> Default for Mechanism<T> {
    fn default() -> Self {
        Self {
            nodes: Vec::new(),
            inputs: Vec::new(),
            inertias: Vec::new(),
            constraints: Vec::new(),
            springs: Vec::new(),
            frictions: Vec::new(),
            forces: Vec::new(),
            prescribed: Vec::new(),
        }
    }
}

impl<T: Number> Mechanism<T> {
    /// Nothing yet, with room for what so many elements state: about half of them are couplings, half
    /// masses.
    pub fn with_room(elements: usize) -> Self {
        Self {
            nodes: Vec::with_capacity(elements),
            inertias: Vec::with_capacity(elements / 2),
            constraints: Vec::with_capacity(elements / 2),
            ..Self::default()
        }
    }

    /// Index of a node, added on first use.
    pub fn node(&mut self, name: &Name) -> usize {
        index_of(&mut self.nodes, name)
    }

    /// Index of an input, added on first use.
    pub fn input(&mut self, name: &Name) -> usize {
        index_of(&mut self.inputs, name)
    }

    /// State a loss torque against a slip, see [`ForceLaw::Loss`].
    pub fn add_loss(
        &mut self,
        element: &Name,
        slip: Row<T>,
        constraint: Option<usize>,
        map: TorqueMap,
    ) {
        let nodes = slip.iter().map(|&(node, c)| (node, -c)).collect();
        let account = if constraint.is_some() { Account::Gear } else { Account::Drag };
        let law = ForceLaw::Loss { slip, constraint, map };
        self.forces.push(Force { element: element.clone(), nodes, law, lag: None, account });
    }

    /// Linear form with the speed of one node.
    pub fn single(node: usize) -> Row<T> {
        Row::from_elem((node, T::of(1.0)), 1)
    }

    /// Linear form over named nodes; entries at the ground drop out.
    pub fn row(&mut self, terms: &[(&Name, T)]) -> Row<T> {
        let ground = const { Name::new_inline(GROUND) };
        let moving = terms.iter().filter(|(name, _)| **name != ground);
        moving.map(|&(name, coefficient)| (self.node(name), coefficient)).collect()
    }
}

fn index_of(names: &mut Vec<Name>, name: &Name) -> usize {
    names.iter().position(|n| n == name).unwrap_or_else(|| {
        names.push(name.clone());
        names.len() - 1
    })
}
