// SPDX-License-Identifier: MIT
//! The closed set of elements, one file each: fields, checks, and the law in a few lines.

mod backlash;
mod bearing;
mod clutch;
mod engine_map;
mod gear;
mod inertia;
mod one_way_clutch;
mod planetary;
mod prescribed_speed;
mod road_load;
mod spring_damper;
mod spring_table;
mod torque;
mod torque_converter;
mod tyre;
mod viscous_coupling;

pub use backlash::Backlash;
pub use bearing::Bearing;
pub use clutch::Clutch;
pub use engine_map::EngineMap;
pub use gear::{Gear, GearLoss};
pub use inertia::Inertia;
pub use one_way_clutch::{OneWayClutch, ParallelClutch};
pub use planetary::Planetary;
pub use prescribed_speed::PrescribedSpeed;
pub use road_load::RoadLoad;
pub use spring_damper::SpringDamper;
pub use spring_table::SpringTable;
pub use torque::Torque;
pub use torque_converter::TorqueConverter;
pub use tyre::Tyre;
pub use viscous_coupling::ViscousCoupling;

use super::error::ModelError;
use super::field::Field;
use super::mechanism::Mechanism;
use super::schema::ElementSchema;
use super::{Described, Name};
use crate::number::Number;
use serde::{Deserialize, Serialize};

macro_rules! elements {
    ($($kind:ident),* $(,)?) => {
        /// Any element of a driveline.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        #[serde(tag = "type", rename_all = "snake_case")]
        pub enum Element<T> {
            $(#[doc = concat!("See [`", stringify!($kind), "`].")] $kind($kind<T>)),*
        }

        impl<T: Number> Element<T> {
            /// Unique name.
            pub fn name(&self) -> &Name {
                match self { $(Self::$kind(e) => &e.name),* }
            }

            /// Refuse impossible values.
            pub fn check(&self) -> Result<(), ModelError> {
                match self {
                    $(Self::$kind(e) => {
                        e.check_range(&e.name, &Field::WHOLE)?;
                        e.check()
                    }),*
                }
            }

            /// Add the element's law to the mechanism.
            pub fn state_law(&self, mechanism: &mut Mechanism<T>) {
                match self { $(Self::$kind(e) => e.state_law(mechanism)),* }
            }

            /// Convert all numbers.
            pub fn map<U>(&self, f: &impl Fn(&T) -> U) -> Element<U> {
                match self { $(Self::$kind(e) => Element::$kind(e.map(f))),* }
            }

            /// Find a number by its path of fields.
            pub fn number_mut(&mut self, path: &[&str]) -> Option<&mut T> {
                match self { $(Self::$kind(e) => e.number_mut(path)),* }
            }
        }

        /// List the schemas of all elements.
        pub fn element_schema() -> Vec<ElementSchema> {
            vec![$(schema_of::<$kind<f64>>(stringify!($kind))),*]
        }
    };
}

elements!(
    Inertia,
    Gear,
    Planetary,
    Clutch,
    OneWayClutch,
    Bearing,
    ViscousCoupling,
    SpringDamper,
    SpringTable,
    Backlash,
    TorqueConverter,
    Tyre,
    RoadLoad,
    Torque,
    EngineMap,
    PrescribedSpeed,
);

fn schema_of<D: Described<f64>>(name: &str) -> ElementSchema {
    let fields = D::alternatives().into_iter().flatten().collect();
    ElementSchema::of(name, D::ABOUT, fields)
}
