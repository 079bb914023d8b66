// SPDX-License-Identifier: MIT
//! 1 The physical description: what the user states, in SI, as plain data.
//!
//! Each element is one file that states its law in the vocabulary of [`mechanism`]. Elements do not depend
//! on an integrator.

pub mod converter_map;
pub mod dual_clutch;
pub mod elements;
mod error;
pub mod friction;
pub mod loss_table;
pub mod mechanism;
pub mod torque_map;

pub use dual_clutch::DualClutch;
pub use elements::Element;
pub use error::{ModelError, ModelFaults};
pub use friction::{FrictionLaw, FrictionTable, Stribeck};
pub use loss_table::{DragTable, LossTable};
pub use mechanism::Mechanism;

use crate::number::Number;
use serde::{Deserialize, Serialize};

/// Name of an element, a node or an input. Short ones stand in place: to compile a driveline, which is
/// done anew for every run of a batch, takes few blocks of memory.
pub type Name = smol_str::SmolStr;

/// Name of the node that does not turn.
pub const GROUND: &str = "ground";

/// A driveline: elements joined at named nodes (shafts). Every name used at a flange is a node.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Driveline<T> {
    /// All elements; names must be unique.
    pub elements: Vec<Element<T>>,
}

impl<T: Number> Driveline<T> {
    /// State every element's law; all faults of the description are reported together.
    pub fn mechanism(&self) -> Result<Mechanism<T>, ModelFaults> {
        let mut faults = Vec::new();
        let mut mechanism = Mechanism::with_room(self.elements.len());
        let mut seen: Vec<&Name> = Vec::with_capacity(self.elements.len());
        for element in &self.elements {
            if seen.contains(&element.name()) {
                faults.push(ModelError::DuplicateName { element: element.name().to_string() });
            }
            seen.push(element.name());
            match element.check() {
                Ok(()) => element.state_law(&mut mechanism),
                Err(error) => faults.push(error),
            }
        }
        if faults.is_empty() { Ok(mechanism) } else { Err(ModelFaults(faults)) }
    }
}
