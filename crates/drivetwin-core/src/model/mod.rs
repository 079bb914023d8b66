// SPDX-License-Identifier: MIT
//! 1 The physical description: what the user states, in SI, as plain data.
//!
//! Each element is one file that states its law in the vocabulary of [`mechanism`]. Elements do not depend
//! on an integrator.

pub mod converter_map;
mod declare;
mod described;
pub mod elements;
mod error;
pub mod field;
pub mod friction;
pub mod loss_table;
pub mod mechanism;
pub mod schema;
pub mod torque_map;

pub use described::Described;
pub use elements::{Element, element_schema};
pub use error::{ModelError, ModelFaults};
pub use friction::{FrictionLaw, FrictionTable, Stribeck};
pub use loss_table::{DragTable, LossTable};
pub use mechanism::Mechanism;

use crate::number::Number;
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;

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
    /// Convert all numbers.
    pub fn map<U>(&self, f: &impl Fn(&T) -> U) -> Driveline<U> {
        Driveline { elements: self.elements.iter().map(|element| element.map(f)).collect() }
    }

    /// Find a number by the name of its element and its path of fields: `B2.friction.mu_c`,
    /// `B2.friction.mu.3` for a point of a table. Names may contain dots: the longest one counts.
    pub fn number_mut(&mut self, path: &str) -> Option<&mut T> {
        let fields_of =
            |element: &Element<T>| path.strip_prefix(element.name().as_str())?.strip_prefix('.');
        let named = self.elements.iter_mut().filter(|element| fields_of(element).is_some());
        let element = named.max_by_key(|element| element.name().len())?;
        let fields: SmallVec<[&str; 4]> = fields_of(element)?.split('.').collect();
        element.number_mut(&fields)
    }

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

impl Driveline<f64> {
    /// Convert the driveline to another number type.
    pub fn promote<T: Number>(&self) -> Driveline<T> {
        self.map(&|&value| T::of(value))
    }
}
